"""An HTML page of identified traces, self-contained: a table, distributions, and each trace.

Pictures are Matplotlib's. A page of very many traces has the table and the distributions only.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import PIL.Image
import yaml
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from biogrip import __version__
from biogrip.command import words
from biogrip.command.outputs import WRITTEN_BY, Outcome
from biogrip.digits import with_unit
from biogrip.figures.fit import draw_fit
from biogrip.figures.likelihood import draw_profiles_of
from biogrip.figures.results import fit_of
from biogrip.figures.style import (
    BLUE,
    COLUMN_IN,
    FITTED,
    MEASURED,
    SHADE,
    figure,
    is_over_decades,
    save_png,
    styled,
)
from biogrip.files import write_text
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED
from biogrip.judging.without_model import LEVEL, level_turned
from biogrip.physics.protocol import evaluate, hold, join_phases
from biogrip.physics.simulation import simulated_response
from biogrip.records.traces import of_recording
from biogrip.terminal import visible, visible_lines

_MARKS = {OK: "✓", DOUBTFUL: "!", REJECTED: "✕"}
# Ratio of the largest to the smallest limit above which an axis is logarithmic.
_WIDE = 5.0
# Times at which a level is drawn.
_BAND = 25


def draw(diagnosis: Diagnosis, data: Mapping[str, Any]) -> list[str]:
    """Return pictures of a trace as data URLs: the fit with its residuals, and all profiles.

    A third one is of the level over time, as far as that is told without a model.
    """
    drawn = draw_best(diagnosis)
    with styled():
        more = [draw_level(diagnosis, data)] if data["without_model"]["quantities"] else []
        return [_address(each) for each in (drawn, draw_profiles_of(data), *more)]


def draw_level(diagnosis: Diagnosis, data: Mapping[str, Any]) -> Figure:
    """Draw what limits any linear sample has at times after a step, and the best fit.

    Where one level was held, readings over it are drawn, too.
    """
    experiment, recording = diagnosis.experiment, diagnosis.recording
    assert experiment is not None
    assert recording is not None
    first_s, last_s = data["without_model"]["covered_s"]
    times = np.geomspace(first_s, last_s, _BAND)
    told = diagnosis.without_model(times.tolist(), [LEVEL]).told
    step = join_phases((hold(2 * times[-1], 1.0),), deforms=experiment.instrument.deforms)
    network = experiment.searched.network(np.exp(diagnosis.likelihood.best))
    best = simulated_response(experiment.gripper, network, step, times, nonlinear=False)[0]
    turned = level_turned(diagnosis.likelihood.problem.residuals) or (lambda response: response)
    drawn = figure(COLUMN_IN, 2.4)
    axes = drawn.subplots()
    low, high = np.array([(it.low, it.high) for it in told], dtype=float).T
    axes.fill_between(times, low, high, color=SHADE, label="any linear sample")
    axes.plot(times, turned(best), "--", color=FITTED, label="best fit")
    after = recording.time_s > 0
    held = evaluate(experiment.torque, recording.time_s[after])
    if not (experiment.instrument.sweeps or np.ptp(held) or experiment.offset_and_drift):
        readings = turned(recording.readings[after] / held)
        axes.plot(recording.time_s[after], readings, ".", color=MEASURED, markersize=1.2)
    ends = float(np.nanmin(low)), float(np.nanmax(high))
    axes.set_ylim(ends[0] - 0.1 * np.ptp(ends), ends[1] + 0.1 * np.ptp(ends))
    axes.set(xscale="log", xlabel="time after a step (s)", xlim=times[[0, -1]])
    axes.set_ylabel(with_unit(told[0].quantity.split("(")[0], told[0].unit))
    axes.legend()
    return drawn


def draw_best(diagnosis: Diagnosis) -> Figure:
    """Draw a trace, its best fit and the residuals over the time of the file's clock.

    Where readings spread over decades after the protocol's start, time is counted from there.
    """
    experiment, recording = diagnosis.experiment, diagnosis.recording
    assert experiment is not None
    assert recording is not None
    found = {finding.quantity.label: finding.value for finding in diagnosis.findings}
    values = {name: found[name] for name in experiment.searched.names}
    fit = fit_of(experiment, {**experiment.fixed, **values}, of_recording(recording), 0)
    start_s = recording.onset_s or 0.0
    spread = is_over_decades(fit.time_s)
    if not spread:
        fit = replace(fit, time_s=fit.time_s + start_s)
    with styled():
        drawn = draw_fit({"best fit": fit}, "")
        if spread and start_s:
            drawn.axes[-1].set_xlabel(f"time since {start_s:.6g} s of the clock (s)")
    return drawn


def _address(drawn: Figure) -> str:
    png, few = BytesIO(), BytesIO()
    save_png(drawn, png)
    # With few colours a picture is a third as large.
    with PIL.Image.open(png) as image:
        image.convert("RGB").quantize(64, dither=PIL.Image.Dither.NONE).save(few, "png")
    return f"data:image/png;base64,{base64.b64encode(few.getvalue()).decode()}"


def draw_strip(label: str, traces: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw a quantity of all traces in their order: values with limits, or the only limit."""
    drawn = figure(COLUMN_IN, 2.2)
    axes = drawn.subplots()
    title, bars, ends = label, [], list[float]()
    marks: dict[tuple[str, str], list[tuple[int, float]]] = {}
    for number, each in enumerate(traces, 1):
        item = next((q for q in each["quantities"] if q["quantity"] == label), None)
        if item is None or item["low"] is item["high"] is None:
            continue
        title, low, high = with_unit(item["symbol"], item["unit"]), item["low"], item["high"]
        kind, value = ("v", high) if low is None else ("^", low)
        if low is not None and high is not None:
            kind, value = "o", item["value"]
            bars.append((number, low, high))
        marks.setdefault((kind, BLUE if each["fit"] == OK else "white"), []).append((number, value))
        ends += [end for end in (low, value, high) if end]
    axes.vlines(*np.reshape(bars, (-1, 3)).T, color=BLUE, linewidth=0.8)
    for (kind, face), points in marks.items():
        axes.plot(*np.transpose(points), kind, color=BLUE, markersize=4, markerfacecolor=face)
    if ends and max(ends) > _WIDE * min(ends):
        axes.set_yscale("log")
    axes.set_xlim(0.5, len(traces) + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("number of the trace")
    axes.set_ylabel(title)
    return drawn


def write_page(outcome: Outcome, page: Path) -> None:
    """Write results, with pictures as far as there are any, as HTML."""
    here = Path(__file__).parent
    traces, copied = outcome.found, outcome.copied
    columns = words.columns_of(traces)
    several = len(traces) != 1 or bool(outcome.refused)
    with styled():
        strips = {name: _address(draw_strip(name, traces)) for name in columns if several}
    assumed: dict[str, list[str]] = {}
    for each in traces:
        assumed.setdefault(_assumed(each), []).append(each["trace"])
    environment = jinja2.Environment(
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=jinja2.FileSystemLoader(here),
    )
    environment.filters["visible"] = visible
    text = environment.get_template("page.html.j2").render(
        traces=traces,
        refused={trace: visible_lines(reason) for trace, reason in outcome.refused.items()},
        pictures=outcome.pictures,
        strips=strips,
        several=several,
        columns=columns,
        copied=copied,
        names=list(dict.fromkeys(name for own in copied.values() for name in own)),
        assumed=assumed,
        marks=_MARKS,
        counts={status: sum(each["fit"] == status for each in traces) for status in _MARKS},
        words=words,
        written_by=f"{WRITTEN_BY} {__version__}",
        style=(here.parent / "page/report.css").read_text(encoding="utf-8"),
    )
    write_text(page, text)


def _assumed(found: Mapping[str, Any]) -> str:
    """Return what a trace assumes as YAML, without its name, so that it is said once of several."""
    assumed = dict(found["assumed"])
    assumed["measurement"] = {**assumed["measurement"]}
    assumed["measurement"].pop("file", None)
    dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text: str = yaml.dump(assumed, Dumper=dumper, sort_keys=False, allow_unicode=True)
    return text
