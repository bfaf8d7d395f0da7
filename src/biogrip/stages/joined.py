"""Stage 4: the rows of a case's batches in one file, for what needs no sorting out."""

from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import written_whole


def run(batches: list[Path], output: Path) -> None:
    """Join CSV files that have the same columns.

    Parameters
    ----------
    batches
        The files, in the order of their seeds.
    output
        All their rows under one header.

    Raises
    ------
    BiogripError
        If a file cannot be read, or has other columns than the first.
    """
    with written_whole(output) as scratch, scratch.open("w", newline="") as joined:
        columns = ""
        for batch in batches:
            header, rows = _parts(batch)
            if not columns:
                columns = header
                joined.write(header)
            if header != columns:
                raise BiogripError(
                    f"{batch}, line 1: found {header.strip()}; wanted {columns.strip()}."
                )
            joined.write(rows)


def _parts(batch: Path) -> tuple[str, str]:
    try:
        with batch.open(newline="") as stream:
            return stream.readline(), stream.read()
    except (OSError, ValueError) as error:
        raise BiogripError(f"{batch}: cannot be read: {error}.") from error
