"""Stage 4: CSV files of a case joined from batches."""

from pathlib import Path

from biogrip.records.rows import read_rows, write_rows
from biogrip.study.study import Case


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
