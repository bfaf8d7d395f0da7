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
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.special import chdtri

import biogrip.levels as levels
from biogrip.arrays import Array, IntArray
from biogrip.digits import instant, plain
from biogrip.fit.any_sample import fit_responses, spread_lags
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import LeastSquaresSettings, fit_from, identify_many
from biogrip.fit.problem import TraceProblem, silent
from biogrip.fit.trace_noise import absorbed
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import DOUBT, HARMLESS, MANY, REJECTED, REJECTION, RING, Note
from biogrip.judging.likelihood import Likelihood, compute_fall, make_likelihood
from biogrip.judging.profiles import Finding, compute_findings
from biogrip.judging.whiteness import is_still
from biogrip.physics.modes import lag_course
from biogrip.physics.noise import estimate_noise, nuisance_basis, without
from biogrip.physics.protocol import evaluate, is_held, spacing_at
from biogrip.physics.residuals import Residuals
from biogrip.physics.response import compute_modes
from biogrip.traces.reader import Recording

_LAGS_A_DECADE = 2
# Delays on the first grid; finer ones have as many between the neighbours of the best.
_DELAYS = 65
# Most readings that an estimate takes of the whole trace, and as many of what the grid spans.
_MOST_READINGS = 2000
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

    def square_sums(onsets_s: Array, chosen: IntArray) -> list[float]:
        nuisance = nuisance_basis(time_s[chosen], offset=offset, drift=problem.drift)
        trace, sums = without(nuisance, readings[chosen]), list[float]()
        for onset_s in onsets_s:
            shown = lag_course(torque, lags, time_s[chosen] - onset_s)
            sums.append(fit_responses(trace, without(nuisance, shown))[1])
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

        low = np.append(problem.low, low_s + inside_s)
        high = np.append(problem.high, high_s - inside_s)

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


# Starts within the limits of a fitted one, from it, over these: as on a circle.
_SHARES = np.sin(np.pi * np.arange(1, 3) / 6)
# First change of the onset over how far readings are apart there, and most of it as a share of the
# trace.
_FIRST_STEP, _MOST = 1 / 64, 0.25
# Start that is earlier by so much of an interval, for differences.
_EARLIER = 0.1
# Most readings by which a load is moved along the clock, and accuracy of that; share of squares of
# what moves that is rounding.
_MOST_ROWS, _ACCURACY_OF_CLOCK, _TOLD = 4.0, 0.01, 1e-6
# Accuracy of an end of the onset's interval, as a share of its distance.
_ACCURACY = 0.02


def notes_on_start(
    recording: Recording, experiment: Experiment, diagnosis: Diagnosis
) -> list[Note]:
    """Return notes on another start of the protocol than at 0, and on a ramp.

    A trace that begins constant, and fits far better with a later start, tells nothing of the
    sample under the protocol as given, whatever noise model absorbs the misfit: the test is a
    likelihood ratio. One that begins as if cut off there may be on another clock. The diagnosis is
    that of the best fit with a start at 0.
    """
    time_s, readings = recording.time_s, recording.readings
    given, notes = experiment.start_given, list[Note]()
    rejected = diagnosis.status == REJECTED
    ramped = _with_ramp(diagnosis.likelihood.problem.residuals)
    if not given and ramped and recording.read.from_s is None and is_cut_off(time_s):
        text = (
            f"The readings begin {plain(time_s[0])} s after the step of the protocol, as if on the "
            "clock of something longer: values hang on when it came. Say when the protocol started "
            "(--start, measurement.start_s), be it at 0, or what came before (--config, protocol)."
        )
        notes.append(Note(REJECTION if rejected else DOUBT, text))
    elif not given and begins_constant(time_s, readings):
        # A constant that is not zero is an offset, with which the onset would be biased.
        free = replace(experiment, offset=True)
        onset_s = estimate_onset(experiment, time_s, readings)
        if begins_constant(time_s, readings, onset_s):
            notes += _about_late_onset(OnsetFits(free, time_s, readings), diagnosis, onset_s)
    if rejected and (how := unsaid_end(recording, experiment)):
        notes.append(Note(REJECTION, f"Under a hold no sample reads that.{how}"))
    if ramped and not rejected and not notes:
        notes += _about_ramp(diagnosis, ramped, recorded=experiment.record is not None)
    followed = experiment.record is not None and not experiment.uncertainty.get("steps")
    known = followed and experiment.load_errors is None
    if known and not experiment.coloured and len(time_s) <= MANY:
        notes += _about_load(diagnosis)
    if followed and not experiment.offset and _begins_amid(experiment.record, recording):
        notes += _about_rest(diagnosis)
    return notes


def unsaid_end(recording: Recording, experiment: Experiment) -> str:
    """Return a hint if readings fall under a hold, as no sample does; an outlier comes back."""
    time_s, size = recording.time_s, np.abs(recording.readings)
    falls = np.minimum(size[:-3], size[1:-2]) - np.maximum(size[2:-1], size[3:])
    held = not experiment.torque.deforms and is_held(experiment.torque, time_s)
    if not held or falls.max() < levels.OUTLYING * estimate_noise(recording.readings):
        return ""
    until = f"{time_s[1 + np.argmax(falls)] + (recording.onset_s or 0.0):g}"
    return f" Readings fall after {until} s, as if nothing was held from there on: --until {until}."


