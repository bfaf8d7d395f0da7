"""When the protocol of a recorded trace starts: what is said of it, and limits that allow for it.

`notes_on_start` tests a trace of which nothing says when its protocol starts: if it begins before
that, or so long after it that the clock may be another's. It says what a tare would change, and a
ramp that ends before the first reading.

`profile_over_onset` widens limits for an onset that is fitted along. A quantity's profile is the
lowest of those for single onsets, each in its increase over the best fit with the best onset. So a
limit is the outermost of the limits for single onsets, with the threshold less the increase that
the onset itself costs. Onsets are taken all over their own confidence interval, closer at its ends,
as on a circle: with nine the limits of an elliptic region are short by at most five per cent. Where
a rotation jumps between two readings, sums of squares have kinks as a function of the onset, on
which a linear approximation fails.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import chdtri, stdtrit

from biogrip.arrays import Array
from biogrip.digits import instant, plain
from biogrip.fit.experiment import Experiment
from biogrip.fit.fitted_onset import (
    OnsetFit,
    OnsetFits,
    begins_constant,
    estimate_onset,
    spacing_at,
)
from biogrip.fit.least_squares import fit_from
from biogrip.judging.diagnosis import RING, Diagnosis
from biogrip.judging.doubts import DOUBT, HARMLESS, REJECTED, REJECTION, Note
from biogrip.judging.likelihood import Likelihood, compute_fall, make_likelihood
from biogrip.judging.profiles import Profile, compute_profiles
from biogrip.judging.verdicts import Finding
from biogrip.physics.protocol import ramp
from biogrip.physics.whitening import estimate_noise

# So that correlated noise does not look like a late onset; and level of other tests.
_FALSE_ALARM, _AS_GOOD = 1e-9, 1e-3
# Intervals from a change to the first reading of a trace that is cut off, fewest readings by which
# their growth is known, and its powers of the time if readings were spaced from the change on.
_DELAYED, _FEWEST_APART, _PLANNED = 10.0, 3, (0.5, 1.5)
# Starts that are compared, the last so much of an interval before the first reading; and how
# unlikely is what fits worse.
_STARTS, _NEAREST, _UNLIKE = 40, 0.01, 0.05
# Change of a recorded load that is held, as a share of it.
_HELD = 0.1
# Misfit over the scatter of neighbours that a right fit does not exceed.
_WHITE = 1.5
_SHARES = np.sin(np.pi * np.arange(1, 5) / 10)
# First change of the onset over how far readings are apart there, and most of it as a share of the
# trace.
_FIRST_STEP, _MOST = 1 / 64, 0.25
# Share of that to which an onset has to be known for readings to be of a ring after it.
_TOLD = 0.1
# Accuracy of an end of the onset's interval, as a share of its distance.
_ACCURACY = 0.01


def notes_on_start(
    experiment: Experiment,
    time_s: Array,
    readings: Array,
    diagnosis: Diagnosis,
) -> list[Note]:
    """Return notes on another start of the protocol than at 0, on a tare, and on a hidden ramp.

    A trace that begins constant, and fits far better with a later start, tells nothing of the
    sample under the protocol as given, whatever noise model absorbs the misfit: the test is a
    likelihood ratio. One that begins long after its first step, as if cut off there, may have been
    recorded on another clock: then it is fitted with that step just before it.

    Parameters
    ----------
    experiment
        Assumptions of the identification, with a protocol that starts at 0.
    time_s, readings : (n_samples,)
        The trace, times ascending.
    diagnosis
        That of the best fit with that protocol.
    """
    may_be_late = not experiment.start_given
    fits, ramped = OnsetFits(experiment, time_s, readings), _with_ramp(experiment, time_s)
    notes: list[Note] = []
    if may_be_late and ramped and is_cut_off(time_s):
        notes += _about_clock(fits, diagnosis)
    elif begins_constant(time_s, readings):
        # A constant that is not zero is an offset, with which the onset would be biased.
        free, onset_s = replace(experiment, offset=True), 0.0
        if may_be_late or experiment.fit_start:
            onset_s = estimate_onset(experiment, time_s, readings)
        if begins_constant(time_s, readings, onset_s):
            if may_be_late:
                notes += _about_late_onset(replace(fits, experiment=free), diagnosis, onset_s)
            if not experiment.offset and (notes or not may_be_late):
                notes += _about_tare(fits, diagnosis, onset_s)
    if diagnosis.status != REJECTED and ramped and not notes:
        notes += _about_ramp(fits, diagnosis, ramped)
    return notes


def _about_late_onset(fits: OnsetFits, diagnosis: Diagnosis, guess_s: float) -> Iterator[Note]:
    """Yield a note if a trace is constant up to an onset, with which it fits far better."""
    trace, noise_sd = (fits.time_s, fits.readings), fits.experiment.noise_sd
    found, given = fits.best(guess_s), fits.at(0.0, diagnosis.likelihood.best)
    fall = compute_fall(len(trace[0]), given.misfit, found.misfit, noise_sd)
    if fall < chdtri(1, _FALSE_ALARM) or not begins_constant(*trace, found.onset_s):
        return
    fit = fits.posed(found.onset_s), found.log_parameters, found.misfit
    likelihood = make_likelihood(*fit, confidence=diagnosis.likelihood.confidence)
    limits = onset_limits(likelihood, fits.time_s - found.onset_s)
    when = instant(found.onset_s, *(found.onset_s + end_s for end_s in limits))
    yield Note(
        REJECTION,
        f"The trace is constant until {when} of its clock, and fits far better if the protocol "
        f"starts there (χ² falls by {plain(fall)}). If it does, say --start fit "
        "(measurement.fit_start), which allows for its uncertainty, or when it was, if that is "
        "known (--start, measurement.start_s).",
    )


def _about_tare(fits: OnsetFits, diagnosis: Diagnosis, onset_s: float) -> Iterator[Note]:
    """Yield a note if the readings before an onset are not zero, by a t test."""
    before = fits.readings[fits.time_s < onset_s][:-1]
    mean, error = float(np.mean(before)), float(np.std(before, ddof=1)) / np.sqrt(len(before))
    if abs(mean) > error * stdtrit(len(before) - 1, 1 - _AS_GOOD / 2):
        unit = f" {fits.experiment.instrument.read.unit}".rstrip()
        yield Note(
            REJECTION if diagnosis.status == REJECTED else DOUBT,
            f"The {len(before)} readings before the start are constant, but {plain(mean)}{unit} "
            "and not 0: if that is the zero of the instrument, say --offset (measurement.offset).",
        )


def is_cut_off(time_s: Array) -> bool:
    """Return True if readings begin long after 0, (n_samples,), as if there had been earlier ones.

    They begin more than ten of their first intervals after it, and these do not grow in proportion
    to the time, as of readings that someone spaced from 0 on.
    """
    few = max(_FEWEST_APART, len(time_s) // 10)
    first_s, last_s = (
        float(np.ptp(ends)) / few for ends in (time_s[: few + 1], time_s[-few - 1 :])
    )
    if time_s[0] <= _DELAYED * first_s:
        return False
    growth = np.log(last_s / first_s) / np.log(time_s[-1 - few] / time_s[0])
    return not _PLANNED[0] < growth < _PLANNED[1]


def _about_clock(fits: OnsetFits, diagnosis: Diagnosis) -> Iterator[Note]:
    """Yield a note if a trace may be on another clock, with its step some time before it."""
    time_s, best = fits.time_s, diagnosis.likelihood.best
    later_s, given = 2 * time_s[0] - time_s[1], fits.at(0.0, best)
    rejected = diagnosis.status == REJECTED
    level, other = chdtri(1, _FALSE_ALARM), given
    if not rejected:
        other = fits.at(later_s, best)
    if rejected or compute_fall(len(time_s), given.misfit, other.misfit, None) > level:
        other = fits.best(later_s)
    alike = _as_good(fits, other)
    starts_s = [min(fit.onset_s for fit in alike), max(fit.onset_s for fit in alike)]
    told = starts_s[1] - starts_s[0] < time_s[1] - time_s[0]
    when = f"at {other.onset_s:.4g} s" if told else "at any time from {:.4g} to {:.4g} s"
    fall = compute_fall(len(time_s), given.misfit, other.misfit, None)
    found = ""
    white = other.misfit < _WHITE * estimate_noise(fits.readings)
    if fall > level and 0 < other.onset_s < time_s[0] and white:
        found = f"the fit is far better (χ² falls by {plain(fall)})"
        found += "" if told else f", and values hang on it: {_moved(diagnosis, None, alike)}"
    elif not rejected and fall > -chdtri(1, _AS_GOOD):
        moved = _moved(diagnosis, given, alike, 0.5)
        found = f"the trace fits as well: {moved}" if moved else ""
    if found:
        yield Note(
            REJECTION if rejected else DOUBT,
            f"The readings begin {plain(time_s[0])} s after the step of the protocol. If it starts "
            f"{when.format(*starts_s)} of the clock, {found}. Say when the protocol started "
            "(--start, measurement.start_s), be it at 0, or what came before (--config, protocol).",
        )


def _as_good(fits: OnsetFits, best: OnsetFit) -> list[OnsetFit]:
    """Return the best fit and others, of onsets from 0 to the first reading, that are as good.

    Each begins with the values of its neighbour.
    """
    first_s, interval_s = fits.time_s[0], fits.time_s[1] - fits.time_s[0]
    onsets_s = first_s - np.geomspace(_NEAREST * interval_s, first_s, _STARTS)
    found = [best]
    for side in (onsets_s[onsets_s < best.onset_s], onsets_s[onsets_s > best.onset_s][::-1]):
        near = best
        for onset_s in side.tolist():
            near = fits.at(onset_s, near.log_parameters)
            if compute_fall(len(fits.time_s), near.misfit, best.misfit, None) > chdtri(1, _UNLIKE):
                break
            found.append(near)
    return found


def _moved(
    diagnosis: Diagnosis, given: OnsetFit | None, others: Sequence[OnsetFit], widths: float = 0.0
) -> str:
    """Name what other fits move beyond its limits, by more than so many of their widths.

    Without a given fit to compare with, for one that is rejected has no limits, all is named.
    """
    x, said = diagnosis.likelihood.best, []
    for each in diagnosis.findings:
        shift = x - given.log_parameters if given else 0.0
        moved = [other.log_parameters + shift for other in others]
        logs, before = [each.quantity.log(own) for own in moved], each.quantity.log(x)
        width = np.log(each.high / each.low) if each.high and each.low else 0.0
        far = [
            not each.allows(own) and abs(after - before) > widths * width
            for own, after in zip(moved, logs, strict=True)
        ]
        if given is None or any(far):
            ends = dict.fromkeys(plain(float(np.exp(end))) for end in (min(logs), max(logs)))
            unit = f" {each.quantity.unit}".rstrip()
            said.append(f"{each.quantity.label} would be {' to '.join(ends)}{unit}")
    return "; ".join(said)


def _about_ramp(fits: OnsetFits, diagnosis: Diagnosis, ramped: Experiment) -> Iterator[Note]:
    """Yield a note if a ramp up to the first reading, or one as long before, moves a value.

    That is by the width of its limits or more.
    """
    best, delay_s = diagnosis.likelihood.best, float(fits.time_s[0])
    given, others = fits.at(0.0, best), replace(fits, experiment=ramped)
    ends = {f"with the first reading, at {plain(delay_s)} s": 0.0}
    if ramped.record is None and len(fits.experiment.phases) == 1:
        ends["at 0, and was as long"] = -delay_s
    moved = {
        end: said
        for end, onset_s in ends.items()
        if (said := _moved(diagnosis, given, [others.at(onset_s, best)], 1.0))
    }
    if moved:
        said = "; or if it ends ".join(f"{end}: {values}" for end, values in moved.items())
        yield Note(
            HARMLESS,
            f"If the load was no step but a ramp that ends {said}. A ramp is given by a protocol "
            "(--config), or as recorded (--load).",
        )


def _with_ramp(experiment: Experiment, time_s: Array) -> Experiment | None:
    """Return one with a ramp up to the first reading, none but for a hold until after that."""
    delay_s, record = float(time_s[0]), experiment.record
    if record is not None:
        later = record[record[:, 0] > delay_s]
        level, before = record[0, 1], record[: len(record) - len(later), 1]
        if delay_s <= 0 or not level or np.ptp(before) > _HELD * abs(level):
            return None
        return replace(experiment, record=np.vstack(([0.0, 0.0], [delay_s, level], later)))
    first, *rest = experiment.phases
    if not 0 < delay_s < first.duration_s or first.slope or first.curvature:
        return None
    phases = (
        ramp(delay_s, 0.0, first.level),
        replace(first, duration_s=first.duration_s - delay_s),
        *rest,
    )
    return replace(experiment, phases=phases)


def onset_limits(best: Likelihood, time_s: Array) -> tuple[float, float]:
    """Return the limits of an onset, in s from it, for times from it, (n_samples,)."""
    step_s = _FIRST_STEP * spacing_at(time_s, 0.0)
    return _end(best, -step_s), _end(best, step_s)


def profile_over_onset(
    diagnosis: Diagnosis, time_s: Array
) -> tuple[Diagnosis, tuple[float, float]]:
    """Return a diagnosis whose limits allow for the uncertainty of a fitted onset, and its limits.

    Parameters
    ----------
    diagnosis
        Diagnosis for the best onset.
    time_s : (n_samples,)
        Times from that onset, ascending.
    """
    best = diagnosis.likelihood
    ends = onset_limits(best, time_s)
    if ends[1] - ends[0] > _TOLD * spacing_at(time_s, 0.0):
        # Nothing tells how soon after a change of the torque a reading came.
        notes = [note for note in diagnosis.notes if not note.text.startswith(RING)]
        diagnosis = replace(diagnosis, notes=notes)
    others = [_at(best, float(change_s)) for end in ends for change_s in end * _SHARES]
    others = [each for each in others if each.threshold > 0]
    if not others:
        return diagnosis, ends
    found = [*diagnosis.findings, *(trade.finding for trade in diagnosis.trades)]
    every = compute_profiles(others, [finding.quantity for finding in found], smooth=False)
    costs = [best.threshold - each.threshold for each in others]
    by_quantity = zip(*every, strict=True)
    merged = [_merged(*each, costs) for each in zip(found, by_quantity, strict=True)]
    kept = len(diagnosis.findings)
    pairs = zip(diagnosis.trades, merged[kept:], strict=True)
    trades = [replace(trade, finding=finding) for trade, finding in pairs]
    return replace(diagnosis, findings=merged[:kept], trades=trades), ends


def _at(best: Likelihood, change_s: float) -> Likelihood:
    """Return the likelihood of an onset that is later by some s, relative to that of the best."""
    problem = best.problem.later(change_s)
    fit = fit_from([problem], best.best)
    misfit = float(fit.misfit[0])
    cost = best.increase(misfit)
    return replace(
        best,
        problem=problem,
        best=fit.x[0],
        misfit=misfit,
        threshold=best.threshold - cost,
        certainty=best.certainty - cost,
    )


def _end(best: Likelihood, step_s: float) -> float:
    """Return the end of the onset's confidence interval on the side of a first step."""
    inside, outside = 0.0, step_s
    most_s = _MOST * best.problem.residuals.duration_s
    while _at(best, outside).threshold > 0:
        if abs(outside) > most_s:
            return outside
        inside, outside = outside, 2 * outside
    accuracy = _ACCURACY * abs(outside)
    return float(brentq(lambda s: _at(best, s).threshold, inside, outside, xtol=accuracy))


def _merged(finding: Finding, profiles: Sequence[Profile], costs: list[float]) -> Finding:
    """Return a finding with the lowest of its profile and of those of other onsets.

    It has no gaps: between two of the onsets nothing is known to be excluded.
    """
    own = finding.profile
    values: Array = np.unique(np.concatenate([p.log_values for p in (own, *profiles)]))
    rows = [
        np.interp(values, profile.log_values, profile.increases + cost)
        for profile, cost in zip((own, *profiles), (0.0, *costs), strict=True)
    ]
    increases: Array = np.min(rows, axis=0)
    ends = [(profile.low, profile.high) for profile in (own, *profiles)]
    lows, highs = ([end for end in side if end is not None] for side in zip(*ends, strict=True))
    return replace(
        finding,
        profile=replace(
            own,
            log_values=values,
            increases=increases,
            low=min(lows) if len(lows) == len(ends) else None,
            high=max(highs) if len(highs) == len(ends) else None,
            gaps=(),
        ),
    )
