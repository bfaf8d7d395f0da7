"""Profile likelihood: how well a trace can still be fitted with one quantity held.

Of all quantities of many traces at once. All points are fitted from the
optimum at once, then from the fits of both neighbours, again and again where these
have become better: what is a basin anywhere in a profile is followed both ways. The
limits are the outermost: what is between them need not all be within confidence,
and where it is not is told as gaps.

References
----------
.. [1] D. J. Venzon and S. H. Moolgavkar, A method for computing profile-likelihood-based
   confidence intervals, Applied Statistics 37 (1988), 87-94.
.. [2] A. Raue et al., Structural and practical identifiability analysis of partially observed
   dynamical models by exploiting the profile likelihood, Bioinformatics 25 (2009), 1923-1929.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.identifiability.confidence_set import gaps_of
from biogrip.identifiability.crossings import Brackets, crossings
from biogrip.identifiability.held_fits import CLOSE, HeldFits
from biogrip.identifiability.likelihood import Likelihood
from biogrip.identifiability.quantities import Quantity
from biogrip.identifiability.smooth import Points, smoothed
from biogrip.identify.local_fits import FAIR, FINE, alike

# Steps away from the best fit, in standard deviations, that every profile has.
_NEAR = np.array([z for z in np.arange(-4.0, 4.1, 0.5) if z != 0])
_POINTS = 35
# Points closer than this are one.
_APART = 1e-9
_ACCURACY = 1e-5
# Share of one more than the rise by which a fit has to become better to be news to its neighbours.
_NEWS = 1e-3


@dataclass(frozen=True)
class Profile:
    """A profile and its confidence limits, as logarithms of the quantity.

    Parameters
    ----------
    log_values, rises : (n_points,)
        Ascending values, and the rise of chi^2 at each.
    best
        Value at the optimum.
    low, high
        Confidence limits; None where the trace does not close the profile.
    lowest : (n_parameters,)
        Log-parameters at the lowest rise, which is below zero if the optimum was missed.
    gaps
        Where, between points within confidence, the profile is above the threshold.
    """

    log_values: Array
    rises: Array
    best: float
    low: float | None
    high: float | None
    lowest: Array
    gaps: tuple[tuple[float, float], ...] = ()


def profiles_of(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], *, smooth: bool = True
) -> list[list[Profile]]:
    """Follow quantities over their whole ranges, and find their confidence limits.

    Parameters
    ----------
    likelihoods
        One a trace.
    quantities
        Whose profiles are wanted.
    smooth
        Whether with as many points as it takes to draw them.

    Returns
    -------
    list of list of Profile
        By trace, then by quantity.
    """
    found: dict[int, list[Profile]] = {}
    for group in alike([likelihood.problem for likelihood in likelihoods]):
        own = _profiles_of_alike([likelihoods[index] for index in group], quantities, smooth=smooth)
        found.update(zip(group.tolist(), own, strict=True))
    return [found[index] for index in range(len(likelihoods))]


def grid_of(likelihood: Likelihood, quantity: Quantity) -> Array:
    """Values over a quantity's whole range, ascending: its best, denser near by, and both ends."""
    low, high = quantity.range(likelihood.problem.low, likelihood.problem.high)
    start = quantity.log(likelihood.best)
    near = start + likelihood.deviation(quantity) * _NEAR
    others = np.concatenate((near[(near > low) & (near < high)], np.linspace(low, high, _POINTS)))
    # Last bits must not make two points of an optimum that lies at an end.
    return np.unique(np.append(others[np.abs(others - start) > _APART], start))


def _profiles_of_alike(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], *, smooth: bool
) -> list[list[Profile]]:
    fits = HeldFits(likelihoods, quantities)
    shape = (len(likelihoods), len(quantities))
    trace, which = (index.ravel() for index in np.indices(shape))
    grids = [grid_of(likelihood, quantity) for likelihood in likelihoods for quantity in quantities]
    # Profiles side by side, (n_profiles, n_points), short ones filled up.
    values = np.full((len(grids), max(len(grid) for grid in grids)), np.nan)
    for row, grid in enumerate(grids):
        values[row, : len(grid)] = grid
    starts = fits.at_best().ravel()
    middle = np.argmax(values == starts[:, None], axis=1)
    done = _Points(fits, trace, which, values)
    done.rises[np.arange(len(grids)), middle] = 0.0
    _from_optimum(done, middle)
    _from_neighbours(done, middle)
    closed, crossed = _crossed(likelihoods, done)
    ends = np.where(closed, crossed, np.nan).T.tolist()
    limits = [(_or_none(low), _or_none(high)) for low, high in ends]
    points = [
        Points(grid, done.rises[index, : len(grid)], done.x[index, : len(grid)])
        for index, grid in enumerate(grids)
    ]
    if smooth:

        def fit(profile: IntArray, targets: Array, starts: Array) -> tuple[Array, Array]:
            return fits.at(trace[profile], which[profile], targets, starts, CLOSE)

        smoothed(points, [[at for at in ends if at is not None] for ends in limits], fit)
    return [
        [
            _profile_of(
                points[index],
                float(starts[index]),
                limits[index],
                float(fits.threshold[trace[index]]),
            )
            for index in range(t * shape[1], (t + 1) * shape[1])
        ]
        for t in range(shape[0])
    ]


