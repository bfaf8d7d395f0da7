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
    alike,
    notes_of,
    outcome_in_words,
    paragraph,
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
from biogrip.judging.cells import Told, compare, gather
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED
from biogrip.page.templates import data_url, environment
from biogrip.physics.models import Sample
from biogrip.physics.protocol import largest_load
from biogrip.physics.sample_model import sketched
from biogrip.terminal import visible_lines

_STATUS_MARKS = {OK: "✓", DOUBTFUL: "!", REJECTED: "✕"}
# The group of all traces, and most panels beside each other.
_ALL, _MOST_PANELS = "all traces", 6
MOST_OPEN = 3
"""Most traces whose pictures are open, printed, and stacked for a telephone."""
# Size of the picture of a fit, which is read on a telephone, too.
_FIT_IN = (4.4, 3.4)


def trace_pictures(
    diagnosis: Diagnosis, data: Mapping[str, Any], *, of_many: bool = False
) -> list[str]:
    """Return pictures of a trace as data URLs: the fit; profiles; and these stacked, of few."""
    ways = (False,) if of_many else (False, True)
    with style.styled():
        profiles = [draw_profiles_of(data, stacked=stacked) for stacked in ways]
    return [address(picture) for picture in (draw_best(diagnosis), *profiles)]


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


def draw_every_trace(outcome: Outcome, columns: Sequence[str]) -> Figure:
    """Draw quantities of all traces, a panel each, with their geometric means."""
    numbers = ("verdict", "value", "low", "high")
    told = []
    for data in outcome.found:
        quantities = {q["quantity"]: tuple(map(q.get, numbers)) for q in data["quantities"]}
        told.append(Told(data["trace"], data["fit"], {_ALL: _ALL}, quantities))
    confidence = outcome.found[0]["confidence"]
    cells = gather(told, _ALL, None, confidence)
    compared = compare(cells, [_ALL], confidence, units=False)
    units = {q["quantity"]: q["unit"] for data in outcome.found for q in data["quantities"]}
    # Side by side, as many as a screen has room for.
    width_in = max(style.PAGE_IN, ONE_COLUMN_IN / 2 * min(len(columns), _MOST_PANELS))
    return draw_cells(cells, compared, {name: units[name] for name in columns}, width_in, None)


def write_page(outcome: Outcome, page: Path) -> None:
    """Write results, with pictures as far as there are any, as HTML."""
    traces, copied = outcome.found, outcome.copied
    columns = words.columns_of(traces)
    several = len(traces) != 1 or bool(outcome.refused)
    figure_of_all = ""
    if several and traces:
        with style.styled():
            figure_of_all = address(draw_every_trace(outcome, [*columns]))
    outcomes = [(data["trace"], data["fit"]) for data in traces]
    outcomes += [(trace, FAILED) for trace in outcome.refused]
    further = outcome_in_words(outcomes) if several else []
    set_up = together(map(set_up_in_words, traces))
    singles = [single for data in traces for single in data.get("traces", [data])]
    shared = common([single["assumed"] for single in singles])
    text = (
        environment()
        .get_template("traces.html.j2")
        .render(
            traces=traces,
            refused={trace: visible_lines(reason) for trace, reason in outcome.refused.items()},
            pictures=outcome.pictures,
            figure_of_all=figure_of_all,
            set_up=set_up,
            notes=alike((data["trace"], note) for data in traces for note in notes_of(data)),
            methods=paragraph([*set_up, *further]),
            several=several,
            columns=columns,
            copied=copied,
            names=list(dict.fromkeys(name for cells in copied.values() for name in cells)),
            shared=_as_yaml(shared),
            alike=shared == singles[0]["assumed"] if singles else True,
            many=len(traces) > MOST_OPEN,
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
    """Return the keys that all of several blocks have alike."""
    first = several[0] if several else {}
    return {key: it for key, it in first.items() if all(block.get(key) == it for block in several)}


def _as_yaml(block: Mapping[str, Any]) -> str:
    dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    return yaml.dump(block, Dumper=dumper, sort_keys=False, allow_unicode=True)
