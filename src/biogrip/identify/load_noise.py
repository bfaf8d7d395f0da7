"""Noise and tare of a recorded load or deformation, where readings tell that they are the sensor's.

What scatters from row to row is either what the sample felt or noise of the sensor, or rounding.
Both courses, as recorded and smoothed, are fitted by what any sample might do. Only if the readings
follow the smoothed one better, that is taken. So it is with what is there from the first row on.

A stretch that does not move (`is_still`) is held at its mean. Another has the least sum of squared
deviations and, times a weight, of squared third differences [1]_: it is the mean of a random
course, given noise and weight, of which the likelihood is highest [2]_. Where rows are rounded
to steps, they are smoothed as far as what is left scatters no more than errors of rounding. Rows
that change by far more than most others are no scatter: there one stretch ends and the next begins.

What that leaves uncertain are directions, in which the course is off by a random amount each.

References
----------
.. [1] E. T. Whittaker, On a new method of graduation, Proceedings of the Edinburgh Mathematical
   Society 41 (1923), 63-75.
.. [2] G. Wahba, A comparison of GCV and GML for choosing the smoothing parameter in the generalized
   spline smoothing problem, Annals of Statistics 13 (1985), 1378-1402.
"""

from collections.abc import Sequence
from dataclasses import replace
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
    records, count = (experiment.record, smooth), min(len(recording.time_s), _MOST_READINGS)
    rest = _left(experiment, records, recording.time_s, recording.readings)
    if rest[0] <= rest[1] * np.exp(levels.SMOOTHED / count):
        return experiment, recording
    noise = float(np.std(left) / np.max(np.abs(experiment.record[:, 1])))
    experiment = replace(experiment, record=smooth, load_errors=errors)
    return experiment, replace(recording, load_noise=noise)


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
        given = recording.time_s - (recording.read.start_s or 0.0), recording.readings
        rest = _left(experiment, (record, smooth), *given)
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
    if len(first) < levels.FEWEST_BEFORE or abs(tare := float(np.median(first))) <= np.std(first):
        return 0.0
    if not is_still(first):
        return 0.0
    given = (record, record - (0.0, tare)), recording.time_s - start_s, recording.readings
    level = chdtri(1, levels.SURELY) / min(len(load), _MOST_READINGS)
    rest = _left(replace(experiment, offset=True), *given)
    if rest[0] <= rest[1] * np.exp(level if load[0, 0] >= start_s else -level):
        return 0.0
    rest = _left(experiment, *given)
    return tare if rest[1] < rest[0] * np.exp(level) else 0.0


def _left(
    experiment: Experiment, records: Sequence[Array], time_s: Array, readings: Array
) -> list[float]:
    """Return the mean square that any sample leaves under each record."""
    some = np.unique(np.linspace(0, len(time_s) - 1, _MOST_READINGS).astype(np.int64))
    lags = spread_lags(experiment.torque, time_s, _LAGS_A_DECADE)
    nuisance, rest = experiment.nuisance(time_s[some]), []
    for record in records:
        posed = replace(experiment, record=record)
        responses = without(nuisance, lag_course(posed.torque, lags, time_s[some]))
        rest.append(fit_responses(without(nuisance, readings[some]), responses)[1])
    return rest


def smoothed(values: Array) -> tuple[Array, Array]:
    """Return a course, (n,), without what scatters in its stretches, and how it may be off.

    It is off by directions, (n_directions, n), times independent standard normal numbers.
    """
    changes = np.abs(np.diff(values))
    # A few equal steps are a staircase.
    step = measure_rounding(values) if np.count_nonzero(changes) >= _FEWEST else 0.0
    far = np.maximum(_FAR * np.median(changes), levels.ONE_STEP * step)
    ends = 1 + np.flatnonzero(changes > far)
    found, errors = values.copy(), [np.zeros((0, len(values)))]
    noise_sd = estimate_noise(values, 0.0)
    for first, last in pairwise([0, *ends.tolist(), len(values)]):
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
    return found, np.vstack(errors)


def _graduated(values: Array, step: float) -> tuple[Array, Array]:
    """Return a stretch, (n,), smoothed [1]_ with the likeliest weight [2]_, and how it may be off.

    Rows may be rounded to steps: then it has the largest weight with which it leaves no more than
    their errors, of which those of equal neighbours are one.
    """
    # Imported here: few records need it, and loading takes long.
    from scipy.linalg import solveh_banded

    count = len(values)
    bands = np.zeros((_ORDER + 1, count))
    for row in range(_ORDER + 1):
        for other in range(row + 1):
            here = slice(row, count - _ORDER + row)
            bands[_ORDER - (row - other), here] += _STENCIL[row] * _STENCIL[other]
    # Nearly the eigenvalues, zero for a parabola.
    places = np.arange(count)
    roughness = ((2 - 2 * np.cos(np.pi * places / count)) ** _ORDER)[_ORDER:]

    def smooth_with(weight: float, rows: Array) -> Array:
        matrix = weight * bands
        matrix[_ORDER] += 1
        return np.asarray(solveh_banded(matrix, rows), np.float64)

    def deviance(weight: float) -> float:
        rest = float(values @ (values - smooth_with(weight, values)))
        rough = weight * roughness / (1 + weight * roughness)
        return len(rough) * float(np.log(max(rest, 1e-300))) - float(np.sum(np.log(rough)))

    if step:
        rough = [np.std(values - smooth_with(weight, values)) for weight in _WEIGHTS]
        weight = _WEIGHTS[max(int(np.searchsorted(rough, step / ROOT_12, side="right")) - 1, 0)]
        equal = count / (1 + np.count_nonzero(np.diff(values)))
        noise = step / ROOT_12 * np.sqrt(equal)
    else:
        weight = min(_WEIGHTS, key=deviance)
        # Of a record without noise rounding may leave less than nothing.
        unexplained = max(float(values @ (values - smooth_with(weight, values))), 0.0)
        noise = np.sqrt(unexplained / len(roughness))
    smooth_ones = int(np.count_nonzero(weight * roughness < _LEFT))
    smooth_ones = min(smooth_ones, _MOST_NUMBERS // count)
    waves = np.cos(np.pi * np.outer(places + 0.5, np.arange(1, smooth_ones)) / count)
    basis = np.linalg.qr(np.column_stack((np.vander(places / count, _ORDER), waves)))[0]
    covariance = basis.T @ smooth_with(weight, basis)
    directions = basis @ np.linalg.cholesky(0.5 * (covariance + covariance.T))
    return smooth_with(weight, values), noise * directions.T
