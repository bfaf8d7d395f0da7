"""Rises of chi^2 with quantities held exactly, for many traces, quantities and values at once."""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.identifiability.held import HeldQuantities
from biogrip.identifiability.likelihood import MISSED, Likelihood
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.levenberg_marquardt import Minima
from biogrip.identify.local_fits import LocalFits

CLOSE = 1e-7
"""Tolerance of fits whose chi^2, of some thousand samples, is to be known to 0.001.

Along a valley, a fit to the last digit takes three times as many steps.
"""


class HeldFits:
    """Fits of any of a number of traces with any of a number of quantities held.

    Parameters
    ----------
    likelihoods
        One a trace; their problems have to be `alike`.
    quantities
        What may be held.

    Attributes
    ----------
    deeper
        By trace, the lowest rise so far and its log-parameters, if that is so far below
        zero that the trace's optimum was missed.
    """

    def __init__(self, likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]) -> None:
        problems = [likelihood.problem for likelihood in likelihoods]
        self.quantities = quantities
        self.best = np.stack([likelihood.best for likelihood in likelihoods])
        self.threshold = np.array([likelihood.threshold for likelihood in likelihoods])
        self.deeper: dict[int, tuple[float, Array]] = {}
        self._fits = LocalFits(problems)
        self._residuals = problems[0].residuals
        self._misfit_rad = np.array([likelihood.misfit_rad for likelihood in likelihoods])
        self._noise_rad = np.array([likelihood.noise_rad for likelihood in likelihoods])
        self._scale_rad = np.array([problem.residuals.noise_scale_rad for problem in problems])

    def at(
        self, trace: IntArray, which: IntArray, targets: Array, near: Array, tolerance: float
    ) -> tuple[Array, Array]:
        """Fit with quantities held.

        Parameters
        ----------
        trace, which : (n,)
            Which trace is fitted, and which quantity held.
        targets : (n,)
            Logarithms at which the quantities are held, within their ranges.
        near : (n, n_parameters)
            Log-parameters to start from; moved to where the quantities have their values.
        tolerance
            Of the fits, see `biogrip.identify.local_fits`.

        Returns
        -------
        rises : (n,)
            Of chi^2 over each trace's optimum.
        log_parameters : (n, n_parameters)
            Where the quantities have their values to rounding.
        """
        held = HeldQuantities(
            self.quantities,
            which,
            targets,
            self._fits.low,
            self._fits.high,
            self._residuals.duration_s,
        )
        found = self._fits.fitted(near, trace, tolerance, held=held)
        # In the unit of the fits' residuals, as what the fits are held to is.
        price = held.price(found.x) * (self._scale_rad / self._noise_rad)[trace] ** 2
        return self._rises(found, trace) + price, found.x

    def with_fixed(
        self, trace: IntArray, x: Array, fixed: BoolArray, tolerance: float
    ) -> tuple[Array, Array]:
        """Fit with some parameters fixed; returns as `at`.

        Parameters
        ----------
        trace : (n,)
            Which trace is fitted.
        x : (n, n_parameters)
            Log-parameters to start from.
        fixed : (n, n_parameters)
            Which of them stay, be they within the search range or not.
        tolerance
            Of the fits, see `biogrip.identify.local_fits`.
        """
        low, high = np.where(fixed, x, self._fits.low), np.where(fixed, x, self._fits.high)
        found = self._fits.fitted(x, trace, tolerance, low=low, high=high)
        return self._rises(found, trace), found.x

    def _rises(self, found: Minima, trace: IntArray) -> Array:
        excess = found.misfit_rad**2 - self._misfit_rad[trace] ** 2
        rises = self._residuals.samples * excess / self._noise_rad[trace] ** 2
        for index in np.flatnonzero(rises < -MISSED):
            of_trace = int(trace[index])
            if of_trace not in self.deeper or rises[index] < self.deeper[of_trace][0]:
                self.deeper[of_trace] = float(rises[index]), found.x[index].copy()
        return rises

    def ranges(self) -> tuple[Array, Array]:
        """Lowest and highest logarithm of each quantity, (n_quantities,) each."""
        ends = [quantity.range(self._fits.low, self._fits.high) for quantity in self.quantities]
        low, high = np.array(ends).T
        return low, high

    def at_best(self) -> Array:
        """Logarithms of the quantities at the optima, (n_traces, n_quantities)."""
        return np.array([[quantity.log(x) for quantity in self.quantities] for x in self.best])

    def deviations(self) -> Array:
        """Standard deviations of the logarithms to first order, at most 1.

        Returns
        -------
        (n_traces, n_quantities)
        """
        information = self._fits.normal(self.best, np.arange(len(self.best))).information
        information = information * ((self._scale_rad / self._noise_rad) ** 2)[:, None, None]
        slopes = np.array([[q.gradient(x) for q in self.quantities] for x in self.best])
        # The prior keeps this regular.
        spread = np.linalg.solve(information, slopes.swapaxes(1, 2)).swapaxes(1, 2)
        return np.sqrt(np.clip(np.sum(spread * slopes, axis=2), 0.0, 1.0))
