"""Regenerated tables beside the published ones."""

from collections.abc import Sequence
from difflib import unified_diff
from itertools import islice
from pathlib import Path

from biogrip.digits import counted
from biogrip.errors import BiogripError

_SHOWN = 40


def compare(published: Path, made: Sequence[Path]) -> str:
    """Compare tables with published files of the same names, and say how many agree.

    Raises
    ------
    BiogripError
        If there is none to compare; or with the lines that differ, if a table is not published, or
        has other bytes.
    """
    if not made:
        raise BiogripError(f"{published}: holds no tables to compare with.")
    differing: list[str] = []
    for now in made:
        before = published / now.name
        if not before.exists():
            differing.append(f"{now.name}: is not published.")
        elif before.read_bytes() != now.read_bytes():
            old, new = (file.read_text(encoding="utf-8").splitlines() for file in (before, now))
            differing += unified_diff(old, new, str(before), str(now), n=0, lineterm="")
    if differing:
        shown = "\n".join(islice(differing, _SHOWN))
        raise BiogripError(f"the regenerated tables differ from {published}.\n{shown}")
    return f"{counted(len(made), 'file')} of tables compared with {published}: the same bytes."
