"""Sensitivity of a posterior to its prior and likelihood, by power scaling.

The prior, or the likelihood, is raised to a power slightly above and below one. Importance
weights of the samples tell by how much the marginal distributions change: the cumulative
Jensen-Shannon distance a doubling of the power.

References
----------
.. [1] N. Kallioinen, T. Paananen, P.-C. Bürkner and A. Vehtari, Detecting and diagnosing prior
   and likelihood sensitivity with power-scaling, Statistics and Computing 34 (2024), 57.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from arviz_stats.base import array_stats

from biogrip.arrays import Array
from biogrip.identifiability.marginals import fulfilled
from biogrip.identifiability.posterior import Posterior
from biogrip.identifiability.quantities import Quantity

NOTABLE = 0.05
"""Sensitivity from which on it is worth a mention [1]."""

_POWERS = (0.99, 1.01)
# If fewer samples fulfil the conditions of a quantity, all count.
_FEWEST = 100


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivities of a quantity's marginal posterior to prior and likelihood."""

    quantity: Quantity
    prior: float
    likelihood: float

    def words(self) -> str:
        """Describe it in words, e.g. ``c_p (0.21; likelihood: 0.02)``."""
        return f"{self.quantity.label} ({self.prior:.2g}; likelihood: {self.likelihood:.2g})"


def compute_sensitivities(
    posterior: Posterior, log_parameters: Array, quantities: Sequence[Quantity]
) -> list[Sensitivity]:
    """Compute the sensitivities of quantities to prior and likelihood.

    The prior's density is that of the parameters themselves, not of their logarithms: a
    log-uniform prior, 1/x, gets steeper or flatter.

    Parameters
    ----------
    posterior
        Posterior that was sampled.
    log_parameters : (n, n_parameters)
        Its samples.
    quantities
        Quantities, of which only samples that fulfil their conditions count.
    """
    of_logs = posterior.prior.log_density(log_parameters)
    likelihood = posterior.log_density(log_parameters) - of_logs
    parts = of_logs - log_parameters.sum(axis=1), likelihood
    duration_s = posterior.problem.residuals.duration_s
    found = []
    for quantity in quantities:
        holds = fulfilled(quantity, log_parameters, duration_s)
        holds |= np.sum(holds) < _FEWEST
        values = quantity.logs(log_parameters[holds])
        found.append(Sensitivity(quantity, *(scaled(values, part[holds]) for part in parts)))
    return found


def scaled(values: Array, log_density: Array) -> float:
    """Return the sensitivity of values, (n,), to a part of their density, given its logarithm."""
    log_weights = [array_stats.power_scale_lw(log_density, alpha=power) for power in _POWERS]
    lower, upper = (np.exp(each - np.max(each))[None] for each in log_weights)
    return float(array_stats.power_scale_sense(values[None], lower, upper, *_POWERS))


def in_words(sensitivities: Sequence[Sensitivity]) -> str:
    """Return a sentence on the quantities that the prior shapes noticeably."""
    shaped = [each.words() for each in sensitivities if each.prior >= NOTABLE]
    if not shaped:
        return "A slightly stronger or weaker prior changes nothing noticeably (power scaling)."
    return (
        f"The prior shapes {', '.join(shaped)}: sensitivities by power scaling, notable from "
        f"{NOTABLE:g} on. Another prior would give them another interval."
    )