def _about_late_onset(fits: OnsetFits, diagnosis: Diagnosis, guess_s: float) -> Iterator[Note]:
    """Yield a note if a trace is constant up to an onset, with which it fits far better."""
    trace, noise_sd = (fits.time_s, fits.readings), fits.experiment.noise_sd
    given, needed = fits.at(0.0, diagnosis.likelihood.best), chdtri(1, levels.SURELY)
    found = fits.best(guess_s)
    fall = compute_fall(len(trace[0]), given.misfit, found.misfit, noise_sd)
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


def _about_load(diagnosis: Diagnosis) -> Iterator[Note]:
    """Yield a note if a recorded load that comes earlier or later fits better."""
    given, residuals = diagnosis.likelihood, diagnosis.likelihood.problem.residuals
    needed, spacing_s = chdtri(1, levels.FALSE_ALARM), spacing_at(residuals.trace.time_s, 0.0)
    residual, slopes = residuals(given.best)
    basis = absorbed(np.vstack((slopes, residuals.trace.condensed.taken)))
    change = residuals.later(_EARLIER * spacing_s).left(given.best) - residual
    moved = without(basis, change)
    told = float(moved @ moved)
    by_chance = float(moved @ residual) ** 2 < needed * given.misfit**2 * told
    if by_chance or told <= _TOLD * float(change @ change):
        return
    from scipy.optimize import minimize_scalar

    most_s = _MOST_ROWS * spacing_s
    late_s = minimize_scalar(
        lambda start_s: _at(given, start_s).misfit,
        bounds=(-most_s, most_s),
        options={"xatol": _ACCURACY_OF_CLOCK * spacing_s},
    ).x
    other = _at(given, late_s)
    fall = compute_fall(residuals.samples, given.misfit, other.misfit, residuals.trace.known_noise)
    values = _moved(diagnosis, [other.best], 0.5)
    if fall > needed and values and abs(late_s) < most_s - spacing_s:
        yield Note(
            DOUBT,
            f"The {residuals.instrument.controlled.name} seems to be logged "
            f"{plain(abs(late_s), 2)} s too {'early' if late_s > 0 else 'late'}: moved by that, it "
            f"fits far better (χ² falls by {plain(fall)}), and {values}. Correct its times if the "
            "logger or a filter delays it.",
        )


def _begins_amid(record: Array | None, recording: Recording) -> bool:
    """Return True if a recorded load moves at its first rows, and a sample felt something then."""
    assert record is not None
    load, (time_s, *_), (reading, *_) = record[:, 1], recording.time_s, recording.readings
    # What was read at the first row is left out where a sample may jump.
    if recording.at_steps and recording.at_steps[0][0] - (recording.onset_s or 0.0) < time_s:
        time_s, reading = record[0, 0], recording.at_steps[0][1]
    pairs = (load[0], load), (reading if time_s <= record[0, 0] else 0.0, recording.readings)
    felt = (
        abs(first) > levels.OF_PEAK_AT_REST * np.ptp(of)
        and abs(first) > levels.OUTLYING * estimate_noise(of)
        for first, of in pairs
    )
    return any(felt) and not is_still(load[: levels.FEWEST_STILL])


def _about_rest(diagnosis: Diagnosis) -> Iterator[Note]:
    """Yield a note if limits hang on the sample's rest before the first row.

    What it remembers of before fades at the rates of its modes; to first order.
    """
    likelihood, residuals = diagnosis.likelihood, diagnosis.likelihood.problem.residuals
    slopes, time_s = residuals(likelihood.best)[1], residuals.trace.time_s
    parameters = np.exp(likelihood.best)[None]
    modes = compute_modes(residuals.gripper, residuals.model, residuals.course, parameters)
    faded = np.exp(modes.rates[0, :, None] * (time_s - time_s[0]))
    # Of equal sizes; what cannot be told at all still has a number.
    slopes = slopes / np.linalg.norm(slopes, axis=1)[:, None]
    both = slopes, without(absorbed(np.vstack((faded, residuals.trace.condensed.taken))), slopes)
    rounding = _TOLD * np.eye(len(slopes))
    known, unknown = (np.diag(np.linalg.inv(rows @ rows.T + rounding)) for rows in both)
    wider = np.sqrt(unknown / known)
    if wider.max() > levels.WIDER_WITHOUT_REST:
        name = residuals.model.names[int(np.argmax(wider))]
        text = (
            f"The {residuals.instrument.controlled.name} moves from the first row on, and the "
            f"sample is taken to be at rest before: else the limits of {name} would be "
            f"{plain(float(wider.max()), 2)} times as wide. If it was moved before, leave out the "
            "time that it remembers of that: --from, measurement.from_s."
        )
        yield Note(DOUBT, text)


