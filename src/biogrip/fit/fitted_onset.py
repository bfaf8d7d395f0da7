"""Onset of the protocol in a recorded trace: when on its clock it begins to follow the torque.

`estimate_onset` needs no sample model: the trace is fitted by any sample's possible responses to
the delayed torque, and the delay with the least residual sum of squares is found on ever finer
grids. `OnsetFits` fits the onset along with a sample, by a pattern search. Where the rotation jumps
between two readings, the misfit as a function of the onset has a step at every reading: it is
smooth only between neighbouring ones, and is minimised there.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize_scalar

from biogrip.arrays import Array, IntArray
from biogrip.fit.any_sample import fit_responses
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import LeastSquaresSettings, fit_from, identify_many
from biogrip.fit.problem import TraceProblem, silent
from biogrip.physics.modes import lag_course
from biogrip.physics.whitening import estimate_noise, nuisance_basis, without

# Longest relaxation time over the protocol's duration, and how many a decade; the shortest is that
# between the closest readings.
_LONGEST, _A_DECADE = 10.0, 2
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
_BUDGET = LeastSquaresSettings(candidates=1000, starts=16)
# Steps of the pattern search in sampling intervals: first, and last, and most of them.
_FIRST_STEP, _LAST_STEP, _MOST_STEPS = 8.0, 0.5, 200
# Smooth intervals on either side of the onset of that search in which the misfit is minimised, and
# how accurately, as a share of them.
_NEAR, _ACCURATE = 2, 1e-3
# Instants that differ by less, relative to the latest, are one.
_ROUNDING = 1e-14


def estimate_onset(problem: Experiment, time_s: Array, readings: Array) -> float:
    """Estimate from when a trace follows the torque, without a sample model, in s of its clock.

    The trace is (n_samples,), times ascending. One that begins constant may have an offset.
    """
    torque, last = problem.torque, len(time_s) - 1
    offset = problem.offset or begins_constant(time_s, readings)
    shortest = float(np.min(np.diff(time_s)))
    decades = np.log10(_LONGEST * torque.end_s / shortest)
    shares = np.geomspace(shortest / torque.end_s, _LONGEST, 2 + int(_A_DECADE * decades))
    responses = lag_course(torque, shares.tolist())

    def square_sum(onset_s: float, some: IntArray) -> float:
        nuisance = nuisance_basis(time_s[some], offset=offset, drift=problem.drift)
        own = without(nuisance, responses(time_s[some] - onset_s))
        return fit_responses(without(nuisance, readings[some]), own)[1]

    low, high = time_s[0], max(time_s[0], time_s[-1] - _LEAST_AFTER * torque.end_s)
    while True:
        onsets = np.linspace(low, high, _DELAYS)
        spanned = np.clip(np.searchsorted(time_s, [low, high]) - [1, 0], 0, last)
        ends = np.linspace([0, spanned[0]], [last, spanned[1]], _MOST_READINGS)
        some = np.unique(ends.astype(np.int64))
        best = int(np.argmin([square_sum(onset, some) for onset in onsets]))
        low, high = onsets[max(best - 1, 0)], onsets[min(best + 1, _DELAYS - 1)]
        if high - low < shortest:
            return float(onsets[best])


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
        start = OnsetFit(guess_s, np.log(found.parameters), found.misfit)
        return self.near(start, _FIRST_STEP)

    def near(self, best: OnsetFit, first_step: float = 1.0) -> OnsetFit:
        """Fit the onset along near that of another fit.

        Steps, of which the first is some median intervals of the readings, are halved where neither
        direction is better. The last ones are half as long as the readings are apart where the
        onset is, which of times with equal ratios is much less than the median.
        """
        interval_s = float(np.median(np.diff(self.time_s)))
        step_s = first_step * interval_s
        for _ in range(_MOST_STEPS):
            if step_s < _LAST_STEP * min(interval_s, spacing_at(self.time_s, best.onset_s)):
                break
            onsets = (min(best.onset_s + s, self._latest_s) for s in (-step_s, step_s))
            sides = (self.at(onset_s, best.log_parameters) for onset_s in onsets)
            lower = min(sides, key=_misfit)
            if lower.misfit < best.misfit:
                best = lower
            else:
                step_s /= 2
        tried = [best]

        def misfit(onset_s: float) -> float:
            tried.append(self.at(float(onset_s), best.log_parameters))
            return tried[-1].misfit

        for low, end in self._smooth_intervals(best.onset_s):
            if (high := min(end, self._latest_s)) <= low:
                continue
            accurate = {"xatol": _ACCURATE * (high - low)}
            minimize_scalar(misfit, bounds=(low, high), method="bounded", options=accurate)
        return min(tried, key=_misfit)

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
