"""Zeros between poles, against a bracketing search, alone and among many."""

import numpy as np
import pytest
from scipy.optimize import brentq

from biogrip.arrays import Array
from biogrip.physics.roots import interlaced_zeros

RANDOM = np.random.default_rng(0)
POLES: Array = np.cumsum(RANDOM.lognormal(0, 2, (9, 200)), axis=0)
POLES[0] = 0.0
WEIGHTS, LEVEL = RANDOM.lognormal(0, 2, (9, 200)), RANDOM.lognormal(0, 1, 200)


def test_zeros_are_those_of_a_bracketing_search() -> None:
    found = interlaced_zeros(WEIGHTS[:, :3], POLES[:, :3], LEVEL[:3]).from_pole(np.zeros(3))
    for zeros, weights, poles, level in zip(found.T, WEIGHTS.T, POLES.T, LEVEL, strict=False):
        ends = [*poles, poles[-1] + 2 * np.sum(weights) / level]
        for zero, low, high in zip(zeros, ends, ends[1:], strict=False):
            inside = low * (1 + 1e-12) + 1e-12, high * (1 - 1e-12)
            alone = brentq(
                lambda x, w=weights, p=poles, b=level: np.sum(w / (x - p)) - b, *inside, xtol=1e-14
            )
            assert zero == pytest.approx(alone, rel=1e-9)


def test_zeros_are_bitwise_the_same_alone_and_among_many() -> None:
    """A few points are summed as a matrix, many pole by pole."""
    together = interlaced_zeros(WEIGHTS, POLES, LEVEL)
    for one in range(0, 200, 20):
        own = slice(one, one + 1)
        alone = interlaced_zeros(WEIGHTS[:, own], POLES[:, own], LEVEL[own])
        assert np.array_equal(alone.pole, together.pole[:, own])
        assert np.array_equal(alone.beyond, together.beyond[:, own])
