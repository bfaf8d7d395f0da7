"""Zeros between poles, against what is enclosed to 50 digits and more."""

from collections.abc import Iterable
from operator import mul
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx

from biogrip.arrays import Array
from biogrip.physics.roots import interlaced_zeros


def random_functions(count: int, poles: int, seed: int) -> tuple[Array, Array, Array]:
    """Weights over 60 decades, poles over ten and zero: far wilder than networks are."""
    rng = np.random.default_rng(seed)
    rates = np.sort(10 ** rng.uniform(-5, 5, (poles, count)), axis=0)
    rates[0] = 0.0
    return 10 ** rng.uniform(-50, 10, (poles, count)), rates, 10 ** rng.uniform(-10, 3, count)


def refined(weights: Iterable[Any], poles: Array, level: float, pole: float, beyond: float) -> arb:
    """The zero next to a point, as its distance from a pole, by Newton's method."""
    with ctx.workdps(120):
        at, from_poles = arb(beyond), [arb(pole) - arb(p) for p in poles]
        own = [arb(w) for w in weights]
        for _ in range(8):
            inverse = [1 / (distance + at) for distance in from_poles]
            terms = [w * over for w, over in zip(own, inverse, strict=True)]
            slope = sum(map(mul, terms, inverse), arb(0))
            at = (at + (sum(terms, arb(0)) - level) / slope).mid()
        return at


@pytest.mark.parametrize("poles", [1, 2, 5, 46])
def test_zeros_have_all_digits(poles: int) -> None:
    """One beyond each pole; of the zero 2e-15, of its distance from a pole far more than needed."""
    weights, rates, level = random_functions(12, poles, poles)
    found = interlaced_zeros(weights, rates, level)
    for n in range(12):
        for i in range(poles):
            pole, beyond = float(found.pole[i, n]), float(found.beyond[i, n])
            exact = refined(weights[:, n], rates[:, n], level[n], pole, beyond)
            above = rates[i + 1, n] if i + 1 < poles else np.inf
            assert rates[i, n] - pole < exact < above - pole
            assert abs(beyond - exact) <= 2e-15 * (abs(pole + exact) + abs(exact))
            assert abs(beyond - exact) <= 1e-9 * abs(exact)


def test_an_infinitesimal_imaginary_part_carries_the_derivative() -> None:
    weights, rates, level = random_functions(6, 12, 3)
    weights = np.maximum(weights, 1e-8)
    along = np.random.default_rng(4).normal(size=weights.shape) * weights
    tilted = interlaced_zeros(weights + 1e-30j * along, rates, level + 0j)
    for n in range(6):
        for i in range(12):
            pole, beyond = float(tilted.pole[i, n]), float(tilted.beyond[i, n].real)
            with ctx.workdps(60):
                step = arb(10) ** -15
                both = list(zip(weights[:, n].tolist(), along[:, n].tolist(), strict=True))
                ahead, behind = (
                    refined([w + by * a for w, a in both], rates[:, n], level[n], pole, beyond)
                    for by in (step, -step)
                )
                exact = ((ahead - behind) / (2 * step)).mid()
            assert float(tilted.beyond[i, n].imag) / 1e-30 == pytest.approx(float(exact), rel=1e-8)