def is_cut_off(time_s: Array) -> bool:
    """Return True if readings begin long after 0, (n_samples,), as if there had been earlier ones.

    They begin more than ten of their first intervals after it, and these do not grow in proportion
    to the time, as of readings that someone spaced from 0 on.
    """
    few = max(levels.FEWEST_APART, len(time_s) // 10)
    first_s = float(time_s[few] - time_s[0]) / few
    last_s = float(time_s[-1] - time_s[-1 - few]) / few
    if time_s[0] <= levels.DELAYED * first_s:
        return False
    growth = np.log(last_s / first_s) / np.log(time_s[-1 - few] / time_s[0])
    return not levels.PLANNED[0] < growth < levels.PLANNED[1]


def _moved(diagnosis: Diagnosis, others: Sequence[Array], widths: float) -> str:
    """Name what other fits, by their log-parameters, move by some widths of its limits."""
    said = []
    for finding in diagnosis.findings:
        quantity, low, high = finding.quantity, finding.log_low, finding.log_high
        least = 0.0 if low is None or high is None else widths * (high - low)
        logs = [quantity.log(x) for x in others]
        far = [
            not finding.allows(x) and abs(log - finding.log_best) > least
            for x, log in zip(others, logs, strict=True)
        ]
        if any(far):
            ends = dict.fromkeys(plain(float(np.exp(end))) for end in (min(logs), max(logs)))
            said.append(f"{quantity.label} would be {' to '.join(ends)} {quantity.unit}".rstrip())
    return "; ".join(said)


def _about_ramp(diagnosis: Diagnosis, ramped: Residuals, *, recorded: bool) -> Iterator[Note]:
    """Yield a note if a ramp up to the first reading moves a value out of its limits."""
    likelihood = diagnosis.likelihood
    fit = fit_from([replace(likelihood.problem, residuals=ramped)], likelihood.best)
    if moved := _moved(diagnosis, [fit.x[0]], 1.0):
        how = "A ramp is given by --ramp DURATION, or as recorded (--load)."
        if recorded:
            how = "Rows of the load before its first one would tell."
        ends = f"ends with the first reading, at {plain(float(ramped.trace.time_s[0]))} s"
        text = f"If the load was no step but a ramp that {ends}: {moved}. {how}"
        yield Note(HARMLESS, text)


def _with_ramp(residuals: Residuals) -> Residuals | None:
    """Return them with steps reached within the first reading; None but for a hold until then."""
    course, delay_s = residuals.course, float(residuals.trace.time_s[0])
    early_s = np.append(course.time_s[course.time_s <= delay_s], delay_s)
    loads = evaluate(course, early_s)
    if delay_s <= 0 or not loads[0] or np.ptp(loads) > levels.HELD * abs(loads[0]):
        return None
    return residuals.under(course.risen(delay_s))


def onset_limits(best: Likelihood, time_s: Array) -> tuple[float, float]:
    """Return the limits of an onset, in s from it, for times from it, (n_samples,)."""
    step_s = _FIRST_STEP * spacing_at(time_s, 0.0)
    return _end(best, -step_s), _end(best, step_s)


def profile_over_onset(diagnosis: Diagnosis, time_s: Array) -> Diagnosis:
    """Return a diagnosis whose limits allow for the onset, with times from it, and its limits."""
    best = diagnosis.likelihood
    ends = onset_limits(best, time_s)
    notes = diagnosis.notes
    if ends[1] - ends[0] > levels.KNOWN_START * spacing_at(time_s, 0.0):
        # Nothing tells how soon after a change of the torque a reading came.
        notes = [note for note in notes if note.about != RING]
    diagnosis = replace(diagnosis, onset_limits_s=ends, notes=notes)
    others = [_at(best, float(change_s)) for end in ends for change_s in end * _SHARES]
    others = [each for each in others if each.threshold > 0]
    if not others:
        return diagnosis
    found = [*diagnosis.findings, *(trade.finding for trade in diagnosis.trades)]
    every = compute_findings(others, [finding.quantity for finding in found])
    costs = [best.threshold - other.threshold for other in others]
    at_ends = [_at(best, end_s).best for end_s in ends]
    merged = [
        _merged(finding, of_others, costs, at_ends)
        for finding, *of_others in zip(found, *every, strict=True)
    ]
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
    finding: Finding, of_others: Sequence[Finding], costs: list[float], at_ends: list[Array]
) -> Finding:
    """Return a finding with the lowest profile of its own and those of other onsets; no gaps.

    At the ends of the onset's interval nothing but their best fits is within the limits.
    """
    every = [finding, *of_others]
    values: Array = np.unique(np.concatenate([one.log_values for one in every]))
    rows = [
        np.interp(values, one.log_values, np.sqrt(np.maximum(one.increases, 0.0))) ** 2 + cost
        for one, cost in zip(every, (0.0, *costs), strict=True)
    ]
    lows = [one.log_low for one in every if one.log_low is not None]
    highs = [one.log_high for one in every if one.log_high is not None]
    fitted = [finding.quantity.log(x) for x in at_ends]
    return replace(
        finding,
        log_values=values,
        increases=np.min(rows, axis=0),
        log_low=min(*lows, *fitted) if len(lows) == len(every) else None,
        log_high=max(*highs, *fitted) if len(highs) == len(every) else None,
        log_gaps=(),
    )
