"""Stage 4: identifications of a case joined from batches, a row per method and seed."""

from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

from biogrip.errors import BiogripError
from biogrip.files import atomic_write
from biogrip.records.identifications import (
    columns,
)
from biogrip.records.rows import read_rows, write_rows
from biogrip.study.study import Case


def join(
    case: Case,
    batches: list[Path],
    history_batches: list[Path],
    parameters: Path,
    history: Path,
) -> None:
    """Join batches in the order of their methods and seeds.

    Raises
    ------
    BiogripError
        If a seed is missing or occurs twice.
    """
    header = columns(case.sample.model)
    rows = [row for batch in batches for row in read_rows(batch, header)[1:]]
    rows = [row for row in rows if int(row[2]) < case.seeds]
    seeds = range(case.seeds)
    if [(row[1], int(row[2])) for row in rows] != [
        (m, s) for m in case.study.methods for s in seeds
    ]:
        names = ", ".join(str(batch) for batch in batches)
        raise BiogripError(
            f"{names}: do not hold each of the seeds 0 to {seeds[-1]} once for each of "
            f"{', '.join(case.study.methods)}. Delete them and run again."
        )
    write_rows(parameters, header, rows)
    with atomic_write(history) as scratch:
        schema = pq.read_schema(history_batches[0])
        with pq.ParquetWriter(scratch, schema) as joined:
            for batch in history_batches:
                # The data set API would import pandas.
                with pq.ParquetFile(batch) as file:
                    table = file.read()
                joined.write_table(table.filter(pc.less(table["seed"], case.seeds)))
