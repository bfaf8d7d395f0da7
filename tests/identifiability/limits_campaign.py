"""Confidence limits against their definition, on very many traces.

``python -m tests.identifiability.limits_campaign [traces]`` takes some minutes per 100 traces; the
test suite has a few of them.
"""

import sys
from collections.abc import Iterator

import numpy as np

from biogrip.identifiability.profile import Likelihood, likelihood_of, limits_near, profile
from biogrip.identifiability.quantities import parameters_and_sum
from tests.identifiability.definition import rise_along, rise_at
from tests.identify.test_methods import MODEL, SAMPLES, problem, run

ALLOWED = 0.01


def likelihood_for(case: str, seed: int) -> Likelihood:
    posed = problem(case, seed, rate_Hz=10.0)
    found = run("least_squares", posed, seed)
    return likelihood_of(posed, np.log(found.parameters), found.misfit_rad, confidence=0.95)


def misses(likelihood: Likelihood) -> Iterator[tuple[str, str, float, float]]:
    """Quantity, whose limit, logarithm of the limit, and by how much of the threshold it misses."""
    rng = np.random.default_rng(0)
    for quantity in parameters_and_sum(MODEL):
        found = profile(likelihood, quantity)
        for limit in (found.low, found.high):
            if limit is not None:
                rise = rise_at(likelihood, quantity, limit, rng)
                yield quantity.label, "profile", limit, rise / likelihood.threshold - 1
        for limit in limits_near(likelihood, quantity):
            if limit is not None:
                rise = rise_along(likelihood, quantity, limit)
                yield quantity.label, "near", limit, rise / likelihood.threshold - 1


def main(traces: int, cases: list[str]) -> None:
    """Print what misses its definition, and how far the worst of the others are from it."""
    for case in cases:
        limits, failed, worst = 0, 0, 0.0
        for seed in range(traces):
            for label, whose, limit, miss in misses(likelihood_for(case, seed)):
                limits += 1
                if abs(miss) <= ALLOWED:
                    worst = max(worst, abs(miss))
                else:
                    failed += 1
                    print(
                        f"{case} {seed}: {label} ({whose}) {np.exp(limit):.6g}: {miss:+.2%}",
                        flush=True,
                    )
        print(
            f"{case}: {traces} traces, {limits} limits, {failed} miss; the others by {worst:.3%}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, sys.argv[2:] or list(SAMPLES))
