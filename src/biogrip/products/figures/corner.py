"""Corner plot of a posterior: marginal of every parameter, and density of every pair.

Axes are logarithmic. Densities of pairs are smoothed; contours enclose the smallest regions with
half and 95 % of the samples.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from biogrip.arrays import Array
from biogrip.experiment.sample import Parameter, with_fixed
from biogrip.products.figures.decades import decade_ticks
from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import BLUE, COLUMN_IN, ORANGE, PAGE_IN, SHADE, figure
from biogrip.products.files.posterior import POSTERIOR, SAMPLES, read_posterior, read_samples
from biogrip.products.product import JUDGEMENT, the
from biogrip.products.uses import from_case, sampled
from biogrip.study.study import Case

# Most parameters that fit into a column's width.
_MOST_IN_COLUMN = 4
_BINS, _SMOOTH = 60, 1.5
_HALF, _MOST = 0.5, 0.95
# Share of samples cut off beyond either end of an axis.
_BEYOND = 0.002
# Ratio of the ends below which an axis spans too little for decade ticks.
_WIDE = 5.0


def draw(case: Case, posterior: Path, samples: Path) -> Figure:
    """Draw the posterior of a case."""
    model = with_fixed(case.sample.model, case.fixed)
    values = read_samples(samples, model)
    return draw_corner(
        model.parameters, values, read_posterior(posterior), case.parameters, case.title
    )


def draw_corner(
    parameters: Sequence[Parameter],
    values: Array,
    posterior: Mapping[str, Any],
    truth: Mapping[str, float],
    title: str,
) -> Figure:
    """Draw posterior samples, (n, n_parameters) in SI units, as a corner plot.

    The posterior is a summary of `posterior_data`; true values count as far as they are known.
    """
    count = len(parameters)
    width = COLUMN_IN if count <= _MOST_IN_COLUMN else PAGE_IN
    drawn = figure(width, width + 0.3)
    grid = drawn.subplots(count, count, squeeze=False, sharex="col")
    logs = np.log(values)
    edges = [_edges(logs[:, i], truth.get(p.name)) for i, p in enumerate(parameters)]
    intervals = {item["quantity"]: item for item in posterior["quantities"]}
    for row, own in enumerate(parameters):
        for column, other in enumerate(parameters):
            axes = grid[row, column]
            if column > row:
                axes.set_axis_off()
            elif column == row:
                _alone(axes, logs[:, row], edges[row], intervals[own.name])
                _mark(axes, truth.get(own.name), None)
            else:
                _pair(axes, logs[:, column], logs[:, row], edges[column], edges[row])
                _mark(axes, truth.get(other.name), truth.get(own.name))
            _ticks(axes, edges[column], edges[row] if column < row else None)
            axes.tick_params(labelsize=6, labelbottom=row == count - 1, labelleft=column == 0)
        grid[row, 0].set_ylabel(f"{own.symbol} ({own.unit})" if row else "", fontsize=7)
        grid[-1, row].set_xlabel(f"{own.symbol} ({own.unit})", fontsize=7)
    drawn.align_labels()
    percent, most = f"{100 * posterior['confidence']:g} %", f"{100 * _MOST:g} % of them"
    handles: list[Any] = [
        Line2D([], [], color=BLUE, linewidth=1.0, label="half of the samples"),
        Line2D([], [], color=BLUE, linewidth=0.6, linestyle="--", label=most),
        Patch(color=SHADE, label=f"{percent} interval"),
    ]
    if truth:
        handles.append(Line2D([], [], color=ORANGE, marker="*", linewidth=0.9, label="truth"))
    drawn.legend(handles=handles, loc="upper right", fontsize=6.5, title=title, title_fontsize=7.5)
    return drawn


def _edges(logs: Array, truth: float | None) -> Array:
    low, high = np.quantile(logs, [_BEYOND, 1 - _BEYOND])
    inside = [np.log(truth)] if truth else []
    low, high = min([low, *inside]), max([high, *inside])
    margin = 0.06 * (high - low)
    return np.linspace(low - margin, high + margin, _BINS + 1)


def _alone(axes: Axes, logs: Array, edges: Array, interval: Mapping[str, Any]) -> None:
    counts, _ = np.histogram(logs, edges)
    axes.axvspan(interval["low"], interval["high"], color=SHADE, linewidth=0, zorder=0)
    axes.stairs(counts / counts.max(), np.exp(edges), color=BLUE, linewidth=0.9)
    axes.axvline(interval["median"], color=BLUE, linewidth=0.6, linestyle=":")
    axes.set_ylim(0, 1.1)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)


def _pair(axes: Axes, x: Array, y: Array, x_edges: Array, y_edges: Array) -> None:
    from scipy.ndimage import gaussian_filter

    counts, _, _ = np.histogram2d(x, y, [x_edges, y_edges])
    density = gaussian_filter(counts.T, _SMOOTH)
    half, most = (_level(density, share) for share in (_HALF, _MOST))
    middles = [np.exp(0.5 * (edges[1:] + edges[:-1])) for edges in (x_edges, y_edges)]
    shades = LinearSegmentedColormap.from_list("shades", ["#ffffff", SHADE, BLUE])
    axes.pcolormesh(
        np.exp(x_edges), np.exp(y_edges), np.sqrt(density), cmap=shades, rasterized=True
    )
    if half > most:
        axes.contour(
            *middles,
            density,
            [most, half],
            colors=BLUE,
            linewidths=[0.6, 1.0],
            linestyles=["--", "-"],
        )


def _level(density: Array, share: float) -> float:
    """Return the density at the edge of the smallest region that contains a share of samples."""
    falling = np.sort(density.ravel())[::-1]
    place = np.searchsorted(np.cumsum(falling), share * falling.sum())
    return float(falling[min(place, len(falling) - 1)])


def _mark(axes: Axes, x: float | None, y: float | None) -> None:
    style: dict[str, Any] = {"color": ORANGE, "linewidth": 0.9}
    if x:
        axes.axvline(x, **style)
    if y:
        axes.axhline(y, **style)
    if x and y:
        axes.plot(
            x, y, "*", color=ORANGE, markersize=5, markeredgecolor="white", markeredgewidth=0.4
        )


def _ticks(axes: Axes, x_edges: Array, y_edges: Array | None) -> None:
    for name, edges in (("x", x_edges), ("y", y_edges)):
        if edges is not None:
            low, high = np.exp(edges[[0, -1]]).tolist()
            getattr(axes, f"set_{name}scale")("log")
            getattr(axes, f"set_{name}lim")(low, high)
            places, labels = decade_ticks(low, high) if high > _WIDE * low else _few(low, high)
            getattr(axes, f"set_{name}ticks")(places, labels)
            getattr(axes, f"set_{name}ticks")([], minor=True)


def _few(low: float, high: float) -> tuple[list[float], list[str]]:
    """Return one or two round values between the ends of an axis, and their labels."""
    inside = [float(v) for v in MaxNLocator(2).tick_values(low, high) if low <= v <= high]
    return inside, [f"{value:.6g}" for value in inside]


CORNER = drawing(
    draw,
    name="posterior_figure",
    file="posterior",
    caption="Posterior of one seed: each parameter alone, and each against each other, over "
    "logarithms. Outlined: the least regions with half and 95 % of the samples; shaded: the "
    "interval; dotted: the median; orange: the truth.",
    uses=from_case("title sample fixed parameters"),
    reads={"posterior": the(POSTERIOR), "samples": the(SAMPLES)},
    cases=sampled,
    weight=JUDGEMENT,
)
