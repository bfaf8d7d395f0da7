"""Units of columns: stated, at the end of a name, or in a row below the header."""

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from unicodedata import normalize

from biogrip.errors import BiogripError, nearest
from biogrip.traces.columns import place, said_by, shortened

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}

_SPELLED_OUT = {
    "s": ("sec", "secs", "second", "seconds"),
    "ms": ("msec", "millisecond", "milliseconds"),
    "min": ("mins", "minute", "minutes", "m"),
    "h": ("hr", "hrs", "hour", "hours"),
    "rad": ("radian", "radians"),
    "mrad": ("milliradian", "milliradians"),
    "urad": ("microrad", "microradian", "microradians"),
    "deg": ("degree", "degrees"),
}
_UNIT_AT_END = re.compile(r"(?:_(\w+)|\(([^()]*)\)|\[([^\[\]]*)\])$")
_IN_BRACKETS = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)")
# Pa^-1, Pa**-1, Pa-1, and with digits above the line, which `plain_name` brings down.
_RECIPROCAL = re.compile(r"([A-Za-z]+)(?:\^|\*\*)?\(?[-\u2212]1\)?")


def unit_of(
    path: Path,
    column: str,
    given: str | None,
    allowed: Mapping[str, float],
    key: str,
    *,
    by_options: bool = False,
    below: str = "",
) -> str:
    """Return the unit of a column, a key of `allowed`.

    Parameters
    ----------
    path
        The file, for messages.
    column
        Name of the column; it may end with the unit.
    given
        Unit that the user states, or None.
    allowed
        Allowed units; if ``1`` is among them, none need be given.
    key
        Key or option that states the unit, for messages.
    by_options
        Field of `Columns`.
    below
        The column's cell in a row of units, if there is one.

    Raises
    ------
    BiogripError
        If no allowed unit is given, or two of name, cell and statement contradict each other.
    """
    choices = ", ".join(allowed)
    named, in_row = _unit_at_end(column, allowed), unit_in_cell(below, allowed)
    stated = (named or in_row) if given is None else plain_name(given)
    if stated is None and "1" in allowed and bare_unit(below) in ("", "-"):
        return "1"
    if stated is None:
        row = f" (but '{shortened(below)}' below it)" if below else ""
        raise BiogripError(
            f"{place(path, column=column)}: found no unit{row}, neither stated (by "
            f"{said_by(by_options, key)}) nor at the end of the name; allowed are "
            f"{choices}."
        )
    if stated not in allowed:
        raise BiogripError(
            f"{place(path, column=column)}: found the unit '{given}', allowed are {choices}."
            + nearest_unit(given, allowed)
        )
    for other, where in ((named, "the name"), (in_row, "the row of units")):
        if other not in (None, stated):
            raise BiogripError(
                f"{place(path, column=column)}: found the unit '{given or stated}' where {where} "
                f"says '{other}', allowed is one unit."
            )
    return stated


def nearest_unit(name: object, allowed: Collection[str]) -> str:
    """Return a hint like ``" Did you mean 'h'?"`` for ``hours``; otherwise that of `nearest`."""
    plain = plain_name(str(name)).lower()
    for unit in allowed:
        if plain in _SPELLED_OUT.get(unit, ()):
            return f" Did you mean '{unit}'?"
    return nearest(name, allowed)


def unit_in_cell(cell: str, allowed: Collection[str]) -> str | None:
    """Return the unit in a cell of a row of units, with brackets or without; None for others."""
    unit = _known(bare_unit(cell), allowed)
    # A lone m may be of metres.
    words = [word for word in _SPELLED_OUT.items() if bare_unit(cell).lower() in word[1]]
    spelled = next((key for key, _ in words if key in allowed and bare_unit(cell) != "m"), None)
    return unit or spelled


def bare_unit(cell: str) -> str:
    """Return the content of a cell, without brackets around it."""
    plain = plain_name(cell)
    bracketed = _IN_BRACKETS.fullmatch(plain)
    return (bracketed[1] or bracketed[2] or "").strip() if bracketed else plain


def in_brackets(cell: str) -> bool:
    """Return True if a cell has nothing but brackets and what they hold."""
    return _IN_BRACKETS.fullmatch(cell.strip()) is not None


def plain_name(name: str) -> str:
    """Return a name without padding, with either micro sign written as u, and ° as deg."""
    return normalize("NFKC", name).strip().replace("\u03bc", "u").replace("°", "deg")


def _unit_at_end(column: str, allowed: Mapping[str, float]) -> str | None:
    ending = _UNIT_AT_END.search(plain_name(column))
    if ending is None:
        return None
    # A name may end with something other than a unit, as in rotation_left or phi (2).
    unit = next(group for group in ending.groups() if group is not None).strip()
    before, _, last = unit.rpartition("_")
    last = f"1/{last}" if before.endswith("per") else last
    return next((u for u in allowed if u in (unit, last)), None) or _known(unit, allowed)


def _known(unit: str, allowed: Collection[str]) -> str | None:
    """Return the allowed unit that is written so, or as a power: ``Pa^-1`` is ``1/Pa``."""
    power = _RECIPROCAL.fullmatch(unit)
    written = f"1/{power[1]}" if power else unit
    return written if written in allowed else None
