"""Confidence limits against their definition."""

from collections.abc import Iterator, Sequence

import numpy as np

from biogrip.judging.likelihood import Likelihood, make_likelihood
from biogrip.judging.profiles import compute_profiles
from biogrip.judging.quantities import Quantity
from tests.helpers.definition import rise_at
from tests.helpers.problems import problem, run

ALLOWED = 0.01
# Random starts at a limit.
STARTS = 20


def likelihood_for(case: str, seed: int) -> Likelihood:
    """What the limits of a simulated trace are measured against."""
    case_problem = problem(case, seed, rate_Hz=10.0)
    found = run("least_squares", case_problem, seed)
    return make_likelihood(
        case_problem, np.log(found.parameters), found.misfit_rad, confidence=0.95
    )


def misses(
    likelihood: Likelihood, quantities: Sequence[Quantity]
) -> Iterator[tuple[str, float, float]]:
    """Quantity, its limit's logarithm, and by what share of the threshold the rise there misses."""
    rng = np.random.default_rng(0)
    (profiles,) = compute_profiles([likelihood], quantities)
    for quantity, found in zip(quantities, profiles, strict=True):
        for limit in (found.low, found.high):
            if limit is not None:
                increase = rise_at(likelihood, quantity, limit, rng, STARTS)
                yield quantity.label, limit, increase / likelihood.threshold - 1
