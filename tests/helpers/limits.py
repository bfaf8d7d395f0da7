"""Confidence limits against their definition."""

from collections.abc import Iterator, Sequence

import numpy as np

from biogrip.judging.likelihood import Likelihood, make_likelihood
from biogrip.judging.limits import find_limits
from biogrip.judging.profiles import compute_profiles
from biogrip.judging.quantities import Quantity
from tests.helpers.definition import rise_at, rises_along
from tests.helpers.problems import problem, run

ALLOWED = 0.01
# Random starts at a limit; steps on the way to one.
STARTS, STEPS = 6, 8


def likelihood_for(case: str, seed: int) -> Likelihood:
    """What the limits of a simulated trace are measured against."""
    case_problem = problem(case, seed, rate_Hz=10.0)
    found = run("least_squares", case_problem, seed)
    return make_likelihood(
        case_problem, np.log(found.parameters), found.misfit_rad, confidence=0.95
    )


def misses(
    likelihood: Likelihood, quantities: Sequence[Quantity]
) -> Iterator[tuple[str, str, float, float]]:
    """Quantity, whose limit, its logarithm, and by what share of the threshold the rise misses."""
    rng = np.random.default_rng(0)
    (profiles,) = compute_profiles([likelihood], quantities)
    (near,) = find_limits([likelihood], quantities)[0]
    for quantity, found, limits in zip(quantities, profiles, near, strict=True):
        for limit in (found.low, found.high):
            if limit is not None:
                increase = rise_at(likelihood, quantity, limit, rng, STARTS)
                yield quantity.label, "profile", limit, increase / likelihood.threshold - 1
        for limit in limits:
            if np.isfinite(limit):
                increases = list(rises_along(likelihood, quantity, limit, STEPS))
                if (
                    min(abs(increase / likelihood.threshold - 1) for increase in increases)
                    > ALLOWED
                ):
                    # Where the optimum's basin leads over into a lower one, it is that one's.
                    increases.append(rise_at(likelihood, quantity, limit, rng, STARTS))
                miss = min((increase / likelihood.threshold - 1 for increase in increases), key=abs)
                yield quantity.label, "near", limit, float(miss)
