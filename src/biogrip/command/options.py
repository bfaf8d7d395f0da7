"""Options of `biogrip identify` that set keys of the config; columns of tables may be the same.

What reads an option returns the key's path and its value; a `ValueError` says what is allowed.
NumPy is not loaded before the options are read, see `biogrip.cli.main`.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from biogrip.errors import BiogripError

Path = tuple[str, ...]


@dataclass(frozen=True)
class Setting:
    """A key of the config, and the value that an option or a cell of a table gives it."""

    by: str
    """The option, or line and column of the table, for messages."""
    path: Path
    """The key."""
    value: Any
    """Plain value, not yet checked."""


def _reading(text: str) -> tuple[Path, Any]:
    from biogrip.physics.instruments import INSTRUMENTS

    quantity, found, column = text.partition("=")
    if found:
        return ("measurement", quantity), column
    return ("measurement", text if text in INSTRUMENTS else "rotation"), text


def _start(text: str) -> tuple[Path, Any]:
    if text == "fit":
        return ("measurement", "fit_start"), True
    with suppress(ValueError):
        float(text)
        return ("measurement", "start_s"), text
    raise ValueError(f"found '{text}', allowed is a number of seconds, or fit")


def _hold(text: str) -> tuple[Path, Any]:
    from biogrip.config.source import HOLD
    from biogrip.traces.columns import number_and_unit

    number, unit = number_and_unit(text)
    if number and math.isfinite(number):
        return HOLD, text if unit else number
    form = "allowed is a number, and not 0, with its unit or in SI units"
    raise ValueError(f"found '{text}', {form}")


def _fix(text: str) -> tuple[Path, Any]:
    name, _, value = text.partition("=")
    with suppress(ValueError):
        if name:
            return ("fixed", name), float(value)
    raise ValueError(f"found '{text}', allowed is NAME=VALUE, as in k_p=0")


def _at(text: str) -> tuple[Path, Any]:
    with suppress(ValueError):
        return ("identifiability", "at_s"), [float(each) for each in text.split(",")]
    raise ValueError(f"found '{text}', allowed are times in s, as in 1,10,100")


def _any_key(text: str) -> tuple[Path, Any]:
    from biogrip.config.source import value_of

    key, found, value = text.partition("=")
    if not (key and found):
        raise ValueError(f"found '{text}', allowed is KEY=VALUE, as in measurement.time_unit=ms")
    try:
        return tuple(key.split(".")), value_of(value, key)
    except BiogripError as error:
        raise ValueError(f"{key}: {error}") from error


Key = str | Callable[[str], tuple[Path, Any]]
"""Key of the config that an option sets, or what reads the option."""

GROUPS: dict[str, list[tuple[str, str, Key, str]]] = {
    "the file's columns": [
        (
            *("--reading", "[QUANTITY=]COLUMN", _reading),
            "of readings, and their quantity [rotation=rotation_rad]; in creep displacement, "
            "strain, compliance; in relaxation force, stress, modulus, relative_modulus; of a "
            "sweep storage, complex_modulus or storage_stiffness, and, by a second --reading, "
            "loss, phase or loss_factor",
        ),
        ("--time", "COLUMN", "measurement.time", "of times [time_s]"),
        ("--frequency", "COLUMN", "measurement.frequency", "of frequencies, of a sweep"),
    ],
    "what was done": [
        (
            *("--hold", "VALUE", _hold),
            "what was held from 0 to the end: the stress if strain was read, the force if "
            "displacement, and the reverse; as in '20 pN', 5mbar or 5%%, or in SI units "
            "[1 for a compliance or a modulus]",
        ),
        (
            *("--load", "COLUMN", "measurement.load"),
            "instead of --hold: column of the same, as recorded",
        ),
        (
            *("--sphere", "RADIUS", "measurement.sphere"),
            "of a sphere that indents the sample, as in '2.5 um': force or "
            "indentation is read, the other is of --hold or --load",
        ),
        ("--start", "SECONDS", _start, "the protocol's start on the clock, or fit to fit it [0]"),
        (
            *("--from", "PLACE", "measurement.from_s"),
            "use nothing before this time (s), or below this frequency",
        ),
        ("--until", "PLACE", "measurement.until_s", "use nothing after or above it"),
    ],
    "the sample": [
        ("--model", "NAME", "sample.model", "sample model, see below [generalized_maxwell]"),
        ("--fix", "NAME=VALUE", _fix, "known parameter, SI units; 0 for no element; repeatable"),
        (
            *("--at", "SECONDS,...", _at),
            "times after a step at which to print G, K or J, of any model",
        ),
    ],
    "the noise and the instrument": [
        ("--noise", "SD", "measurement.noise_rad", "known noise, in the readings' SI unit"),
        (
            *("--noise-share", "SHARE", "measurement.noise_share"),
            "known noise, as a share of the readings",
        ),
        ("--sd", "COLUMN", "measurement.sd", "column of the readings' standard deviations"),
        (
            *("--noise-model", "NAME", "measurement.noise_model"),
            "white, or coloured: autocorrelated",
        ),
        ("--offset", "", "measurement.offset", "fit an offset of the readings, too, or not"),
        ("--drift", "", "measurement.drift", "fit a linear drift, too, or not"),
    ],
    "any other key of the config": [
        (
            *("--set", "KEY=VALUE", _any_key),
            "as in measurement.time_unit=ms or measurement.block=2, YAML; repeatable",
        )
    ],
}
"""Options by what they are about: name; what is given, nothing for a switch; key; help."""

OPTIONS = {
    name[2:].replace("-", "_"): key
    for options in GROUPS.values()
    for name, _, key, _ in options
    if key != _any_key
}
"""Keys, or what reads an option, by the options' names, with underscores for hyphens."""
