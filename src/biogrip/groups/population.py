"""Population of the cells of one dish by random-effects meta-analysis: median, spread, shrinkage.

A quantity's logarithm in cell i is estimated as y_i with standard deviation s_i, and scatters
from cell to cell with the spread tau about the population's mu:

    y_i ~ N(mu, tau^2 + s_i^2)

With weights w_i = 1/(tau^2 + s_i^2) the generalized statistic is Q = sum w_i (y_i - mu)^2, where
mu = sum w_i y_i / sum w_i; it is distributed as chi^2 with n - 1 degrees of freedom. Where it
equals n - 1 is the estimate of tau, where it equals a quantile, a limit.

References
----------
.. [1] R. C. Paule and J. Mandel, Consensus values and weighting factors, Journal of Research of
   the National Bureau of Standards 87 (1982), 377-385: the estimate of tau.
.. [2] A. A. Veroniki et al., Methods to estimate the between-study variance and its uncertainty
   in meta-analysis, Research Synthesis Methods 7 (2016), 55-79: why that one.
.. [3] J. Hartung and G. Knapp, On tests of the overall treatment effect in meta-analysis with
   normally distributed responses, Statistics in Medicine 20 (2001), 1771-1782.
.. [4] K. Sidik and J. N. Jonkman, A simple confidence interval for meta-analysis, Statistics in
   Medicine 21 (2002), 3153-3159: with [3], the interval of mu.
.. [5] W. Viechtbauer, Confidence intervals for the amount of heterogeneity in meta-analysis,
   Statistics in Medicine 26 (2007), 37-52: limits of tau by profiles of Q.
.. [6] S. W. Raudenbush and A. S. Bryk, Empirical Bayes meta-analysis, Journal of Educational
   Statistics 10 (1985), 75-98: shrunk values and their deviations.
"""

from dataclasses import dataclass
from math import exp, sqrt

import numpy as np

from biogrip.arrays import Array

FEWEST_CELLS = 3
"""Fewest cells for a population: with two, the 95 % interval of the median would reach six
times their distance to either side."""

# Iterations for tau, which may start many doublings below its value.
_MOST_STEPS = 500


@dataclass(frozen=True)
class Estimates:
    """Estimates of one quantity in the cells of one dish, as logarithms."""

    cells: tuple[str, ...]
    """Names of the cells."""
    log_values: Array
    """Logarithms of the quantity, (n_cells,)."""
    deviations: Array
    """Standard deviations of the logarithms, above zero, (n_cells,)."""


@dataclass(frozen=True)
class Population:
    """Population of the cells of a dish; all values are logarithms of the quantity."""

    estimates: Estimates
    """Estimates that the population is fitted to."""
    confidence: float
    """Confidence level of all intervals, e.g. 0.95."""
    centre: float
    """Mean of the logarithms, that is the logarithm of the median."""
    deviation: float
    """Its standard deviation."""
    spread: float
    """Standard deviation between cells, without estimation errors."""
    spread_low: float
    """Lower confidence limit of the spread."""
    spread_high: float
    """Upper one."""
    shrunk: Array
    """Empirical Bayes estimates of the cells, (n_cells,)."""
    shrunk_deviations: Array
    """Their standard deviations, (n_cells,)."""

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the deviations."""
        return len(self.estimates.cells) - 1

    @property
    def reach(self) -> float:
        """Half width of an interval in standard deviations."""
        from scipy.special import stdtrit

        return float(stdtrit(self.freedom, (1 + self.confidence) / 2))

    @property
    def median(self) -> float:
        """Median of the population in SI units."""
        return exp(self.centre)

    @property
    def low(self) -> float:
        """Lower confidence limit of the median in SI units."""
        return exp(self.centre - self.reach * self.deviation)

    @property
    def high(self) -> float:
        """Upper confidence limit of the median in SI units."""
        return exp(self.centre + self.reach * self.deviation)


def estimate_population(estimates: Estimates, confidence: float) -> Population:
    """Estimate the population of the cells of a dish.

    Parameters
    ----------
    estimates
        Estimates of at least two cells.
    confidence
        Confidence level of the intervals, e.g. 0.95.
    """
    from statsmodels.stats.meta_analysis import combine_effects

    y, error = estimates.log_values, estimates.deviations**2
    combined = combine_effects(y, error, method_re="pm", maxiter=_MOST_STEPS)
    variance, centre = float(combined.tau2), float(combined.mean_effect_re)
    deviation = sqrt(combined.var_hksj_re)
    # Share of a cell's variance that is not its estimation error.
    own = variance / (variance + error)
    low, high = _spread_limits(y, error, confidence)
    return Population(
        estimates,
        confidence,
        centre,
        deviation,
        sqrt(variance),
        low,
        high,
        centre + own * (y - centre),
        np.sqrt(own * error + (1 - own) ** 2 * deviation**2),
    )


def _spread_limits(y: Array, error: Array, confidence: float) -> tuple[float, float]:
    """Return limits of tau; a limit is 0 if Q is below the quantile even without spread."""
    from scipy.optimize import brentq
    from scipy.special import chdtri

    freedom = len(y) - 1
    tails = (1 - confidence) / 2, (1 + confidence) / 2
    largest = float(np.sum((y - np.mean(y)) ** 2)) / chdtri(freedom, tails[1])

    def beyond(variance: float, quantile: float) -> float:
        return _q(y, error, variance) - quantile

    limits = []
    for tail in tails:
        quantile = float(chdtri(freedom, tail))
        if beyond(0.0, quantile) <= 0:
            limits.append(0.0)
        else:
            # Upper bound: Q is largest about the plain mean without errors.
            most = 2 * largest
            limits.append(sqrt(brentq(beyond, 0.0, most, (quantile,), xtol=1e-15 * most)))
    return limits[0], limits[1]


def _q(y: Array, error: Array, variance: float) -> float:
    weight = 1 / (variance + error)
    centre = np.sum(weight * y) / np.sum(weight)
    return float(np.sum(weight * (y - centre) ** 2))
