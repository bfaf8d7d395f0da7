"""Map of Cramér-Rao bounds over k_p and c, in the study's experiment and in the case's own."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.products.designed_cases import USED, WELL, bounds, designed_cases
from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import PAGE_IN, figure, panel
from biogrip.products.uses import from_case
from biogrip.study.study import Case, Study

_STIFFNESSES = np.geomspace(1e-3, 1e2, 16)
_DAMPINGS = np.geomspace(1e-2, 1e3, 16)
_SHOWN_PERCENT = (0.1, 1000.0)


def draw(case: Case) -> Figure:
    """Draw maps of the bounds over k_p and c, in the study's experiment and in the case's own."""
    symbols = [parameter.symbol for parameter in case.searched.parameters]
    drawn = figure(PAGE_IN, 3.6)
    grid = drawn.subplots(2, len(symbols), sharex=True, sharey=True, squeeze=False)
    samples = samples_of(case)
    experiments = (case.study.experiment, "study's"), (case.experiment, "own")
    for row, (experiment, whose) in enumerate(experiments):
        percent = 100 * bounds(case, experiment, samples).T
        for column, symbol in enumerate(symbols):
            axes = grid[row, column]
            mesh = _map(axes, percent[column].reshape(len(_DAMPINGS), -1))
            _mark(axes, case)
            letter = chr(ord("a") + row * len(symbols) + column)
            panel(axes, letter, f"{symbol}, {whose} protocol")
    for axes in grid[-1]:
        axes.set_xlabel("$k_p$ (N/m)")
    for axes in grid[:, 0]:
        axes.set_ylabel("$c$ (N s/m)")
    drawn.colorbar(mesh, ax=grid, label="bound (%)", extend="both", pad=0.01)
    return drawn


def samples_of(case: Case) -> Array:
    """Return parameters of the map's samples, (n, n_parameters), with k_p varying fastest."""
    stiffness, damping = np.meshgrid(_STIFFNESSES, _DAMPINGS)
    values = {name: np.full(stiffness.size, case.parameters[name]) for name in case.searched.names}
    values |= {"k_p": stiffness.ravel(), "c": damping.ravel()}
    return np.stack([values[name] for name in case.searched.names], axis=1)


def _map(axes: Axes, percent: Array) -> QuadMesh:
    # Draw an infinite bound like one above the scale.
    shown = np.where(np.isfinite(percent), percent, 1e9)
    mesh = axes.pcolormesh(
        _STIFFNESSES,
        _DAMPINGS,
        shown,
        norm=LogNorm(*_SHOWN_PERCENT),
        cmap="cividis_r",
        shading="nearest",
    )
    if shown.min() < 100 * WELL < shown.max():
        axes.contour(_STIFFNESSES, _DAMPINGS, shown, [100 * WELL], colors="black", linewidths=1.2)
    axes.set(xscale="log", yscale="log")
    return mesh


def _mark(axes: Axes, case: Case) -> None:
    """Mark the case, if it is inside the map."""
    k_p, c = case.parameters["k_p"], case.parameters["c"]
    if _STIFFNESSES[0] <= k_p <= _STIFFNESSES[-1]:
        axes.plot(k_p, c, "*", color="white", markeredgecolor="black", markersize=8)


def _mapped(study: Study) -> list[str]:
    """Return names of designed cases in which both k_p and c are searched."""
    return [
        name
        for name in designed_cases(study)
        if {"k_p", "c"} <= set(study.cases[name].searched.names)
    ]


DESIGNED_MAP = drawing(
    draw,
    caption="Cramér-Rao bounds of every parameter, all of them free, over the parallel spring "
    "k_p and the branch's damper c of a sample, in the study's experiment (above) and in the "
    f"case's own (below), at the same noise. The line is {100 * WELL:g} %, the star the case.",
    uses=from_case(USED),
    cases=_mapped,
)