def _or_none(limit: float) -> float | None:
    return None if np.isnan(limit) else limit


Limits = tuple[float | None, float | None]


def _profile_of(points: Points, best: float, limits: Limits, threshold: float) -> Profile:
    """Put a profile together from its points."""
    return Profile(
        points.values,
        points.rises,
        best,
        limits[0],
        limits[1],
        points.x[int(np.argmin(points.rises))],
        gaps_of(points.values, points.rises, threshold),
    )


class _Points:
    """Points of profiles, (n_profiles, n_points), as far as they are fitted."""

    def __init__(self, fits: HeldFits, trace: IntArray, which: IntArray, values: Array) -> None:
        self.fits, self.trace, self.which, self.values = fits, trace, which, values
        self.count = np.sum(np.isfinite(values), axis=1)
        self.rises = np.where(np.isfinite(values), np.inf, np.nan)
        self.x = np.repeat(fits.best[trace][:, None], values.shape[1], axis=1)

    def try_from(
        self, profile: IntArray, point: IntArray, start: IntArray, tolerance: float
    ) -> BoolArray:
        """Fit points from other points' fits; tell which have become much better."""
        rises, x = self.fits.at(
            self.trace[profile],
            self.which[profile],
            self.values[profile, point],
            self.x[profile, start],
            tolerance,
        )
        news = np.zeros(self.values.shape, dtype=bool)
        # A point may be fitted from both sides, so one side after the other.
        for side in (point <= start, point > start):
            here = profile[side], point[side]
            before, after = self.rises[here], rises[side]
            news[here] |= after < before - _NEWS * (1 + np.abs(after))
            better = after < before
            at = here[0][better], here[1][better]
            self.rises[at], self.x[at] = after[better], x[side][better]
        return news

    def extremes(self) -> Array:
        """Fits at both ends of each trace's profiles, (2 n_quantities, n_traces, n_parameters).

        A basin that some profile comes to may be the deepest at the limit of another.
        """
        ends = np.stack((self.x[:, 0], self.x[np.arange(len(self.x)), self.count - 1]))
        ends = ends.reshape(2, len(self.fits.best), -1, self.x.shape[2])
        extremes: Array = np.concatenate(ends.swapaxes(1, 2))
        return extremes


def _from_optimum(points: _Points, middle: IntArray) -> None:
    """Fit every point but the optimum from the optimum."""
    profile, point = np.nonzero(np.isfinite(points.values))
    profile, point = (index[point != middle[profile]] for index in (profile, point))
    points.try_from(profile, point, middle[profile], FAIR)


def _from_neighbours(points: _Points, middle: IntArray) -> None:
    """Fit points from their neighbours' fits, as long as these are news."""
    news = np.isfinite(points.values)
    while np.any(news):
        profile, neighbour = (np.tile(index, 2) for index in np.nonzero(news))
        point = neighbour + np.repeat((-1, 1), len(neighbour) // 2)
        to_fit = (point >= 0) & (point < points.count[profile]) & (point != middle[profile])
        profile, point, neighbour = profile[to_fit], point[to_fit], neighbour[to_fit]
        news = points.try_from(profile, point, neighbour, CLOSE)


def _crossed(likelihoods: Sequence[Likelihood], points: _Points) -> tuple[BoolArray, Array]:
    """Which ends of profiles are closed, (2, n_profiles), and where these cross the threshold."""
    threshold = points.fits.threshold[points.trace]
    certainty = np.array([max(each.certainty, each.threshold) for each in likelihoods])[
        points.trace
    ]
    everyone = np.arange(len(points.count))
    closed = np.stack(
        (points.rises[:, 0] > certainty, points.rises[everyone, points.count - 1] > certainty)
    )
    crossed = np.full(closed.shape, np.nan)
    end, profile = np.nonzero(closed)
    while len(profile):
        below = (points.rises < threshold[:, None]) & np.isfinite(points.values)
        first = np.argmax(below, axis=1)
        last = below.shape[1] - 1 - np.argmax(below[:, ::-1], axis=1)
        inside = np.where(end == 0, first[profile], last[profile])
        outside = np.where(end == 0, inside - 1, inside + 1)
        inner, outer = (profile, inside), (profile, outside)
        brackets = Brackets(
            points.trace[profile],
            points.which[profile],
            points.values[inner],
            points.values[outer],
            points.rises[inner],
            points.rises[outer],
            points.x[inner],
            points.x[outer],
            points.extremes()[:, points.trace[profile]],
        )
        found = crossings(points.fits, brackets, FINE, _ACCURACY)
        crossed[end, profile] = found.at
        points.rises[outer], points.x[outer] = found.outside_rise, found.outside_x
        # Where the outer point has come below the threshold, the next bracket is further out.
        on = np.isnan(found.at) & (outside > 0) & (outside < points.count[profile] - 1)
        end, profile = end[on], profile[on]
    return closed & np.isfinite(crossed), crossed
