"""Options of `biogrip identify` that set keys of the config; columns of tables may be the same.

What reads an option returns the key's path and its value; else it raises a `ValueError` or a
`LookupError`.
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


Reader = Callable[[str], tuple[Path, Any]]
"""What reads an option, or a cell of a table, to the path of a key of the config and its value."""


def _text(key: str) -> Reader:
    """Return what takes the text as it is; the config's check makes numbers of it."""
    return lambda text: (tuple(key.split(".")), text)


def _switch(key: str) -> Reader:
    return lambda text: (tuple(key.split(".")), {"true": True, "false": False}[text.lower()])


def _reading(text: str) -> tuple[Path, Any]:
    from biogrip.physics.instruments import INSTRUMENTS

    quantity, equals, column = text.partition("=")
    if equals:
        return ("measurement", quantity), column
    return ("measurement", text if text in INSTRUMENTS else "rotation"), text


def _blocks_read(text: str) -> tuple[Path, Any]:
    numbers = [int(number) for number in text.split(",")]
    return ("measurement", "block"), numbers if numbers[1:] else numbers[0]


def _rows_used(text: str) -> tuple[Path, Any]:
    column, value = text.rsplit("=", 1)
    if not (column and value):
        raise ValueError
    with suppress(ValueError):
        return ("measurement", "rows", column), float(value)
    return ("measurement", "rows", column), value


def _start(text: str) -> tuple[Path, Any]:
    if text == "fit":
        return ("measurement", "fit_start"), True
    return ("measurement", "start_s"), float(text)


def _hold(text: str) -> tuple[Path, Any]:
    from biogrip.config.source import HOLD
    from biogrip.traces.columns import number_and_unit

    number, unit = number_and_unit(text)
    if not (number and math.isfinite(number)):
        raise ValueError
    return HOLD, text if unit else number


def _ramp(text: str) -> tuple[Path, Any]:
    from biogrip.config.source import RAMP
    from biogrip.traces.columns import TIME_UNITS, known_unit, number_and_unit

    number, unit = number_and_unit(text)
    duration_s = number * TIME_UNITS[known_unit(unit or "s", TIME_UNITS) or ""]
    if not 0 < duration_s < math.inf:
        raise ValueError
    return RAMP, duration_s


def _contact(text: str) -> tuple[Path, Any]:
    return ("measurement", "fit_contact"), {"fit": True}[text]


def _share(text: str) -> tuple[Path, Any]:
    from biogrip.traces.columns import number_and_unit

    number, unit = number_and_unit(text)
    return ("measurement", "noise_share"), number / {"": 1, "%": 100}[unit]


def _phase_sd(text: str) -> tuple[Path, Any]:
    from biogrip.physics.instruments import PHASE
    from biogrip.traces.columns import known_unit, number_and_unit

    number, unit = number_and_unit(text)
    return ("measurement", "phase_sd_rad"), number * PHASE.units[
        known_unit(unit, PHASE.units) or ""
    ]


def _fix(text: str) -> tuple[Path, Any]:
    name, _, value = text.partition("=")
    if not name:
        raise ValueError
    return ("fixed", name), float(value)


def _at(text: str) -> tuple[Path, Any]:
    return ("identifiability", "at_s"), [float(time_s) for time_s in text.split(",")]


def _any_key(text: str) -> tuple[Path, Any]:
    from biogrip.config.source import value_of

    key, value = text.split("=", 1)
    if not key:
        raise ValueError
    try:
        return tuple(key.split(".")), value_of(value, key)
    except BiogripError as error:
        raise BiogripError(f"{key}: {error}") from error


GROUPS: dict[str, list[tuple[str, str, Reader, str]]] = {
    "the file's columns": [
        (
            *("--reading", "[QUANTITY=]COLUMN", _reading),
            "of readings, and their quantity [rotation=rotation_rad]; in creep displacement, "
            "strain, compliance; in relaxation force, stress, modulus, relative_modulus; of a "
            "sweep storage, complex_modulus, complex_viscosity or storage_stiffness, and, by a "
            "second --reading, loss, phase or loss_factor",
        ),
        ("--time", "COLUMN", _text("measurement.time"), "of times [time_s]"),
        ("--frequency", "COLUMN", _text("measurement.frequency"), "of frequencies, of a sweep"),
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
            *("--load", "COLUMN", _text("measurement.load")),
            "instead of --hold: column of the same, as recorded",
        ),
        (
            *("--shape", "SHAPE", _text("measurement.shape")),
            "what stands between force and modulus, as 'sphere 2.5 um' or 'pyramid 17.5 deg': "
            "force or displacement is read, the other is of --hold or --load",
        ),
        ("--contact", "fit", _contact, "fit where the tip touches the sample, too [at depth 0]"),
        ("--start", "SECONDS", _start, "the protocol's start on the clock, or fit to fit it [0]"),
        (
            *("--from", "PLACE", _text("measurement.from_s")),
            "use nothing before this time (s), or below this frequency",
        ),
        ("--until", "PLACE", _text("measurement.until_s"), "use nothing after or above it"),
    ],
    "the sample": [
        ("--model", "NAME", _text("sample.model"), "sample model, see below [generalized_maxwell]"),
        ("--fix", "NAME=VALUE", _fix, "known parameter, SI units; 0 for no element; repeatable"),
        (
            *("--at", "SECONDS,...", _at),
            "times after a step at which to print G, K or J, of any model",
        ),
    ],
    "the noise and the instrument": [
        ("--noise", "SD", _text("measurement.noise_rad"), "known noise, in the readings' SI unit"),
        (
            *("--noise-share", "SHARE", _share),
            "known noise, as a share of the readings: 0.02 or 2%%",
        ),
        (
            *("--phase-sd", "ANGLE", _phase_sd),
            "known noise of a sweep's phase, as in 0.3deg; --noise-share is then the amplitude's",
        ),
        ("--sd", "COLUMN", _text("measurement.sd"), "column of the readings' standard deviations"),
        (
            *("--noise-model", "NAME", _text("measurement.noise_model")),
            "white, or coloured: autocorrelated",
        ),
        (
            "--offset",
            "",
            _switch("measurement.offset"),
            "fit an offset, too; or --no-offset",
        ),
        ("--drift", "", _switch("measurement.drift"), "fit a linear drift, too; or --no-drift"),
    ],
    "any other key of the config": [
        (
            *("--set", "KEY=VALUE", _any_key),
            "as in measurement.time_unit=ms or measurement.scale=-1, YAML; repeatable",
        )
    ],
}
"""Options by what they are about: name; what is given, nothing for a switch; reader; help."""

OPTIONS = {option[0][2:]: option for options in GROUPS.values() for option in options}


def setting_of(option: str, text: str, by: str = "") -> Setting:
    """Return what an option sets, or a cell of a column that is named like it.

    By is what messages name, by default the option. A `BiogripError` says what is allowed.
    """
    name, metavar, read, what = OPTIONS[option]
    try:
        return Setting(by or name, *read(text))
    except (ValueError, LookupError) as error:
        allowed = f"{metavar or 'true or false'}: {what}".replace("%%", "%")
        said = f"found '{text}', allowed is {allowed}."
        raise BiogripError(f"{error}" if f"{error}".startswith("found ") else said) from error
