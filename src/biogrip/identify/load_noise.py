"""Noise and tare of a recorded load or deformation, where readings tell that they are the sensor's.

What scatters from row to row is either what the sample felt or noise of the sensor. Both courses,
as recorded and smoothed, are fitted by what any sample might do. Only if the readings follow the
smoothed one better, that is taken. So it is with what is there from the first row on.

A smoothed course has the least sum of squared deviations and, times a weight, of squared third
differences [1]_. The weight is that of least generalised cross-validation [2]_; shares of the
deviations follow from those of sinusoids. Rows that change by far more than most others are no
scatter: there one stretch ends and the next begins.

References
----------
.. [1] E. T. Whittaker, On a new method of graduation, Proceedings of the Edinburgh Mathematical
   Society 41 (1923), 63-75.
.. [2] P. Craven and G. Wahba, Smoothing noisy data with spline functions, Numerische Mathematik 31
   (1979), 377-403.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.special import chdtri

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.fit.any_sample import fit_responses, spread_lags
from biogrip.fit.experiment import Experiment
from biogrip.physics.modes import lag_course
from biogrip.physics.noise import without
from biogrip.traces.reader import Recording

# Weights that are tried; change of a row over the median's that is no scatter; fewest rows.
_WEIGHTS = 10.0 ** np.arange(-2, 13)
_FAR, _FEWEST = 8.0, 20
_LAGS_A_DECADE = 2
# Most readings that are compared.
_MOST_READINGS = 5000


def without_noise(experiment: Experiment, time_s: Array, readings: Array) -> tuple[Array, float]:
    """Return the record of an experiment, (n, 2), smoothed if its noise is the sensor's.

    Also returned is the standard deviation of what was smoothed out, as a share of the largest
    value. Of the trace, times ascend, (n_samples,).
    """
    assert experiment.record is not None
    smooth = experiment.record.copy()
    smooth[:, 1] = smoothed(smooth[:, 1])
    values, largest = experiment.record[:, 1], float(np.max(np.abs(experiment.record[:, 1])))
    noise = float(np.std(smooth[:, 1] - values)) / largest
    if not noise:
        return smooth, noise
    rest = _left(experiment, (experiment.record, smooth), time_s, readings)
    better = rest[0] > rest[1] * np.exp(levels.SMOOTHED / min(len(time_s), _MOST_READINGS))
    return (smooth, noise) if better else (experiment.record, 0.0)


def tare_of(experiment: Experiment, recording: Recording) -> float:
    """Return what is controlled in the first rows, on and on, 0 if readings follow that.

    Whatever sample and offset, they would have to follow the record better without it; or as well,
    if these rows precede the start. Of a sphere nothing is linear.
    """
    record, load, start_s = experiment.record, recording.load, recording.read.start_s or 0.0
    if record is None or load is None or experiment.instrument.relative or recording.read.sphere:
        return 0.0
    same = np.abs(load[:, 1] - load[0, 1]) < levels.HELD * np.ptp(load[:, 1])
    first = load[: int(np.argmin(same)), 1]
    if len(first) < levels.FEWEST_BEFORE or abs(tare := float(np.median(first))) <= np.std(first):
        return 0.0
    given = recording.time_s - start_s, recording.readings
    rest = _left(replace(experiment, offset=True), (record, record - (0.0, tare)), *given)
    better = chdtri(1, levels.SURELY) / min(len(load), _MOST_READINGS)
    return tare if rest[0] > rest[1] * np.exp(better if load[0, 0] >= start_s else -better) else 0.0


def _left(
    experiment: Experiment, records: Sequence[Array], time_s: Array, readings: Array
) -> list[float]:
    """Return the mean square that any sample leaves under each record."""
    some = np.unique(np.linspace(0, len(time_s) - 1, _MOST_READINGS).astype(np.int64))
    lags = spread_lags(experiment.torque, time_s, _LAGS_A_DECADE)
    nuisance, rest = experiment.nuisance(time_s[some]), []
    for record in records:
        own = replace(experiment, record=record)
        responses = without(nuisance, lag_course(own.torque, lags, time_s[some]))
        rest.append(fit_responses(without(nuisance, readings[some]), responses)[1])
    return rest


def smoothed(values: Array) -> Array:
    """Return a course, (n,), without what scatters in its stretches."""
    changes = np.abs(np.diff(values))
    ends = 1 + np.flatnonzero(changes > _FAR * np.median(changes))
    found = values.copy()
    for first, last in pairwise([0, *ends.tolist(), len(values)]):
        if last - first >= _FEWEST:
            found[first:last] = _graduated(values[first:last])
    return found


def _graduated(values: Array) -> Array:
    """Return a stretch, (n,), smoothed [1]_ with the best of the weights [2]_."""
    # Imported here: few records need it, and loading takes long.
    from scipy.linalg import solveh_banded

    count = len(values)
    # Third differences, squared: D^T D by its diagonals.
    stencil = np.array([-1.0, 3.0, -3.0, 1.0])
    bands = np.zeros((4, count))
    for row in range(4):
        for other in range(row + 1):
            bands[3 - (row - other), row : count - 3 + row] += stencil[row] * stencil[other]
    frequencies = (2 - 2 * np.cos(np.pi * np.arange(count) / count)) ** 3
    best, found = np.inf, values
    for weight in _WEIGHTS:
        matrix = weight * bands
        matrix[3] += 1
        smooth = np.asarray(solveh_banded(matrix, values), np.float64)
        free = count - np.sum(1 / (1 + weight * frequencies))
        score = float(np.sum((values - smooth) ** 2)) / free**2
        if score < best:
            best, found = score, smooth
    return found
