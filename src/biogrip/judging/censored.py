"""The mean of cells of which some are only bounded, and what every unit has of it.

Logarithms of a quantity are normal. A cell that is determined counts by the density of its value, a
cell that is only bounded by the probability beyond its bound (Tobin, Econometrica 26 (1958),
24-36). That likelihood has one maximum (Olsen, Econometrica 46 (1978), 1211-1215), to which leads
what Wolynetz does (Applied Statistics 28 (1979), 195-206):

1. From a mean and a scatter take what is expected of cells beyond their bounds, and of its square.
2. Mean and scatter are those of all cells, with these for the cells that are only bounded.

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

_MOST_STEPS, _CONVERGED = 2000, 1e-10


def censored_mean(values: Array, sides: Array, weights: Array) -> float:
    """Return the mean of normal values (n,) of which some are bounds; nan if there is none.

    Sides (n,) are `BELOW`, `KNOWN` or `ABOVE`. Two values have to be known and to differ, or all
    to be known.
    """
    known = sides == KNOWN
    if known.all() and len(known):
        return float(np.average(values, weights=weights))
    if len(set(values[known].tolist())) < 2:
        return nan
    mean, sd = float(np.average(values, weights=weights)), float(np.std(values))
    for _ in range(_MOST_STEPS):
        ends = (values - mean) / sd
        hazards = sides * np.exp(-(ends**2) / 2 - log_ndtr(-sides * ends)) / np.sqrt(2 * np.pi)
        shift = float(np.average(np.where(known, ends, hazards), weights=weights))
        squares = np.where(known, ends**2, 1 + ends * hazards)
        mean += sd * shift
        growth = float(np.average(squares, weights=weights) - shift**2) ** 0.5
        sd *= growth
        if abs(shift) + abs(growth - 1) < _CONVERGED:
            return mean
    return nan


def pseudo_values(values: Array, sides: Array, weights: Array, units: Any) -> dict[Any, float]:
    """Return the pseudo-value of every unit (n,); their mean is the cells' mean.

    Nothing is returned where a mean is missing, as if without a unit no two cells were known.
    """
    names, places = np.unique(units, return_inverse=True)
    mean = censored_mean(values, sides, weights)
    if len(names) < 2:
        without = np.array([mean])
    else:
        rests = [places != place for place in range(len(names))]
        without = np.array([censored_mean(values[it], sides[it], weights[it]) for it in rests])
    pseudo = mean - (len(names) - 1) * (without - without.mean())
    return (
        dict(zip(names.tolist(), pseudo.tolist(), strict=True)) if np.isfinite(pseudo).all() else {}
    )
