"""When the protocol of a recorded trace starts: found, doubted, and allowed for in limits.

`estimate_onset` needs no sample model: of delays on ever finer grids it takes the one with which
any sample's possible responses leave least. `OnsetFits` fits the onset along with a sample. Where a
rotation jumps between two readings, the misfit as a function of the onset has a step at every one:
it is minimised between neighbouring ones, from one interval to the next.

`notes_on_start` tests if a trace begins before its protocol, or so long after it that the clock may
be another's; it says what a ramp before the first reading would change.

`profile_over_onset` takes the lowest of the profiles for single onsets, each in its increase over
the best fit with the best onset. Onsets are taken all over their own confidence interval, closer at
its ends, as on a circle: with seven the limits of an elliptic region are short by at most four per
cent. Linear approximations fail at the kinks.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from scipy.special import chdtri

import biogrip.levels as levels
from biogrip.arrays import Array, IntArray, parts
from biogrip.digits import instant, plain
from biogrip.fit.any_sample import fit_any_sample, fit_responses, spread_lags
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import LeastSquaresSettings, fit_from, identify_many
from biogrip.fit.problem import TraceProblem, silent
from biogrip.fit.trace_noise import absorbed
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import DOUBT, HARMLESS, MANY, REJECTED, REJECTION, RING, Note
from biogrip.judging.likelihood import Likelihood, compute_fall, make_likelihood
from biogrip.judging.profiles import Profile, compute_profiles
from biogrip.judging.verdicts import Finding
from biogrip.physics.modes import lag_course
from biogrip.physics.noise import estimate_noise, nuisance_basis, without
from biogrip.physics.protocol import ramp, spacing_at

_LAGS_A_DECADE = 2
# Delays on the first grid; finer ones have as many between the neighbours of the best.
_DELAYS = 65
# Most readings that an estimate takes of the whole trace, and as many of what the grid spans.
_MOST_READINGS = 2000
# Numbers formed together, which should fit a processor's cache.
_NUMBERS_AT_ONCE = 400_000
# Least share of the protocol that has to be after the onset.
_LEAST_AFTER = 0.02
# Readings after the latest onset, beside one for each parameter.
_MORE_AFTER = 2
_BUDGET = LeastSquaresSettings(candidates=1000, starts=16)
# Most steps of a fit, and intervals that it goes through; smooth intervals around an onset.
_MOST_STEPS, _NEAR = 200, 2
# How far from the ends of an interval an onset stays, as a share of it; least change of a misfit.
_INSIDE, _STILL = 1e-5, 1e-6
# Instants that differ by less, relative to the latest, are one.
_ROUNDING = 1e-14


def estimate_onset(problem: Experiment, time_s: Array, readings: Array) -> float:
    """Estimate from when a trace follows the torque, without a sample model, in s of its clock.

    The trace is (n_samples,), times ascending. One that begins constant may have an offset.
    """
    onset_s, rest = _estimate(problem, time_s, readings, offset=problem.offset)
    if problem.offset or not begins_constant(time_s, readings):
        return onset_s
    # Constant is an instrument with an offset, or a sample that has yielded at once.
    other_s, other = _estimate(problem, time_s, readings, offset=True)
    noise = max(other, (levels.CONSTANT_OF_PEAK * float(np.ptp(readings))) ** 2)
    return other_s if len(time_s) * (rest - other) > levels.OFFSET * noise else onset_s


def _estimate(
    problem: Experiment, time_s: Array, readings: Array, *, offset: bool
) -> tuple[float, float]:
    """Return the onset, and the mean square that is left."""
    torque, last = problem.torque, len(time_s) - 1
    shortest = float(np.min(np.diff(time_s)))
    lags = spread_lags(torque, time_s, _LAGS_A_DECADE)

    def square_sums(onsets_s: Array, some: IntArray) -> list[float]:
        nuisance = nuisance_basis(time_s[some], offset=offset, drift=problem.drift)
        trace, sums = without(nuisance, readings[some]), list[float]()
        for few in parts(len(onsets_s), max(1, _NUMBERS_AT_ONCE // (len(lags) * len(some)))):
            # All at once: one call costs more than its numbers.
            every, place = np.unique(time_s[some] - onsets_s[few, None], return_inverse=True)
            shown, place = lag_course(torque, lags, every), place.reshape(-1, len(some))
            sums += [fit_responses(trace, without(nuisance, shown[:, own]))[1] for own in place]
        return sums

    # A reading at the very onset precedes it: the first one, too, may follow it.
    low = min(time_s[0], max(2 * time_s[0] - time_s[1], time_s[-1] - torque.end_s))
    high = max(time_s[0], time_s[-1] - _LEAST_AFTER * torque.end_s)
    while True:
        onsets = np.linspace(low, high, _DELAYS)
        spanned = np.clip(np.searchsorted(time_s, [low, high]) - [1, 0], 0, last)
        ends = np.linspace([0, spanned[0]], [last, spanned[1]], _MOST_READINGS)
        some = np.unique(ends.astype(np.int64))
        best = int(np.argmin(square_sums(onsets, some)))
        low, high = onsets[max(best - 1, 0)], onsets[min(best + 1, _DELAYS - 1)]
        if high - low < shortest:
            every = np.unique(np.linspace(0, last, _MOST_READINGS).astype(np.int64))
            return float(onsets[best]), square_sums(onsets[[best]], every)[0] / len(every)


def begins_constant(time_s: Array, readings: Array, onset_s: float | None = None) -> bool:
    """Return True if the readings before an onset are constant within the noise of the trace.

    Without an onset, the first few readings are looked at. The last one before it may be on a ramp.
    """
    before = readings[: levels.FEWEST_BEFORE]
    if onset_s is not None:
        before = readings[time_s < onset_s][:-1]
    noise_sd, peak = estimate_noise(readings), float(np.ptp(readings))
    size = max(levels.CONSTANT * noise_sd, levels.CONSTANT_OF_PEAK * peak)
    return len(before) >= levels.FEWEST_BEFORE and bool(np.std(before) < size)


@dataclass(frozen=True)
class OnsetFit:
    """Best fit of a trace for one onset."""

    onset_s: float
    """The onset, on the trace's clock."""
    log_parameters: Array
    """Sample parameters, (n_parameters,)."""
    misfit: float
    """RMS misfit."""


