"""The cells of one dish as a sample of a population: its median, its spread, and shrunk cells.

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
"""Of fewer cells a population is not spoken of: the 95 % interval of the median of two reaches
from it, either way, six times as far as one of them is from the other."""

# From the smallest errors, the estimate of tau comes near by doubling.
_MOST_STEPS = 500


@dataclass(frozen=True)
class Estimates:
    """What is known of one quantity in the cells of one dish.

    Parameters
    ----------
    cells
        Names.
    log_values : (n_cells,)
        Logarithms of the quantity.
    deviations : (n_cells,)
        Their standard deviations, above zero.
    """

    cells: tuple[str, ...]
    log_values: Array
    deviations: Array


@dataclass(frozen=True)
class Population:
    """Where the cells of a dish come from; all are logarithms of the quantity.

    Parameters
    ----------
    estimates
        Its cells.
    confidence
        Of all intervals, e.g. 0.95.
    centre, deviation
        Mean of the logarithms, that is the logarithm of the median, and its standard deviation.
    spread
        Standard deviation from cell to cell, without what is the error of each.
    spread_low, spread_high
        Its confidence limits.
    shrunk, shrunk_deviations : (n_cells,)
        Cells as they are most probable given all others, and their standard deviations.
    """

    estimates: Estimates
    confidence: float
    centre: float
    deviation: float
    spread: float
    spread_low: float
    spread_high: float
    shrunk: Array
    shrunk_deviations: Array

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the deviations."""
        return len(self.estimates.cells) - 1

    @property
    def reach(self) -> float:
        """How many standard deviations an interval reaches to either side."""
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


def population_of(estimates: Estimates, confidence: float) -> Population:
    """Estimate the population that the cells of a dish come from.

    Parameters
    ----------
    estimates
        At least two cells.
    confidence
        Of the intervals, e.g. 0.95.
    """
    from statsmodels.stats.meta_analysis import combine_effects

    y, error = estimates.log_values, estimates.deviations**2
    combined = combine_effects(y, error, method_re="pm", maxiter=_MOST_STEPS)
    variance, centre = float(combined.tau2), float(combined.mean_effect_re)
    deviation = sqrt(combined.var_hksj_re)
    # Of what a cell differs from the median by, so much is not its error.
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
    """Limits of tau, zero where Q is below the quantile without any spread."""
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
            # Q is no more than it is about the plain mean, and without the errors.
            most = 2 * largest
            limits.append(sqrt(brentq(beyond, 0.0, most, (quantile,), xtol=1e-15 * most)))
    return limits[0], limits[1]


def _q(y: Array, error: Array, variance: float) -> float:
    weight = 1 / (variance + error)
    centre = np.sum(weight * y) / np.sum(weight)
    return float(np.sum(weight * (y - centre) ** 2))
