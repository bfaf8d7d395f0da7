"""Tables of recorded traces: a row a trace, with settings of its own and words to be copied.

The column `file` makes a table. A column whose name has a dot, as `measurement.noise_rad`, is a key
of the config, and its cells are values for the traces of their rows; an empty cell leaves the key
as config and options have it. All other columns are copied to the results.
"""

import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from biogrip.errors import BiogripError, nearest
from biogrip.identify.outputs import COLUMNS
from biogrip.identify.settings import Asked, Setting, first_few, value_of
from biogrip.terminal import visible
from biogrip.traces.columns import listed, place

FILE = "file"
"""The column that every table has."""

_SEPARATORS = ",;\t"
_OF_RESULTS = re.compile(r".* (verdict|value|low|high)( \(.*\))?")
_HEAD_BYTES = 100_000


def is_table(path: Path) -> bool:
    """Return True if the first line of a file is a header with a column `file`."""
    with path.open("rb") as stream:
        first = stream.readline(_HEAD_BYTES).decode("utf-8-sig", errors="replace")
    # Another spelling, as File, is a table, too, whose reader says what is wrong.
    names = [name.strip(' "\r\n').lower() for name in re.split(f"[{_SEPARATORS}]", first)]
    return FILE in names


def read_table(
    path: Path, config: Path | None = None, options: Sequence[Setting] = ()
) -> list[Asked]:
    """Read the traces of a table with config and options of the command; settings are not checked.

    The table is text in UTF-8: `.tsv` is separated by tabs, another by what its header has.

    Raises
    ------
    BiogripError
        With line and column of the first few problems: text that is no table, values that are no
        YAML, a trace twice.
    """
    header, *rows = _cells(path)
    if FILE not in header:
        raise BiogripError(
            f"{place(path, 1)}: found no column '{FILE}' among {listed(header)}; allowed is one."
            f"{nearest(FILE, header)}"
        )
    problems = list(_name_problems(path, header))
    found, lines = [], dict[str, int]()
    for line, row in enumerate(rows, 2):
        if not any(row):
            continue
        by_name = dict(zip(header, row, strict=True))
        trace = path.parent / by_name.pop(FILE)
        # Resolved, so that links to one file are found.
        before = lines.setdefault(os.path.realpath(trace), line)
        if trace == path.parent:
            problems.append(f"{place(path, line, FILE)}: found nothing, allowed is a trace.")
        elif before != line:
            text = f"found '{visible(trace)}' again, as on line {before}; allowed is each"
            problems.append(f"{place(path, line, FILE)}: {text} trace once.")
        settings = list(options)
        for name, cell in by_name.items():
            if "." in name and cell:
                try:
                    value = value_of(cell)
                    settings.append(Setting(visible(path), tuple(name.split(".")), value, line))
                except BiogripError as error:
                    problems.append(f"{place(path, line, name)}: {error}")
        copied = {name: cell for name, cell in by_name.items() if name and "." not in name}
        found.append(Asked(trace, config, tuple(settings), place(path, line), copied))
    if not found:
        problems.append(f"{place(path)}: found no traces, allowed is a row for each.")
    if problems:
        raise BiogripError("\n".join(first_few(problems)))
    return found


def _cells(path: Path) -> list[list[str]]:
    """Return the header and all rows as text, empty where a row is shorter."""
    # Imported here: loading pandas takes long.
    import pandas as pd

    try:
        with path.open(encoding="utf-8-sig") as stream:
            header = stream.readline()
        frame = pd.read_csv(
            path,
            sep="\t" if path.suffix == ".tsv" else max(_SEPARATORS, key=header.count),
            header=None,
            dtype=str,
            keep_default_na=False,
            skip_blank_lines=False,
            skipinitialspace=True,
            encoding="utf-8-sig",
        )
    except (OSError, ValueError) as error:
        found = " ".join(str(error).split())
        raise BiogripError(f"{place(path)}: cannot be read as a table: {found}.") from error
    return [[str(cell).strip() for cell in row] for row in frame.fillna("").to_numpy()]


def _name_problems(path: Path, header: Sequence[str]) -> Iterator[str]:
    """Find names that stand twice, or would be taken for results."""
    for number, name in enumerate(header):
        if name and name in header[:number]:
            text = "stands twice; allowed is each name once."
            yield f"{place(path, 1, name)}: {text}"
        elif name in COLUMNS or _OF_RESULTS.fullmatch(name):
            text = "is a column of the results; allowed is another name."
            yield f"{place(path, 1, name)}: {text}"
