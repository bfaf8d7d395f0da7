"""What the user says of a recording's file: the columns to read, and their units.

A unit is stated, stands at the end of the column's name, as in ``rotation_urad``, ``phi (mrad)``,
``t in s`` or ``F/N``, or in a row below the names. It is never guessed, and no two may differ.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from math import pi
from pathlib import Path
from shlex import quote
from unicodedata import normalize

from biogrip.errors import BiogripError, nearest
from biogrip.physics.instruments import (
    DISPLACEMENT,
    FORCE,
    INSTRUMENTS,
    KNOWN_SHAPES,
    MODULUS,
    PHASE,
    ROTATION,
    STRAIN,
    STRESS,
    Channel,
    Shape,
)
from biogrip.terminal import visible

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "d": 86_400.0}
AXES = {
    "time": TIME_UNITS,
    "frequency": {"rad/s": 1.0, "Hz": 2 * pi, "1/s": 1.0, "mHz": 2e-3 * pi, "kHz": 2e3 * pi},
}
"""What readings follow, with its units as multiples of s or rad/s."""

# In any case of letters; no time has a unit with a capital.
_SPELLED_OUT = {
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("msec", "millisecond", "milliseconds"),
    "us": ("usec", "microsecond", "microseconds"),
    "min": ("min", "mins", "minute", "minutes"),
    "h": ("h", "hr", "hrs", "hour", "hours"),
    "d": ("day", "days"),
    "rad": ("radian", "radians"),
    "mrad": ("milliradian", "milliradians"),
    "urad": ("microrad", "microradian", "microradians"),
    "deg": ("degree", "degrees"),
    "um": ("micron", "microns", "micrometer", "micrometers", "micrometre", "micrometres"),
    "nm": ("nanometer", "nanometers", "nanometre", "nanometres"),
    "mm": ("millimeter", "millimeters", "millimetre", "millimetres"),
    "N": ("newton", "newtons"),
    "Hz": ("hertz",),
    "1": ("-", "\u2212", "\u2013", "in/in", "mm/mm", "m/m", "um/um", "nm/nm"),
    "%": ("percent", "pct"),
    "‰": ("permille", "mstrain", "millistrain", "mε", "mm/m"),
    "ppm": ("ustrain", "microstrain", "uε", "um/m"),
    "Pa": ("n/m2", "n/m^2", "pascal", "pascals"),
    "kPa": ("kn/m2", "kn/m^2"),
    "MPa": ("n/mm2", "n/mm^2"),
}
_IN_BRACKETS = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\}|<([^<>]*)>")
# What ends a name and is only a unit, and what may be one. After a digit, / is a reciprocal's.
_SURELY = (
    rf"(?:{_IN_BRACKETS.pattern})$",
    r"(?<![\d\s])\s*/\s*([^\W\d]+|%)$",
    r"(?:\sin|,)\s+(\S+)$",
)
_PERHAPS = (r"[_\s]([^\s_]+)$", r"(?i)(%|‰|percent|pct|(?:micro|milli|[um])strain)$")
# Pa^-1, Pa**-1, Pa-1, and with digits above the line, which `plain_name` brings down.
_RECIPROCAL = re.compile(r"([A-Za-z]+)(?:\^|\*\*)?\(?[-\u2212]1\)?")
# Names of pure numbers that have no unit: a word, more that end with one for a strain or a share of
# a modulus, and names of tan(delta).
_PURE = re.compile(
    r"[^\W\d_]+|(?:[\w.,-]*[\w.,]?[ _-])*(?:strain|modulus|deformation|gamma|epsilon|eps|[γεϵ])"
    r"|(?:loss|damping)[ _](?:factor|tangent)|(?:.* )?tan[ _]?\(?(?:delta|[dδ])\)?",
    re.I,
)
# Of two lengths, as Lp/Rp, and units that no column here has.
_RATIO = re.compile(r"[^\W\d_]+\d*\s*/\s*([^\W_]+)")
# 1/s in a column of this name is rad/s; in another it may as well be Hz.
_ANGULAR = re.compile("ang|omega|ω|kreis", re.I)
_READING_UNITS = {unit for instrument in INSTRUMENTS.values() for unit in instrument.read.units}
_ELECTRICAL, _COUNTED = {"V", "mV", "uV", "A", "mA"}, {"px", "pixel", "pixels", "counts"}
_UNITS = {*TIME_UNITS, *_ELECTRICAL, *_COUNTED, *_READING_UNITS}
_NUMBERED = re.compile(r"[ _]?(\d+|\(\d*\)|\[\d*\])$")
# A number with what may be its unit behind it.
_SIZED = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(.*?)\s*", re.I)
_SUCKS = " A pressure sucks into a pipette, as by --shape 'pipette 2.5 um', with your own radius."
_TO_STRAIN = " A length is a strain by a scale or shape, as by --shape 'cylinder 8 mm x 4 mm'."
_MOST_LISTED = 50
_LONGEST_SHOWN = 40
_LONGEST_PATH = 200


def unit_of(
    path: Path | None,
    column: str,
    given: str | None,
    allowed: Mapping[str, float],
    said_by: str,
    below: str = "",
    *,
    scaled: bool = False,
) -> str:
    """Return the unit of a column, a key of `allowed`; if ``1`` is among them, none need be given.

    It is `given`, at the end of the column's name, or in its cell `below` in a row of units. What
    states it, `said_by`, is for messages. A unit that is given may be of another kind than the
    column's only if this is `scaled`. A `BiogripError` says that no allowed unit is given, or
    which of name, cell and statement contradict each other.
    """
    where, choices = place(path, column=column), ", ".join(allowed)
    # Those of another quantity contradict; that of an axis may be shortened, as time_m.
    others = () if scaled or allowed in AXES.values() else _READING_UNITS - {"1"}
    # A name may end with something other than a unit, as in rotation_left or phi (2).
    at_end = _first_unit(_endings(column, *_SURELY, *_PERHAPS), allowed, others)
    in_row = _first_unit([_bare(below)], allowed, others)
    usable = (unit for unit in (at_end, in_row) if unit in allowed)
    unit = next(usable, None) if given is None else known_unit(given, allowed)
    if given is not None and unit is None:
        raise BiogripError(f"{where}: found the unit '{given}', allowed are {choices}.")
    of_frequency = unit == "1/s" and "Hz" in allowed
    if of_frequency and not _ANGULAR.search(plain_name(column)):
        raise BiogripError(f"{where}: found the unit 1/s; allowed are rad/s or Hz, by {said_by}.")
    if unit is None and "1" in allowed and _bare(below) in ("", "-") and _is_pure(column):
        return "1"
    if unit is None:
        end = _said_at_end(column)
        found = f"the unit '{shortened(end)}' at the end of the name" if end else "no unit"
        row = f" (but '{shortened(below)}' below it)" if below else ""
        kind = at_end or in_row or ""
        how = "" if kind else f", by {said_by} or at the end of the name"
        hint = _hint(column, allowed, kind)
        raise BiogripError(f"{where}: found {found}{row}; allowed are {choices}{how}.{hint}")
    for other, said in ((at_end, "the name"), (in_row, "the row of units")):
        if other not in (None, unit):
            raise BiogripError(
                f"{where}: found the unit '{given or unit}' where {said} says '{other}', allowed "
                "is one unit."
            )
    return "rad/s" if of_frequency else unit


def _first_unit(written: Sequence[str], *kinds: Collection[str]) -> str | None:
    units = (known_unit(text, kind) for kind in kinds for text in written)
    return next(filter(None, units), None)


def _hint(column: str, allowed: Mapping[str, float], kind: str) -> str:
    """Return what helps a column without an allowed unit, but with one of another kind."""
    if allowed == MODULUS.units and not kind:
        return " What is over another modulus, as G/G0, is a relative_modulus."
    if allowed == ROTATION.units:
        names = (name for name in INSTRUMENTS if name in plain_name(column).lower())
        example = f"{next(names, STRAIN.name)}={column}"
        return f" Which quantity is it? Say so, as by --reading {quote(example)}."
    if allowed == STRAIN.units and kind in DISPLACEMENT.units:
        return _TO_STRAIN
    return _SUCKS if allowed == FORCE.units and kind in STRESS.units else ""


def unit_in_cell(cell: str, allowed: Collection[str]) -> str | None:
    """Return the unit in a cell of a row of units, with brackets or without; None for others."""
    return known_unit(_bare(cell), allowed)


def is_unit(cell: str) -> bool:
    """Return True if a cell is a unit of anything, with brackets or without."""
    return unit_in_cell(cell, _UNITS) is not None


def in_brackets(cell: str) -> bool:
    """Return True if a cell has nothing but brackets and what they hold."""
    return _IN_BRACKETS.fullmatch(cell) is not None


def plain_name(name: str) -> str:
    """Return a name without padding, with either micro sign as u, ° as deg, and primes as '."""
    plain = normalize("NFKC", name).strip().replace("\u03bc", "u").replace("°", "deg")
    return plain.replace("\u2032", "'").replace('"', "''")


