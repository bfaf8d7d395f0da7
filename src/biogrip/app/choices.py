"""What is chosen in the window, as options of ``biogrip identify``, and back from options."""

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import yaml

from biogrip.arrays import Array
from biogrip.command.options import GROUPS
from biogrip.errors import BiogripError
from biogrip.physics.instruments import INSTRUMENTS, PARTNERS
from biogrip.traces.columns import AXES, plain_name, unit_of

FIELDS = (
    *("time", "frequency", "block", "rows", "hold", "load", "ramp", "shape", "contact", "start"),
    *("from", "until", "model"),
)
"""Options that have a field of the same name."""

CHOICES = (
    *("kind", "reading", "column", "partner", "partner_column", *FIELDS, "offset", "no-compare"),
    *("more", "across", "upward", "by", "unit"),
)
"""All that can be chosen, as text; nothing by default."""

OF_TIME = "time", "hold", "load", "ramp", "contact", "start", "offset"
"""What a sweep does not have."""

_SWITCHES = {
    prefix + name[2:]
    for options in GROUPS.values()
    for name, metavar, *_ in options
    for prefix in ("--", "--no-")
    if not metavar
} | {"--no-compare"}
_WORDS = yaml.safe_load(Path(__file__).with_name("likely.yaml").read_text("utf-8"))
_CHANNELS = [each for of in INSTRUMENTS.values() for each in (of.read, *of.partners)]
_OPTION = re.compile(r"(--[a-z-]+)(?: ((?:'[^']*'|\"[^\"]*\"|[^\s'\"])+?))?(?=[.,;:)]*(?:\s|$))")
_PLACEHOLDER = re.compile(r"(^|=)[A-Z]+$")
_UNITS_ALLOWED = re.compile(r"allowed are ([^.;:]+?)(?:, or |, by |[.;]|$)")


def likely_choices(
    names: Sequence[str], units: Sequence[str] | None, numbers: Callable[[str], Array]
) -> dict[str, str]:
    """Return which columns probably have what, and what was done then.

    Of a load and a deformation, that of fewer different numbers was held.
    """
    columns: dict[str, str] = {}
    for with_unit in (True, False):
        for name, unit in zip(names, units or [""] * len(names), strict=False):
            quantity = _quantity_of(name, unit, with_unit=with_unit)
            if name not in columns.values():
                columns.setdefault(quantity, name)
    partners = [name for name in PARTNERS if name in columns]
    some = [name for name in INSTRUMENTS if name in columns]
    some = [name for name in some if INSTRUMENTS[name].sweeps == ("frequency" in columns)] or some
    some.sort(key=lambda name: INSTRUMENTS[name].relative, reverse=True)
    reading, *others = some or ["strain"]
    load = "" if INSTRUMENTS[reading].relative else INSTRUMENTS[reading].controlled.name
    load = load if load in others else ""
    if load and _steps(numbers(columns[reading])) < _steps(numbers(columns[load])):
        reading, load = load, reading
    return {
        **{"across": columns.get("frequency", columns.get("time", ""))},
        **{"upward": columns.get(reading, "")},
        **{axis: columns.get(axis, "") for axis in AXES},
        **{"kind": INSTRUMENTS[reading].kind, "reading": reading},
        **{"column": columns.get(reading, ""), "load": columns.get(load, "")},
        **({"partner": partners[0], "partner_column": columns[partners[0]]} if partners else {}),
    }


def _quantity_of(name: str, unit: str, *, with_unit: bool) -> str:
    words = plain_name(name).replace("_", " ")
    for quantity in (each for each, of in _WORDS.items() if re.search(of, words, re.I)):
        allowed = dict(AXES.get(quantity, {}))
        for channel in _CHANNELS:
            allowed |= channel.units if channel.name == quantity else {}
        try:
            unit_of(None, name, None, allowed, "", unit)
        except BiogripError:
            if with_unit:
                continue
        return str(quantity)
    return ""


def _steps(values: Array) -> int:
    """Return how many numbers there are that differ by a hundredth of the largest."""
    values = values[np.isfinite(values)]
    return len({*np.rint(100 * values / np.max(np.abs(values), initial=1e-300))})


def options_typed(chosen: Mapping[str, str]) -> list[str]:
    """Return what is chosen as it is typed; a `BiogripError` has a quote without an end."""
    sweeps = chosen["kind"] == "oscillation"
    hidden = OF_TIME if sweeps else ("frequency", "partner_column")
    shown = {name: text for name, text in chosen.items() if text and name not in hidden}
    typed: list[str] = []
    for quantity, column in (("reading", "column"), ("partner", "partner_column")):
        typed += ["--reading", f"{chosen[quantity]}={shown[column]}"] if column in shown else []
    for name in filter(shown.__contains__, FIELDS):
        typed += [f"--{name}", shown[name]]
    try:
        more = shlex.split(chosen["more"])
    except ValueError as error:
        raise BiogripError(f"more options: {error}.") from error
    switches = (f"--{name}" for name in ("offset", "no-compare") if name in shown)
    return [*typed, *switches, *more]


def with_option(chosen: Mapping[str, str], option: str, value: str) -> dict[str, str]:
    """Return choices with an option: in its field, or else among more options."""
    name, (quantity, _, column) = option.removeprefix("--"), value.partition("=")
    if option == "--reading" and quantity in PARTNERS:
        return {**chosen, "partner": quantity, "partner_column": column}
    if option == "--reading" and quantity in INSTRUMENTS:
        kind = INSTRUMENTS[quantity].kind
        return {**chosen, "kind": kind, "reading": quantity, "column": column}
    if name in (*FIELDS, "offset", "no-compare"):
        return {**chosen, name: value or "on"}
    more = shlex.join(filter(None, (option, value)))
    return {**chosen, "more": f"{chosen['more']} {more}".strip()}


def remedies_in(message: str) -> dict[tuple[str, str], str]:
    """Return options and values that a message names, with what their buttons say.

    Where it asks for a unit, there is one for each that is allowed.
    """
    remedies: dict[tuple[str, str], str] = {}
    for option, written in _OPTION.findall(message):
        value = "".join(shlex.split(written)) if option not in _SWITCHES else ""
        units = _UNITS_ALLOWED.search(message) if value.endswith("=UNIT") else None
        for unit in re.split(", | or ", units[1]) if units else ():
            remedies[option, value.replace("UNIT", unit)] = unit
        known = option in _SWITCHES or any(option == own[0] for of in GROUPS.values() for own in of)
        if known and bool(value) != (option in _SWITCHES) and not _PLACEHOLDER.search(value):
            remedies[option, value] = shlex.join(filter(None, (option, value)))
    return remedies
