"""Mixture of multivariate t distributions, fitted to posterior samples.

A posterior may have a peak in some directions and a plateau over decades in others.
Clusters of samples (k-means), a t distribution each, approximate both. The mixture gives
independent proposals to the sampler, and importance weights to the evidence.

References
----------
.. [1] D. Arthur and S. Vassilvitskii, k-means++: the advantages of careful seeding, Proceedings
   of the 18th annual ACM-SIAM Symposium on Discrete Algorithms, 2007, 1027-1035.
.. [2] S. Kotz and S. Nadarajah, Multivariate t Distributions and Their Applications, Cambridge
   University Press, 2004, eq. (1.1).
"""

from dataclasses import dataclass
from functools import cached_property
from math import lgamma

import numpy as np

from biogrip.arrays import Array

FREEDOM = 5
"""Degrees of freedom: tails heavy enough for importance weights to be bounded."""

_MOST_CLUSTERS = 60
# Points per cluster and dimension; and the most points that a mixture is fitted to.
_POINTS, _MOST_POINTS = 5, 10_000
# Share of the weight that is divided equally, so that proposals are not rarer than samples.
_ALIKE = 0.2
# Least variance of a cluster in any direction, relative to that of all points.
_LEAST_VARIANCE = 1e-10


@dataclass(frozen=True)
class Mixture:
    """Weighted multivariate t distributions."""

    weights: Array
    """Sum to one, (n_clusters,)."""
    centres: Array
    """(n_clusters, n_dimensions)."""
    factors: Array
    """Lower Cholesky factors of the scale matrices, (n_clusters, n_dimensions, n_dimensions)."""

    def log_density(self, points: Array) -> Array:
        """Return the logarithm of the density, (n,), at points, (n, n_dimensions)."""
        peaks, scaling = self._peaks
        scaled = (points - self.centres[:, None]) @ scaling
        distance = np.einsum("kni,kni->kn", scaled, scaled)
        each = peaks[:, None] - 0.5 * (FREEDOM + points.shape[1]) * np.log1p(distance / FREEDOM)
        highest = np.max(each, axis=0)
        found: Array = highest + np.log(np.sum(np.exp(each - highest), axis=0))
        return found

    @cached_property
    def _peaks(self) -> tuple[Array, Array]:
        """Log densities at the centres, (n_clusters,), and inverse factors that scale distances."""
        size = self.centres.shape[1]
        logs = np.log(np.diagonal(self.factors, axis1=1, axis2=2))
        constant = lgamma((FREEDOM + size) / 2) - lgamma(FREEDOM / 2)
        constant -= 0.5 * size * np.log(FREEDOM * np.pi)
        peaks: Array = np.log(self.weights) + constant - np.sum(logs, axis=1)
        return peaks, np.asarray(np.linalg.inv(self.factors), np.float64).swapaxes(1, 2)

    def draw(self, count: int, rng: np.random.Generator | np.random.RandomState) -> Array:
        """Draw points, (count, n_dimensions)."""
        which = rng.choice(len(self.weights), size=count, p=self.weights)
        normal = rng.standard_normal((count, self.centres.shape[1]))
        normal /= np.sqrt(rng.chisquare(FREEDOM, size=(count, 1)) / FREEDOM)
        drawn: Array = self.centres[which] + np.einsum("nij,nj->ni", self.factors[which], normal)
        return drawn


def fit_mixture(points: Array, rng: np.random.Generator) -> Mixture:
    """Fit a mixture to a cloud of points.

    Parameters
    ----------
    points : (n, n_dimensions)
        Samples; at least some dozens per dimension.
    rng
        Random generator that seeds the clusters.
    """
    from scipy.cluster.vq import kmeans2

    points = points[:: -(-len(points) // _MOST_POINTS)]
    count, size = points.shape
    spread = np.std(points, axis=0)
    clusters = min(_MOST_CLUSTERS, max(count // (_POINTS * size), 1))
    _, own = kmeans2(points / spread, clusters, minit="++", seed=rng)
    found, own, sizes = np.unique(own, return_inverse=True, return_counts=True)
    centres = np.array([np.mean(points[own == cluster], axis=0) for cluster in range(len(found))])
    away = points - centres[own]
    squares = np.zeros((len(found), size, size))
    np.add.at(squares, own, away[:, :, None] * away[:, None, :])
    usual = np.sum(squares, axis=0) / count + np.diag(_LEAST_VARIANCE * spread**2)
    # Scale matrices are shrunk towards their mean, as if it stood for this many points.
    borrowed = size + 2
    scales = (squares + borrowed * usual) / (sizes + borrowed)[:, None, None]
    weights = (1 - _ALIKE) * sizes / count + _ALIKE / len(found)
    return Mixture(weights, centres, np.linalg.cholesky(scales))
