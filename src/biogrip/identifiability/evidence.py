"""Bayesian evidence of a model with its prior, computed by importance sampling.

References
----------
.. [1] R. E. Kass and A. E. Raftery, Bayes factors, Journal of the American Statistical
   Association 90 (1995), 773-795: section 4.3, importance sampling.
.. [2] A. Vehtari, D. Simpson, A. Gelman, Y. Yao and J. Gabry, Pareto smoothed importance
   sampling, Journal of Machine Learning Research 25 (2024), 1-58: what k-hat says.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.identifiability.mixture import fit_mixture
from biogrip.identifiability.posterior import Posterior
from biogrip.identifiability.sampling import Samples
from biogrip.identifiability.valley_coordinates import valley_coordinates

MOST_K_HAT = 0.7
"""Largest Pareto k-hat of importance weights with a reliable mean [2]."""

_DRAWN = 20_000


@dataclass(frozen=True)
class Evidence:
    """Bayesian evidence: the integral of likelihood times prior over the parameters."""

    log: float
    """Its natural logarithm, with densities of the trace per rad."""
    error: float
    """Standard deviation of `log`."""
    k_hat: float
    """Pareto shape of the tail of the importance weights."""

    @property
    def reliable(self) -> bool:
        """True if the tail of the importance weights is light enough for a reliable mean."""
        return self.k_hat <= MOST_K_HAT


def compute_evidence(posterior: Posterior, samples: Samples, rng: np.random.Generator) -> Evidence:
    """Compute the evidence with points drawn from a mixture that is fitted to the samples.

    Parameters
    ----------
    posterior, samples
        The posterior and samples of it.
    rng
        Random generator of the points.
    """
    from arviz_stats.base import array_stats

    axes = valley_coordinates(posterior.problem.residuals.model)
    visited = samples.log_parameters.reshape(-1, samples.log_parameters.shape[2])
    mixture = fit_mixture(axes.of(visited), rng)
    points = mixture.draw(_DRAWN, rng)
    weights = posterior.log_density(axes.back(points)) - mixture.log_density(points)
    largest = np.max(weights)
    relative = np.exp(weights - largest)
    mean = float(np.mean(relative))
    # `psislw` takes the negative logarithms of the weights.
    _, k_hat = array_stats.psislw(-weights[np.isfinite(weights)])
    return Evidence(
        float(largest + np.log(mean)),
        float(np.std(relative) / (mean * np.sqrt(_DRAWN))),
        float(k_hat),
    )
