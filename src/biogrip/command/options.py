"""Options of `biogrip identify` that set keys of the config; columns of tables may be the same.

What reads an option returns the key's path and its value; a `ValueError` says what is allowed.
NumPy is not loaded before the options are read, see `biogrip.cli.main`.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

Path = tuple[str, ...]


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
    from biogrip.study.source import HOLD
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


OPTIONS: dict[str, str | Callable[[str], tuple[Path, Any]]] = {
    "time": "measurement.time",
    "frequency": "measurement.frequency",
    "reading": _reading,
    "sd": "measurement.sd",
    "hold": _hold,
    "load": "measurement.load",
    "sphere": "measurement.sphere",
    "start": _start,
    "from": "measurement.from_s",
    "until": "measurement.until_s",
    "noise": "measurement.noise_rad",
    "noise_model": "measurement.noise_model",
    "noise_share": "measurement.noise_share",
    "offset": "measurement.offset",
    "drift": "measurement.drift",
    "model": "sample.model",
    "fix": _fix,
    "at": _at,
}
"""Keys, or what reads an option, by the options' names, with underscores for hyphens."""
