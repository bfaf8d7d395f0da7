"""Onset of the protocol in a recorded trace: when on its clock it begins to follow the torque.

`estimate_onset` needs no sample model: the trace is fitted by any sample's possible responses to
the delayed torque, and the delay with the least residual sum of squares is found on ever finer
grids. `OnsetFits` fits the onset along with a sample. Where a rotation jumps between two readings,
the misfit as a function of the onset has a step at every one: it is smooth only between
neighbouring ones, and is minimised there, from one interval to the next.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import least_squares

from biogrip.arrays import Array, IntArray
from biogrip.fit.any_sample import fit_responses, spread_lags
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import LeastSquaresSettings, fit_from, identify_many
from biogrip.fit.problem import TraceProblem, silent
from biogrip.physics.modes import lag_course
from biogrip.physics.whitening import estimate_noise, nuisance_basis, without

_LAGS_A_DECADE = 2
# Delays on the first grid; finer ones have as many between the neighbours of the best.
_DELAYS = 65
# Most readings that an estimate takes of the whole trace, and as many of what the grid spans.
_MOST_READINGS = 2000
# Least share of the protocol that has to be after the onset.
_LEAST_AFTER = 0.02
# Readings after the latest onset, beside one for each parameter.
_MORE_AFTER = 2
# Fewest readings before an onset by which a late one is recognised.
_FEWEST_BEFORE = 3
# Standard deviation of readings that are constant, in noise, and in peaks of noise-free traces.
_CONSTANT, _CONSTANT_OF_PEAK = 2.0, 1e-3
# Fall of χ² by which an offset is better than a late onset: by chance once in a billion.
_CLEARLY = 40.0
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
    noise = max(other, (_CONSTANT_OF_PEAK * float(np.ptp(readings))) ** 2)
    return other_s if len(time_s) * (rest - other) > _CLEARLY * noise else onset_s


def _estimate(
    problem: Experiment, time_s: Array, readings: Array, *, offset: bool
) -> tuple[float, float]:
    """Return the onset, and the mean square that is left."""
    torque, last = problem.torque, len(time_s) - 1
    shortest = float(np.min(np.diff(time_s)))
    responses = lag_course(torque, spread_lags(torque, time_s, _LAGS_A_DECADE))

    def square_sum(onset_s: float, some: IntArray) -> float:
        nuisance = nuisance_basis(time_s[some], offset=offset, drift=problem.drift)
        own = without(nuisance, responses(time_s[some] - onset_s))
        return fit_responses(without(nuisance, readings[some]), own)[1]

    # A reading at the very onset precedes it: the first one, too, may follow it.
    low = min(time_s[0], max(2 * time_s[0] - time_s[1], time_s[-1] - torque.end_s))
    high = max(time_s[0], time_s[-1] - _LEAST_AFTER * torque.end_s)
    while True:
        onsets = np.linspace(low, high, _DELAYS)
        spanned = np.clip(np.searchsorted(time_s, [low, high]) - [1, 0], 0, last)
        ends = np.linspace([0, spanned[0]], [last, spanned[1]], _MOST_READINGS)
        some = np.unique(ends.astype(np.int64))
        sums = [square_sum(onset, some) for onset in onsets]
        best = int(np.argmin(sums))
        low, high = onsets[max(best - 1, 0)], onsets[min(best + 1, _DELAYS - 1)]
        if high - low < shortest:
            every = np.unique(np.linspace(0, last, _MOST_READINGS).astype(np.int64))
            return float(onsets[best]), square_sum(float(onsets[best]), every) / len(every)


def begins_constant(time_s: Array, readings: Array, onset_s: float | None = None) -> bool:
    """Return True if the readings before an onset are constant within the noise of the trace.

    Without an onset, the first few readings are looked at. The last one before it may be on a ramp.
    """
    before = readings[:_FEWEST_BEFORE]
    if onset_s is not None:
        before = readings[time_s < onset_s][:-1]
    noise_sd, peak = estimate_noise(readings), float(np.ptp(readings))
    size = max(_CONSTANT * noise_sd, _CONSTANT_OF_PEAK * peak)
    return len(before) >= _FEWEST_BEFORE and bool(np.std(before) < size)


@dataclass(frozen=True)
class OnsetFit:
    """Best fit of a trace for one onset."""

    onset_s: float
    """The onset, on the trace's clock."""
    log_parameters: Array
    """Sample parameters, (n_parameters,)."""
    misfit: float
    """RMS misfit."""


def spacing_at(time_s: Array, at_s: float) -> float:
    """Return how far ascending times, (n,), are apart at one of them, or nearest to it, in s."""
    after = int(np.clip(np.searchsorted(time_s, at_s), 1, len(time_s) - 1))
    return float(time_s[after] - time_s[after - 1])


def _misfit(fit: OnsetFit) -> float:
    return fit.misfit


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
        the one before, until no neighbour has a lower misfit.
        """
        for _ in range(_MOST_STEPS):
            ends = [
                (low_s, min(high_s, self._latest_s))
                for low_s, high_s in self._smooth_intervals(best.onset_s)
                if low_s < self._latest_s
            ]
            found = min((self._within(best, *own) for own in ends), key=_misfit)
            if found.misfit >= best.misfit * (1 - _STILL):
                return best
            own, best = next(pair for pair in ends if best.onset_s <= pair[1]), found
            if own[0] <= best.onset_s <= own[1]:
                return best
        return best

    def _within(self, start: OnsetFit, low_s: float, high_s: float) -> OnsetFit:
        """Fit sample and onset within an interval, from the values of another fit."""
        inside_s = _INSIDE * (high_s - low_s)
        problem = self.posed(start.onset_s)
        low, high = (
            np.append(ends, onset_s)
            for ends, onset_s in (
                (problem.low, low_s + inside_s),
                (problem.high, high_s - inside_s),
            )
        )

        def of(x: Array) -> Array:
            return self.posed(x[-1]).residuals.left(x[:-1])

        def slopes(x: Array) -> Array:
            residuals, rows = self.posed(x[-1]).residuals(x[:-1])
            aside_s = inside_s if x[-1] < 0.5 * (low_s + high_s) else -inside_s
            moved = self.posed(x[-1] + aside_s).residuals.left(x[:-1]) - residuals
            return np.vstack((rows, moved / aside_s)).T

        first = np.clip(np.append(start.log_parameters, start.onset_s), low, high)
        fit = least_squares(of, first, slopes, (low, high), x_scale="jac", max_nfev=_MOST_STEPS)
        misfit = float(np.sqrt(2 * fit.cost / len(self.time_s)))
        return OnsetFit(float(fit.x[-1]), fit.x[:-1], misfit)

    def _smooth_intervals(self, onset_s: float) -> Iterator[tuple[float, float]]:
        """Yield intervals of onsets around one, within which no reading passes a change of torque.

        An onset before the first reading passes none, however early: the first interval then
        begins some times as far before it.
        """
        changes_s = self._identified.torque.changes_s
        edges = np.unique(np.subtract.outer(self.time_s, changes_s))
        equal_s = _ROUNDING * max(np.abs(self.time_s).max(), np.abs(changes_s).max())
        edges = edges[np.diff(edges, prepend=-np.inf) > equal_s]
        after = int(np.searchsorted(edges, onset_s))
        if after < _NEAR:
            before_s = max(edges[0] - onset_s, spacing_at(edges, onset_s))
            yield float(edges[0] - _NEAR * before_s), float(edges[0])
        yield from pairwise(edges[max(after - _NEAR, 0) : after + _NEAR].tolist())
