"""The mean of cells of which some are only bounded, and what every unit has of it.

Logarithms of a quantity are normal. A cell that is determined counts by the density of its value, a
cell that is only bounded by the probability beyond its bound: Tobin's likelihood (Econometrica 26
(1958), 24-36). In the ratios mean/scatter and 1/scatter it has no maximum but one (Olsen,
Econometrica 46 (1978), 1211-1215), which Newton's method finds.

Cells of a dish are alike, which this likelihood neglects: its mean remains right (Liang and Zeger,
Biometrika 73 (1986), 13-22), and its error is taken from units, by the jackknife (Miller,
Biometrika 61 (1974), 1-15). A pseudo-value of a unit is what the mean has of it; where no cell is
only bounded it is the mean of the unit's cells.
"""

from math import nan
from typing import Any

import numpy as np
from scipy.special import log_ndtr

from biogrip.arrays import Array

BELOW, KNOWN, ABOVE = -1, 0, 1
"""Where a cell lies: below its bound, at its value, above its bound."""

_MOST_STEPS, _CONVERGED, _LARGEST_CHANGE = 100, 1e-12, 0.5


def censored_mean(values: Array, sides: Array, weights: Array) -> float:
    """Return the mean of normal values (n,) of which some are bounds; nan if there is none.

    Sides (n,) are `BELOW`, `KNOWN` or `ABOVE`. At least two values have to be known and to differ,
    unless all are known.
    """
    known = sides == KNOWN
    if known.all() and len(known):
        return float(np.average(values, weights=weights))
    if len(set(values[known].tolist())) < 2:
        return nan
    middle, width = np.mean(values), np.std(values)
    scaled, weights = (values - middle) / width, weights / weights.sum()
    mean_ratio, inverse = 0.0, 1.0
    for _ in range(_MOST_STEPS):
        slope, curvature = _derivatives(scaled, sides, weights, mean_ratio, inverse)
        step = -np.linalg.solve(curvature, slope)
        step *= min(1.0, _LARGEST_CHANGE * inverse / max(abs(step[1]), 1e-300))
        mean_ratio, inverse = mean_ratio + step[0], inverse + step[1]
        if np.abs(step).max() < _CONVERGED * inverse:
            return float(middle + width * mean_ratio / inverse)
    return nan


def _derivatives(
    values: Array, sides: Array, weights: Array, mean_ratio: float, inverse: float
) -> tuple[Array, Array]:
    """Return slope (2,) and curvature (2, 2) of the log-likelihood by mean/scatter, 1/scatter."""
    known = sides == KNOWN
    deviations = inverse * values - mean_ratio
    log_density = -(deviations**2) / 2 - np.log(2 * np.pi) / 2
    hazard = -sides * np.exp(log_density - log_ndtr(-sides * deviations))
    first = weights * np.where(known, -deviations, hazard)
    second = weights * np.where(known, -1.0, -hazard * (hazard + deviations))
    by_parameter = np.stack([-np.ones_like(values), values])
    slope, curvature = by_parameter @ first, (by_parameter * second) @ by_parameter.T
    share = weights @ known
    slope[1] += share / inverse
    curvature[1, 1] -= share / inverse**2
    return slope, curvature


def pseudo_values(values: Array, sides: Array, weights: Array, units: Array) -> dict[Any, float]:
    """Return the pseudo-value of every unit (n,); their mean is the cells' mean.

    Nothing is returned where a mean is missing, as if without a unit no two cells were known.
    """
    names, places = np.unique(units, return_inverse=True)
    mean = censored_mean(values, sides, weights)
    if len(names) > 1:
        rests = [places != place for place in range(len(names))]
        without = np.array([censored_mean(values[it], sides[it], weights[it]) for it in rests])
        pseudo = mean - (len(names) - 1) * (without - without.mean())
    else:
        pseudo = np.array([mean])
    return (
        dict(zip(names.tolist(), pseudo.tolist(), strict=True)) if np.isfinite(pseudo).all() else {}
    )