@dataclass(frozen=True)
class OnsetFits:
    """Fits of a trace for given onsets, linear and in white noise."""

    experiment: Experiment
    """Assumptions of the identification."""
    time_s: Array
    """Times, ascending on any clock, (n_samples,)."""
    readings: Array
    """The trace, (n_samples,)."""

    @cached_property
    def _identified(self) -> Experiment:
        return self.experiment.to_identify()

    def posed(self, onset_s: float) -> TraceProblem:
        """Return the problem for an onset."""
        return self._identified.of(self.time_s - onset_s, self.readings)

    def at(self, onset_s: float, near: Array) -> OnsetFit:
        """Fit the sample for an onset by a local fit from log-parameters, (n_parameters,)."""
        fit = fit_from([self.posed(onset_s)], near)
        return OnsetFit(onset_s, fit.x[0], float(fit.misfit[0]))

    def given(self, likelihood: Likelihood) -> OnsetFit:
        """Return the fit for an onset at 0: that of a likelihood if it is in white noise, too."""
        own, best = likelihood.problem.residuals, likelihood.best
        projected = self.posed(0.0).residuals.trace.condensed.nuisance
        if own.coloured or not np.array_equal(own.trace.condensed.nuisance, projected):
            return self.at(0.0, best)
        return OnsetFit(0.0, best, likelihood.misfit)

    @cached_property
    def _latest_s(self) -> float:
        """Latest onset, which leaves readings enough to fit the sample."""
        after = len(self._identified.searched.names) + _MORE_AFTER
        return float(self.time_s[max(len(self.time_s) - after, 0)])

    def best(self, guess_s: float) -> OnsetFit:
        """Fit the onset along, beginning with a guess in s."""
        guess_s = min(guess_s, self._latest_s)
        rngs = [np.random.default_rng(0)]
        (found,) = identify_many([self.posed(guess_s)], _BUDGET, rngs, silent)
        return self.near(OnsetFit(guess_s, np.log(found.parameters), found.misfit))

    def near(self, best: OnsetFit) -> OnsetFit:
        """Fit the onset along near that of another fit, whose misfit is never exceeded.

        It goes on from interval to interval of `_smooth_intervals`, each from the best values of
        the one before, until no neighbour that was not tried has a lower misfit.
        """
        tried = list[tuple[float, float]]()
        for _ in range(_MOST_STEPS):
            ends = [
                (low_s, min(high_s, self._latest_s))
                for low_s, high_s in self._smooth_intervals(best.onset_s)
                if low_s < self._latest_s
            ]
            fits = [self._within(best, *own) for own in ends if own not in tried]
            tried += ends
            found = min([best, *fits], key=lambda fit: fit.misfit)
            if found.misfit >= best.misfit * (1 - _STILL):
                return best
            best = found
        return best

    def _within(self, start: OnsetFit, low_s: float, high_s: float) -> OnsetFit:
        """Fit sample and onset within an interval, from the values of another fit."""
        inside_s = _INSIDE * (high_s - low_s)
        problem, size = self.posed(start.onset_s), start.misfit or 1.0
        # Imported here: loading it takes longer than a short job.
        from scipy.optimize import least_squares

        low, high = (
            np.append(ends, onset_s)
            for ends, onset_s in (
                (problem.low, low_s + inside_s),
                (problem.high, high_s - inside_s),
            )
        )

        def of(x: Array) -> Array:
            return self.posed(x[-1]).residuals.left(x[:-1]) / size

        def slopes(x: Array) -> Array:
            residuals, rows = self.posed(x[-1]).residuals(x[:-1])
            aside_s = inside_s if x[-1] < 0.5 * (low_s + high_s) else -inside_s
            moved = self.posed(x[-1] + aside_s).residuals.left(x[:-1]) - residuals
            return np.vstack((rows, moved / aside_s)).T / size

        first = np.clip(np.append(start.log_parameters, start.onset_s), low, high)
        given = of, first, slopes, (low, high)
        fit = least_squares(*given, x_scale="jac", ftol=_STILL, max_nfev=_MOST_STEPS)
        misfit = size * float(np.sqrt(2 * fit.cost / len(self.time_s)))
        return OnsetFit(float(fit.x[-1]), fit.x[:-1], misfit)

    def _smooth_intervals(self, onset_s: float) -> Iterator[tuple[float, float]]:
        """Yield intervals of onsets around one, in which no reading passes a change of torque."""
        changes_s = self._identified.torque.changes_s
        edges = np.unique(np.subtract.outer(self.time_s, changes_s))
        equal_s = _ROUNDING * max(np.abs(self.time_s).max(), np.abs(changes_s).max())
        edges = edges[np.diff(edges, prepend=-np.inf) > equal_s]
        after = int(np.searchsorted(edges, onset_s))
        if after < _NEAR:
            before_s = max(edges[0] - onset_s, spacing_at(edges, onset_s))
            yield float(edges[0] - _NEAR * before_s), float(edges[0])
        yield from pairwise(edges[max(after - _NEAR, 0) : after + _NEAR].tolist())


