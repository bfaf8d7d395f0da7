"""Figures of a designed experiment: torque, readings, sensitivities and jaw force."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.design.several import Several
from biogrip.digits import counted, with_unit
from biogrip.experiment.protocol import Phase
from biogrip.own_design.at_a_price import WAYS, points
from biogrip.own_design.designed import Designed, kind, shown_unit
from biogrip.products.figures.style import BLACK, BLUE, GREEN, ORANGE, PAGE_IN, PURPLE, SKY, figure

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)
_WAYS: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "marker": "o", "drawstyle": "steps-post"},
    {"color": PURPLE, "marker": "^", "drawstyle": "steps-post", "ls": "-."},
    {"color": ORANGE, "marker": "D", "ls": "--"},
)
_AFTER = 120
# Most periods that are drawn one by one.
_MOST_DRAWN = 40


def draw_experiment(found: Designed) -> Figure:
    """Draw what is held, readings and any jaw force over the whole experiment."""
    plan = found.plan
    history, times = plan.torque, plan.time_s
    instrument = found.inputs.instrument
    heights = [1.3, 0.7, 1.3] if instrument.has_jaws else [1.3, 0.7]
    drawn = figure(PAGE_IN, 4.6 * sum(heights) / 3.3)
    upper, middle, *lower = drawn.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    _draw_torque(upper, found)
    upper.set_ylabel(with_unit(instrument.controlled.name, shown_unit(instrument)[1]))
    counts, _ = np.histogram(times, np.linspace(0, history.end_s, 201))
    middle.stairs(counts, np.linspace(0, history.end_s, 201), fill=True, color=SKY)
    middle.set_ylabel("readings")
    middle.set_yscale("symlog", linthresh=1)
    for axes in lower:
        for row, force in enumerate(found.force_N):
            axes.plot(found.force_time_s, 1e6 * force, lw=0.6, color=_COLOURS[row % len(_COLOURS)])
        axes.axhline(0, color=BLACK, lw=0.6)
        axes.set_ylabel("jaw force (µN)")
    [middle, *lower][-1].set_xlabel("time (s)")
    drawn.align_ylabels()
    return drawn


def _draw_torque(axes: Axes, found: Designed) -> None:
    """Draw what is held as a line, or as a band where a sinusoid has too many periods."""
    history, phases = found.plan.torque, found.plan.phases
    scale, _ = shown_unit(found.inputs.instrument)
    start_s, times, torques = 0.0, [0.0], [0.0]
    for start_s, phase in zip(history.time_s, phases, strict=True):
        load, instants = phase.left, np.array([0.0, phase.duration_s])
        for harmonic in load.harmonics:
            periods = phase.duration_s * harmonic.frequency_Hz
            if periods < _MOST_DRAWN:
                instants = np.linspace(0.0, phase.duration_s, max(2, int(30 * periods)))
            else:
                low, high = load.value_Nm + harmonic.amplitude_Nm * np.array([-1, 1])
                span = [start_s, start_s + phase.duration_s]
                axes.fill_between(span, scale * low, scale * high, color=SKY, lw=0.8)
        times += (start_s + instants).tolist()
        torques += (scale * load.at(instants)).tolist()
    axes.plot([*times, times[-1]], [*torques, 0.0], lw=0.8)


def draw_sensitivities(found: Designed) -> Figure:
    """Draw sensitivities in units of the noise after the steps with the most readings.

    For a sinusoid the last whole period is drawn, with all readings folded into it.
    """
    plan = found.plan
    inputs = replace(found.inputs, parameters=found.inputs.parameters[:1])
    history, averaged = inputs.history(plan.phases), inputs.averaged(plan.phases)
    times = plan.time_s
    step = history.time_s.searchsorted(times, side="left") - 1
    chosen = sorted(np.argsort(-np.bincount(step, minlength=len(history.time_s)))[:3].tolist())
    drawn = figure(PAGE_IN, 2.6)
    panels = drawn.subplots(1, len(chosen), squeeze=False)[0]
    for axes, k in zip(panels, chosen, strict=True):
        start_s, phase = history.time_s[k], plan.phases[k]
        read = times[step == k] - start_s
        period_s = _period_s(phase)
        if period_s is None:
            shown = after = np.geomspace(0.3 / inputs.fastest_Hz, phase.duration_s, _AFTER)
            axes.set(xscale="log", xlabel="time since the step (s)")
        else:
            shown = np.linspace(0.0, 1.0, _AFTER)
            after = (shown + phase.duration_s // period_s - 1) * period_s
            read = read % period_s / period_s
            axes.set_xlabel("part of the period")
        rows = inputs.sensitivities(averaged, start_s + after * (1 - 1e-12))[0]
        for index, name in enumerate(inputs.model.names):
            axes.semilogy(
                shown, np.abs(rows[index]), color=_COLOURS[index % len(_COLOURS)], label=name
            )
        lowest = axes.get_ylim()[0]
        axes.plot(read, np.full(len(read), lowest), "|", color=BLACK, ms=5)
        axes.set_title(f"{kind(phase)} {k + 1}: {counted(len(read), 'reading')}")
    panels[0].set_ylabel("|sensitivity| / noise")
    panels[0].legend()
    return drawn


def draw_price(several: Several) -> Figure:
    """Draw the share of cells that are known over what experiments with each cost."""
    drawn = figure(PAGE_IN, 3.2)
    axes = drawn.subplots()
    for name, way, style in zip(WAYS, points(several), _WAYS, strict=True):
        cost, share = zip(*way, strict=True) if way else ((), ())
        axes.plot(cost, 100 * np.array(share), label=name, ms=3.5, **style)
    axes.axhline(100 * several.settings.share, color=BLACK, lw=0.6, ls=":")
    axes.set(xlabel="cost of the experiments with a cell", ylabel="cells known (%)", ylim=(0, 103))
    axes.set_xlim(left=0)
    axes.legend(loc="lower right")
    return drawn


def _period_s(phase: Phase) -> float | None:
    """Return the period of a sinusoid that lasts at least one."""
    for harmonic in phase.left.harmonics:
        if phase.duration_s * harmonic.frequency_Hz >= 1:
            return 1 / harmonic.frequency_Hz
    return None


def drawings(found: Designed) -> Iterator[tuple[str, Figure]]:
    """Yield all figures of a design with their titles."""
    force = ", jaw force of each plausible sample" if found.inputs.instrument.has_jaws else ""
    yield (
        f"{found.inputs.instrument.controlled.name.capitalize()}, readings (a bar is 1/200 of the "
        f"experiment){force}",
        draw_experiment(found),
    )
    yield (
        "Sensitivity of a reading to each parameter over the noise, after the steps with the "
        "most readings (ticks); in the last period of a sinusoid",
        draw_sensitivities(found),
    )
    if found.several:
        yield (
            "Share of cells with all quantities as well as asked for (dotted: of how many), over "
            "what experiments with a cell cost",
            draw_price(found.several),
        )
