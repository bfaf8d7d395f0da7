"""Stage 4: CSV files of a case joined from batches."""

from collections.abc import Callable, Iterable
from pathlib import Path

from biogrip.products.files.identifications import TIMINGS
from biogrip.products.files.intervals import INTERVALS
from biogrip.products.files.model_fits import MODEL_FITS
from biogrip.products.files.rows import RowFile, read_rows, write_rows
from biogrip.products.plan import Plan
from biogrip.products.product import Product, of_batches, wildcards_of
from biogrip.study.study import Case


def join(seeds: int, batches: list[Path], rows: Path) -> None:
    """Join CSV files that have the same columns.

    Parameters
    ----------
    seeds
        Number of seeds; batches may hold more, of an earlier run with more.
    batches
        The files, in the order of their seeds.
    rows
        Joined file with the rows of these seeds.

    Raises
    ------
    BiogripError
        If a file cannot be read, or has other columns than the first.
    """
    header = read_rows(batches[0])[0]
    found = (row for batch in batches for row in read_rows(batch, header)[1:])
    seed = header.index("seed")
    write_rows(rows, header, (row for row in found if int(row[seed]) < seeds))


def joined(
    name: str,
    kind: RowFile,
    cases: Callable[[Plan], Iterable[str]],
    seeds: Callable[[Case], int],
) -> Product:
    """Declare a product that joins the batches of a stage."""
    return Product(
        name,
        {"rows": kind.path},
        join,
        lambda study, job: seeds(study.case(job["case"])),
        lambda plan: wildcards_of(cases(plan)),
        message=f"Putting together the {name.replace('_', ' ')} of {{case}}",
        reads={"batches": of_batches(kind.batch_path)},
    )


JOINED = (
    joined("all_times", TIMINGS, lambda plan: plan.study.cases, lambda case: case.seeds),
    joined(
        "all_intervals",
        INTERVALS,
        lambda plan: plan.study.covered,
        lambda case: case.coverage_seeds,
    ),
    joined(
        "all_model_fits",
        MODEL_FITS,
        lambda plan: plan.study.cases if plan.study.selects_models else (),
        lambda case: case.seeds,
    ),
)
