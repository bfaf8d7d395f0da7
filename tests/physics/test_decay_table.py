import math
from functools import partial

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.misfit import _power_sums
from biogrip.physics.rate_tables import DecayTable

RNG = np.random.default_rng(0)
TRACES = {
    "noise": RNG.standard_normal(4001),
    "constant": np.ones(4001),
    "alternating": np.resize([1.0, -1.0], 4001),
    "last sample alone": np.eye(1, 4001, 4000)[0],
    "one sample": np.ones(1),
    "two samples": np.array([1.0, -3.0]),
    "very many samples": RNG.standard_normal(300_000),
}


def rates_of(longest: float) -> Array:
    """From none to infinite, dense where sums over so many samples change."""
    between = -np.geomspace(1e-6 / longest, 1e3, 20 if longest > 1e5 else 300)
    edges = -np.array([0, 1e-300, 1e-20, 39.9, 40, 40.1, 45, 1e6, 1e300, np.inf])
    return np.concatenate((edges, between))


@pytest.mark.parametrize("name", TRACES)
def test_agrees_with_direct_sums_at_every_rate(name: str) -> None:
    """To rounding, also where next to nothing is left of all but the first samples."""
    trace = TRACES[name]
    later = np.arange(1.0, len(trace))
    rates = rates_of(len(trace))
    sums = partial(_power_sums, trace[None], np.zeros(1, dtype=np.int64))
    (found,) = DecayTable(sums, len(trace), 1.0)(rates)
    for rate, value in zip(rates, found, strict=True):
        # Where this is less, the exponential is zero.
        exponents = rate * later[: np.searchsorted(-rate * later, 746.0)]
        terms = np.concatenate(([1.0], np.exp(exponents))) * trace[: 1 + len(exponents)]
        # Of the last sample alone almost nothing is left; the bound counts it in full.
        scale = 1e-16 * np.abs(trace).max() + 1e-14 * np.abs(terms).sum()
        assert abs(value - math.fsum(terms)) < scale
