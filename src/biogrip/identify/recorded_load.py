"""What a recorded load or deformation needs: its noise, its tare, and where a tip touches.

What scatters from row to row is either what the sample felt or noise of the sensor, or rounding.
Both courses, as recorded and smoothed, are fitted by what any sample might do. Only if the readings
follow the smoothed one better, that is taken. So it is with what is there from the first row on.

A stretch that does not move (`is_still`) is held at its mean. Another has the least sum of squared
deviations and, times a weight, of squared third differences [1]_: it is the mean of a random
course, given noise and weight, of which the likelihood is highest [2]_. Where rows are rounded
to steps, they are smoothed as far as what is left scatters no more than errors of rounding. Rows
that change by far more than most others are no scatter: there one stretch ends and the next begins.
So it is where another weight becomes better, as where a load gets faster.

What that leaves uncertain are directions, in which the course is off by a random amount each.

A depth that counts from a wrong zero is off by one length throughout, d -> d + d0. A scan with what
any linear sample may do finds d0 roughly; least squares of sample and d0 then find both. Limits of
the sample allow for any d0, to first order (`biogrip.fit.trace_fit.contact_function`), and d0 has
limits of first order.

References
----------
.. [1] E. T. Whittaker, On a new method of graduation, Proceedings of the Edinburgh Mathematical
   Society 41 (1923), 63-75.
.. [2] G. Wahba, A comparison of GCV and GML for choosing the smoothing parameter in the generalized
   spline smoothing problem, Annals of Statistics 13 (1985), 1378-1402.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.special import chdtri, stdtrit

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.fit.any_sample import fit_responses, spread_lags
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import identify_many
from biogrip.fit.trace_fit import contact_function
from biogrip.fit.trace_noise import absorbed
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import DOUBT, REJECTED, REJECTION, Note
from biogrip.judging.onset import begins_constant
from biogrip.judging.whiteness import is_still
from biogrip.physics.modes import lag_course
from biogrip.physics.noise import ROOT_12, estimate_noise, measure_rounding, without
from biogrip.physics.protocol import with_steps
from biogrip.traces.reader import Recording

# Weights that are tried; change of a row over the median's that is no scatter; fewest rows, of
# which fewer do not move if they scatter by so many of the sensor's noises.
_WEIGHTS = 10.0 ** np.arange(-2, 13, 0.5)
_FAR, _FEWEST, _STILL = 8.0, 20, 2.0
# Fewest rows of a part of a stretch, how many places are tried to part it, and fall of its
# cross-validation with which it is; rows on either side of a corner that are not smoothed.
_PART, _PARTINGS, _BETTER, _BESIDE = 50, 24, 30.0, 3
# Variance of a direction that is smoothed out, over that of one that is left; most numbers at once.
_LEFT, _MOST_NUMBERS = 30.0, 20_000_000
_LAGS_A_DECADE = 2
# Most readings that are compared.
_MOST_READINGS = 5000
# Differences whose squares are smoothed, and their order.
_STENCIL, _ORDER = np.array([-1.0, 3.0, -3.0, 1.0]), 3
# Contacts that are tried, up to this share of the largest depth off; most steps.
_DEPTHS_TRIED, _FURTHEST, _MOST_EVALUATIONS = 41, 0.5, 50


def without_noise(recording: Recording, experiment: Experiment) -> tuple[Recording, Experiment]:
    """Return an experiment whose record is smoothed, if its noise is the sensor's, and say so."""
    assert experiment.record is not None
    values, errors = smoothed(experiment.record[:, 1])
    left = experiment.record[:, 1] - values
    if not np.any(left):
        return recording, experiment
    smooth = np.column_stack((experiment.record[:, 0], values))
    both, count = [experiment, replace(experiment, record=smooth)], len(recording.time_s)
    rest = _left_by_any(both, recording.time_s, recording.readings)
    if rest[0] <= rest[1] * np.exp(levels.SMOOTHED / min(count, _MOST_READINGS)):
        return recording, experiment
    noise = float(np.std(left) / np.max(np.abs(experiment.record[:, 1])))
    return replace(recording, load_noise=noise), replace(both[1], load_errors=errors)


