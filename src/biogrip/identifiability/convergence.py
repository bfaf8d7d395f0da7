"""Convergence diagnostics of posterior samples: R-hat and effective sample sizes.

References
----------
.. [1] A. Vehtari, A. Gelman, D. Simpson, B. Carpenter and P.-C. Bürkner, Rank-normalization,
   folding, and localization: an improved R-hat for assessing convergence of MCMC, Bayesian
   Analysis 16 (2021), 667-718.
"""

from dataclasses import dataclass

import numpy as np
from arviz_stats.base import array_stats

from biogrip.arrays import Array
from biogrip.identifiability.valley_coordinates import ValleyCoordinates

MOST_R_HAT = 1.02
"""Largest R-hat of samples that have converged.

1.01 is recommended for four long chains [1]. A hundred walkers are short chains: with m
independent samples each, R-hat is 1 + 1/m even if they have converged.
"""

FEWEST = 2000
"""Least effective sample size: it gives the share beyond a 95 % limit to 0.5 %."""

# Quantiles for the effective sample size of the tails: the ends of 95 % intervals.
_TAILS = (0.025, 0.975)


@dataclass(frozen=True)
class Convergence:
    """Convergence diagnostics of posterior samples, each the worst of all parameters."""

    r_hat: float
    """Rank-normalized split R-hat, with the walkers as chains."""
    bulk: float
    """Effective sample size of the middle."""
    tail: float
    """That of the tails."""

    @property
    def reached(self) -> bool:
        """True if the samples have converged."""
        return self.r_hat <= MOST_R_HAT and min(self.bulk, self.tail) >= FEWEST

    def words(self) -> str:
        """Describe the diagnostics in a sentence."""
        numbers = (
            f"R-hat is {self.r_hat:.3f}, and the effective sample size is {self.bulk:.2g}, in the "
            f"tails {self.tail:.2g}"
        )
        if self.reached:
            return f"The samples have converged: {numbers}."
        return (
            f"The samples have not converged: {numbers}; wanted are at most {MOST_R_HAT:g} and at "
            f"least {FEWEST}. Do not rely on them: raise posterior.most_steps, or narrow the "
            "search range or the prior."
        )


def diagnose_convergence(log_parameters: Array, axes: ValleyCoordinates) -> Convergence:
    """Compute convergence diagnostics over all parameters and straightened coordinates.

    Parameters
    ----------
    log_parameters : (n_steps, n_walkers, n_parameters)
        Samples.
    axes
        Straightened coordinates, sums among others.
    """
    steps, walkers, size = log_parameters.shape
    turned = axes.of(log_parameters.reshape(-1, size)).reshape(steps, walkers, size)
    # Coordinates that are not parameters themselves.
    own = sorted(axes.members) if len(axes.members) > 1 else []
    by_chain = np.concatenate([log_parameters, turned[:, :, own]], axis=2).transpose(2, 1, 0)
    return Convergence(
        float(np.max(array_stats.rhat(by_chain))),
        float(np.min(array_stats.ess(by_chain, method="bulk"))),
        float(np.min(array_stats.ess(by_chain, method="tail", prob=_TAILS))),
    )
