"""Difference of the linear from the nonlinear model, over angle and torque."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from biogrip.figures.style import BLUE, PAGE_IN, TARGET, figure, panel
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.nonlinear import correction
from biogrip.physics.protocol import torque_history
from biogrip.records.identifications import DIFFERENCES
from biogrip.stages.model_difference import network_of, scaled
from biogrip.study.study import Case, Study
from biogrip.tables.mechanics import LIMIT_PERCENT

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
            lines = axes.contour(*values, [LIMIT_PERCENT], colors="black", linewidths=1.2)
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
    gripper, network = case.gripper, network_of(case)
    torque = scaled(torque_history(case.phases), _SHOWN_FACTOR)
    time_s = np.linspace(0, torque.end_s, 1001)
    response = step_response(gripper, network, symmetric=torque.symmetric, inertia=False)
    linear = rotation(response, torque, time_s)[0]
    difference = correction(gripper, network, torque).at(time_s)[0]
    axes.plot(time_s, 1e3 * difference, color=BLUE)
    axes.axhline(0, color=TARGET, linewidth=0.6)
    axes.set(xlabel="time (s)", ylabel="nonlinear - linear rotation (mrad)")
    bottom, top = axes.get_ylim()
    # Leave room for text above the curve.
    axes.set_ylim(bottom, top + 0.08 * (top - bottom))
    peak = f"peak rotation {1e3 * np.max(np.abs(linear)):.3g} mrad"
    axes.annotate(peak, (0.98, 0.99), xycoords="axes fraction", ha="right", va="top", fontsize=7)
