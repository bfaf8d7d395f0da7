"""The explorer of the page: the judged trace of each case with its fits, drawn by Plotly."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from plotly.graph_objects import Figure, Scatter

from biogrip.arrays import Array
from biogrip.digits import significant, with_unit
from biogrip.figures.fit import Fit, fit_of, scale_of_fit
from biogrip.figures.style import COLORS, MEASURED, TARGET, is_over_decades
from biogrip.fit.problem import Method
from biogrip.records.identifications import read_identifications
from biogrip.records.traces import read_measurements
from biogrip.stages.identification import TRACE, experiment_for
from biogrip.study.study import Case

# As many readings as a phone draws.
_MOST_READINGS = 2000
# More digits than a screen shows, and fewer than those in which processors differ.
_DIGITS = 6
_DASHES = {"-": "solid", "--": "dash", "-.": "dashdot", ":": "dot"}
_LAYOUT: dict[str, Any] = {
    "template": "simple_white",
    "height": 480,
    "margin": {"l": 0, "r": 10, "t": 60, "b": 0},
    "legend": {"orientation": "h", "y": -0.2, "yanchor": "top"},
    "xaxis": {"title": {"text": "time (s)"}},
    "yaxis": {"automargin": True, "exponentformat": "power"},
}

Fits = Sequence[tuple[Method, Fit]]
"""A trace with the fit of each method."""


def fits_of(
    case: Case,
    methods: Sequence[Method],
    identifications: Path,
    measurements: Path,
    calibrated: Sequence[Path],
) -> Fits:
    """Return the judged trace of a case with the fit of each method, from files of the case."""
    recorded = read_measurements(measurements, [TRACE])
    experiment = experiment_for(case.experiment, recorded, calibrated)
    fits = []
    for method in methods:
        runs = read_identifications(identifications, case, method.name)
        found = runs.set_index("seed").loc[TRACE]
        values = {p.name: float(found[p.column]) for p in experiment.model.parameters}
        fits.append((method, fit_of(experiment, values, recorded, TRACE)))
    return fits


def explorer(cases: Sequence[tuple[str, Fits]]) -> str:
    """Return an interactive figure of the fits of each case, by title, with a menu of the cases.

    It is an HTML element that holds Plotly's library and needs no network.
    """
    lines = [_lines(fits) for _, fits in cases]
    axes = [_axes(fits[0][1]) for _, fits in cases]
    buttons = []
    for (title, _), own, of_case in zip(cases, lines, axes, strict=True):
        change = [{"visible": [each is own for each in lines for _ in each]}, of_case]
        buttons.append({"label": escape(title), "method": "update", "args": change})
    drawn = Figure([line for own in lines for line in own], _LAYOUT)
    for line in drawn.data[len(lines[0]) :]:
        line.visible = False
    menu = {"buttons": buttons, "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"}
    drawn.update_layout({**axes[0], "updatemenus": [menu]})
    config = {"displayModeBar": False, "responsive": True}
    return str(drawn.to_html(config, full_html=False, div_id="explorer"))


def _lines(fits: Fits) -> list[Scatter]:
    trace = fits[0][1]
    factor, _ = scale_of_fit(trace)
    stride = -(-len(trace.time_s) // _MOST_READINGS)

    def line(values: Array, name: str, **style: Any) -> Scatter:
        x, y = (
            significant(each[::stride], _DIGITS).astype("f4")
            for each in (trace.time_s, factor * values)
        )
        return Scatter(x=x, y=y, name=name, **style)

    kind = "recorded trace" if trace.target is None else "noisy trace"
    dots = {"size": 3, "color": MEASURED}
    lines = [line(trace.measured, kind, mode="markers", marker=dots)]
    if trace.target is not None:
        lines.append(line(trace.target, "target", mode="lines", line_color=TARGET))
    for method, fit in fits:
        style = {"color": COLORS[method.color], "dash": _DASHES[method.dashes]}
        lines.append(line(fit.fitted, method.title, mode="lines", line=style))
    return lines


def _axes(trace: Fit) -> dict[str, Any]:
    return {
        "xaxis.type": "log" if is_over_decades(trace.time_s) else "linear",
        "xaxis.autorange": True,
        "yaxis.title.text": with_unit(trace.read.title, scale_of_fit(trace)[1]),
        "yaxis.autorange": True,
    }
