"""Moduli over frequency with the limits that one trace sets them."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.experiment.network import complex_modulus
from biogrip.identifiability.fit_status import REJECTED
from biogrip.identifiability.moduli import LOSS, STORAGE
from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import FITTED, PAGE_IN, SHADE, TARGET, figure, panel
from biogrip.products.files.modulus_profiles import PATH, read_modulus_profiles
from biogrip.products.product import JUDGEMENT, the
from biogrip.products.uses import from_case, with_moduli
from biogrip.study.study import Case

_POINTS = 121
_MOST_DECADES = 8.0
_BEYOND = 10.0
_TITLES = {STORAGE: "storage modulus $G'$", LOSS: "loss modulus $G''$"}


def draw(case: Case, limits: Path) -> Figure:
    """Draw the moduli of a case over frequency, with their limits unless the fit is rejected."""
    found = read_modulus_profiles(limits)
    values = np.array([row["value"] for row in found["moduli"]])
    top = _BEYOND * np.max(values)
    bottom = max(np.min(values) / _BEYOND, top / 10**_MOST_DECADES)
    drawn = figure(PAGE_IN, 2.6)
    both = drawn.subplots(1, 2, sharey=True)
    for axes, letter, (part, title) in zip(both, "ab", _TITLES.items(), strict=True):
        rows = [row for row in found["moduli"] if row["part"] == part]
        omega, best, low, high = (
            np.array([row[key] for row in rows], dtype=float)
            for key in ("rad_per_s", "value", "low", "high")
        )
        axes.set(xscale="log", yscale="log", xlim=(omega[0], omega[-1]), ylim=(bottom, top))
        axes.set_xlabel("angular frequency (rad/s)")
        axes.plot(omega, best, ".-", color=FITTED, label="best fit", markersize=3)
        if found["fit"] != REJECTED:
            _band(axes, omega, low, high, f"{100 * found['confidence']:g} % limits")
        if case.parameters:
            dense = np.geomspace(omega[0], omega[-1], _POINTS)
            parts = complex_modulus(case.sample.model.sample(case.parameters), dense)
            axes.plot(dense, parts[part == LOSS][0], color=TARGET, linewidth=0.8, label="truth")
        panel(axes, letter, title)
    both[0].set_ylabel(f"modulus ({found['unit']})")
    handles, labels = both[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    rejected = ": fit rejected" if found["fit"] == REJECTED else ""
    drawn.suptitle(f"{case.title}{rejected}", x=0.01, ha="left", fontsize=8)
    return drawn


def _band(axes: Axes, omega: Array, low: Array, high: Array, label: str) -> None:
    """Shade between the limits; where there is none on a side, to the end of the axis."""
    shaded = np.isfinite(low) | np.isfinite(high)
    bottom, top = axes.get_ylim()
    axes.fill_between(
        omega, np.nan_to_num(low, nan=bottom), np.nan_to_num(high, nan=top),
        where=shaded, color=SHADE, linewidth=0, zorder=0, label=label,
    )  # fmt: skip
    for limit in (low, high):
        axes.plot(omega, limit, color=FITTED, linewidth=0.5)


MODULUS_BANDS = drawing(
    draw,
    name="modulus_bands_figure",
    file="modulus_bands",
    caption="Storage and loss modulus of the best fit to one trace over frequency, and the "
    "confidence limits that the profile likelihood of each sets it, whatever the parameters: what "
    "rheologists compare. Shaded to the edge: no limit on that side; not shaded: none on either. A "
    "rejected fit has no limits.",
    uses=from_case("title parameters sample"),
    reads={"limits": the(PATH)},
    cases=with_moduli,
    weight=JUDGEMENT,
)
