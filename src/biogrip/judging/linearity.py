"""Is a sample linear? One gain for each level of the load, in one test.

What is read is the sum of what each level that was held causes. Of a linear sample all have one
gain, which its stiffnesses take; of one that stiffens or softens, each level has its own.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.special import fdtrc, stdtrit

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import p_value, plain, with_limits
from biogrip.fit.trace_noise import absorbed
from biogrip.judging.doubts import DOUBT, MANY, REJECTED, REJECTION, Note, compute_status
from biogrip.judging.likelihood import Likelihood
from biogrip.physics.noise import without
from biogrip.physics.protocol import Course, superposed
from biogrip.physics.residuals import Residuals

NOT_LINEAR = "not linear"
"""What the note on gains that differ is about."""

# Most levels of which gains are told; steps with which gains settle.
_MOST_LEVELS, _STEPS = 10, 8


def held_levels(course: Course) -> list[tuple[float, Course]]:
    """Return the levels at which a load is held, ascending in size, and the protocol of each alone.

    Levels are one that differ by less than a tenth, and none below a tenth of the largest.
    """
    ends_s = np.append(course.time_s[1:], course.end_s)
    heights = np.where(np.any(course.within_phases[:, 1:], axis=1), 0.0, course.within_phases[:, 0])
    order = np.argsort(np.abs(heights), kind="stable")
    order = order[np.abs(heights[order]) > levels.HELD * np.abs(heights).max(initial=0.0)]
    groups: list[list[int]] = []
    for phase in order.tolist():
        close = levels.HELD * abs(heights[phase])
        if groups and abs(heights[phase] - heights[groups[-1][0]]) < close:
            groups[-1].append(phase)
        else:
            groups.append([phase])
    found = []
    for group in groups:
        starts_s = np.concatenate((course.time_s[group], ends_s[group]))
        changes = np.zeros((len(starts_s), 3))
        changes[:, 0] = np.concatenate((heights[group], -heights[group]))
        own = superposed(starts_s, changes, course.end_s, deforms=course.deforms)
        found.append((float(np.mean(heights[group])), own))
    return found


def notes_on_gains(likelihood: Likelihood, notes: list[Note]) -> Iterator[Note]:
    """Yield a note if gains of levels differ, by an F test; others say if the fit is rejected."""
    residuals = likelihood.problem.residuals
    if residuals.course.sweeps or residuals.samples > MANY:
        return
    held = held_levels(residuals.course)
    if not 1 < len(held) <= _MOST_LEVELS:
        return
    found = _gains(likelihood, [replace(residuals, course=course) for _, course in held[1:]])
    if found is None:
        return
    gains, errors, chance = found
    instrument = residuals.instrument
    unit = f" {instrument.controlled.unit}".rstrip()
    said = " and ".join(
        f"at {plain(level)}{unit} is {with_limits(gain, gain - error, gain + error)}"
        for (level, _), gain, error in zip(held[1:], gains, errors, strict=True)
    )
    yield Note(
        REJECTION if compute_status(notes) == REJECTED else DOUBT,
        f"{instrument.read.title.capitalize()} per {instrument.controlled.name} {said} of that "
        f"at {plain(held[0][0])}{unit} ({p_value(chance)}): the sample is not linear.",
        NOT_LINEAR,
    )


def _gains(
    likelihood: Likelihood, levels_alone: list[Residuals]
) -> tuple[Array, Array, float] | None:
    """Fit gains over that of the first level, and the sample along, by steps of Gauss-Newton.

    Returns the gains, (n_levels - 1,), half widths of their limits, and the chance of as much if
    the sample is linear; None if it may be.
    """
    residuals, best = likelihood.problem.residuals, likelihood.best.copy()
    condensed, gains, chance = residuals.trace.condensed, np.ones(len(levels_alone)), 1.0
    for step in range(_STEPS):
        left, slopes = residuals(best)
        shown = condensed.cleared(np.array([level.simulated(best) for level in levels_alone]))
        left = left + (gains - 1) @ shown[:, 0]
        slopes = slopes + np.tensordot(gains - 1, shown[:, 1:], 1)
        basis = absorbed(np.vstack((slopes, condensed.taken)))
        alone, rest = without(basis, shown[:, 0]), without(basis, left)
        free = len(rest) - len(basis) - len(alone)
        if free < 1:
            return None
        more = np.asarray(np.linalg.lstsq(alone.T, -rest)[0], np.float64)
        after = rest + more @ alone
        square = float(after @ after) / free
        if not step:
            explained = float(rest @ rest - after @ after)
            chance = float(fdtrc(len(alone), free, explained / len(alone) / square))
            if chance >= levels.FALSE_ALARM:
                return None
        more = np.clip(more, -0.5, 0.5)
        gains += more
        best += np.clip(np.linalg.lstsq(slopes.T, -left - more @ shown[:, 0])[0], -1.0, 1.0)
    room = stdtrit(free, 0.5 + likelihood.confidence / 2)
    errors = room * np.sqrt(square * np.diagonal(np.linalg.pinv(alone @ alone.T)))
    return gains, errors, chance
