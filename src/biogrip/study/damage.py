"""Finds result files that are not whole, so that they are made again.

Stages write whole files or none. What a crashed machine or a broken copy cut
short, though, is there and new: Snakemake takes it for done. Mostly its end is
missing; a file cut between two rows no longer agrees with itself or its like.
"""

import json
from collections import Counter
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
    ".tex": b"\\end{table}\n",
}
# Files whose second column (method, model or quantity) holds each of its values once a seed.
_BY_SEED = ("identifications", "timings", "selection", "coverage")


def remove_damaged(results: Path) -> dict[Path, str]:
    """Remove the files of a study that are not whole.

    Returns
    -------
    dict
        What was wrong with each file that was removed.
    """
    found = dict(_damaged(results))
    for path in found:
        path.unlink()
    return found


def _damaged(results: Path) -> Iterator[tuple[Path, str]]:
    paths = list(results.glob("[!.]*.*"))
    for stage in STAGE_FOLDERS:
        if stage != "logs":
            paths += (results / stage).rglob("[!.]*")
    for path in sorted(paths):
        if not path.is_file():
            continue
        if not _ends_well(path):
            yield path, "was cut short"
        elif _lacks_rows(path, path.relative_to(results).parts):
            yield path, "lacks rows"


def _ends_well(path: Path) -> bool:
    if path.suffix == ".json":
        try:
            json.loads(path.read_bytes())
        except ValueError:
            return False
        return True
    end = _ENDS.get(path.suffix, b"")
    with path.open("rb") as stream:
        stream.seek(max(0, stream.seek(0, 2) - len(end) - 1))
        last = stream.read()
    return last.endswith(end) or (path.suffix == ".html" and last == end + b"\n")


def _lacks_rows(path: Path, parts: tuple[str, ...]) -> bool:
    stage = parts[0]
    if stage == "tables" and path.suffix in (".csv", ".md"):
        csv, markdown = path.with_suffix(".csv"), path.with_suffix(".md")
        if not (csv.exists() and markdown.exists()):
            return False
        rows = {csv: _lines(csv), markdown: _lines(markdown, b"|") - 1}
        return rows[path] < max(rows.values())
    if path.suffix != ".csv" or stage not in _BY_SEED:
        return False
    rows_of = Counter(
        line.partition(b",")[2].partition(b",")[0] for line in path.read_bytes().splitlines()[1:]
    )
    batch = parse_batch(path.stem) if len(parts) > 2 else None
    if batch is None:
        return len(set(rows_of.values())) > 1
    # Of quantities there may be none, where none is determined.
    return set(rows_of.values()) != {len(batch.seeds)} and (bool(rows_of) or stage != "coverage")


def _lines(path: Path, start: bytes = b"") -> int:
    return sum(line.startswith(start) for line in path.read_bytes().splitlines())
