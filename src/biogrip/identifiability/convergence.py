"""Whether samples of a posterior have converged, and how much they tell.

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
from biogrip.identifiability.straightened import Straightened

MOST_R_HAT = 1.02
"""Above it, walkers do not agree on where the samples are.

1.01 is recommended of four long chains [1]. A hundred walkers are short ones: with m independent
samples each, R-hat is 1 + 1/m although nothing is wrong.
"""

FEWEST = 2000
"""Independent samples: the share of them beyond a 95 % limit is then known to 0.5 %."""

# What the tails are effective for: the ends of 95 % intervals.
_TAILS = (0.025, 0.975)


@dataclass(frozen=True)
class Convergence:
    """What is known of how samples were taken, each number the worst of all parameters.

    Parameters
    ----------
    r_hat
        Split R-hat of ranks, the walkers being chains: by how much they differ from one another.
    bulk, tail
        How many independent samples would tell the middle, and the tails, as well.
    """

    r_hat: float
    bulk: float
    tail: float

    @property
    def reached(self) -> bool:
        """Whether the samples can be relied on."""
        return self.r_hat <= MOST_R_HAT and min(self.bulk, self.tail) >= FEWEST

    def words(self) -> str:
        """Say so in a sentence."""
        told = (
            f"R-hat is {self.r_hat:.3f}, and the samples tell as much as {self.bulk:.2g} "
            f"independent ones, of the tails as {self.tail:.2g}"
        )
        if self.reached:
            return f"The samples have converged: {told}."
        return (
            f"The samples have not converged: {told}; wanted are at most {MOST_R_HAT:g} and at "
            f"least {FEWEST}. Do not rely on them: raise posterior.most_steps, or narrow the "
            "search range or the prior."
        )


def convergence_of(log_parameters: Array, axes: Straightened) -> Convergence:
    """Judge the samples of all parameters, and of what they are straight in.

    Parameters
    ----------
    log_parameters : (n_steps, n_walkers, n_parameters)
        Samples.
    axes
        Coordinates that tell more of them than parameters do, sums among others.
    """
    steps, walkers, size = log_parameters.shape
    turned = axes.of(log_parameters.reshape(-1, size)).reshape(steps, walkers, size)
    # Of the coordinates, those that are no parameters themselves.
    own = sorted(axes.members) if len(axes.members) > 1 else []
    by_chain = np.concatenate([log_parameters, turned[:, :, own]], axis=2).transpose(2, 1, 0)
    return Convergence(
        float(np.max(array_stats.rhat(by_chain))),
        float(np.min(array_stats.ess(by_chain, method="bulk"))),
        float(np.min(array_stats.ess(by_chain, method="tail", prob=_TAILS))),
    )
