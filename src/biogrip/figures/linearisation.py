"""Linear against nonlinear model: traces, and the domain in which they agree to 1 %."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from biogrip.figures.style import BLUE, ORANGE, PAGE_IN, figure, panel
from biogrip.response.linear import rotation, step_response
from biogrip.response.nonlinear import FINE, correction
from biogrip.stages.linearisation import scaled
from biogrip.study import build
from biogrip.tables.linearisation import read_comparison

_SHOWN_FACTOR = 20.0
_MOST_CASES = 3


def draw(settings: dict[str, Any], inputs: list[Path]) -> Figure:
    """Draw both models for the last case at twenty times the torque, and maps of their difference.

    Parameters
    ----------
    settings
        As of the comparison.
    inputs
        The comparison of the models, CSV.
    """
    comparison = read_comparison(inputs[0])
    cases = dict(list(settings["cases"].items())[:_MOST_CASES])
    drawn = figure(PAGE_IN, 2.6)
    traces, *maps = drawn.subplots(1, 1 + len(cases), width_ratios=[1.2] + [1] * len(cases))
    _traces(traces, settings, list(cases.values())[-1])
    for index, (name, case) in enumerate(cases.items()):
        rows = comparison[comparison["case"] == name]
        grid = rows.pivot(
            index="torque_factor", columns="reference_angle_deg", values="difference_over_peak"
        )
        shares = 100 * grid.to_numpy(float)
        axes = maps[index]
        mesh = axes.pcolormesh(
            grid.columns,
            grid.index,
            shares,
            norm=LogNorm(1e-5, 30),
            cmap="cividis",
            shading="nearest",
        )
        if np.nanmax(shares) > 1:
            lines = axes.contour(
                grid.columns, grid.index, shares, [1.0], colors="white", linewidths=1.2
            )
            axes.clabel(lines, fmt="1 %%", fontsize=7)
        axes.set_yscale("log")
        axes.set_yticks(
            [0.3, 1, 3, 10, 30], ["0.3", "1", "3", "10", "30"] if index == 0 else [""] * 5
        )
        axes.minorticks_off()
        axes.set_xlabel(r"$\hat\theta_2$ (deg)")
        if index == 0:
            axes.set_ylabel("torque / protocol's torque")
        panel(axes, "bcd"[index], case["title"], most_letters=19)
    drawn.colorbar(mesh, ax=maps, label="difference (% of peak)", pad=0.01)
    return drawn


def _traces(axes: Any, settings: dict[str, Any], case: dict[str, Any]) -> None:
    model, gripper = build.sample_model(case), build.gripper(case["gripper"])
    network = model.network(np.array([[case["parameters"][name] for name in model.names]]))
    torque = scaled(build.torque(settings), _SHOWN_FACTOR)
    time_s = np.linspace(0, torque.end_s, 1001)
    response = step_response(gripper, network, symmetric=torque.symmetric, inertia=False)
    linear = rotation(response, torque, time_s)[0]
    nonlinear = linear + correction(gripper, network, torque, FINE).at(time_s)[0]
    axes.plot(time_s, 1e3 * linear, color=BLUE, label="linear")
    axes.plot(time_s, 1e3 * nonlinear, "--", color=ORANGE, label="nonlinear")
    axes.set_xlabel("time (s)")
    axes.set_ylabel("closing rotation (mrad)")
    axes.legend()
    panel(axes, "a", f"{case['title']}, {_SHOWN_FACTOR:g} x torque")
