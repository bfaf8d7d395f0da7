"""Posterior of a sample's parameters, with an unknown noise level integrated out.

References
----------
.. [1] G. E. P. Box and G. C. Tiao, Bayesian Inference in Statistical Analysis, Addison-Wesley,
   1973, sections 1.3 and 2.7: noise of unknown level under Jeffreys' prior.
"""

from dataclasses import dataclass
from math import lgamma, log, pi

import numpy as np

from biogrip.arrays import Array
from biogrip.identifiability.prior import Prior
from biogrip.identify.problem import Problem


@dataclass(frozen=True)
class Posterior:
    """Posterior density of the log-parameters of a trace, not divided by the evidence."""

    problem: Problem
    """The trace and the model."""
    prior: Prior
    """Prior of the log-parameters."""
    noise_rad: float | None = None
    """Standard deviation of the noise if it is known."""

    def log_density(self, log_parameters: Array, power: float = 1.0) -> Array:
        """Return the logarithm of likelihood times prior, of each point independent of others.

        Parameters
        ----------
        log_parameters : (n, n_parameters)
        power
            Power to which the likelihood is raised.

        Returns
        -------
        (n,)
            Minus infinity where the prior excludes a point, or the model has no response.
        """
        density = self.prior.log_density(log_parameters)
        allowed = np.flatnonzero(np.isfinite(density))
        if len(allowed):
            # Accepting a proposal is a comparison: the fewer digits a sum of squares loses, the
            # rarer it is that two processors disagree.
            misfit_rad = self.problem.residuals.condensed_misfit(np.exp(log_parameters[allowed]))
            density[allowed] += power * self.log_likelihood(misfit_rad)
        return np.where(np.isnan(density), -np.inf, density)

    def log_likelihood(self, misfit_rad: Array) -> Array:
        r"""Return the logarithms of the likelihood for given misfits, (n,).

        S is the sum of squares, and nu the number of readings less that of nuisance
        functions, whose coefficients have a flat prior. If the noise is known, the
        logarithm is -nu/2 ln(2 pi sigma^2) - S/(2 sigma^2). If it is not, sigma has
        Jeffreys' prior 1/sigma, and the likelihood integrated over it is

            Gamma(nu/2) / 2 (pi S)^(-nu/2)                                [1], section 1.3
        """
        residuals = self.problem.residuals
        half, square_sum = 0.5 * residuals.free, residuals.samples * misfit_rad**2
        if self.noise_rad is not None:
            variance = self.noise_rad**2
            return -half * log(2 * pi * variance) - 0.5 * square_sum / variance
        return lgamma(half) - log(2) - half * np.log(pi * square_sum)
