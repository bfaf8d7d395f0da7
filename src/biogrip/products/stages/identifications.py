"""Stage 4: identifications of a case joined from batches, a row per method and seed."""

from dataclasses import dataclass
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

from biogrip.errors import BiogripError
from biogrip.experiment.sample import Sample
from biogrip.files import atomic_write
from biogrip.products.files.identifications import (
    BATCHES,
    HISTORIES,
    HISTORY_BATCHES,
    PATH,
    columns,
)
from biogrip.products.files.rows import read_rows, write_rows
from biogrip.products.plan import Wildcards
from biogrip.products.product import Product, Weight, of_batches, wildcards_of
from biogrip.study.study import Study


@dataclass(frozen=True)
class Settings:
    """Seeds, methods and sample model to join.

    Parameters
    ----------
    seeds, methods
        Number of seeds, and methods in order; batches may hold more seeds, of an earlier run with
        more.
    sample
        Sample model, which decides the columns.
    """

    seeds: int
    methods: tuple[str, ...]
    sample: Sample


def settings(study: Study, job: Wildcards) -> Settings:
    """Return the seeds, methods and sample model of a case."""
    case = study.case(job["case"])
    return Settings(case.seeds, tuple(study.methods), case.sample)


def join(
    settings: Settings,
    batches: list[Path],
    history_batches: list[Path],
    parameters: Path,
    history: Path,
) -> None:
    """Join batches in the order of their methods and seeds.

    Parameters
    ----------
    settings
        Seeds, methods and sample model.
    batches, history_batches
        Files of the identification stage, in the order of methods and seeds.
    parameters, history
        Joined files of the case.

    Raises
    ------
    BiogripError
        If a seed is missing or occurs twice.
    """
    header = columns(settings.sample.model)
    rows = [row for batch in batches for row in read_rows(batch, header)[1:]]
    rows = [row for row in rows if int(row[2]) < settings.seeds]
    seeds = range(settings.seeds)
    if [(row[1], int(row[2])) for row in rows] != [(m, s) for m in settings.methods for s in seeds]:
        names = ", ".join(str(batch) for batch in batches)
        raise BiogripError(
            f"{names}: do not hold each of the seeds 0 to {seeds[-1]} once for each of "
            f"{', '.join(settings.methods)}. Delete them and run again."
        )
    write_rows(parameters, header, rows)
    with atomic_write(history) as scratch:
        schema = pq.read_schema(history_batches[0])
        with pq.ParquetWriter(scratch, schema) as joined:
            for batch in history_batches:
                # The data set API would import pandas.
                with pq.ParquetFile(batch) as file:
                    table = file.read()
                joined.write_table(table.filter(pc.less(table["seed"], settings.seeds)))


IDENTIFICATIONS = Product(
    "identifications",
    {"parameters": PATH, "history": HISTORIES},
    join,
    settings,
    lambda plan: wildcards_of([*plan.study.cases, *plan.study.points]),
    message="Putting together the identifications of {case}",
    reads={"batches": of_batches(BATCHES), "history_batches": of_batches(HISTORY_BATCHES)},
    weight=Weight(10, 2000, group="case"),
)
