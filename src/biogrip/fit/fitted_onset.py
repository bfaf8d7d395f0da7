"""Onset of the protocol in a recorded trace, fitted along with the sample.

The fit of the sample is repeated for onsets that a pattern search proposes. Where the rotation
jumps between two readings, the misfit as a function of the onset has a step at every reading: it
is smooth only between neighbouring ones, and is minimised there.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize_scalar

from biogrip.arrays import Array
from biogrip.fit.least_squares import LeastSquaresSettings, fit_from, identify_many
from biogrip.fit.problem import CaseProblem, silent
from biogrip.physics.whitening import estimate_noise

_BUDGET = LeastSquaresSettings(candidates=1000, starts=16)
# Steps of the pattern search in sampling intervals: first, and last, and most of them.
_FIRST_STEP, _LAST_STEP, _MOST_STEPS = 8.0, 0.5, 200
# Readings on either side of the onset of that search between which the misfit is minimised.
_NEAR = 3
# Instants that differ by less, relative to the latest, are one.
_ROUNDING = 1e-14
# Fits in each interval at first, and the share of their spread by which more may lower the misfit:
# a search has by then come within a tenth of the interval of where the misfit is lowest.
_FEW, _DROP = 6, 0.5


@dataclass(frozen=True)
class OnsetFit:
    """Best fit of a trace for one onset."""

    onset_s: float
    """The onset, on the trace's clock."""
    log_parameters: Array
    """Sample parameters, (n_parameters,)."""
    misfit_rad: float
    """RMS misfit."""


def spacing_at(time_s: Array, at_s: float) -> float:
    """Return how far ascending times, (n,), are apart at one of them, or nearest to it, in s."""
    after = int(np.clip(np.searchsorted(time_s, at_s), 1, len(time_s) - 1))
    return float(time_s[after] - time_s[after - 1])


def _misfit_rad(fit: OnsetFit) -> float:
    return fit.misfit_rad


class OnsetFits:
    """Fits of a trace for given onsets, linear and in white noise.

    Parameters
    ----------
    case_problem
        Assumptions of the identification.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending on any clock.
    """

    def __init__(self, case_problem: CaseProblem, time_s: Array, rotation_rad: Array) -> None:
        self._case_problem = case_problem.to_identify()
        self._time_s, self._rotation_rad = time_s, rotation_rad
        self._interval_s = float(np.median(np.diff(time_s)))
        self.noise_rad = estimate_noise(rotation_rad)

    def best(self, guess_s: float) -> OnsetFit:
        """Fit the onset along, beginning with a guess in s."""
        problem = self._case_problem.of(self._time_s - guess_s, self._rotation_rad)
        (found,) = identify_many([problem], _BUDGET, [np.random.default_rng(0)], silent)
        start = OnsetFit(guess_s, np.log(found.parameters), found.misfit_rad)
        return self._between_readings(self._searched(start, _FIRST_STEP))

    def near(self, start: OnsetFit) -> OnsetFit:
        """Fit the onset along near that of another fit."""
        best = self._searched(start, 1.0)
        for ends in self._smooth_intervals(best.onset_s, 1):
            best = min(self._lowered([best], ends, _FEW), key=_misfit_rad)
        return best

    def at(self, onset_s: float, near: Array) -> OnsetFit:
        """Fit the sample for an onset by a local fit from log-parameters, (n_parameters,)."""
        problem = self._case_problem.of(self._time_s - onset_s, self._rotation_rad)
        fit = fit_from([problem], near)
        return OnsetFit(onset_s, fit.x[0], float(fit.misfit_rad[0]))

    def _searched(self, best: OnsetFit, first_step: float) -> OnsetFit:
        """Search the onset in steps, halved where neither direction is better.

        The first is some median intervals of the readings.

        The last steps are half as long as the readings are apart where the onset is, which of
        times with equal ratios is much less than the median.
        """
        step_s = first_step * self._interval_s
        for _ in range(_MOST_STEPS):
            if step_s < _LAST_STEP * min(self._interval_s, spacing_at(self._time_s, best.onset_s)):
                break
            sides = (self.at(best.onset_s + s, best.log_parameters) for s in (-step_s, step_s))
            lower = min(sides, key=_misfit_rad)
            if lower.misfit_rad < best.misfit_rad:
                best = lower
            else:
                step_s /= 2
        return best

    def _between_readings(self, best: OnsetFit) -> OnsetFit:
        """Minimise the misfit in each neighbouring interval in which it is smooth.

        Those are left early in which the first fits are all far above the best one.
        """
        intervals = list(self._smooth_intervals(best.onset_s, _NEAR))
        tried = [self._lowered([best], ends, _FEW) for ends in intervals]
        first = min((fit for fits in tried for fit in fits), key=_misfit_rad)
        for fits, ends in zip(tried, intervals, strict=True):
            misfits_rad = [fit.misfit_rad for fit in fits[1:]]
            if min(misfits_rad) - _DROP * np.ptp(misfits_rad) <= first.misfit_rad:
                best = min(best, *self._lowered(fits, ends, _MOST_STEPS), key=_misfit_rad)
        return best

    def _lowered(
        self, fits: list[OnsetFit], bounds: tuple[float, float], most: int
    ) -> list[OnsetFit]:
        """Return fits, and those that a search for the lowest misfit adds within bounds."""
        known = {fit.onset_s: fit for fit in fits}

        def misfit_rad(onset_s: float) -> float:
            if onset_s not in known:
                nearest = min(known, key=lambda known_s: abs(known_s - onset_s))
                known[onset_s] = self.at(onset_s, known[nearest].log_parameters)
            return known[onset_s].misfit_rad

        minimize_scalar(misfit_rad, bounds=bounds, method="bounded", options={"maxiter": most})
        return list(known.values())

    def _smooth_intervals(self, onset_s: float, near: int) -> Iterator[tuple[float, float]]:
        """Yield intervals of onsets around one, within which no reading passes a change of torque.

        An onset before the first reading passes none, however early: the first interval then
        begins some times as far before it.
        """
        torque = self._case_problem.torque
        changes_s = np.unique([start for start, *_ in (*torque.jumps, *torque.swings)])
        edges = np.unique(np.subtract.outer(self._time_s, changes_s))
        equal_s = _ROUNDING * max(np.abs(self._time_s).max(), np.abs(changes_s).max())
        edges = edges[np.diff(edges, prepend=-np.inf) > equal_s]
        after = int(np.searchsorted(edges, onset_s))
        if after < near:
            before_s = max(edges[0] - onset_s, spacing_at(edges, onset_s))
            yield float(edges[0] - _NEAR * before_s), float(edges[0])
        yield from pairwise(edges[max(after - near, 0) : after + near].tolist())