# Starts from 0 to the first reading that are tried for a better one.
_BETWEEN = 5
# Starts that are compared, the last so much of an interval before the first reading.
_STARTS, _NEAREST = 40, 0.01
_SHARES = np.sin(np.pi * np.arange(1, 3) / 6)
# First change of the onset over how far readings are apart there, and most of it as a share of the
# trace.
_FIRST_STEP, _MOST = 1 / 64, 0.25
# Start that is earlier by so much of an interval, for differences.
_EARLIER = 0.1
# Newton steps that move a load along the clock, and by how many readings at most; share of squares
# of what moves that is rounding.
_STEPS_OF_CLOCK, _MOST_ROWS, _TOLD = 3, 3.0, 1e-6
# Accuracy of an end of the onset's interval, as a share of its distance.
_ACCURACY = 0.02


def notes_on_start(
    experiment: Experiment,
    time_s: Array,
    readings: Array,
    diagnosis: Diagnosis,
) -> list[Note]:
    """Return notes on another start of the protocol than at 0, and on a ramp.

    A trace that begins constant, and fits far better with a later start, tells nothing of the
    sample under the protocol as given, whatever noise model absorbs the misfit: the test is a
    likelihood ratio. One that begins as if cut off there may be on another clock. Times ascend,
    (n_samples,), and the diagnosis is that of the best fit with a start at 0.
    """
    may_be_late = not experiment.start_given
    fits, ramped = OnsetFits(experiment, time_s, readings), _with_ramp(experiment, time_s)
    notes: list[Note] = []
    if may_be_late and ramped and is_cut_off(time_s):
        notes += _about_clock(fits, diagnosis)
    elif may_be_late and begins_constant(time_s, readings):
        # A constant that is not zero is an offset, with which the onset would be biased.
        free, onset_s = (
            replace(experiment, offset=True),
            estimate_onset(experiment, time_s, readings),
        )
        if begins_constant(time_s, readings, onset_s):
            notes += _about_late_onset(replace(fits, experiment=free), diagnosis, onset_s)
    if diagnosis.status != REJECTED and ramped and not notes:
        notes += _about_ramp(fits, diagnosis, ramped)
    smooth = experiment.record is not None and not experiment.uncertainty.get("steps")
    smooth &= experiment.load_errors is None
    if smooth and not experiment.coloured and len(time_s) <= MANY:
        notes += _about_load(fits, diagnosis)
    return notes


