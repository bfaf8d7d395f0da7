"""What the traces of one cell tell of a quantity: the likelihood of its logarithm, from a profile.

With the noise known the likelihood is exp(-increase/2). With a variance that is estimated from f
degrees of freedom it is Student's, (1 + increase/f)^(-(f + 1)/2), whose intervals are those of the
F threshold of `Likelihood`.

The signed root of the increase is interpolated between the points of the profile: it is a straight
line where the likelihood is normal. Beyond the ends of the search range, where nothing was fitted,
the likelihood stays what it is at the end. So an element that may as well vanish does not end the
population, and a value that is excluded at the end stays as unlikely as there.

References
----------
.. [1] D. M. Bates and D. G. Watts, Nonlinear Regression Analysis and Its Applications, Wiley,
   1988, chapter 6: profiles by their signed roots.
.. [2] G. E. P. Box and G. C. Tiao, Bayesian Inference in Statistical Analysis, Addison-Wesley,
   1973, section 2.4: Student's likelihood where the noise is estimated.
.. [3] F. N. Fritsch and J. Butland, A method for constructing local monotone piecewise cubic
   interpolants, SIAM Journal on Scientific and Statistical Computing 5 (1984), 300-304.
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from biogrip.arrays import Array

# Largest step between knots in standard deviations: straight lines widen the likelihood by its
# square/12, or 0.5 %. Below the least likelihood no knots are added.
_STEP = 0.25
_LEAST = 1e-6
# Steps between knots in spreads of a population, below which trapezia err by less than 1e-3.
_NARROW = 0.1


@dataclass(frozen=True)
class CellLikelihood:
    """Likelihood of the logarithm of a quantity in one cell, linear between knots."""

    knots: Array
    """Ascending logarithms, (n_knots,)."""
    values: Array
    """Likelihood at each, relative to the largest, (n_knots,). Beyond the ends it is constant."""

    def with_knots(self, others: Array) -> "CellLikelihood":
        """Return the same likelihood with more knots."""
        knots = np.union1d(self.knots, others)
        return CellLikelihood(knots, np.interp(knots, self.knots, self.values))

    def masses(self, centres: Array, spreads: Array) -> Array:
        """Integrate the likelihood over normal populations, from each knot to the next.

        The integral of a straight line with a normal density is exact, however narrow the
        population is beside the distance of knots. Where it is far wider, differences of nearly
        equal numbers would lose their digits, and trapezia do.

        Parameters
        ----------
        centres, spreads : (n_populations,)
            Mean and standard deviation of each population; the deviation is above zero.

        Returns
        -------
        (n_knots + 1, n_populations)
            The first and the last are those beyond the ends.
        """
        likely = np.maximum(self.values[:-1], self.values[1:]) > _LEAST
        narrow = np.max(np.diff(self.knots)[likely]) < _NARROW * spreads
        found = np.empty((len(self.knots) + 1, len(spreads)))
        for wide, integrals in ((~narrow, self._exact), (narrow, self._trapezia)):
            if np.any(wide):
                found[:, wide] = integrals(centres[wide], spreads[wide])
        return found

    def _exact(self, centres: Array, spreads: Array) -> Array:
        from scipy.special import ndtr

        z = (self.knots[:, None] - centres) / spreads
        tail = ndtr(-np.abs(z))
        below, above = np.where(z < 0, tail, 1 - tail), np.where(z > 0, tail, 1 - tail)
        # The smaller tails, of which the difference keeps its digits.
        shares = np.where(z[:-1] > 0, above[:-1] - above[1:], below[1:] - below[:-1])
        density = np.exp(-0.5 * z * z) / np.sqrt(2 * np.pi)
        slopes = (np.diff(self.values) / np.diff(self.knots))[:, None]
        at_centre = self.values[:-1, None] - slopes * z[:-1] * spreads
        between = at_centre * shares + slopes * spreads * (density[:-1] - density[1:])
        ends = self.values[0] * below[0], self.values[-1] * above[-1]
        return np.vstack((ends[0], np.maximum(between, 0.0), ends[1]))

    def _trapezia(self, centres: Array, spreads: Array) -> Array:
        from scipy.special import ndtr

        z = (self.knots[:, None] - centres) / spreads
        heights = np.exp(-0.5 * z * z) * (self.values / np.sqrt(2 * np.pi))[:, None]
        between = np.diff(z, axis=0) * (heights[:-1] + heights[1:]) / 2
        return np.vstack((self.values[0] * ndtr(z[0]), between, self.values[-1] * ndtr(-z[-1])))


def make_cell_likelihood(
    log_values: Array, increases: Array, freedom: float = inf
) -> CellLikelihood:
    """Make the likelihood of a cell from points of its profile.

    Parameters
    ----------
    log_values : (n_points,)
        Ascending logarithms of the quantity.
    increases : (n_points,)
        Increase of chi^2 at each.
    freedom
        Degrees of freedom of the estimated noise; infinite if it is known.
    """
    from scipy.interpolate import PchipInterpolator

    best = int(np.argmin(increases))
    sides = np.sign(np.arange(len(log_values)) - best)
    roots = sides * np.sqrt(increases - increases[best])
    signed = PchipInterpolator(log_values, roots)
    deviations = np.sqrt(-2 * _log_likelihood(roots, freedom))
    steps = np.ceil(np.abs(np.diff(sides * deviations)) / _STEP)
    likely = np.minimum(deviations[:-1], deviations[1:]) < np.sqrt(-2 * np.log(_LEAST))
    count = np.where(likely, np.maximum(steps, 1), 1).astype(np.int64)
    knots = np.unique(
        np.concatenate(
            [
                np.linspace(start, end, number + 1)
                for start, end, number in zip(log_values[:-1], log_values[1:], count, strict=True)
            ]
        )
    )
    return CellLikelihood(knots, np.exp(_log_likelihood(signed(knots), freedom)))


def _log_likelihood(roots: Array, freedom: float) -> Array:
    if freedom == inf:
        return -0.5 * roots**2
    return -0.5 * (freedom + 1) * np.log1p(roots**2 / freedom)
