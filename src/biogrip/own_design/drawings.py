"""What a designed experiment looks like: torque, readings, what they tell, and the jaw force."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from biogrip.experiment.protocol import torque_at
from biogrip.own_design.designed import Designed
from biogrip.products.figures.style import BLACK, BLUE, GREEN, ORANGE, PAGE_IN, PURPLE, SKY, figure
from biogrip.response.ringing import ringing_responses

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)
_AFTER = 120


def draw_experiment(found: Designed) -> Figure:
    """Draw torque, readings and jaw force over the whole experiment."""
    plan = found.plan
    history, times = plan.torque, plan.time_s
    drawn = figure(PAGE_IN, 4.6)
    upper, middle, lower = drawn.subplots(3, 1, sharex=True, height_ratios=[1.3, 0.7, 1.3])
    edges = np.append(history.time_s, history.end_s)
    upper.step(edges, 1e9 * np.append(torque_at(history, history.time_s), 0), where="post", lw=0.8)
    upper.set_ylabel("torque (nN m)")
    counts, _ = np.histogram(times, np.linspace(0, history.end_s, 201))
    middle.stairs(counts, np.linspace(0, history.end_s, 201), fill=True, color=SKY)
    middle.set_ylabel("readings")
    middle.set_yscale("symlog", linthresh=1)
    for row, force in enumerate(found.force_N):
        lower.plot(found.force_time_s, 1e6 * force, lw=0.6, color=_COLOURS[row % len(_COLOURS)])
    lower.axhline(0, color=BLACK, lw=0.6)
    lower.set_ylabel("jaw force (µN)")
    lower.set_xlabel("time (s)")
    drawn.align_ylabels()
    return drawn


def draw_told(found: Designed) -> Figure:
    """Draw sensitivities in units of the noise after the steps with the most readings."""
    plan, wanted = found.plan, found.wanted
    history, times = plan.torque, plan.time_s
    step = history.time_s.searchsorted(times, side="left") - 1
    chosen = sorted(np.argsort(-np.bincount(step, minlength=len(history.time_s)))[:3].tolist())
    ends = np.append(history.time_s[1:], history.end_s)
    drawn = figure(PAGE_IN, 2.6)
    panels = drawn.subplots(1, len(chosen), squeeze=False)[0]
    for axes, k in zip(panels, chosen, strict=True):
        length = ends[k] - history.time_s[k]
        after = np.geomspace(0.3 / wanted.fastest_Hz, length, _AFTER)
        rows = ringing_responses(
            wanted.gripper,
            wanted.model,
            history,
            history.time_s[k] + after * (1 - 1e-12),
            wanted.parameters[:1],
        )[0]
        for index, name in enumerate(wanted.model.names):
            told = np.abs(rows[1 + index]) / wanted.noise_rad
            axes.loglog(after, told, color=_COLOURS[index % len(_COLOURS)], label=name)
        read = times[step == k] - history.time_s[k]
        lowest = axes.get_ylim()[0]
        axes.plot(read, np.full(len(read), lowest), "|", color=BLACK, ms=5)
        axes.set_title(f"step {k + 1}: {len(read)} readings")
        axes.set_xlabel("time since the step (s)")
    panels[0].set_ylabel("|sensitivity| / noise")
    panels[0].legend()
    return drawn


def drawings(found: Designed) -> Iterator[tuple[str, Figure]]:
    """All figures of a design, with their titles."""
    yield (
        "Torque, readings (a bar is 1/200 of the experiment), jaw force of each plausible sample",
        draw_experiment(found),
    )
    yield (
        "What a reading tells of each parameter, in units of the noise, after the steps with the "
        "most readings (ticks)",
        draw_told(found),
    )