def _about_late_onset(fits: OnsetFits, diagnosis: Diagnosis, guess_s: float) -> Iterator[Note]:
    """Yield a note if a trace is constant up to an onset, with which it fits far better."""
    trace, noise_sd = (fits.time_s, fits.readings), fits.experiment.noise_sd
    given, needed = fits.given(diagnosis.likelihood), chdtri(1, levels.SURELY)
    fall_to = partial(compute_fall, len(trace[0]), given.misfit, noise_sd=noise_sd)
    # Fitted along, a start cannot gain more than any sample, but for what moving it a little does.
    of_any_sample = fit_any_sample(fits.posed(guess_s).residuals).misfit
    if fall_to(of_any_sample) < levels.OF_WHAT_A_START_GAINS * needed:
        return
    found = fits.best(guess_s)
    fall = fall_to(found.misfit)
    if fall < needed or not begins_constant(*trace, found.onset_s):
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


def _about_load(fits: OnsetFits, diagnosis: Diagnosis) -> Iterator[Note]:
    """Yield a note if a recorded load that comes earlier or later, by Newton steps, fits better."""
    given = other = fits.given(diagnosis.likelihood)
    needed, spacing_s = chdtri(1, levels.FALSE_ALARM), spacing_at(fits.time_s, 0.0)
    for _ in range(_STEPS_OF_CLOCK):
        starts_s = other.onset_s, other.onset_s + _EARLIER * spacing_s
        here, later = (fits.posed(start_s).residuals for start_s in starts_s)
        residual, slopes = here(other.log_parameters)
        basis = absorbed(np.vstack((slopes, here.trace.condensed.taken)))
        change = later.left(other.log_parameters) - residual
        moved = without(basis, change)
        told = float(moved @ moved)
        if told <= _TOLD * float(change @ change):
            return
        step = -float(moved @ residual) / told
        if other is given and step**2 * told < needed * given.misfit**2:
            return
        late_s = other.onset_s + step * _EARLIER * spacing_s
        if abs(late_s) > _MOST_ROWS * spacing_s:
            return
        other = fits.at(late_s, other.log_parameters)
    fall_from = partial(compute_fall, len(residual), after=other.misfit)
    fall = fall_from(given.misfit, noise_sd=fits.experiment.noise_sd)
    values = _moved(diagnosis, given, [other], 0.5)
    if fall > needed and values:
        name, late_s = fits.experiment.instrument.controlled.name, other.onset_s
        of_any = fit_any_sample(fits.posed(0.0).residuals).misfit
        alike = fall_from(of_any) <= needed
        yield Note(
            DOUBT,
            f"The {name} seems to be logged {plain(abs(late_s), 2)} s too "
            f"{'early' if late_s > 0 else 'late'}: moved by that, it fits far better (χ² falls by "
            f"{plain(fall)}), and {values}. Correct its times if the logger or a filter delays it."
            f"{' A linear sample of another kind would fit as well.' if alike else ''}",
        )


