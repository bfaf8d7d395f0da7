"""Notes on a fit, their weights, and those that its residuals give reason for.

The heaviest note decides the status of a fit: ok, doubtful or rejected (`compute_status`).
Residuals are tested for white noise (`biogrip.judging.whiteness`), each test at the level
`FALSE_ALARM`. A step that explains the others is named in their place. Noise that grows
with the rotation is told first, and the other tests are of what it leaves.

What is correlated beyond chance (`CERTAIN_MISFIT`) and larger than the scatter of neighbouring
readings may be noise all the same, if it is correlated for a short time (`has_fast_noise`). Else it
is misfit. A misfit of 2 % of the peak or more rejects the fit. With a smaller one limits count
independent residuals only: the fit is good to so much of the peak, which is doubtful, not wrong. A
noise model that is correlated for too long may be misfit, too (`find_slow_misfit`).

What is read is the sum of what each level that was held causes. Of a linear sample all have one
gain, which its stiffnesses take; of one that stiffens or softens, each level has its own, which one
test tells (`notes_on_gains`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.special import chdtr, chdtrc, fdtrc, stdtrit

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray
from biogrip.digits import counted, p_value, plain, with_limits
from biogrip.fit.any_sample import fit_any_sample
from biogrip.fit.trace_noise import (
    NoiseModel,
    absorbed,
    compare_extremes,
    compute_growth,
    outliers_of,
)
from biogrip.judging import whiteness
from biogrip.judging.likelihood import Likelihood
from biogrip.physics.noise import ROOT_12, estimate_noise, without
from biogrip.physics.protocol import Course, superposed
from biogrip.physics.residuals import Residuals

HARMLESS, DOUBT, REJECTION = "harmless", "doubt", "rejection"
"""Weights of a note, in ascending order."""

OK, DOUBTFUL, REJECTED = "ok", "doubtful", "rejected"
"""Status of a fit by the heaviest of its notes."""

ROUNDED, RING, NOT_LINEAR, SET_UP = "rounded", "ring", "not linear", "set-up"
"""What notes are about that others depend on; the set-up is a start, a zero or a contact."""

_STATUS = {HARMLESS: OK, DOUBT: DOUBTFUL, REJECTION: REJECTED}
_WEIGHTS = tuple(_STATUS)


@dataclass(frozen=True)
class Note:
    """A sentence about a fit, with its weight."""

    weight: str
    """`HARMLESS`: the results hold. `DOUBT`: they may not. `REJECTION`: they do not."""
    text: str
    """The sentence."""
    about: str = ""
    """`ROUNDED`, `RING`, `NOT_LINEAR` or `SET_UP`, if it is about that."""


def compute_status(notes: Sequence[Note]) -> str:
    """Return the status of a fit by the heaviest of its notes."""
    weights = {note.weight for note in notes}
    return _STATUS[max(weights, key=_WEIGHTS.index, default=HARMLESS)]


def order_notes(notes: Sequence[Note]) -> list[Note]:
    """Order notes by descending weight, and else as given."""
    return sorted(notes, key=lambda note: -_WEIGHTS.index(note.weight))


def find_reasons(notes: Sequence[Note]) -> list[str]:
    """Return the texts of the notes that decide a status which is not ok."""
    status = compute_status(notes)
    return [note.text for note in notes if _STATUS[note.weight] == status != OK]


# Of more readings no basis is formed: what a fit absorbs of so many is nothing.
MANY = 100_000
# Most outliers that are named.
_NAMED = 5


FindNotes = Callable[[], list[Note]]
"""Function that tests what a fit leaves: doubts about it and about the noise that was given."""


@dataclass(frozen=True)
class _Left:
    """Residuals, over the growth of the noise, and what tests of them have in common."""

    likelihood: Likelihood
    growth: Array
    """How the noise grows with the reading, (n_samples,)."""
    struck: BoolArray
    """True for outliers, (n_samples,)."""
    bulk: Array
    """Residuals of the other readings."""
    basis: Array
    """What the fit absorbs of these, orthonormal."""
    scale: float
    """Standard deviation of the noise."""

    @cached_property
    def times(self) -> float:
        """Size of what is left over that of the noise."""
        return float(np.sqrt(np.mean(self.bulk**2))) / self.scale

    @cached_property
    def correlation(self) -> tuple[float, float]:
        """Correlation of neighbours, and its chance."""
        return whiteness.correlated(self.bulk, self.basis)


def examine_residuals(likelihood: Likelihood) -> tuple[Likelihood, FindNotes]:
    """Tell what the best fit of a trace leaves: noise, or misfit, for which limits may allow.

    Returns the likelihood that these limits have, and what finds the notes.
    """
    residuals, misfit = likelihood.problem.residuals, likelihood.misfit
    if misfit < levels.UNRESOLVED * residuals.peak:
        return likelihood, list
    if residuals.samples > MANY:
        residual, slopes = residuals.left(likelihood.best), np.zeros((0, residuals.samples))
    else:
        residual, slopes = residuals(likelihood.best)
    rounding = residuals.trace.rounding
    least = min(levels.NOISE_FREE * likelihood.noise_sd, levels.NOISE_FREE_OF_PEAK * residuals.peak)
    if misfit < least and estimate_noise(residual, rounding) < levels.NO_SCATTER * misfit:
        return likelihood, list
    growth = compute_growth(residual, residuals.response(likelihood.best), rounding)
    directions = np.vstack((slopes, residuals.trace.condensed.taken)) if len(slopes) else slopes
    basis = absorbed(directions / growth)
    standard = residual / growth
    if np.ptp(growth):
        # What a fit with these weights would leave, to first order.
        standard = without(basis, standard)
    struck = outliers_of(whiteness.by_leverage(standard, basis), rounding)
    if whiteness.far_out(standard, struck, basis, residuals.freedom) >= levels.FALSE_ALARM:
        struck[:] = False
    # Outliers are noise of the recording: they make a fit doubtful, not wrong.
    basis = absorbed(basis[:, ~struck]) if struck.any() else basis
    scale = residuals.noise_scale
    if np.ptp(growth) or likelihood.freedom == np.inf:
        scale = max(scale, estimate_noise(standard, rounding))
    left = _Left(likelihood, growth, struck, standard[~struck], basis, scale)
    certain = left.correlation[1] < levels.CERTAIN_MISFIT and left.times > levels.TOO_MUCH
    found, worth, find_notes = None, None, _find_notes
    if certain:
        found, worth = _misfit(left, residual)
    small = misfit <= levels.TOO_MUCH * rounding / ROOT_12 and np.max(np.abs(residual)) <= rounding
    small &= not residuals.course.sweeps and not residuals.coloured
    if small and likelihood.freedom < np.inf:
        # All errors of one reading count as one, of which a fit may absorb most.
        _, counts = np.unique(residuals.trace.readings, return_counts=True)
        share = min(misfit * ROOT_12 / rounding, 1.0) ** 2
        worth = share * residuals.samples**2 / float(np.sum(counts**2)), residuals.samples
        find_notes = _find_notes_of_rounding
    return likelihood.as_misfit(*worth) if worth else likelihood, partial(find_notes, left, found)


def _find_notes(left: _Left, misfit: Note | None = None) -> list[Note]:
    """Return notes on what a fit leaves, if it is misfit with the note on that."""
    likelihood, struck = left.likelihood, left.struck
    residuals = likelihood.problem.residuals
    if misfit:
        notes = [misfit]
        # What a misfit has in a row are no outliers.
        struck = struck & ~(np.convolve(struck, (1, 0, 1), "same") > 0)
    else:
        notes = list(_about_given(likelihood, left.bulk))
        if compute_status(notes) == DOUBTFUL:
            # With the wrong noise or unit, nothing else is known.
            return notes
    doubts = [*_about_growth(left), *_about_outliers(residuals, struck)]
    in_time = not residuals.course.sweeps
    # Outliers distort a fit, so that all that it leaves is correlated.
    if not left.struck.any():
        colour = list(_about_colour(left))
        changes = _about_changes(left, coloured=bool(colour))
        # The misfit is said once.
        doubts += changes[-1:] if misfit else changes or colour
    notes += (Note(DOUBT, doubt) for doubt in doubts)
    if notes and in_time and not residuals.coloured and compute_status(notes) == DOUBTFUL:
        how = "If the set-up is right, measurement.noise_model: coloured, or --noise-model coloured"
        notes.append(Note(HARMLESS, f"{how}, gives intervals that allow for such noise."))
    return notes


def _find_notes_of_rounding(left: _Left, misfit: Note | None = None) -> list[Note]:
    """Return the note on errors of rounding in place of those of `_find_notes`."""
    residuals = left.likelihood.problem.residuals
    size = f"{plain(residuals.trace.rounding, 2)} {residuals.instrument.read.unit}".rstrip()
    text = (
        f"The readings are rounded to steps of {size}, more than their noise, or are cut off "
        "there. The limits allow for one error wherever a reading is the same."
    )
    status = compute_status(_find_notes(left, misfit))
    return [Note(HARMLESS if status == OK else DOUBT, text, ROUNDED)]


def _misfit(left: _Left, residual: Array) -> tuple[Note, tuple[float, float] | None]:
    """Return the note on a misfit, and its worth and freedom if limits allow for it."""
    residuals, times, scale = left.likelihood.problem.residuals, left.times, left.scale
    more = plain(times, 2)
    share = scale * float(np.sqrt(times**2 - 1)) / residuals.peak
    relative = residuals.course.sweeps and residuals.coloured
    of_peak = f"{plain(100 * share, 2)} % of the {'moduli' if relative else 'peak'}"
    suspects = name_suspects(residuals, times, scale)
    misfit = whiteness.as_correlated(left.bulk, left.basis)
    if not residuals.course.sweeps and has_fast_noise(residuals, residual, misfit[0]):
        text = (
            f"The RMS residual is {more} times the noise of neighbouring readings, as of noise "
            "that is correlated for a short time."
        )
    elif share < levels.FAR_OFF:
        text = (
            f"The fit is good to {of_peak}; the rest, {more} times the noise of the trace, is not "
            f"noise: {suspects}."
        )
    else:
        text = (
            f"The RMS residual is {more} times the noise of the trace, and {of_peak}: {suspects}."
        )
        return Note(REJECTION, text), None
    if misfit[0] < 1:
        slow = "broad as the sweep" if residuals.course.sweeps else "slow as the trace"
        text += f" It is as {slow}, which the limits allow for."
    else:
        counted_as = f"{plain(misfit[0], 2)} independent ones"
        text += f" The limits count the {len(left.bulk)} residuals as {counted_as}."
    return Note(DOUBT, text), misfit


def name_suspects(residuals: Residuals, times: float, scale: float) -> str:
    """Return what is wrong where a misfit is some times the noise, by what any sample leaves."""
    fit = fit_any_sample(residuals)
    other, left = fit.sd / scale, fit.left_of_readings()
    least = plain(other, 2)
    gives = "gives this trace under this protocol"
    culprits = "load, clock, contact, drift, or a sample that is not linear"
    if residuals.course.sweeps:
        which = "both" if residuals.instrument.partners else "these"
        gives = f"has {which} moduli (Kramers-Kronig)"
        _, culprits = whiteness.find_inertia(residuals, *left)
    noises = "the noise" if least == "1" else f"{least} times the noise"
    inadequate = f"the model is not adequate, as a linear sample of another kind fits to {noises}"
    if whiteness.correlated(*left)[1] >= levels.FALSE_ALARM:
        if other > levels.TOO_MUCH and times < other * levels.TOO_MUCH:
            place = residuals.course.place(residuals.trace.time_s[np.argmax(np.abs(left[0]))])
            furthest = f"single readings are far off, the furthest at {place}"
            return f"{furthest}, as no linear sample leaves less than {noises}"
        return inadequate
    if other * levels.TOO_MUCH < times:
        return f"{inadequate}; the rest comes from {culprits}"
    nearest = f"the nearest leaves {least} times the noise, and that is correlated"
    return f"no linear sample {gives}; {nearest}: {culprits}"


def _about_growth(left: _Left) -> Iterator[str]:
    """Yield a sentence on noise that grows with what is read."""
    times, residuals = compare_extremes(left.growth), left.likelihood.problem.residuals
    if times < levels.TOO_MUCH:
        return
    instrument = residuals.instrument
    read = instrument.read.name
    many = f"{read}s" if instrument.has_jaws else "readings"
    text = (
        f"The noise grows with the {read}: it is {plain(times, 2)} times as large for the "
        f"largest tenth of the {many} as for the smallest, and neither the weights of the readings "
        "nor the intervals allow for that."
    )
    # Of noise that grows little the share is hardly known.
    if not residuals.coloured and times > levels.CLEARLY:
        share = left.scale * left.growth / np.abs(residuals.response(left.likelihood.best))
        text += f" Readings are weighted by --noise-share {plain(np.median(share), 2)}."
    yield text


def _about_colour(left: _Left) -> Iterator[str]:
    """Yield a sentence for each test of white noise that residuals fail."""
    residual, basis, (correlation, chance) = left.bulk, left.basis, left.correlation
    suspects = partial(name_suspects, left.likelihood.problem.residuals, left.times, left.scale)
    if chance < levels.FALSE_ALARM:
        yield (
            f"Neighbouring residuals are correlated ({correlation:.2f}; white noise would give "
            f"0 ± {1 / np.sqrt(len(residual)):.2f}): the intervals are too narrow, or {suspects()}."
        )
    # Nothing wanders over places of two moduli.
    sweeps = left.likelihood.problem.residuals.course.sweeps
    chance = 1.0 if sweeps else whiteness.wandering(residual, basis)
    if chance < levels.FALSE_ALARM:
        yield (
            "The residual wanders: its means over stretches of the trace scatter more than those "
            f"of white noise ({p_value(chance)}). It contains something slow that the model "
            "lacks, perhaps a drift of the instrument: the intervals are too narrow."
        )


def _about_changes(left: _Left, *, coloured: bool) -> list[str]:
    """Return a sentence on a change within the trace, if it explains what its fit leaves."""
    residuals, residual, basis = left.likelihood.problem.residuals, left.bulk, left.basis
    trace, growth = residuals.trace, left.growth
    if residuals.course.sweeps:
        is_inertia, cause = whiteness.find_inertia(residuals, residual, basis, growth)
        return [f"The fit leaves what is of {cause}."] if is_inertia and not coloured else []
    step = whiteness.find_step(residual, basis, lambda it: trace.condensed.cleared(it) / growth)
    if step is None or step.chance >= levels.FALSE_ALARM:
        return []
    # What a fit with a step leaves has to be white noise, if what it leaves without one is not.
    rest = step.left, step.basis
    chance = min(whiteness.correlated(*rest)[1], whiteness.wandering(*rest)) if coloured else 1.0
    if chance < levels.FALSE_ALARM:
        return []
    before_s, after_s = trace.time_s[step.before - 1 : step.before + 1]
    size = f"{plain(-step.size, 2)} {residuals.instrument.read.unit}".rstrip()
    what = f"readings change at about {plain(0.5 * (before_s + after_s))} s"
    away = "what is before or after (--from, --until)"
    if step.before == 1:
        what = f"first reading ({plain(before_s)} s) does not fit the rest"
        away = "that reading (--from)"
    by = f"as by a step of {size}: white noise hardly does that ({p_value(step.chance)})"
    said = [f"The {what}, {by}, and the values may be far off. Leave out {away}."]
    if left.times > levels.CLEARLY:
        least = plain(fit_any_sample(residuals).sd / left.scale, 2)
        rms = f"The RMS residual is {plain(left.times, 2)} times the noise of the trace"
        said.insert(0, f"{rms}; the closest linear sample leaves {least} times the noise.")
    return said


def _about_outliers(residuals: Residuals, struck: BoolArray) -> Iterator[str]:
    """Yield a sentence that names outliers by their times."""
    far = residuals.trace.time_s[struck]
    if len(far):
        named = ", ".join(map(residuals.course.place, far[:_NAMED]))
        more = f" and {len(far) - _NAMED} more" if len(far) > _NAMED else ""
        of = "" if residuals.course.sweeps else " of the protocol"
        yield (
            f"{counted(len(far), 'outlier')}, at {named}{more}{of}: too far from the fit for the "
            f"noise of the others. Outliers distort the fit."
        )


def _about_given(likelihood: Likelihood, residual: Array) -> Iterator[Note]:
    """Yield a note if the noise that was given is refuted by residuals, in a chi-squared test."""
    if likelihood.freedom < np.inf:
        return
    residuals = likelihood.problem.residuals
    lost = residuals.samples - residuals.free + len(likelihood.best)
    left = max(len(residual) - lost, 1)
    chi_squared = float(residual @ residual) / likelihood.noise_sd**2
    share = float(np.sqrt(chi_squared / left))
    if share < levels.TOO_LITTLE and float(chdtr(left, chi_squared)) < levels.FALSE_ALARM:
        weight, so = DOUBT, "its value or unit is not the right one"
    elif share > 1 and float(chdtrc(left, chi_squared)) < levels.FALSE_ALARM:
        weight, so = HARMLESS, "limits are too narrow by that"
        if share > levels.TOO_MUCH:
            suspects = name_suspects(residuals, share, likelihood.noise_sd)
            weight, so = DOUBT, f"its value or unit is not the right one, or {suspects}"
    else:
        return
    yield Note(
        weight, f"What the fit leaves is {plain(share, 3)} times the noise that was given: {so}."
    )


# Stretches of `IN_ONE_STRETCH`.
_SLOW_STRETCHES = 20


def find_slow_misfit(
    noise_model: NoiseModel,
    errors: tuple[float, float],
    duration_s: float,
    share_of_peak: float,
    suspects: Callable[[], str],
) -> Note | None:
    """Return a note if the slow parts of a noise model may be misfit.

    Its correlation time and the odds of its walk count less `SURE` times the `errors` of their
    logarithms. `share_of_peak` is the standard deviation of those parts over the largest response.
    """
    share, time_s = noise_model.ar1, noise_model.time_s
    certain = np.exp(-levels.SURE * np.array(errors))
    least_s = time_s * float(certain[0])
    slow = share > levels.MOSTLY and least_s > levels.SLOW * duration_s
    slow |= share > levels.NOTICEABLE and least_s > levels.LONG * duration_s
    what = f"is correlated over {plain(time_s, 2)} s of a trace of {plain(duration_s)} s"
    walk = noise_model.walk
    certain_walk = certain[1] * walk / (1 - walk + certain[1] * walk)
    if certain_walk > levels.NOTICEABLE and walk > share:
        slow, share, what = True, walk, "walks at random"
    if not slow:
        return None
    return Note(
        DOUBT,
        f"What the fit leaves {what}, {100 * share:.0f} % of its variance and "
        f"{plain(100 * share_of_peak, 2)} % of the peak. The limits allow for that; but it may be "
        f"misfit, and then {suspects()}.",
    )


def has_fast_noise(residuals: Residuals, residual: Array, independent: float) -> bool:
    """Return True if what a fit leaves is stationary noise that is correlated for a short time.

    It counts as so many independent residuals: see `whiteness.as_correlated`.
    """
    stretches = np.array_split(np.square(residual), min(_SLOW_STRETCHES, len(residual)))
    largest = max(float(np.sum(stretch)) for stretch in stretches)
    stationary = largest <= levels.IN_ONE_STRETCH * float(residual @ residual)
    # Neighbours of such noise differ by a root of its readings less than all of it scatters.
    scatter = np.sqrt(np.mean(residual**2)) / max(residuals.noise_scale, 1e-300)
    rough = scatter < levels.SMOOTH * np.sqrt(max(levels.SLOW * len(residual), 1.0))
    fast = independent > 0.5 / levels.SLOW
    return stationary and bool(rough) and fast and not residuals.coloured


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
    starts = [0]
    for place, phase in enumerate(order.tolist()):
        if abs(heights[phase] - heights[order[starts[-1]]]) >= levels.HELD * abs(heights[phase]):
            starts.append(place)
    groups = np.split(order, starts[1:]) if len(order) else []
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