def known_unit(written: str, allowed: Collection[str]) -> str | None:
    """Return the allowed unit that is written, as µm, sec or Pa^-1; None if there is none."""
    plain = plain_name(written)
    power = _RECIPROCAL.fullmatch(plain)
    bare = f"1/{power[1]}" if power else re.sub(r"[ ·.*⋅]", "", plain)
    for unit in allowed:
        if bare == unit.replace(" ", "") or plain.lower() in _SPELLED_OUT.get(unit, ()):
            return unit
    return None


def number_and_unit(text: str) -> tuple[float, str]:
    """Return a number and what stands behind it, as in ``20 pN`` or ``5%``.

    A `ValueError` says that it does not begin with a number.
    """
    found = _SIZED.fullmatch(plain_name(text))
    if found is None:
        raise ValueError(f"found '{shortened(text)}', allowed is a number, or one with its unit")
    if found[2].startswith(","):
        raise ValueError(f"found '{shortened(text)}', a decimal comma? Allowed is a point")
    return float(found[1]), found[2]


def shape_and_sizes(text: str) -> tuple[Shape, list[float]]:
    """Return the shape of a text like ``cylinder 8 mm x 4 mm``, and its sizes in m or rad.

    A `ValueError` says what is allowed.
    """
    name, _, rest = plain_name(text).partition(" ")
    if (shape := KNOWN_SHAPES.get(name)) is None:
        examples = ", ".join(f"'{known.example}'" for known in KNOWN_SHAPES.values())
        raise ValueError(f"found '{shortened(text)}', allowed are, as examples, {examples}")
    sizes, units = list[float](), shape.sizes.units
    with suppress(ValueError, KeyError):
        for part in re.split(r"\s+x\s+|\s*,\s*", rest):
            number, written = number_and_unit(part)
            sizes.append(number * units[known_unit(written, units) or written])
    most = pi / 2 if shape.sizes is PHASE else 1.0
    if len(sizes) != shape.example.count(" x ") + 1 or not all(0 < size < most for size in sizes):
        raise ValueError(f"found '{shortened(text)}', allowed is as in '{shape.example}'")
    return shape, sizes


