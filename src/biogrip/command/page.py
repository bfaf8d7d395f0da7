"""An HTML page of identified traces, self-contained: a figure, a table, and each trace.

Pictures are Matplotlib's. A page of very many traces has the figure and the table only.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from matplotlib.figure import Figure

from biogrip import __version__
from biogrip.command import words
from biogrip.command.outputs import FAILED, WRITTEN_BY, Outcome
from biogrip.command.words import (
    outcome_in_words,
    paragraph,
    preferred_in_words,
    set_up_in_words,
    together,
)
from biogrip.digits import with_unit
from biogrip.figures import style
from biogrip.figures.cells import ONE_COLUMN_IN, draw_cells
from biogrip.figures.fit import draw_fit, fit_of
from biogrip.figures.likelihood import draw_profiles_of
from biogrip.files import write_text
from biogrip.identify.together import Together
from biogrip.judging.cells import CELL, Told, compare, gather, shared_columns
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED
from biogrip.judging.without_model import LEVEL, level_turned
from biogrip.page.templates import data_url, environment
from biogrip.physics.models import Sample
from biogrip.physics.protocol import evaluate, hold, join_phases, largest_load
from biogrip.physics.response import simulated_response
from biogrip.physics.sample_model import sketched
from biogrip.terminal import visible_lines

_STATUS_MARKS = {OK: "✓", DOUBTFUL: "!", REJECTED: "✕"}
# Most groups of a column that a figure shows, and the word of all traces where there is no such.
_GROUPS_SHOWN, _ALL, _MOST_PANELS = 6, "all traces", 6
# Most traces whose pictures are open, and printed.
_MOST_OPEN = 3
# Times at which a level is drawn; size of the picture of a fit, which is read on a telephone, too.
_BAND, _FIT_IN = 25, (4.4, 3.4)


def trace_pictures(diagnosis: Diagnosis, data: Mapping[str, Any]) -> list[str]:
    """Return pictures of a trace as data URLs: the fit with its residuals; profiles, and stacked.

    A fourth one is of the level over time, as far as that is told without a model.
    """
    drawn, told = draw_best(diagnosis), data["without_model"]["quantities"]
    with style.styled():
        more = [draw_level(diagnosis, data)] if told and diagnosis.recording else []
        profiles = [draw_profiles_of(data, stacked=stacked) for stacked in (False, True)]
        return [address(picture) for picture in (drawn, *profiles, *more)]


def draw_level(diagnosis: Diagnosis, data: Mapping[str, Any]) -> Figure:
    """Draw what limits any linear sample has at times after a step, and the best fit.

    Where one level was held, readings over it are drawn, too.
    """
    recording, experiment = diagnosis.identified
    first_s, last_s = data["without_model"]["covered_s"]
    times = np.geomspace(first_s, last_s, _BAND)
    told = diagnosis.without_model(times.tolist(), [LEVEL]).told
    step = join_phases((hold(2 * times[-1], 1.0),), deforms=experiment.instrument.deforms)
    network = experiment.searched.network(np.exp(diagnosis.likelihood.best))
    best = simulated_response(experiment.gripper, network, step, times)[0]
    turned = level_turned(diagnosis.likelihood.problem.residuals) or (lambda response: response)
    drawn = style.figure(style.COLUMN_IN, 2.4)
    axes = drawn.subplots()
    low, high = np.array([(level.low, level.high) for level in told], dtype=float).T
    axes.fill_between(times, low, high, color=style.SHADE, label="any linear sample")
    axes.plot(times, turned(best), "--", color=style.FITTED, label="best fit")
    after = recording.time_s > 0
    held = evaluate(experiment.torque, recording.time_s[after])
    if not (experiment.instrument.sweeps or np.ptp(held) or experiment.offset_and_drift):
        readings = turned(recording.readings[after] / held)
        axes.plot(recording.time_s[after], readings, ".", color=style.MEASURED, markersize=1.2)
    ends = float(np.nanmin(low)), float(np.nanmax(high))
    axes.set_ylim(ends[0] - 0.1 * np.ptp(ends), ends[1] + 0.1 * np.ptp(ends))
    axes.set(xscale="log", xlabel="time after a step (s)", xlim=times[[0, -1]])
    axes.set_ylabel(with_unit(told[0].quantity.split("(")[0], told[0].unit))
    axes.legend()
    return drawn


def draw_joint(sample: Together) -> Figure:
    """Draw every trace of a sample, what the joint fit shows, and residuals over the noise.

    Traces that read one quantity share a panel, each over its largest load, but of a sweep, or
    where what is read is relative to it.
    """
    values = {finding.quantity.label: finding.value for finding in sample.findings}
    reads = dict.fromkeys(single.identified[1].instrument.read for single in sample.traces)
    drawn = style.figure(style.COLUMN_IN * len(reads), 3.6)
    panels = drawn.subplots(2, len(reads), sharex="col", squeeze=False, height_ratios=[2.4, 1])
    colors = cycle(style.COLORS.values())
    for name, single, color in zip(sample.names, sample.traces, colors, strict=False):
        recording, experiment = single.identified
        instrument = experiment.instrument
        fit = fit_of(experiment, values, recording.time_s, recording.readings, recording.sd)
        top, below = panels[:, [*reads].index(instrument.read)]
        alone = instrument.relative or instrument.sweeps
        load = 1.0 if alone else abs(largest_load(experiment.phases))
        noise_sd = single.likelihood.noise_sd if fit.sd is None else fit.sd
        at, left = np.abs(fit.time_s), (fit.measured - fit.fitted) / noise_sd
        for axes, values_of in ((top, fit.measured / load), (below, left)):
            axes.plot(at, values_of, ".", color=color, markersize=1.2)
        look = "_" if instrument.sweeps else "-"
        top.plot(at, fit.fitted / load, look, color=color, label=style.literal(name))
        unit = f"{fit.read.unit or 1}/{instrument.controlled.unit}".removesuffix("/")
        over = "" if alone else f" over {instrument.controlled.name}"
        top.set_ylabel(with_unit(fit.read.title + over, fit.read.unit if alone else unit))
        below.set_xlabel("angular frequency (rad/s)" if instrument.sweeps else "time (s)")
        if instrument.sweeps:
            top.set(xscale="log", yscale="log")
    panels[1, 0].set_ylabel("residual over noise")
    drawn.legend(loc="outside upper left", ncols=2)
    return drawn


def draw_best(diagnosis: Diagnosis) -> Figure:
    """Draw a trace, its best fit and the residuals over the time of the file's clock.

    Where readings spread over decades after the protocol's start, time is counted from there.
    """
    if isinstance(diagnosis, Together):
        with style.styled():
            return draw_joint(diagnosis)
    recording, experiment = diagnosis.identified
    values = {finding.quantity.label: finding.value for finding in diagnosis.findings}
    fit = fit_of(experiment, values, recording.time_s, recording.readings, recording.sd)
    start_s = recording.onset_s or 0.0
    spread = style.is_over_decades(fit.time_s)
    if not spread:
        fit = replace(fit, time_s=fit.time_s + start_s)
    with style.styled():
        drawn = draw_fit({"best fit": fit}, "")
        drawn.set_size_inches(*_FIT_IN)
        if spread and start_s:
            drawn.axes[-1].set_xlabel(f"time since {start_s:.6g} s of the clock (s)")
    return drawn


def address(drawn: Figure) -> str:
    """Return a figure as a PNG of few colours, as a data URL."""
    with style.styled():
        return data_url("image/png", style.png_of(drawn, 64))


def draw_every_trace(outcome: Outcome, columns: Mapping[str, str]) -> tuple[Figure, str]:
    """Draw quantities of all traces, and return the figure with what its groups are.

    Groups are those of the column with the fewest words, units those of one that puts cells of a
    group together.
    """
    names = dict.fromkeys(name for cells in outcome.copied.values() for name in cells)
    none = dict.fromkeys(names, "")
    copied = outcome.copied
    every = [_told_by(data, {**none, **copied.get(data["trace"], {})}) for data in outcome.found]
    words_of = {name: {told.words[name] for told in every} for name in every[0].words}
    few = [name for name, of in words_of.items() if 1 < len(of) <= _GROUPS_SHOWN and "" not in of]
    by = min(set(few) - {CELL}, key=lambda name: (len(words_of[name]), name), default=_ALL)
    shared = sorted(shared_columns(every, by), key=lambda column: not column[1])
    unit = shared[0][0] if shared and by != _ALL else None
    confidence = outcome.found[0]["confidence"]
    cells = gather(every, by, unit, confidence)
    groups = sorted({cell.group for cell in cells})
    compared = compare(cells, groups, confidence, units=unit is not None)
    units = {q["quantity"]: q["unit"] for data in outcome.found for q in data["quantities"]}
    said = f"Groups: {by}. " if by != _ALL else ""
    said += f"Large marks: means of each {unit}." if unit else "Cells are taken for independent."
    # A panel each side by side, as many as a screen has room for.
    width_in = max(style.PAGE_IN, ONE_COLUMN_IN / 2 * min(len(columns), _MOST_PANELS))
    units = {name: units[name] for name in columns}
    return draw_cells(cells, compared, units, width_in, unit), said


def _told_by(data: Mapping[str, Any], copied: Mapping[str, str]) -> Told:
    """Return what a trace tells, with the cells of its row in a table of traces."""
    numbers = ("verdict", "value", "low", "high")
    told = {q["quantity"]: tuple(map(q.get, numbers)) for q in data["quantities"]}
    return Told(data["trace"], data["fit"], {**copied, _ALL: "all traces"}, told)


def write_page(outcome: Outcome, page: Path) -> None:
    """Write results, with pictures as far as there are any, as HTML."""
    traces, copied = outcome.found, outcome.copied
    columns = words.columns_of(traces)
    several = len(traces) != 1 or bool(outcome.refused)
    figure_of_all = groups = ""
    if several and traces:
        with style.styled():
            drawn, groups = draw_every_trace(outcome, columns)
            figure_of_all = address(drawn)
    outcomes = [(data["trace"], data["fit"], " ".join(data["reasons"])) for data in traces]
    outcomes += [(trace, FAILED, reason) for trace, reason in outcome.refused.items()]
    further = outcome_in_words(outcomes) if several else preferred_in_words(traces[0])
    set_up = together(map(set_up_in_words, traces))
    singles = [single for data in traces for single in data.get("traces", [data])]
    assumed: dict[str, dict[str, Any]] = {single["trace"]: single["assumed"] for single in singles}
    shared = common([*assumed.values()])
    beyond_shared = {trace: _as_yaml(beyond(block, shared)) for trace, block in assumed.items()}
    text = (
        environment()
        .get_template("traces.html.j2")
        .render(
            traces=traces,
            refused={trace: visible_lines(reason) for trace, reason in outcome.refused.items()},
            pictures=outcome.pictures,
            figure_of_all=figure_of_all,
            groups=groups,
            set_up=set_up,
            methods=paragraph([*set_up, *further]),
            several=several,
            columns=columns,
            copied=copied,
            names=list(dict.fromkeys(name for cells in copied.values() for name in cells)),
            shared=_as_yaml(shared),
            own=beyond_shared,
            many=len(traces) > _MOST_OPEN,
            marks=_STATUS_MARKS,
            counts={
                status: sum(data["fit"] == status for data in traces) for status in _STATUS_MARKS
            },
            words=words,
            drawing_of=lambda sample: sketched(Sample(*sample.values()).model),
            written_by=f"{WRITTEN_BY} {__version__}",
        )
    )
    write_text(page, text)


def common(several: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what all of several nested blocks say alike."""
    alike = {}
    for key in several[0] if several else ():
        every: list[Any] = [block.get(key) for block in several]
        if all(value == every[0] for value in every):
            alike[key] = every[0]
        elif all(isinstance(value, dict) for value in every) and (inner := common(every)):
            alike[key] = inner
    return alike


def beyond(one: Mapping[str, Any], shared: Mapping[str, Any]) -> dict[str, Any]:
    """Return what one of nested blocks says beyond what all share."""
    more = {}
    for key, value in one.items():
        if key not in shared:
            more[key] = value
        elif value != shared[key]:
            more[key] = beyond(value, shared[key])
    return more


def _as_yaml(block: Mapping[str, Any]) -> str:
    dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    return yaml.dump(block, Dumper=dumper, sort_keys=False, allow_unicode=True)
