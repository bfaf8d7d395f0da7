"""What is chosen in the window, as options of ``biogrip identify``, and back from options."""

import re
import shlex
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import yaml

from biogrip.arrays import Array
from biogrip.command.options import GROUPS
from biogrip.errors import BiogripError
from biogrip.physics.instruments import DISPLACEMENT, INSTRUMENTS, PARTNERS, ROTATION, STRESS
from biogrip.traces.columns import AXES, plain_name

KNOWN = yaml.safe_load(Path(__file__).with_name("known.yaml").read_text("utf-8"))
"""Words of columns, and examples."""

TICKED = "offset", "contact", "no-compare"
CHOICES = (
    *("reading", "column", "partner", "partner_column", "across", "upward", "more", "by", "unit"),
    *("time", "frequency", "block", "rows", "hold", "load", "ramp", "shape", "start", "from"),
    *("until", "model", *TICKED),
)
"""All that can be chosen, as text: options by their names, more options, columns of pictures."""

# What a sweep does not have, and what only that has.
_OF_TIME, _OF_SWEEPS = {"time", "hold", "load", "ramp", "contact", "start", "offset"}, {"frequency"}
_TAKES_VALUE = {name: bool(metavar) for of in GROUPS.values() for name, metavar, *_ in of}
_OPTION = re.compile(r"(--[a-z-]+)(?: ((?:'[^']*'|\"[^\"]*\"|[^\s'\"])+?))?(?=[.,;:)]*(?:\s|$))")
_PLACEHOLDER, _QUOTED = re.compile(r"(^|=)[A-Z]+$|^(and|or)$"), re.compile("'(.*?)'|\"(.*?)\"")
_UNITS_ALLOWED = re.compile(r"allowed are ([^.;:]+?)(?:, or |, by |[.;]|$)")


def likely_choices(numbers: Mapping[str, Array]) -> dict[str, str]:
    """Return which columns of numbers by name probably have what, and what was done then.

    Of a load and a deformation, that of fewer different numbers was held.
    """
    columns: dict[str, str] = {}
    for name in numbers:
        words = plain_name(name).replace("_", " ")
        likely = (own for own, pattern in KNOWN["words"].items() if re.search(pattern, words))
        columns.setdefault(next(likely, "other"), name)
    read = [it for name, it in INSTRUMENTS.items() if name in columns]
    instrument = max(read, key=lambda it: it.sweeps + it.relative, default=INSTRUMENTS["strain"])
    reading, load = instrument.read.name, instrument.controlled.name * (not instrument.relative)
    if {load, reading} <= {*columns}:
        load, reading = sorted((load, reading), key=lambda name: _steps(numbers[columns[name]]))
    elif reading == DISPLACEMENT.name and STRESS.name in columns:
        # A pipette sucks.
        load = STRESS.name
    partner = next((name for name in PARTNERS if name in columns and name != reading), "")
    chosen = {"column": reading, "load": load, "partner_column": partner}
    chosen |= {axis: axis for axis in AXES}
    named = {key: columns.get(quantity, "") for key, quantity in chosen.items()}
    named |= {"across": named["frequency"] or named["time"], "upward": named["column"]}
    return {**named, "reading": reading, "partner": partner}


def _steps(values: Array) -> int:
    """Return how many numbers there are that differ by a hundredth of the largest."""
    values = values[np.isfinite(values)]
    return len({*np.rint(100 * values / np.max(np.abs(values), initial=1e-300))})


def options_typed(chosen: Mapping[str, str]) -> list[str]:
    """Return what is chosen as it is typed; a `BiogripError` has a quote without an end."""
    reading = chosen["reading"] or ROTATION.name
    hidden = _OF_TIME if INSTRUMENTS[reading].sweeps else _OF_SWEEPS
    typed = ["--reading", f"{reading}={chosen['column']}"] if chosen["column"] else []
    if hidden is _OF_TIME and chosen["partner_column"]:
        typed += ["--reading", f"{chosen['partner']}={chosen['partner_column']}"]
    for name in CHOICES[1:]:
        if chosen[name] and name not in hidden and (option := f"--{name}") in _TAKES_VALUE:
            typed += [option, chosen[name]] if _TAKES_VALUE[option] else [option]
    try:
        return [*typed, *shlex.split(chosen["more"])]
    except ValueError as error:
        raise BiogripError(f"more options: {error}.") from error


def with_option(option: str, value: str, more: str) -> dict[str, str]:
    """Return what to choose for an option: its field, or else more options."""
    quantity, _, column = value.partition("=")
    if option == "--reading" and quantity in INSTRUMENTS.keys() - PARTNERS.keys():
        return {"reading": quantity, "column": column}
    if (name := option.removeprefix("--")) in CHOICES:
        return {name: value or "on"}
    return {"more": f"{more} {shlex.join(filter(None, (option, value)))}".strip()}


def remedies_by_column(message: str) -> dict[str, dict[tuple[str, str], str]]:
    """Return remedies of a message's lines by the column that they are about, or by nothing."""
    remedies: dict[str, dict[tuple[str, str], str]] = {}
    for line in message.split("\n"):
        column = line.partition(", column '")[2].partition("': ")[0]
        remedies[column] = remedies.get(column, {}) | remedies_in(line)
    return remedies


def remedies_in(message: str) -> dict[tuple[str, str], str]:
    """Return options and values that a line names, with what their buttons say.

    Where it asks for a unit, there is one for each that is allowed.
    """
    remedies: dict[tuple[str, str], str] = {}
    for option, written in _OPTION.findall(message):
        takes = _TAKES_VALUE.get(option)
        value = _QUOTED.sub(r"\1\2", written) if takes else ""
        if value.endswith("=UNIT") and (units := _UNITS_ALLOWED.search(message)):
            for unit in re.split(", | or ", units[1]):
                remedies[option, value.replace("UNIT", unit)] = unit
        elif takes == bool(value) and not _PLACEHOLDER.search(value):
            remedies[option, value] = shlex.join(filter(None, (option, value)))
    return remedies
