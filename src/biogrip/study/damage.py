"""Finds result files that are not whole, so that they are made again.

Stages write whole files or none. What a crashed machine or a broken copy cut
short, though, is there and new: Snakemake takes it for done.
"""

import json
from collections.abc import Iterator
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
    ".tex": b"\n",
}
# Rows of a batch may be none where no quantity is determined.
_MAY_BE_EMPTY = "coverage"


def remove_damaged(results: Path) -> list[Path]:
    """Remove and return the files of a study that were cut short."""
    found = list(_damaged(results))
    for path in found:
        path.unlink()
    return found


def _damaged(results: Path) -> Iterator[Path]:
    paths = list(results.glob("[!.]*.*"))
    for stage in STAGE_FOLDERS:
        if stage != "logs":
            paths += (results / stage).rglob("[!.]*")
    for path in sorted(paths):
        if path.is_file() and not _is_whole(path, path.relative_to(results).parts[0]):
            yield path


def _is_whole(path: Path, stage: str) -> bool:
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
        if end not in stream.read():
            return False
    batch = parse_batch(path.stem)
    if path.suffix != ".csv" or batch is None:
        return True
    # Cut between two rows; every seed has as many.
    rows = path.read_bytes().count(b"\n") - 1
    return rows % len(batch.seeds) == 0 and (rows > 0 or stage == _MAY_BE_EMPTY)
