"""Stage 4: CSV files of a case joined from batches."""

from collections.abc import Callable, Iterable
from operator import attrgetter
from pathlib import Path

from biogrip.products.product import Product, of_batches, wildcards_of
from biogrip.products.uses import covered, every, from_case
from biogrip.records.identifications import TIMINGS
from biogrip.records.intervals import INTERVALS
from biogrip.records.model_fits import MODEL_FITS
from biogrip.records.rows import RowFile, read_rows, write_rows
from biogrip.study.study import Case, Study


def join(case: Case, batches: list[Path], rows: Path) -> None:
    """Join CSV files that have the same columns, without seeds of an earlier run with more.

    Raises
    ------
    BiogripError
        If a file cannot be read, or has other columns than the first.
    """
    header = read_rows(batches[0])[0]
    found = (row for batch in batches for row in read_rows(batch, header)[1:])
    seed = header.index("seed")
    write_rows(rows, header, (row for row in found if int(row[seed]) < case.seeds))


def joined(
    name: str,
    what: str,
    kind: RowFile,
    cases: Callable[[Study], Iterable[str]] = every,
    seeds: Callable[[Case], int] = attrgetter("seeds"),
) -> Product:
    """Declare a product that joins the batches of a stage."""
    return Product(
        name,
        {"rows": kind.path},
        join,
        from_case(seeds=seeds),
        lambda plan: wildcards_of(cases(plan.study)),
        message=f"Putting together the {what} of {{case}}",
        reads={"batches": of_batches(kind.batch_path)},
        rule="joined",
    )


JOINED = (
    joined("timings_of_case", "times", TIMINGS),
    joined("coverage_of_case", "intervals", INTERVALS, covered, attrgetter("coverage_seeds")),
    joined(
        "selection_of_case",
        "model fits",
        MODEL_FITS,
        lambda study: study.cases if study.selects_models else (),
    ),
)
