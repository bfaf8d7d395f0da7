"""Linear against nonlinear model: traces, and the domain in which they agree to 1 %."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from biogrip.experiment.protocol import TorqueHistory, torque_history
from biogrip.experiment.truth import Truth
from biogrip.instrument.gripper import Gripper
from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import BLUE, ORANGE, PAGE_IN, figure, panel
from biogrip.products.files.differences import DIFFERENCES
from biogrip.products.product import the
from biogrip.products.stages.model_difference import Settings, scaled, settings
from biogrip.products.tables.linearisation import CAPTION
from biogrip.response.linear import rotation, step_response
from biogrip.response.nonlinear import FINE, correction

_SHOWN_FACTOR = 20.0
_MOST_CASES = 3


def draw(settings: Settings, differences: Path) -> Figure:
    """Draw both models for the last case at twenty times the torque, and maps of their difference.

    Parameters
    ----------
    settings
        As of the comparison.
    differences
        The comparison of the models, CSV.
    """
    comparison = DIFFERENCES.read(differences)
    cases = dict(list(settings.cases.items())[:_MOST_CASES])
    drawn = figure(PAGE_IN, 2.6)
    traces, *maps = drawn.subplots(1, 1 + len(cases), width_ratios=[1.2] + [1] * len(cases))
    _traces(traces, torque_history(settings.phases), *list(cases.values())[-1])
    for index, (name, (truth, _)) in enumerate(cases.items()):
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
        panel(axes, "bcd"[index], truth.title, most_letters=19)
    drawn.colorbar(mesh, ax=maps, label="difference (% of peak)", pad=0.01)
    return drawn


def _traces(axes: Axes, protocol: TorqueHistory, truth: Truth, gripper: Gripper) -> None:
    values = [truth.parameters[name] for name in truth.model.names]
    network = truth.model.network(np.array([values]))
    torque = scaled(protocol, _SHOWN_FACTOR)
    time_s = np.linspace(0, torque.end_s, 1001)
    response = step_response(gripper, network, symmetric=torque.symmetric, inertia=False)
    linear = rotation(response, torque, time_s)[0]
    nonlinear = linear + correction(gripper, network, torque, FINE).at(time_s)[0]
    axes.plot(time_s, 1e3 * linear, color=BLUE, label="linear")
    axes.plot(time_s, 1e3 * nonlinear, "--", color=ORANGE, label="nonlinear")
    axes.set_xlabel("time (s)")
    axes.set_ylabel("closing rotation (mrad)")
    axes.legend()
    panel(axes, "a", f"{truth.title}, {_SHOWN_FACTOR:g} x torque")


LINEARISATION_MAP = drawing(
    draw,
    name="linearisation_map",
    file="linearisation",
    caption=CAPTION,
    settings=settings,
    reads={"differences": the(DIFFERENCES.path)},
    when=lambda study: bool(study.simulated),
    sheet="study_figures",
)
