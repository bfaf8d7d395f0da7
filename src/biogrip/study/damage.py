"""Finds result files that are not whole, so that they are made again.

Stages write whole files or none. What a crashed machine or a broken copy cut
short, though, is there and new: Snakemake takes it for done. Mostly its end is
missing; a file cut between two rows has too few of them.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from biogrip.study.batches import parse_batch
from biogrip.study.config import STAGE_FOLDERS

_ENDS = {
    ".parquet": b"PAR1",
    ".png": b"IEND\xaeB`\x82",
    ".pdf": b"%%EOF\n",
    ".csv": b"\n",
    ".yaml": b"\n",
    ".html": b"</html>",
    ".md": b"\n",
    ".tex": b"\\end{table}\n",
}
# Rows of a batch may be none where no quantity is determined.
_MAY_BE_EMPTY = "coverage"


def remove_damaged(results: Path, rows: Mapping[str, int]) -> dict[Path, str]:
    """Remove the files of a study that are not whole.

    Parameters
    ----------
    results
        Folder of the results.
    rows
        How many rows a CSV file has at least, by its path in there.

    Returns
    -------
    dict
        What is wrong with each file that was removed.
    """
    found = dict(_damaged(results, rows))
    for path in found:
        path.unlink()
    return found


def _damaged(results: Path, rows: Mapping[str, int]) -> Iterator[tuple[Path, str]]:
    paths = list(results.glob("[!.]*.*"))
    for stage in STAGE_FOLDERS:
        if stage != "logs":
            paths += (results / stage).rglob("[!.]*")
    for path in sorted(paths):
        if not path.is_file():
            continue
        name = path.relative_to(results)
        if not _ends_well(path):
            yield path, "was cut short"
        elif path.suffix == ".csv":
            found = path.read_bytes().count(b"\n") - 1
            wanted = _rows_wanted(path, found, rows.get(name.as_posix(), 0), name.parts[0])
            if found < wanted:
                yield path, f"has {found} of {wanted} rows"


def _ends_well(path: Path) -> bool:
    if path.suffix == ".json":
        try:
            json.loads(path.read_bytes())
        except ValueError:
            return False
        return True
    end = _ENDS.get(path.suffix, b"")
    with path.open("rb") as stream:
        size = stream.seek(0, 2)
        stream.seek(max(0, size - len(end) - 1))
        return end in stream.read()


def _rows_wanted(path: Path, found: int, known: int, stage: str) -> int:
    """Rows that a CSV file should have at least."""
    batch = parse_batch(path.stem)
    if batch is not None:
        # Every seed has as many.
        least = 0 if stage == _MAY_BE_EMPTY else 1
        return len(batch.seeds) * max(least, -(-found // len(batch.seeds)))
    twin = path.with_suffix(".md")
    if stage == "tables" and twin.exists():
        # Above them are the heading and the line below it.
        return max(0, sum(line.startswith(b"|") for line in twin.read_bytes().splitlines()) - 2)
    return known
