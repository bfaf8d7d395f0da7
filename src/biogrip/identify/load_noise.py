"""Noise and tare of a recorded load or deformation, where readings tell that they are the sensor's.

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

References
----------
.. [1] E. T. Whittaker, On a new method of graduation, Proceedings of the Edinburgh Mathematical
   Society 41 (1923), 63-75.
.. [2] G. Wahba, A comparison of GCV and GML for choosing the smoothing parameter in the generalized
   spline smoothing problem, Annals of Statistics 13 (1985), 1378-1402.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.special import chdtri

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.fit.any_sample import fit_responses, spread_lags
from biogrip.fit.experiment import Experiment
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


def without_noise(experiment: Experiment, recording: Recording) -> tuple[Experiment, Recording]:
    """Return an experiment whose record is smoothed, if its noise is the sensor's, and say so."""
    assert experiment.record is not None
    values, errors = smoothed(experiment.record[:, 1])
    left = experiment.record[:, 1] - values
    if not np.any(left):
        return experiment, recording
    smooth = np.column_stack((experiment.record[:, 0], values))
    both, count = [experiment, replace(experiment, record=smooth)], len(recording.time_s)
    rest = left_by_any(both, recording.time_s, recording.readings)
    if rest[0] <= rest[1] * np.exp(levels.SMOOTHED / min(count, _MOST_READINGS)):
        return experiment, recording
    noise = float(np.std(left) / np.max(np.abs(experiment.record[:, 1])))
    return replace(both[1], load_errors=errors), replace(recording, load_noise=noise)


def with_its_steps(experiment: Experiment, recording: Recording) -> tuple[Experiment, Recording]:
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
        rest = left_by_any(both, time_s, recording.readings)
        if rest[1] < rest[0]:
            record, uncertain_s = other, other_s
    steps = {str(number): error for number, error in enumerate(uncertain_s.tolist())}
    uncertainty = {**experiment.uncertainty, "steps": steps}
    if steps:
        # A log may write all of them alike, as in the first row after each.
        uncertainty["all steps"] = {"share": 1.0}
    experiment = replace(experiment, record=record, uncertainty=uncertainty)
    if not (tare := tare_of(experiment, recording)):
        return experiment, recording
    controlled = experiment.instrument.controlled
    size = f"{plain(tare)} {controlled.unit}".rstrip()
    said = f"Taken off the {controlled.name}, a tare that readings do not follow: {size}."
    recording = replace(recording, remarks_before=(*recording.remarks_before, said))
    return replace(experiment, record=record - (0.0, tare)), recording


def tare_of(experiment: Experiment, recording: Recording) -> float:
    """Return what is controlled in first rows that do not move, 0 if readings follow that.

    Whatever sample and offset, they would have to follow the record better without it; or as well,
    if these rows precede the start; and without an offset not far worse. Before its contact a tip
    has no tare.
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
    rest = left_by_any([replace(each, offset=True) for each in both], *given)
    if rest[0] <= rest[1] * np.exp(level if load[0, 0] >= start_s else -level):
        return 0.0
    rest = left_by_any(both, *given)
    return tare if rest[1] < rest[0] * np.exp(level) else 0.0


def left_by_any(experiments: Sequence[Experiment], time_s: Array, readings: Array) -> list[float]:
    """Return the mean square that any sample leaves of readings, for each of several loads."""
    some = np.unique(np.linspace(0, len(time_s) - 1, _MOST_READINGS).astype(np.int64))
    lags = spread_lags(experiments[0].torque, time_s, _LAGS_A_DECADE)
    nuisance, left = experiments[0].nuisance(time_s[some]), []
    for experiment in experiments:
        responses = without(nuisance, lag_course(experiment.torque, lags, time_s[some]))
        left.append(fit_responses(without(nuisance, readings[some]), responses)[1])
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
    found, errors = values.copy(), [np.zeros((0, len(values)))]
    noise_sd = estimate_noise(values, 0.0)
    for first, last in pairwise(sorted([*ends, *(corners if not step else [])])):
        stretch, beside = values[first:last], ((0, 0), (first, len(values) - last))
        few = last - first < _FEWEST and np.std(stretch) < _STILL * noise_sd
        if few or is_still(stretch):
            found[first:last] = np.mean(stretch)
            scatter = max(float(np.std(stretch)), noise_sd * few)
            error = np.full((1, last - first), scatter / np.sqrt(last - first))
            errors.append(np.pad(error, beside))
        elif last - first >= _FEWEST:
            found[first:last], left = _graduated(stretch, step)
            errors.append(np.pad(left, beside))
    # Beside a corner nothing tells its rows but themselves.
    beside_corners = np.add.outer(corners, np.arange(-_BESIDE, _BESIDE)).ravel().astype(np.int64)
    errors.append(noise_sd * np.eye(len(values))[beside_corners])
    return found, np.vstack(errors)


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
        found = [
            _Stretch(rows[:at]).cross_validation() + _Stretch(rows[at:]).cross_validation()
            for at in tried.tolist()
        ]
        best = int(np.argmin(found))
        if found[best] > most:
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
