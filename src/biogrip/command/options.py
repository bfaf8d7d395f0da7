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


def _blocks_read(text: str) -> tuple[Path, Any]:
    with suppress(ValueError):
        numbers = [int(number) for number in text.split(",")]
        return ("measurement", "block"), numbers if numbers[1:] else numbers[0]
    raise ValueError(f"found '{text}', allowed is a number, or several as in 1,2")


def _rows_used(text: str) -> tuple[Path, Any]:
    column, _, value = text.rpartition("=")
    if not (column and value):
        raise ValueError(f"found '{text}', allowed is COLUMN=VALUE, as in 'T (C)=20'")
    with suppress(ValueError):
        return ("measurement", "rows", column), float(value)
    return ("measurement", "rows", column), value


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


def _ramp(text: str) -> tuple[Path, Any]:
    from biogrip.config.source import RAMP
    from biogrip.traces.columns import TIME_UNITS, known_unit, number_and_unit

    with suppress(ValueError, KeyError):
        number, unit = number_and_unit(text)
        duration_s = number * TIME_UNITS[known_unit(unit or "s", TIME_UNITS) or ""]
        if 0 < duration_s < math.inf:
            return RAMP, duration_s
    raise ValueError(f"found '{text}', allowed is a time above 0 with its unit, as in 80ms")


def _contact(text: str) -> tuple[Path, Any]:
    if text == "fit":
        return ("measurement", "fit_contact"), True
    raise ValueError(f"found '{text}', allowed is fit")


def _share(text: str) -> tuple[Path, Any]:
    from biogrip.traces.columns import number_and_unit

    number, unit = number_and_unit(text)
    if unit in ("", "%"):
        return ("measurement", "noise_share"), number / 100 if unit else number
    raise ValueError(f"found '{text}', allowed is a share, as in 0.02 or 2%")


def _phase_sd(text: str) -> tuple[Path, Any]:
    from biogrip.physics.instruments import PHASE
    from biogrip.traces.columns import known_unit, number_and_unit

    number, written = number_and_unit(text)
    if unit := known_unit(written, PHASE.units):
        return ("measurement", "phase_sd_rad"), number * PHASE.units[unit]
    raise ValueError(f"found '{text}', allowed is an angle, as in 0.3deg or 5mrad")


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
            "sweep storage, complex_modulus, complex_viscosity or storage_stiffness, and, by a "
            "second --reading, loss, phase or loss_factor",
        ),
        ("--time", "COLUMN", "measurement.time", "of times [time_s]"),
        ("--frequency", "COLUMN", "measurement.frequency", "of frequencies, of a sweep"),
        (
            *("--block", "N,...", _blocks_read),
            "number of the table to read, of several in the file; 1,2 joins two that are one test",
        ),
        (
            *("--rows", "COLUMN=VALUE", _rows_used),
            "use only rows with this in another column, as in 'T (C)=20'; repeatable",
        ),
    ],
    "what was done": [
        (
            *("--hold", "VALUE", _hold),
            "what was held from 0 to the end: the stress if strain was read, the force if "
            "displacement, and the reverse; as in '20 pN', 5mbar or 5%%, or in SI units "
            "[1 for a compliance or a modulus]",
        ),
        (
            *("--ramp", "DURATION", _ramp),
            "within which it was reached, linearly and from its start on, as in 80ms [at once]",
        ),
        (
            *("--load", "COLUMN", "measurement.load"),
            "instead of --hold: column of the same, as recorded",
        ),
        (
            *("--shape", "SHAPE", "measurement.shape"),
            "what stands between force and modulus, as 'sphere 2.5 um' or 'pyramid 17.5 deg': "
            "force or displacement is read, the other is of --hold or --load",
        ),
        ("--contact", "fit", _contact, "fit where the tip touches the sample, too [at depth 0]"),
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
            *("--noise-share", "SHARE", _share),
            "known noise, as a share of the readings: 0.02 or 2%%",
        ),
        (
            *("--phase-sd", "ANGLE", _phase_sd),
            "known noise of a sweep's phase, as in 0.3deg; --noise-share is then the amplitude's",
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
            "as in measurement.time_unit=ms or measurement.scale=-1, YAML; repeatable",
        )
    ],
}
"""Options by what they are about: name; what is given, nothing for a switch; key; help."""

REPLACED = {"sphere": "shape"}
"""Options that there were, and what there is instead."""

OPTIONS = {
    name[2:].replace("-", "_"): key
    for options in GROUPS.values()
    for name, _, key, _ in options
    if key != _any_key
}
"""Keys, or what reads an option, by the options' names, with underscores for hyphens."""
