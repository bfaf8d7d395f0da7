"""Ticks of logarithmic axes in plain text; math text would take a tenth of a figure's time."""

import math
import re
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"\^\{(.*?)\}")


def power_of_ten(exponent: int) -> str:
    """Return a power of ten with a superscript exponent."""
    return "10" + str(exponent).translate(_SUPERSCRIPTS)


def decade_ticks(low: float, high: float) -> tuple[list[float], list[str]]:
    """Return at most three ticks of a logarithmic axis whose labels do not overlap."""
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    decades = list(range(first, last + 1))
    if len(decades) >= 2:
        step = -(-(len(decades) - 1) // 2)
        chosen = decades[::step]
        return [10.0**d for d in chosen], [power_of_ten(d) for d in chosen]
    steps = [m * 10.0**d for d in range(first - 1, last + 2) for m in (1, 2, 5)]
    found = [value for value in steps if low <= value <= high]
    # Labels of these values are wide, so keep two.
    inside = [found[0], found[-1]] if len(found) > 2 else found
    return inside, [f"{value:g}" for value in inside]


class _Plain(LogFormatterSciNotation):
    """Log formatter that writes plain text instead of math text."""

    def __call__(self, x: float, pos: Any = None) -> str:
        text: str = super().__call__(x, pos)
        plain = _POWER.sub(lambda power: power[1].translate(_SUPERSCRIPTS), text)
        return re.sub(r"\$\\mathdefault\{(.*)\}\$", r"\1", plain).replace(r"\times", "×")


def label_plainly(drawn: Figure) -> None:
    """Replace default formatters of logarithmic axes by plain-text ones."""
    for axes in drawn.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for kind in ("major", "minor"):
                usual = getattr(axis, f"get_{kind}_formatter")()
                if type(usual) is LogFormatterSciNotation:
                    plain = _Plain(labelOnlyBase=usual.labelOnlyBase)
                    getattr(axis, f"set_{kind}_formatter")(plain)
