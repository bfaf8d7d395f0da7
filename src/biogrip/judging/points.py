"""Points of profiles, fitted from one another, and added where drawings need more of them."""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit.local_fits import FAIR
from biogrip.judging.constrained_fits import CLOSE, ConstrainedFits

HIGHEST = 16.0
"""Increase of chi^2 up to which a profile has dense points, as figures show no more."""

# Largest difference between neighbours of the square root of the increase, which is nearly linear.
_STEP = 0.3
_MOST_ROUNDS = 8
NEWS = 1e-3
"""Improvement of a fit, relative to 1 + increase of chi^2, that has its neighbours fitted again."""


class Points:
    """Points of several profiles, one profile after the other, with their best fits so far.

    Parameters
    ----------
    fits
        The profiles.
    grids
        Of each, ascending logarithms of the quantity, that of the optimum among them.

    Attributes
    ----------
    profile : (n_points,)
        Index of the profile of each point.
    values, increases : (n_points,)
        Logarithms of the quantity, and increases of chi^2.
    x : (n_points, n_parameters)
        Log-parameters fitted there.
    """

    def __init__(self, fits: ConstrainedFits, grids: Sequence[Array]) -> None:
        self.fits = fits
        self.profile = np.repeat(np.arange(len(grids)), [len(grid) for grid in grids])
        self.values = np.concatenate(grids)
        self.x = fits.best[self.profile]
        self._optimum = self.values == fits.at_best[self.profile]
        self.increases = np.where(self._optimum, 0.0, np.inf)

    def from_optimum(self) -> None:
        """Fit every point but the optimum, starting from the optimum."""
        point = np.flatnonzero(~self._optimum)
        self._try(point, point, FAIR)

    def from_neighbours(self) -> None:
        """Fit points from their neighbours' fits, as long as these have improved."""
        # Optima, and places beyond the ends, belong to no profile here: they are not fitted.
        to_fit = np.append(np.where(self._optimum, -1, self.profile), -1)
        news = np.full(len(self.values), True)
        while np.any(news):
            start = np.tile(np.flatnonzero(news), 2)
            point = start + np.repeat((-1, 1), len(start) // 2)
            own = to_fit[point] == self.profile[start]
            news = self._try(point[own], start[own], CLOSE)

    def _try(self, point: IntArray, start: IntArray, tolerance: float) -> BoolArray:
        """Fit points from other points' fits; return a mask of those that have improved much."""
        profile, targets = self.profile[point], self.values[point]
        increases, x = self.fits.at(profile, targets, self.x[start], tolerance)
        news = np.zeros(len(self.values), dtype=bool)
        # A point may be fitted from both sides, so one side after the other.
        for side in (point <= start, point > start):
            before, after = self.increases[point[side]], increases[side]
            news[point[side]] |= after < before - NEWS * (1 + np.abs(after))
            better = after < before
            at = point[side][better]
            self.increases[at], self.x[at] = after[better], x[side][better]
        return news

    def ends(self) -> IntArray:
        """Return the indices of the first and last point of every profile, (2, n_profiles)."""
        every = np.arange(len(self.fits.best))
        last = np.searchsorted(self.profile, every, side="right") - 1
        return np.stack((np.searchsorted(self.profile, every), last))

    def extremes(self) -> Array:
        """Return the fits at both ends of profiles, (2 n_quantities, n_traces, n_parameters).

        A basin at the end of one profile may be the deepest at the limit of another.
        """
        ends = self.x[self.ends()].reshape(2, len(self.fits.likelihoods), -1, self.x.shape[1])
        extremes: Array = np.concatenate(ends.swapaxes(1, 2))
        return extremes

    def smooth(self, limits: Array) -> None:
        """Add points for drawing: the limits, then midpoints of neighbours that are far apart.

        Parameters
        ----------
        limits : (n_profiles, 2)
            Logarithms of the quantity, within the profiles; NaN where there is none.
        """
        profile, side = np.nonzero(np.isfinite(limits))
        values = limits[profile, side]
        below = (self.profile == profile[:, None]) & (self.values < values[:, None])
        left = self.ends()[0, profile] + np.sum(below, axis=1) - 1
        new = self.values[left + 1] != values
        self._add(left[new], values[new])
        for _ in range(_MOST_ROUNDS):
            roots = np.sqrt(np.clip(self.increases, 0.0, HIGHEST))
            left = np.flatnonzero((np.abs(np.diff(roots)) > _STEP) & (np.diff(self.profile) == 0))
            self._add(left, 0.5 * (self.values[left] + self.values[left + 1]))

    def _add(self, left: IntArray, values: Array) -> None:
        """Insert points after given ones, each with the lower of the fits from both neighbours."""
        if not len(left):
            return
        profile, right = self.profile[left], left + 1
        increases, x = self.fits.from_each(profile, values, self.x[np.stack((left, right))], CLOSE)
        self.profile = np.insert(self.profile, right, profile)
        self.values = np.insert(self.values, right, values)
        self.increases = np.insert(self.increases, right, np.min(increases, axis=0))
        self.x = np.insert(self.x, right, x, axis=0)
