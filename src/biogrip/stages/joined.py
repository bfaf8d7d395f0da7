"""Stage 4: the rows of a case's batches in one file, for what needs no sorting out."""

import csv
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError
from biogrip.files import written_whole


def run(settings: dict[str, Any], batches: list[Path], output: Path) -> None:
    """Join CSV files that have the same columns.

    Parameters
    ----------
    settings
        ``seeds``: how many seeds there are; batches may hold more, left from a larger study.
    batches
        The files, in the order of their seeds.
    output
        The rows of these seeds under one header.

    Raises
    ------
    BiogripError
        If a file cannot be read, has other columns than the first, or no seeds.
    """
    with written_whole(output) as scratch, scratch.open("w", newline="") as sink:
        writer = csv.writer(sink, lineterminator="\n")
        columns: list[str] = []
        for batch in batches:
            header, *rows = _rows(batch)
            if not columns:
                columns = header
                writer.writerow(header)
            if header != columns:
                raise BiogripError(
                    f"{batch}, line 1: found {','.join(header)}; wanted {','.join(columns)}."
                )
            seed = header.index("seed")
            writer.writerows(row for row in rows if int(row[seed]) < settings["seeds"])


def _rows(batch: Path) -> list[list[str]]:
    try:
        with batch.open(newline="") as stream:
            return list(csv.reader(stream))
    except (OSError, ValueError, csv.Error) as error:
        raise BiogripError(f"{batch}: cannot be read: {error}.") from error
