"""Increase of chi^2 with a quantity held at a value, for many traces and quantities at once."""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit.levenberg_marquardt import Minima
from biogrip.fit.local_fits import LocalFits
from biogrip.judging.likelihood import MISSED, Likelihood
from biogrip.judging.quantities import Quantity
from biogrip.judging.quantity_constraint import QuantityConstraint

CLOSE = 1e-7
"""Tolerance of fits that give chi^2 of some thousand readings to 0.001.

Along a valley, a fit to the last digit takes three times as many steps.
"""


class ConstrainedFits:
    """Fits of several traces with one of several quantities held at given values.

    Each profile belongs to a trace and a quantity; those of the first trace come first.

    Parameters
    ----------
    likelihoods
        One per trace; their problems have to be `alike`.
    quantities
        Quantities that may be held.

    Attributes
    ----------
    trace : (n_profiles,)
        Index of the trace of each profile.
    best : (n_profiles, n_parameters)
        Log-parameters of the trace's optimum.
    at_best : (n_profiles,)
        Logarithm of the quantity there.
    threshold, certainty : (n_profiles,)
        As in `Likelihood`; certainty is no less than the threshold.
    missed
        By trace, the lowest increase of chi^2 and its log-parameters, if it is so far
        below zero that the trace's global optimum was missed.
    """

    def __init__(self, likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]) -> None:
        self.likelihoods, self.quantities = likelihoods, quantities
        problems = [likelihood.problem for likelihood in likelihoods]
        self.trace = np.repeat(np.arange(len(likelihoods)), len(quantities))
        self._optima = np.stack([likelihood.best for likelihood in likelihoods])
        self.best = self._optima[self.trace]
        self.at_best = np.array([q.log(x) for x in self._optima for q in quantities])
        settings = [
            (one.threshold, one.certainty, one.misfit_rad, one.noise_rad) for one in likelihoods
        ]
        threshold, certainty, self._misfit_rad, self._noise_rad = np.array(settings).T
        self.threshold = threshold[self.trace]
        self.certainty = np.maximum(certainty, threshold)[self.trace]
        self.missed: dict[int, tuple[float, Array]] = {}
        self._fits = LocalFits(problems)
        self._residuals = problems[0].residuals
        scale_rad = np.array([problem.residuals.noise_scale_rad for problem in problems])
        # Ratio of chi^2 to the fits' sums of squares.
        self._ratio = (scale_rad / self._noise_rad) ** 2

    def at(
        self, profile: IntArray, targets: Array, near: Array, tolerance: float
    ) -> tuple[Array, Array]:
        """Minimize chi^2 over all parameters with one quantity held at a value.

        Parameters
        ----------
        profile : (n,)
            Index of the profile: the trace that is fitted and the quantity that is held.
        targets : (n,)
            Logarithms at which the quantities are held, within their ranges.
        near : (n, n_parameters)
            Starts, log-parameters; moved onto the constraint.
        tolerance
            Of the fits, see `biogrip.fit.local_fits`.

        Returns
        -------
        increases : (n,)
            Increase of chi^2 over each trace's optimum.
        log_parameters : (n, n_parameters)
            Fitted log-parameters, on the constraint up to rounding.
        """
        trace, which = np.divmod(profile, len(self.quantities))
        low, high = self._fits.low[trace], self._fits.high[trace]
        last_s = self._residuals.duration_s
        constraint = QuantityConstraint(self.quantities, which, targets, low, high, last_s)
        found = self._fits.fitted(near, trace, tolerance, constraint=constraint)
        return self._increases(found, trace) + constraint.price(found.x) * self._ratio[
            trace
        ], found.x

    def from_each(
        self, profile: IntArray, targets: Array, starts: Array, tolerance: float
    ) -> tuple[Array, Array]:
        """Fit as `at` does, each from several starts, (n_starts, n, n_parameters).

        Returns
        -------
        increases : (n_starts, n)
            Increase of chi^2 from each start.
        log_parameters : (n, n_parameters)
            Those of the lowest increase.
        """
        count, near = len(starts), np.concatenate(starts)
        increases, x = self.at(np.tile(profile, count), np.tile(targets, count), near, tolerance)
        increases = increases.reshape(count, -1)
        return increases, x.reshape(starts.shape)[np.argmin(increases, axis=0), range(len(profile))]

    def with_fixed(self, x: Array, fixed: BoolArray, tolerance: float) -> tuple[Array, Array]:
        """Fit the first trace with some parameters fixed; tolerance and results as in `at`.

        Parameters
        ----------
        x : (n, n_parameters)
            Starts, log-parameters.
        fixed : (n_parameters,)
            True for parameters fixed at their start, within the search range or not.
        """
        trace = np.zeros(len(x), dtype=np.int64)
        low, high = (np.where(fixed, x, end[0]) for end in (self._fits.low, self._fits.high))
        found = self._fits.fitted(x, trace, tolerance, low=low, high=high)
        return self._increases(found, trace), found.x

    def _increases(self, found: Minima, trace: IntArray) -> Array:
        excess = found.misfit_rad**2 - self._misfit_rad[trace] ** 2
        increases = self._residuals.samples * excess / self._noise_rad[trace] ** 2
        for index in np.flatnonzero(increases < -MISSED):
            of_trace = int(trace[index])
            if of_trace not in self.missed or increases[index] < self.missed[of_trace][0]:
                self.missed[of_trace] = float(increases[index]), found.x[index].copy()
        return increases

    def ranges(self) -> Array:
        """Return the lowest and highest logarithm of each profile's quantity, (2, n_profiles)."""
        bounds = zip(self._fits.low, self._fits.high, strict=True)
        return np.array(
            [quantity.range(*ends) for ends in bounds for quantity in self.quantities]
        ).T

    def deviations(self) -> Array:
        """Return the logarithms' first-order standard deviations, at most 1, (n_profiles,)."""
        information = self._fits.normal(self._optima, np.arange(len(self._optima))).information
        information = information * self._ratio[:, None, None]
        slopes = np.array([[q.gradient(x) for q in self.quantities] for x in self._optima])
        # The prior keeps the matrix regular.
        spread = np.linalg.solve(information, slopes.swapaxes(1, 2)).swapaxes(1, 2)
        return np.sqrt(np.clip(np.sum(spread * slopes, axis=2), 0.0, 1.0)).ravel()
