"""How likely a difference between two dishes is seen, and how many cells it takes.

Of n cells a dish that scatter by the spread tau, each estimated with the error s, the logarithm
of the ratio of medians has the variance 2 (tau^2 + s^2)/n, and t is distributed with 2 (n - 1)
degrees of freedom about ln(ratio) in units of its root: the noncentral t. Where errors differ
from cell to cell, badly known cells count less, and the power is more than with their root mean
square.

References
----------
.. [1] J. Cohen, Statistical Power Analysis for the Behavioral Sciences, 2nd ed., Erlbaum, 1988,
   chapter 2.
"""

from math import exp, hypot, log

from biogrip.groups.population import FEWEST_CELLS


def power(ratio: float, cells: int, spread: float, error: float, confidence: float = 0.95) -> float:
    """Probability that a difference is found at all.

    Parameters
    ----------
    ratio
        Of the medians of the two populations.
    cells
        How many cells each dish has, at least 2.
    spread
        Standard deviation of the logarithm from cell to cell.
    error
        Standard deviation of each estimate of it.
    confidence
        Of the interval that is not to hold 1.
    """
    from statsmodels.stats.power import TTestIndPower

    size = abs(log(ratio)) / hypot(spread, error)
    return float(TTestIndPower().power(size, cells, 1 - confidence))


def cells_needed(
    ratio: float, wanted: float, spread: float, error: float, confidence: float = 0.95
) -> int:
    """Cells that each dish must have for a difference to be found with a probability.

    Fewer than are compared at all it never is.

    Parameters
    ----------
    ratio, spread, error, confidence
        As of `power`; the ratio is not 1.
    wanted
        The probability, e.g. 0.8.
    """
    most = FEWEST_CELLS
    while power(ratio, most, spread, error, confidence) < wanted:
        most *= 2
    return next(
        cells
        for cells in range(max(FEWEST_CELLS, most // 2), most + 1)
        if power(ratio, cells, spread, error, confidence) >= wanted
    )


def ratio_seen(
    cells: int, wanted: float, spread: float, error: float, confidence: float = 0.95
) -> float:
    """Smallest ratio above 1 that is found with a probability; parameters as of `cells_needed`."""
    from statsmodels.stats.power import TTestIndPower

    size = TTestIndPower().solve_power(None, cells, 1 - confidence, wanted)
    return exp(float(size) * hypot(spread, error))
