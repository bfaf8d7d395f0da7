"""Profiles of all quantities of many traces at once.

`biogrip.identifiability.profile.profile` for a batch. Outwards, each point is
fitted from its neighbour's fit, in all profiles at the same time. Then every point
is fitted from its outer neighbour's fit, again and again where that one has become
better, so that a basin which is lower further out is followed inwards.
"""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.identifiability.crossings import Brackets, crossings
from biogrip.identifiability.held_fits import HeldFits
from biogrip.identifiability.profile import Likelihood, Profile, grid_of
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.local_fit import FINE

_ACCURACY = 1e-5
# Chi^2 by which a neighbour's fit must lead further down to be news to the next.
_NEWS = 1e-3


def many_profiles(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]
) -> list[list[Profile]]:
    """Follow quantities over their whole ranges, and find their confidence limits.

    Parameters
    ----------
    likelihoods
        One a trace.
    quantities
        Whose profiles are wanted.

    Returns
    -------
    list of list of Profile
        By trace, then by quantity.
    """
    fits = HeldFits(likelihoods, quantities)
    shape = (len(likelihoods), len(quantities))
    trace, which = (index.ravel() for index in np.indices(shape))
    grids = [grid_of(likelihood, quantity) for likelihood in likelihoods for quantity in quantities]
    count = np.array([len(grid) for grid in grids])
    # Profiles side by side, (n_profiles, n_points), short ones filled up.
    values = np.full((len(grids), count.max()), np.nan)
    for profile, grid in enumerate(grids):
        values[profile, : len(grid)] = grid
    starts = fits.at_best().ravel()
    middle = np.argmax(values == starts[:, None], axis=1)
    done = _Points(fits, trace, which, values)
    _outwards(done, middle, count)
    _inwards(done, middle, count)
    closed, crossed = _crossed(likelihoods, done, count)
    return [
        [
            Profile(
                grids[index],
                done.rises[index, : count[index]],
                float(starts[index]),
                float(crossed[0, index]) if closed[0, index] else None,
                float(crossed[1, index]) if closed[1, index] else None,
            )
            for index in range(t * shape[1], (t + 1) * shape[1])
        ]
        for t in range(shape[0])
    ]


class _Points:
    """Points of profiles, (n_profiles, n_points), as far as they are fitted."""

    def __init__(self, fits: HeldFits, trace: IntArray, which: IntArray, values: Array) -> None:
        self.fits, self.trace, self.which, self.values = fits, trace, which, values
        self.rises = np.zeros_like(values)
        self.x = np.repeat(fits.best[trace][:, None], values.shape[1], axis=1)

    def fit(self, profile: IntArray, point: IntArray, neighbour: IntArray) -> tuple[Array, Array]:
        """Fit points from their neighbours' fits: rises, (n,), and log-parameters."""
        return self.fits.at(
            self.trace[profile],
            self.which[profile],
            self.values[profile, point],
            self.x[profile, neighbour],
            FINE,
        )


def _outwards(points: _Points, middle: IntArray, count: IntArray) -> None:
    """Fit every point from the neighbour that is closer to the optimum."""
    for distance in range(1, points.values.shape[1]):
        ahead, behind = middle + distance < count, middle - distance >= 0
        profile = np.concatenate((np.flatnonzero(ahead), np.flatnonzero(behind)))
        sense = np.repeat((1, -1), (np.sum(ahead), np.sum(behind)))
        point = middle[profile] + sense * distance
        if not len(profile):
            break
        rises, x = points.fit(profile, point, point - sense)
        points.rises[profile, point], points.x[profile, point] = rises, x


def _inwards(points: _Points, middle: IntArray, count: IntArray) -> None:
    """Fit points from the neighbour that is further out, as long as that is of use."""
    profile, point = np.nonzero(np.isfinite(points.values))
    sense = np.sign(point - middle[profile])
    neighbour = point + sense
    chosen = (sense != 0) & (neighbour >= 0) & (neighbour < count[profile])
    while np.any(chosen):
        profile, point, sense = profile[chosen], point[chosen], sense[chosen]
        rises, x = points.fit(profile, point, point + sense)
        before = points.rises[profile, point]
        better = rises < before
        points.rises[profile[better], point[better]] = rises[better]
        points.x[profile[better], point[better]] = x[better]
        # Who is next inwards of those that are much better, and not the optimum itself.
        point = point - sense
        chosen = (rises < before - _NEWS) & (point != middle[profile])


def _crossed(
    likelihoods: Sequence[Likelihood], points: _Points, count: IntArray
) -> tuple[BoolArray, Array]:
    """Which ends of the profiles are closed, and where they cross the threshold, (2, n_profiles)."""
    threshold = points.fits.threshold[points.trace]
    certainty = np.array([max(each.certainty, each.threshold) for each in likelihoods])[points.trace]
    everyone = np.arange(len(count))
    closed = np.stack(
        (points.rises[:, 0] > certainty, points.rises[everyone, count - 1] > certainty)
    )
    below = (points.rises < threshold[:, None]) & np.isfinite(points.values)
    first = np.argmax(below, axis=1)
    last = below.shape[1] - 1 - np.argmax(below[:, ::-1], axis=1)
    end, profile = np.nonzero(closed)
    inside = np.where(end == 0, first[profile], last[profile])
    outside = np.where(end == 0, inside - 1, inside + 1)
    brackets = Brackets(
        points.trace[profile],
        points.which[profile],
        points.values[profile, inside],
        points.values[profile, outside],
        points.rises[profile, inside],
        points.rises[profile, outside],
        points.x[profile, inside],
    )
    crossed = np.full(closed.shape, np.nan)
    crossed[end, profile] = crossings(points.fits, brackets, FINE, _ACCURACY)
    return closed, crossed