def with_its_steps(recording: Recording, experiment: Experiment) -> tuple[Recording, Experiment]:
    """Return an experiment whose record has its steps, of uncertain times, and no tare, and say so.

    A step of a record that is rounded may be one of rounding alone: it is none if readings follow
    the smoothed course better.
    """
    assert experiment.record is not None
    values = experiment.record[:, 1]
    step, extent = measure_rounding(values), np.ptp(values)
    record, uncertain_s = with_steps(experiment.record, noise_sd=estimate_noise(values, 0.0))
    if step and extent > levels.FEWEST_STEPS * step:
        other, other_s = with_steps(experiment.record, levels.ONE_STEP * step)
        smooth = np.column_stack((other[:, 0], smoothed(other[:, 1])[0]))
        both = [replace(experiment, record=course) for course in (record, smooth)]
        time_s = recording.time_s - (recording.read.start_s or 0.0)
        rest = _left_by_any(both, time_s, recording.readings)
        if rest[1] < rest[0]:
            record, uncertain_s = other, other_s
    steps = {str(number): error for number, error in enumerate(uncertain_s.tolist())}
    uncertainty = {**experiment.uncertainty, "steps": steps}
    if steps:
        # A log may write all of them alike, as in the first row after each.
        uncertainty["all steps"] = {"share": 1.0}
    experiment = replace(experiment, record=record, uncertainty=uncertainty)
    if not (tare := tare_of(experiment, recording)):
        return recording, experiment
    controlled = experiment.instrument.controlled
    size = f"{plain(tare)} {controlled.unit}".rstrip()
    said = f"Taken off the {controlled.name}, a tare that readings do not follow: {size}."
    recording = replace(recording, remarks_before=(*recording.remarks_before, said))
    return recording, replace(experiment, record=record - (0.0, tare))


def tare_of(experiment: Experiment, recording: Recording) -> float:
    """Return what is controlled in first rows that do not move, 0 if readings follow that.

    Whatever sample and offset, they would have to follow the record better without it; or as well,
    if these rows precede the start; and without an offset not far worse. Where readings in these
    rows tell an offset, as well will do, if they follow the record far worse without any. Before
    its contact a tip has no tare.
    """
    record, load, start_s = experiment.record, recording.load, recording.read.start_s or 0.0
    if record is None or load is None or experiment.instrument.relative or recording.read.has_tip:
        return 0.0
    same = np.abs(load[:, 1] - load[0, 1]) < levels.HELD * np.ptp(load[:, 1])
    first = load[: int(np.argmin(same)), 1]
    few = len(first) < levels.FEWEST_BEFORE
    if few or abs(tare := float(np.median(first))) <= np.std(first) or not is_still(first):
        return 0.0
    given = recording.time_s - start_s, recording.readings
    level = chdtri(1, levels.SURELY) / min(len(load), _MOST_READINGS)
    both = [experiment, replace(experiment, record=record - (0.0, tare))]
    may_have_one = experiment.offset or "offset" in experiment.undeclared
    told = may_have_one and begins_constant(*given, float(load[len(first), 0]) - start_s)
    kept, off = _left_by_any([replace(posed, offset=True) for posed in both], *given)
    if kept <= off * np.exp(level if load[0, 0] >= start_s and not told else -level):
        return 0.0
    rest = _left_by_any([replace(it, offset=it.offset and not told) for it in both], *given)
    left = off * np.exp(2 * level) if told else rest[1]
    return tare if left < rest[0] * np.exp(level) else 0.0


def _left_by_any(experiments: Sequence[Experiment], time_s: Array, readings: Array) -> list[float]:
    """Return the mean square that any sample leaves of readings, for each of several loads."""
    thinned = np.unique(np.linspace(0, len(time_s) - 1, _MOST_READINGS).astype(np.int64))
    lags = spread_lags(experiments[0].torque, time_s, _LAGS_A_DECADE)
    nuisance, left = experiments[0].nuisance(time_s[thinned]), []
    for experiment in experiments:
        responses = without(nuisance, lag_course(experiment.torque, lags, time_s[thinned]))
        left.append(fit_responses(without(nuisance, readings[thinned]), responses)[1])
    return left


