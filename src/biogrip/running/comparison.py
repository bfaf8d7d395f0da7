"""The command ``biogrip compare``: regenerated against published tables, cell by cell."""

from pathlib import Path

import pandas as pd

from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.products.product import PUBLISHED_TABLE_KINDS

_SHOWN = 40


def compare(published: Path, now: Path, only: str = "*") -> str:
    """Compare the tables of two folders.

    Parameters
    ----------
    published, now
        Folders of published and of regenerated tables.
    only
        Pattern for file names without suffix.

    Returns
    -------
    str
        Number of tables that agree.

    Raises
    ------
    BiogripError
        If a table is missing on either side or any cell differs; the message names row, column
        and both values.
    """
    names = _tables(published, only)
    if not names:
        raise BiogripError(f"{published}: holds no tables to compare with.")
    problems = [f"{name}: published, but not regenerated" for name in _missing(names, now)]
    regenerated = _tables(now, only)
    problems += [
        f"{name}: regenerated, but not published" for name in _missing(regenerated, published)
    ]
    differences: list[tuple[str, ...]] = []
    for name in sorted(names & regenerated):
        if (published / name).read_bytes() != (now / name).read_bytes():
            found = _differences(published / name, now / name) if name.endswith(".csv") else []
            differences += found
            if not found:
                problems.append(f"{name}: differs in its text")
    if not problems and not differences:
        return f"{counted(len(names), 'file')} of tables compared with {published}: the same bytes."
    raise BiogripError(_report(published, problems, differences))


def _tables(folder: Path, only: str) -> set[str]:
    """Return names of the tables in a folder whose stem is like a pattern."""
    return {path.name for path in folder.glob(f"{only}.*") if path.suffix in PUBLISHED_TABLE_KINDS}


def _missing(names: set[str], folder: Path) -> list[str]:
    return sorted(name for name in names if not (folder / name).exists())


def _differences(published: Path, now: Path) -> list[tuple[str, ...]]:
    old, new = (pd.read_csv(path, dtype=str, keep_default_na=False) for path in (published, now))
    key = [name for name in ("case", "parameter", "quantity", "symbol", "gene") if name in old]
    if list(old.columns) != list(new.columns) or not key:
        return []
    rows: list[tuple[str, ...]] = []
    old, new = old.set_index(key), new.set_index(key)
    if not (old.index.is_unique and new.index.is_unique):
        return []
    for label in old.index.union(new.index, sort=False):
        name = " ".join(label) if isinstance(label, tuple) else str(label)
        if label not in new.index or label not in old.index:
            side = ("present", "absent") if label in old.index else ("absent", "present")
            rows.append((published.stem, name, "(row)", *side))
            continue
        for column in old.columns:
            a, b = (str(frame.at[label, column]) for frame in (old, new))
            if a != b:
                rows.append((published.stem, name, column, a, b))
    return rows


def _report(published: Path, problems: list[str], differences: list[tuple[str, ...]]) -> str:
    lines = [f"the regenerated tables differ from {published}."]
    lines += problems
    if differences:
        frame = pd.DataFrame(
            differences[:_SHOWN], columns=["table", "row", "column", "published", "now"]
        )
        lines += ["", frame.to_markdown(index=False, disable_numparse=True)]
        if len(differences) > _SHOWN:
            lines.append(f"... and {counted(len(differences) - _SHOWN, 'further difference')}.")
    return "\n".join(lines)