def is_cut_off(time_s: Array) -> bool:
    """Return True if readings begin long after 0, (n_samples,), as if there had been earlier ones.

    They begin more than ten of their first intervals after it, and these do not grow in proportion
    to the time, as of readings that someone spaced from 0 on.
    """
    few = max(levels.FEWEST_APART, len(time_s) // 10)
    first_s, last_s = (
        float(np.ptp(ends)) / few for ends in (time_s[: few + 1], time_s[-few - 1 :])
    )
    if time_s[0] <= levels.DELAYED * first_s:
        return False
    growth = np.log(last_s / first_s) / np.log(time_s[-1 - few] / time_s[0])
    return not levels.PLANNED[0] < growth < levels.PLANNED[1]


def _about_clock(fits: OnsetFits, diagnosis: Diagnosis) -> Iterator[Note]:
    """Yield a note if a trace may be on another clock, with its step some time before it."""
    time_s, best = fits.time_s, diagnosis.likelihood.best
    later_s, given = 2 * time_s[0] - time_s[1], fits.given(diagnosis.likelihood)
    rejected = diagnosis.status == REJECTED
    level, white_sd = chdtri(1, levels.SURELY), levels.WHITE * estimate_noise(fits.readings)
    tried_s = np.linspace(0.0, later_s, _BETWEEN + 1)[1:].tolist()
    other = min((fits.at(start_s, best) for start_s in tried_s), key=lambda fit: fit.misfit)
    if rejected:
        other = fits.best(later_s)
    elif compute_fall(len(time_s), given.misfit, other.misfit) > level:
        other = fits.near(other)
    alike = _as_good(fits, other)
    starts_s = [min(fit.onset_s for fit in alike), max(fit.onset_s for fit in alike)]
    told = starts_s[1] - starts_s[0] < time_s[1] - time_s[0]
    when = f"at {other.onset_s:.4g} s" if told else "at any time from {:.4g} to {:.4g} s"
    fall = compute_fall(len(time_s), given.misfit, other.misfit)
    found = ""
    if fall > level and 0 < other.onset_s < time_s[0] and other.misfit < white_sd:
        found = f"the fit is far better (χ² falls by {plain(fall)})"
        found += "" if told else f", and values hang on it: {_moved(diagnosis, None, alike)}"
    elif not rejected and fall > -chdtri(1, levels.AS_GOOD):
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
    """Return fits of onsets from 0 to the first reading that are as good as the best, and that."""
    first_s, interval_s = fits.time_s[0], fits.time_s[1] - fits.time_s[0]
    onsets_s = first_s - np.geomspace(_NEAREST * interval_s, first_s, _STARTS)
    found = [best]
    for side in (onsets_s[onsets_s < best.onset_s], onsets_s[onsets_s > best.onset_s][::-1]):
        near = best
        for onset_s in side.tolist():
            near = fits.at(onset_s, near.log_parameters)
            if compute_fall(len(fits.time_s), near.misfit, best.misfit) > chdtri(1, levels.UNLIKE):
                break
            found.append(near)
    return found


def _moved(
    diagnosis: Diagnosis, given: OnsetFit | None, others: Sequence[OnsetFit], widths: float = 0.0
) -> str:
    """Name what other fits move by some widths of its limits; all if none is compared with."""
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
    """Yield a note if a ramp up to the first reading moves a value out of its limits."""
    best, delay_s = diagnosis.likelihood.best, float(fits.time_s[0])
    given = fits.given(diagnosis.likelihood)
    other = replace(fits, experiment=ramped).at(0.0, best)
    said, how = [], "A ramp is given by --ramp DURATION, or as recorded (--load)."
    if moved := _moved(diagnosis, given, [other], 1.0):
        ends = f"ends with the first reading, at {plain(delay_s)} s"
        said.append(f"If the load was no step but a ramp that {ends}: {moved}.")
    if ramped.record is not None:
        how = "Rows of the load before its first one would tell."
    if said:
        yield Note(HARMLESS, " ".join([*said, how]))


def _with_ramp(experiment: Experiment, time_s: Array) -> Experiment | None:
    """Return one with a ramp up to the first reading, none but for a hold until after that."""
    delay_s, record = float(time_s[0]), experiment.record
    if record is not None:
        later = record[record[:, 0] > delay_s]
        level, before = record[0, 1], record[: len(record) - len(later), 1]
        if delay_s <= 0 or not level or np.ptp(before) > levels.HELD * abs(level):
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


def profile_over_onset(diagnosis: Diagnosis, time_s: Array) -> Diagnosis:
    """Return a diagnosis whose limits allow for the onset, with times from it, and its limits."""
    best = diagnosis.likelihood
    ends = onset_limits(best, time_s)
    diagnosis = replace(diagnosis, onset_limits_s=ends)
    if ends[1] - ends[0] > levels.KNOWN_START * spacing_at(time_s, 0.0):
        # Nothing tells how soon after a change of the torque a reading came.
        notes = [note for note in diagnosis.notes if note.about != RING]
        diagnosis = replace(diagnosis, notes=notes)
    others = [_at(best, float(change_s)) for end in ends for change_s in end * _SHARES]
    others = [each for each in others if each.threshold > 0]
    if not others:
        return diagnosis
    found = [*diagnosis.findings, *(trade.finding for trade in diagnosis.trades)]
    every = compute_profiles(others, [finding.quantity for finding in found], smooth=False)
    costs = [best.threshold - each.threshold for each in others]
    by_quantity = zip(*every, strict=True)
    at_ends = [_at(best, end_s).best for end_s in ends]
    merged = [_merged(*each, costs, at_ends) for each in zip(found, by_quantity, strict=True)]
    kept = len(diagnosis.findings)
    pairs = zip(diagnosis.trades, merged[kept:], strict=True)
    trades = [replace(trade, finding=finding) for trade, finding in pairs]
    return replace(diagnosis, findings=merged[:kept], trades=trades)


def _at(best: Likelihood, change_s: float) -> Likelihood:
    """Return the likelihood of an onset that is later by some s, relative to that of the best."""
    problem = replace(best.problem, residuals=best.problem.residuals.later(change_s))
    fit = fit_from([problem], best.best, roughly=True)
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
    from scipy.optimize import brentq

    inside, outside = 0.0, step_s
    most_s = _MOST * best.problem.residuals.duration_s
    while _at(best, outside).threshold > 0:
        if abs(outside) > most_s:
            return outside
        inside, outside = outside, 2 * outside
    accuracy = _ACCURACY * abs(outside)
    return float(brentq(lambda s: _at(best, s).threshold, inside, outside, xtol=accuracy))


def _merged(
    finding: Finding, profiles: Sequence[Profile], costs: list[float], at_ends: list[Array]
) -> Finding:
    """Return a finding with the lowest profile of its own and those of other onsets; no gaps.

    At the ends of the onset's interval nothing but their best fits is within the limits.
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
    fitted = [finding.quantity.log(x) for x in at_ends]
    return replace(
        finding,
        profile=replace(
            own,
            log_values=values,
            increases=increases,
            low=min(*lows, *fitted) if len(lows) == len(ends) else None,
            high=max(*highs, *fitted) if len(highs) == len(ends) else None,
            gaps=(),
        ),
    )