def smoothed(values: Array) -> tuple[Array, Array]:
    """Return a course, (n,), without what scatters in its stretches, and how it may be off.

    It is off by directions, (n_directions, n), times independent standard normal numbers.
    """
    changes = np.abs(np.diff(values))
    # A few equal steps are a staircase.
    step = measure_rounding(values) if np.count_nonzero(changes) >= _FEWEST else 0.0
    far = np.maximum(_FAR * np.median(changes), levels.ONE_STEP * step)
    ends = [0, *(1 + np.flatnonzero(changes > far)).tolist(), len(values)]
    corners = [first + at for first, last in pairwise(ends) for at in _parted(values[first:last])]
    smooth, errors = values.copy(), [np.zeros((0, len(values)))]
    noise_sd = estimate_noise(values, 0.0)
    for first, last in pairwise(sorted([*ends, *(corners if not step else [])])):
        stretch, beside = values[first:last], ((0, 0), (first, len(values) - last))
        few = last - first < _FEWEST and np.std(stretch) < _STILL * noise_sd
        if few or is_still(stretch):
            smooth[first:last] = np.mean(stretch)
            scatter = max(float(np.std(stretch)), noise_sd * few)
            error = np.full((1, last - first), scatter / np.sqrt(last - first))
            errors.append(np.pad(error, beside))
        elif last - first >= _FEWEST:
            smooth[first:last], left = _graduated(stretch, step)
            errors.append(np.pad(left, beside))
    # Beside a corner nothing tells its rows but themselves.
    beside_corners = np.add.outer(corners, np.arange(-_BESIDE, _BESIDE)).ravel().astype(np.int64)
    errors.append(noise_sd * np.eye(len(values))[beside_corners])
    return smooth, np.vstack(errors)


@dataclass(frozen=True, eq=False)
class _Stretch:
    """Rows of a record that one weight smooths."""

    values: Array

    @cached_property
    def _bands(self) -> Array:
        count = len(self.values)
        bands = np.zeros((_ORDER + 1, count))
        for row in range(_ORDER + 1):
            for other in range(row + 1):
                here = slice(row, count - _ORDER + row)
                bands[_ORDER - (row - other), here] += _STENCIL[row] * _STENCIL[other]
        return bands

    @cached_property
    def roughness(self) -> Array:
        """Nearly the eigenvalues, but those of a parabola, which are zero."""
        count = len(self.values)
        return ((2 - 2 * np.cos(np.pi * np.arange(count) / count)) ** _ORDER)[_ORDER:]

    def smooth_with(self, weight: float, rows: Array | None = None) -> Array:
        """Return the stretch, or other rows of its length, smoothed with a weight."""
        # Imported here: few records need it, and loading takes long.
        from scipy.linalg import solveh_banded

        matrix = weight * self._bands
        matrix[_ORDER] += 1
        rows = self.values if rows is None else rows
        return np.asarray(solveh_banded(matrix, rows, check_finite=False), np.float64)

    def rest(self, weight: float) -> float:
        """Return the sum of squares that smoothing with a weight leaves, with its roughness."""
        # Of a record without noise rounding may leave less than nothing.
        return max(float(self.values @ (self.values - self.smooth_with(weight))), 0.0)

    def deviance(self, weight: float) -> float:
        """Return the deviance of a weight, of noise of any size [2]_."""
        rough = weight * self.roughness
        least = len(rough) * float(np.log(max(self.rest(weight), 1e-300)))
        return least - float(np.sum(np.log(rough / (1 + rough))))

    def cross_validation(self) -> float:
        """Return what the likeliest of the weights predicts rows by, comparable with that of parts.

        It is their number times the logarithm of generalized cross-validation.
        """
        weight = min(_WEIGHTS[::2], key=self.deviance)
        count = len(self.values)
        freedom = _ORDER + float(np.sum(1 / (1 + weight * self.roughness)))
        left = max(self.rest(weight) / count, 1e-300) / (1 - freedom / count) ** 2
        return count * float(np.log(left))


