"""Force of the jaws, rotation of jaws that cannot pull, and what the linear model leaves out."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.figures.results import scale_of
from biogrip.figures.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    ORANGE,
    PAGE_IN,
    TARGET,
    figure,
    panel,
)
from biogrip.physics.nonlinear import correction
from biogrip.physics.response import step_response, superpose
from biogrip.physics.simulation import jaw_force
from biogrip.physics.unilateral import UnilateralResponse, unilateral_response
from biogrip.records.identifications import DIFFERENCES
from biogrip.records.traces import read_target
from biogrip.study.study import Case, Study
from biogrip.tables.mechanics import LIMIT_PERCENT


def draw_force(case: Case, target: Path) -> Figure:
    """Draw the jaw force under bilateral contact, and the rotation with and without adhesion."""
    time_s, _, rotation = read_target(target)
    device = case.gripper, case.network, case.torque
    # Without inertia, since the jaws ring for less than a sampling interval after a step.
    sticking = jaw_force(*device, time_s, nonlinear=case.nonlinear_target, inertia=False)[0]
    drawn = figure(COLUMN_IN, 3.2)
    forces, rotations = drawn.subplots(2, 1, sharex=True, height_ratios=[1.25, 1])
    factor, unit = scale_of(sticking, "N")
    forces.axhline(0, color=BLACK, linewidth=0.6)
    forces.plot(time_s, factor * sticking, color=BLUE, label="jaws that hold the sample")
    negative = np.minimum(factor * sticking, 0)
    pulling = bool(negative.min() < -1e-9 * factor * np.abs(sticking).max())
    if pulling:
        forces.fill_between(
            time_s, negative, 0, color=ORANGE, alpha=0.35, linewidth=0, hatch="////",
            label="the jaws would have to pull",
        )  # fmt: skip
    apart = None
    if pulling and not case.nonlinear_target:
        apart = unilateral_response(*device, time_s)
        shown = _from_loss(apart, apart.jaw_force_N)
        forces.plot(time_s, factor * shown, "--", color=ORANGE, label="jaws that let go")
    forces.set_ylabel(f"jaw force ({unit})")
    low, high = float(negative.min()), factor * float(sticking.max())
    forces.set_ylim(low - 0.08 * (high - low), high + (0.62 if apart else 0.42) * (high - low))
    forces.legend(loc="upper right")
    forces.set_title(case.title)

    factor, unit = scale_of(rotation, "rad")
    name = "target" + (", jaws that let go" if case.unilateral else "")
    rotations.plot(time_s, factor * rotation, color=BLACK, label=name)
    if apart and not case.unilateral:
        shown = _from_loss(apart, apart.rotation[0])
        rotations.plot(time_s, factor * shown, "--", color=ORANGE, label="jaws that let go")
    rotations.set_ylabel(f"rotation ({unit})")
    low, high = (factor * float(end) for end in (min(rotation.min(), 0), rotation.max()))
    rotations.set_ylim(low, high + 0.4 * (high - low))
    rotations.set_xlabel("time (s)")
    rotations.set_xlim(time_s[0], time_s[-1])
    rotations.legend(loc="upper right", ncols=2)
    drawn.align_ylabels()
    return drawn


def _from_loss(found: UnilateralResponse, values: Array) -> Array:
    """Return values from the last sample before contact is first lost, NaN before."""
    lost = np.flatnonzero(~found.touching)
    start = max(lost[0] - 1, 0) if len(lost) else len(values)
    return np.where(np.arange(len(values)) >= start, values, np.nan)


_SHOWN_FACTOR = 20.0
_MOST_CASES = 3


def draw_linearisation(study: Study, differences: Path) -> Figure:
    """Draw the difference for the last case at twenty times the torque, and maps of a few."""
    comparison = DIFFERENCES.read(differences)
    cases = dict(list(study.cases.items())[:_MOST_CASES])
    drawn = figure(PAGE_IN, 2.6)
    traces, *maps = drawn.subplots(1, 1 + len(cases), width_ratios=[1.2] + [1] * len(cases))
    last = list(cases)[-1]
    _difference(traces, cases[last])
    panel(traces, "a", f"{cases[last].title}, {_SHOWN_FACTOR:g} x torque")
    for index, name in enumerate(cases):
        rows = comparison[comparison["case"] == name]
        grid = rows.pivot(
            index="torque_factor", columns="reference_angle_deg", values="difference_over_peak"
        )
        shares = 100 * grid.to_numpy(float)
        axes = maps[index]
        values, style = (grid.columns, grid.index, shares), {"cmap": "cividis_r"}
        mesh = axes.pcolormesh(*values, norm=LogNorm(1e-5, 30), shading="nearest", **style)
        if np.nanmax(shares) > LIMIT_PERCENT:
            lines = axes.contour(*values, [LIMIT_PERCENT], colors="white", linewidths=1.2)
            axes.clabel(lines, fmt=f"{LIMIT_PERCENT:g} %%", fontsize=7)
        axes.set_yscale("log")
        ticks = [0.3, 1, 3, 10, 30]
        axes.set_yticks(ticks, ["" if index else f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.set_xlabel(r"$\hat\theta_2$ (deg)")
        if index == 0:
            axes.set_ylabel("torque / protocol's torque")
        panel(axes, "bcd"[index], cases[name].title, most_letters=19)
    drawn.colorbar(mesh, ax=maps, label="difference (% of peak)", pad=0.01)
    return drawn


def _difference(axes: Axes, case: Case) -> None:
    """Draw the nonlinear minus the linear rotation, as the curves themselves look the same."""
    gripper, network, torque = case.gripper, case.network, case.torque.times(_SHOWN_FACTOR)
    time_s = np.linspace(0, torque.end_s, 1001)
    response = step_response(gripper, network, inertia=False)
    linear = superpose(response, torque, time_s)[0]
    difference = correction(gripper, network, torque).at(time_s)[0]
    axes.plot(time_s, 1e3 * difference, color=BLUE)
    axes.axhline(0, color=TARGET, linewidth=0.6)
    axes.set(xlabel="time (s)", ylabel="nonlinear - linear rotation (mrad)")
    bottom, top = axes.get_ylim()
    # Leave room for text above the curve.
    axes.set_ylim(bottom, top + 0.08 * (top - bottom))
    peak = f"peak rotation {1e3 * np.max(np.abs(linear)):.3g} mrad"
    axes.annotate(peak, (0.98, 0.99), xycoords="axes fraction", ha="right", va="top", fontsize=7)
