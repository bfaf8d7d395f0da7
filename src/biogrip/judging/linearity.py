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
    courses, confidence = [course for _, course in held], likelihood.confidence
    *_, chance = _more(residuals, likelihood.best, courses, confidence)
    if chance >= levels.FALSE_ALARM:
        return
    gains, errors = _gains(likelihood, courses)
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


def _gains(likelihood: Likelihood, courses: list[Course]) -> tuple[Array, Array]:
    """Fit gains over that of the first level, (n_levels - 1,), and half widths of their limits.

    A gain of what is read is one of the load: by steps of Gauss-Newton, loads are scaled, and with
    them the sample is fitted.
    """
    residuals, best = likelihood.problem.residuals, likelihood.best.copy()
    gains, given = np.ones(len(courses) - 1), residuals.course
    for _ in range(_STEPS):
        left, slopes = residuals(best)
        shown = [replace(residuals, course=course).response(best) for course in courses[1:]]
        cleared = residuals.trace.condensed.cleared(np.array(shown))
        step = np.linalg.lstsq(np.vstack((slopes, cleared)).T, -left)[0]
        best += np.clip(step[: len(best)], -1.0, 1.0)
        more = 1 + np.clip(step[len(best) :], -0.5, 0.5)
        gains *= more
        scaled = [course.times(by) for course, by in zip(courses[1:], more, strict=True)]
        added = [course.times(1 - 1 / by) for course, by in zip(scaled, more, strict=True)]
        courses, given = [courses[0], *scaled], _sum([given, *added])
        residuals = residuals.under(given)
    _, errors, _ = _more(residuals, best, courses, likelihood.confidence)
    return gains, gains * errors


def _sum(courses: list[Course]) -> Course:
    """Return the protocol that controls what several control together."""
    orders = max(own.changes.shape[1] for own in courses)
    changes = [np.pad(own.changes, ((0, 0), (0, orders - own.changes.shape[1]))) for own in courses]
    starts_s = np.concatenate([own.time_s for own in courses])
    first = courses[0]
    return superposed(starts_s, np.vstack(changes), first.end_s, deforms=first.deforms)


def _more(
    residuals: Residuals, best: Array, courses: list[Course], confidence: float
) -> tuple[Array, Array, float]:
    """Return gains over that of the first level, to first order, half widths, and their chance."""
    left, slopes = residuals(best)
    shown = [replace(residuals, course=course).response(best) for course in courses[1:]]
    cleared = residuals.trace.condensed.cleared(np.array(shown))
    basis = absorbed(np.vstack((slopes, residuals.trace.condensed.taken)))
    alone, rest = without(basis, cleared), without(basis, left)
    free = len(rest) - len(basis) - len(alone)
    if free < 1:
        return np.ones(len(alone)), np.zeros(len(alone)), 1.0
    more = np.asarray(np.linalg.lstsq(alone.T, -rest)[0], np.float64)
    after = rest + more @ alone
    square = float(after @ after) / free
    chance = fdtrc(len(alone), free, float(rest @ rest - after @ after) / len(alone) / square)
    room = stdtrit(free, 0.5 + confidence / 2)
    errors = room * np.sqrt(square * np.diagonal(np.linalg.pinv(alone @ alone.T)))
    return 1 + more, errors, float(chance)