def _parted(values: Array) -> list[int]:
    """Return the rows of a stretch, (n,), at which another weight becomes clearly better.

    There a load gets faster, or stands still, with a corner that one weight would round.
    """
    thinned = 1 + len(values) // _MOST_READINGS
    rows = values[::thinned]
    low, high = _PART, len(rows) - _PART
    if low >= high:
        return []
    most = _Stretch(rows).cross_validation() - _BETTER
    while True:
        tried = np.unique(np.linspace(low, high, _PARTINGS).astype(np.int64))
        predicted = [
            _Stretch(rows[:at]).cross_validation() + _Stretch(rows[at:]).cross_validation()
            for at in tried.tolist()
        ]
        best = int(np.argmin(predicted))
        if predicted[best] > most:
            return []
        low, high = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
        if tried[-1] - tried[0] < _PARTINGS:
            break
    at = int(tried[best]) * thinned
    return [*_parted(values[:at]), at, *(at + later for later in _parted(values[at:]))]


def _graduated(values: Array, step: float) -> tuple[Array, Array]:
    """Return a stretch, (n,), smoothed [1]_ with the likeliest weight [2]_, and how it may be off.

    Rows may be rounded to steps: then it has the largest weight with which it leaves no more than
    their errors, of which those of equal neighbours are one.
    """
    stretch, count = _Stretch(values), len(values)
    if step:
        rough = [np.std(values - stretch.smooth_with(weight)) for weight in _WEIGHTS]
        weight = _WEIGHTS[max(int(np.searchsorted(rough, step / ROOT_12, side="right")) - 1, 0)]
        equal = count / (1 + np.count_nonzero(np.diff(values)))
        noise = step / ROOT_12 * np.sqrt(equal)
    else:
        weight = min(_WEIGHTS, key=stretch.deviance)
        noise = np.sqrt(stretch.rest(weight) / len(stretch.roughness))
    smooth_ones = int(np.count_nonzero(weight * stretch.roughness < _LEFT))
    smooth_ones = min(smooth_ones, _MOST_NUMBERS // count)
    places = np.arange(count)
    waves = np.cos(np.pi * np.outer(places + 0.5, np.arange(1, smooth_ones)) / count)
    basis = np.linalg.qr(np.column_stack((np.vander(places / count, _ORDER), waves)))[0]
    covariance = basis.T @ stretch.smooth_with(weight, basis)
    directions = basis @ np.linalg.cholesky(0.5 * (covariance + covariance.T))
    return stretch.smooth_with(weight), noise * directions.T


def with_contact(experiment: Experiment, recording: Recording) -> Experiment:
    """Return an experiment whose tip is as deep as fits best, of a trace with times from 0."""
    assert experiment.record is not None
    assert experiment.tip_power is not None
    time_s, readings = recording.time_s, recording.readings
    deepest = float(experiment.record[:, 1].max()) ** (1 / experiment.tip_power)
    tried = deepest * np.linspace(-_FURTHEST, _FURTHEST, _DEPTHS_TRIED)
    guesses = [replace(experiment, deeper=deeper) for deeper in tried.tolist()]
    guess = guesses[int(np.argmin(_left_by_any(guesses, time_s, readings)))]
    return replace(experiment, deeper=_fitted(guess, time_s, readings))


def _fitted(guess: Experiment, time_s: Array, readings: Array) -> float:
    """Fit depth and sample, beginning with a guess of the depth."""
    # Imported here: loading it takes longer than a short job.
    from scipy.optimize import least_squares

    exact = guess.to_identify()
    problem = exact.of(time_s, readings)
    (best_fit,) = identify_many([problem], exact.least_squares, [np.random.default_rng(0)])
    depth, noise = abs(guess.deeper) + 1e-3, problem.residuals.noise_scale

    def at(x: Array) -> tuple[Experiment, Array, Array]:
        moved = replace(exact, deeper=guess.deeper + depth * x[-1])
        residuals = replace(problem.residuals, course=moved.torque)
        return moved, *residuals(x[:-1])

    def slopes(x: Array) -> Array:
        moved, _, rows = at(x)
        by_depth = contact_function(moved, time_s, np.exp(x[:-1]))
        cleared = problem.residuals.trace.condensed.cleared(depth * by_depth)
        return np.vstack((rows, cleared)).T / noise

    start = np.append(np.log(best_fit.parameters), 0.0)
    ends = np.append(problem.low, -np.inf), np.append(problem.high, np.inf)
    fit = least_squares(lambda x: at(x)[1] / noise, start, slopes, ends, max_nfev=_MOST_EVALUATIONS)
    return guess.deeper + depth * float(fit.x[-1])


def depth_off(diagnosis: Diagnosis) -> tuple[float, float, float]:
    """Return by how much a tip would be deeper than it was taken to be, to first order.

    It is that which what the fit leaves, in white noise, tells beside the sample's parameters. Also
    returned are how much a unit of it shows, as a norm, and the misfit with it over the scatter.
    """
    recording, experiment = diagnosis.identified
    likelihood, exact = diagnosis.likelihood, experiment.to_identify()
    residuals = exact.of(recording.time_s, recording.readings).residuals
    left, slopes = residuals(likelihood.best)
    if experiment.tip_power is None:
        # A depth that is read is less by what the tip is deeper.
        read = recording.read.instrument.read
        change = -read.slope(np.abs(residuals.response(likelihood.best)) ** (1 / read.power))
    else:
        change = contact_function(exact, recording.time_s, np.exp(likelihood.best))
    change = residuals.trace.condensed.cleared(change)
    basis = absorbed(np.vstack((slopes, residuals.trace.condensed.taken)))
    alone = without(basis, change)
    told = float(alone @ alone)
    if told <= levels.CONSTANT_OF_PEAK**2 * float(change @ change):
        return 0.0, 0.0, np.inf
    deeper = -float(alone @ left) / told
    rest = float(np.std(left + deeper * alone)) / residuals.noise_scale
    return deeper, float(np.sqrt(told)), rest


def depth_limits(diagnosis: Diagnosis) -> tuple[float, float, float]:
    """Return by how much a tip is deeper than recorded, in m, and its limits."""
    recording, experiment = diagnosis.identified
    likelihood, (_, shown, _) = diagnosis.likelihood, depth_off(diagnosis)
    sds = float(stdtrit(min(likelihood.freedom, 1e9), 0.5 + likelihood.confidence / 2))
    room = np.divide(likelihood.noise_sd, shown) * sds
    unit, middle = recording.read.instrument.controlled.units["m"], experiment.deeper
    return middle / unit, (middle - room) / unit, (middle + room) / unit


def notes_on_contact(diagnosis: Diagnosis) -> Iterator[Note]:
    """Yield a doubt if what a fit leaves follows the derivative by the contact, which was given."""
    recording, experiment = diagnosis.identified
    instrument, how = recording.read.instrument, "say --contact fit"
    depth = instrument.controlled
    if experiment.tip_power is None:
        depth, how = instrument.read, "count its depths from there"
    if depth.power == 1 or experiment.fit_contact:
        return
    deeper, shown, rest = depth_off(diagnosis)
    noise_sd = diagnosis.likelihood.noise_sd
    if rest < levels.WHITE:
        # All that is no noise is of the contact.
        noise_sd = min(noise_sd, rest * diagnosis.likelihood.problem.residuals.noise_scale)
    if (deeper * shown / noise_sd) ** 2 < chdtri(1, levels.FALSE_ALARM):
        return
    size_nm = 1e9 * abs(deeper) / depth.units["m"]
    side = "before" if deeper > 0 else "after"
    text = f"The tip seems to touch about {plain(size_nm, 2)} nm {side} the zero of its depth"
    rejected = diagnosis.status == REJECTED
    yield Note(REJECTION if rejected else DOUBT, f"{text}: {how}.")