def held_unit(value: float | str, controlled: Channel, by: str = "--hold") -> tuple[float, str]:
    """Return the number and the unit of what was held, a key of its units; a number is in SI units.

    A `BiogripError` has what gave it, `by`, and the units that are allowed.
    """
    try:
        number, written = number_and_unit(str(value))
    except ValueError as error:
        raise BiogripError(f"{by}: {error}.") from error
    unit = known_unit(written, controlled.units) if written else controlled.unit or "1"
    if unit is None or unit not in controlled.units:
        allowed = ", ".join(controlled.units)
        found = f"found the unit '{shortened(written)}' of a {controlled.title}"
        found = found if written else "found no unit"
        others = [n for n, it in INSTRUMENTS.items() if known_unit(written, it.controlled.units)]
        other = f" Or say what is read, as by --reading {others[0]}=COLUMN." if others else ""
        if controlled.title == FORCE.name and known_unit(written, STRESS.units):
            other = _SUCKS
        raise BiogripError(f"{by}: {found}, allowed are {allowed}.{other}")
    return number, unit


def _endings(column: str, *patterns: str) -> list[str]:
    name = re.sub(r"_per_([^\W_]+)$", r" 1/\1", plain_name(column))
    found = filter(None, (re.search(pattern, name) for pattern in patterns))
    return ["".join(filter(None, match.groups())).strip() for match in found]


def _said_at_end(column: str) -> str | None:
    """Return what can be nothing but a unit, or is one, at the end of a name, or None."""
    if _is_ratio(column):
        return None
    ends = [end for end in _endings(column, *_SURELY) if end and not end.isdigit()]
    ends += (end for end in _endings(column, *_PERHAPS) if known_unit(end, _UNITS))
    return next(iter(ends), None)


def _is_pure(column: str) -> bool:
    """Return True if a name has no ending, but perhaps a number, that could be a unit."""
    name = plain_name(column)
    if _is_ratio(name):
        return True
    return not name.isdigit() and _PURE.fullmatch(_NUMBERED.sub("", name)) is not None


def _is_ratio(column: str) -> bool:
    """Return True if a name is that of one thing over another, which is no unit."""
    found = _RATIO.fullmatch(plain_name(column))
    return found is not None and known_unit(found[1], _UNITS) is None


def _bare(cell: str) -> str:
    # A row of units may be a comment.
    plain = plain_name(cell).removeprefix("% ")
    return plain[1:-1].strip() if in_brackets(plain) else plain


def place(path: Path | None, line: int | None = None, column: str | None = None) -> str:
    """Return the file, line and column at the beginning of a message; of an array its index."""
    if path is None:
        return "the trace" if column is None else column + f"[{line}]" * (line is not None)
    at = "" if line is None else f", line {line}"
    of = "" if column is None else f", column '{visible(column)}'"
    return f"{visible(path)}{at}{of}"


def shortened(cell: str) -> str:
    """Return the beginning of a long cell, for messages."""
    return cell if len(cell) <= _LONGEST_SHOWN else cell[:_LONGEST_SHOWN] + "..."


def listed(names: list[str], most: int = _MOST_LISTED) -> str:
    """Return the names of columns, of many the first."""
    found = ", ".join(map(shortened, names[:most]))
    return found if len(names) <= most else f"{found} and {len(names)} in all"


def trace_file_problem(path: str | Path) -> str | None:
    """Return what is wrong with the path of a trace, or None if it is a file."""
    file, shown = Path(path), f"{visible(path):.{_LONGEST_PATH}}"
    folder = "" if file.is_absolute() else f" in {visible(file.parent.absolute())}"
    found = f"there is no file {shown}{folder:.{_LONGEST_PATH}}."
    try:
        if file.exists():
            regular = f"found '{shown}', which is no regular file; allowed is one."
            return None if file.is_file() else regular
        beside = [str(other) for other in file.parent.glob("*") if other.is_file()]
    except (OSError, ValueError):
        # A name that is too long or invalid for the system: no neighbours to suggest.
        return found
    return found + nearest(str(file), beside)
