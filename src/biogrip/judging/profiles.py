"""Profile likelihood: minimum of chi^2 over all parameters as a function of one quantity.

All quantities of many traces are profiled at once. All points are fitted from the
optimum, then from the fits of both neighbours, again and again where these have
improved: a basin found anywhere in a profile is followed both ways. The confidence
limits are the outermost: values between them may be excluded, too, which gaps tell.

References
----------
.. [1] D. J. Venzon and S. H. Moolgavkar, A method for computing profile-likelihood-based
   confidence intervals, Applied Statistics 37 (1988), 87-94.
.. [2] A. Raue et al., Structural and practical identifiability analysis of partially observed
   dynamical models by exploiting the profile likelihood, Bioinformatics 25 (2009), 1923-1929.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.local_fits import FINE, alike
from biogrip.judging.constrained_fits import ConstrainedFits
from biogrip.judging.crossings import Brackets, crossings
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.points import Points
from biogrip.judging.quantities import Quantity

# Points near the best fit, in standard deviations, that every profile has.
_NEAR = np.array([z for z in np.arange(-4.0, 4.1, 0.5) if z != 0])
_POINTS = 35
# Points closer to the optimum than this are left out.
_APART = 1e-9
_ACCURACY = 1e-5
# Factor by which a gap exceeds the threshold: fits give chi^2 with an error of about 0.01.
_CLEARLY = 1.01


@dataclass(frozen=True)
class Profile:
    """A profile and its confidence limits, as logarithms of the quantity."""

    log_values: Array
    """Ascending values, (n_points,)."""
    increases: Array
    """Increase of chi^2 at each, (n_points,)."""
    best: float
    """Value at the optimum."""
    low: float | None
    """Lower confidence limit; None where the trace sets none."""
    high: float | None
    """Upper confidence limit, likewise."""
    lowest: Array
    """Log-parameters of the lowest increase, which is negative if the optimum was missed,
    (n_parameters,)."""
    gaps: tuple[tuple[float, float], ...] = ()
    """Stretches between the limits in which the profile is above the threshold."""
    certainty: float | None = None
    """Increase that a limit takes at an end of the range, if an end is above the threshold and yet
    has no limit for want of it; else None."""


def compute_profiles(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], *, smooth: bool = True
) -> list[list[Profile]]:
    """Compute profile likelihoods over the whole ranges of quantities, and confidence limits.

    Parameters
    ----------
    likelihoods
        One per trace.
    quantities
        Quantities that are profiled.
    smooth
        True to add as many points as a drawing needs.

    Returns
    -------
    list of list of Profile
        By trace, then by quantity.
    """
    found: dict[int, list[Profile]] = {}
    count = len(quantities)
    for group in alike([likelihood.problem for likelihood in likelihoods]):
        fits = ConstrainedFits([likelihoods[index] for index in group], quantities)
        own = _profiles(fits, smooth=smooth)
        for place, index in enumerate(group.tolist()):
            found[index] = own[place * count : (place + 1) * count]
    return [found[index] for index in range(len(likelihoods))]


def _profiles(fits: ConstrainedFits, *, smooth: bool) -> list[Profile]:
    grids = [_grid(each, quantity) for each in fits.likelihoods for quantity in fits.quantities]
    points = Points(fits, grids)
    points.from_optimum()
    points.from_neighbours()
    limits = _limits(points).T
    if smooth:
        points.smooth(limits)
    found = []
    for index, ends in enumerate(limits.tolist()):
        own = points.profile == index
        values, increases, x = points.values[own], points.increases[own], points.x[own]
        low, high = (None if np.isnan(end) else end for end in ends)
        gaps = find_gaps(values, increases, float(fits.threshold[index]))
        lowest = x[int(np.argmin(increases))]
        short = (increases[[0, -1]] > fits.threshold[index]) & np.isnan(ends)
        certainty = float(fits.certainty[index]) if np.any(short) else None
        best = float(fits.at_best[index])
        found.append(Profile(values, increases, best, low, high, lowest, gaps, certainty))
    return found


def _grid(likelihood: Likelihood, quantity: Quantity) -> Array:
    """Return ascending values over a quantity's whole range, denser near the optimum."""
    low, high = quantity.range(likelihood.problem.low, likelihood.problem.high)
    start = quantity.log(likelihood.best)
    near = start + likelihood.deviation(quantity) * _NEAR
    others = np.concatenate((near[(near > low) & (near < high)], np.linspace(low, high, _POINTS)))
    # Rounding must not make two points of an optimum that lies at an end.
    return np.unique(np.append(others[np.abs(others - start) > _APART], start))


def _limits(points: Points) -> Array:
    """Find the limits, where profiles cross the threshold, (2, n_profiles); NaN without limit."""
    fits, ends = points.fits, points.ends()
    crossed = np.full(ends.shape, np.nan)
    end, profile = np.nonzero(points.increases[ends] > fits.certainty)
    while len(profile):
        below = np.flatnonzero(points.increases < fits.threshold[points.profile])
        own = points.profile[below]
        first, last = np.searchsorted(own, profile), np.searchsorted(own, profile, "right") - 1
        inside = below[np.where(end == 0, first, last)]
        outside = np.where(end == 0, inside - 1, inside + 1)
        both = np.stack((inside, outside))
        values, increases, x = points.values[both], points.increases[both], points.x[both]
        elsewhere = points.extremes()[:, fits.trace[profile]]
        brackets = Brackets(profile, values, increases, x, elsewhere)
        found = crossings(fits, brackets, FINE, _ACCURACY)
        crossed[end, profile] = found
        points.increases[both], points.x[both] = brackets.increases, brackets.x
        # Where the outer point has come below the threshold, the next bracket is further out.
        on = np.isnan(found) & (outside != ends[end, profile])
        end, profile = end[on], profile[on]
    return crossed


def find_gaps(
    log_values: Array, increases: Array, threshold: float
) -> tuple[tuple[float, float], ...]:
    """Find the stretches of a profile above the threshold that lie between points below it.

    Parameters
    ----------
    log_values, increases : (n_points,)
        A profile.
    threshold
        Increase of chi^2 at the limits.

    Returns
    -------
    tuple of (float, float)
        Both ends of each, interpolated linearly in the square root of the increase.
    """
    inside = np.flatnonzero(increases < threshold).tolist()
    found = []
    for start, end in pairwise(inside):
        if end > start + 1 and increases[start + 1 : end].max() > _CLEARLY * threshold:
            begins = _crossing(log_values, increases, threshold, start, start + 1)
            found.append((begins, _crossing(log_values, increases, threshold, end, end - 1)))
    return tuple(found)


def _crossing(
    log_values: Array, increases: Array, threshold: float, inside: int, outside: int
) -> float:
    ends = np.sqrt(np.maximum(increases[[inside, outside]], 0.0))
    if ends[1] <= ends[0]:
        return float(log_values[outside])
    share = min((np.sqrt(threshold) - ends[0]) / (ends[1] - ends[0]), 1.0)
    return float(log_values[inside] + share * (log_values[outside] - log_values[inside]))
