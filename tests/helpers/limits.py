"""Confidence limits against their definition."""

import functools
from collections.abc import Iterator, Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.methods import identifier
from biogrip.fit.problem import Problem, silent
from biogrip.judging.likelihood import Likelihood, make_likelihood
from biogrip.judging.limits import find_limits
from biogrip.judging.profiles import compute_profiles
from biogrip.judging.quantities import Quantity
from biogrip.physics.noise import stream
from tests.helpers.default import STUDY
from tests.helpers.definition import rise_at, rises_along
from tests.helpers.places import EXAMPLE
from tests.helpers.problems import MODEL, posed_for, problem, run

ALLOWED = 0.01
# Random starts at a limit; steps on the way to one.
STARTS, STEPS = 6, 8
ALIKE = 1e-3
NAMES = ("example_trace", *(f"trace_{year}" for year in range(2006, 2021)), "a", "b", "zz", "cell")


def likelihood_for(case: str, seed: int) -> Likelihood:
    """What the limits of a simulated trace are measured against."""
    case_problem = problem(case, seed, rate_Hz=10.0)
    found = run("least_squares", case_problem, seed)
    return make_likelihood(
        case_problem, np.log(found.parameters), found.misfit_rad, confidence=0.95
    )


@functools.cache
def _example() -> Problem:
    time_s, rotation_rad = np.loadtxt(EXAMPLE, delimiter=",", skiprows=1, unpack=True)
    return posed_for(MODEL, time_s, rotation_rad)


def example(name: str) -> Likelihood:
    """Likelihood of the example trace in a file of some name: its random starts follow from it."""
    rng = stream(STUDY.study_seed, name, 0, "identifiability")
    identify = identifier("least_squares", STUDY.config.method("least_squares"))
    (found,) = identify([_example()], [rng], silent)
    return make_likelihood(_example(), np.log(found.parameters), found.misfit_rad, confidence=0.95)


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


def differences(limits: Array) -> Array:
    """Largest differences of limits in shares of the intervals' widths.

    Parameters
    ----------
    limits : (n_names, n_quantities, 2)
        Logarithms, NaN where there is none; measured from the estimate, if there is but one.

    Returns
    -------
    (n_quantities,)
    """
    assert np.array_equal(np.isnan(limits).any(axis=0), np.isnan(limits).all(axis=0))
    spread = np.nanmax(np.ptp(limits, axis=0), axis=1)
    width = limits[0, :, 1] - limits[0, :, 0]
    return spread / np.where(np.isnan(width), 1.0, width)


def limits_of(likelihood: Likelihood, quantities: Sequence[Quantity]) -> list[tuple[float, float]]:
    """Limits of quantities' profiles, NaN where there is none."""
    (found,) = compute_profiles([likelihood], quantities)
    return [
        (np.nan if p.low is None else p.low, np.nan if p.high is None else p.high) for p in found
    ]
