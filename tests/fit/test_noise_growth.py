"""Noise that grows with the rotation: how often it is seen, and its shape."""

import numpy as np
import pytest

from biogrip.fit.noise_model_fit import compute_growth, outliers_of

ROTATION = np.geomspace(0.004, 1.0, 400)


def test_noise_that_is_the_same_everywhere_seldom_grows() -> None:
    """Of 1000 traces 3 or so seem to grow, and at most four standard deviations more."""
    rng = np.random.default_rng(0)
    grown = sum(
        bool(np.ptp(compute_growth(rng.standard_normal(400), ROTATION))) for _ in range(1000)
    )
    assert grown <= 3 + 4 * np.sqrt(3)


@pytest.mark.parametrize("floor", [0.0, 0.1])
def test_the_shape_is_that_of_the_noise(floor: float) -> None:
    """To a quarter of it; four hundred samples, a tenth of them outliers, tell no more."""
    rng, deviations = np.random.default_rng(1), np.hypot(floor, ROTATION)
    residual = deviations * rng.standard_normal(400)
    residual[::10] *= 20
    growth = compute_growth(residual, ROTATION)
    assert np.mean(growth**2) == pytest.approx(1.0)
    shape = deviations / np.sqrt(np.mean(deviations**2))
    np.testing.assert_allclose(growth, shape, rtol=0.25)


def test_outliers_are_judged_by_the_noise_around_them() -> None:
    rng = np.random.default_rng(2)
    residual = ROTATION * rng.standard_normal(400)
    residual[[40, 350]] = 10 * ROTATION[[40, 350]]
    assert np.count_nonzero(outliers_of(residual)) > 40
    growth = compute_growth(residual, ROTATION)
    np.testing.assert_array_equal(np.flatnonzero(outliers_of(residual / growth)), [40, 350])


def test_a_first_reading_without_rotation_does_not_make_its_noise_vanish() -> None:
    """It has a floor of noise, as all have: 1 % of what the largest rotations have."""
    rotation = np.concatenate(([0.0], ROTATION))
    for seed in range(20):
        noise = np.random.default_rng(seed).standard_normal(401)
        residual = np.hypot(0.01, rotation) * noise
        even = residual / compute_growth(residual, rotation)
        assert np.abs(even[0]) < 10 * np.sqrt(np.mean(even[1:] ** 2))


@pytest.mark.parametrize("index", [0, -1])
def test_outliers_are_seen_at_the_ends(index: int) -> None:
    residual = np.random.default_rng(3).standard_normal(400)
    residual[index] = 50.0
    assert outliers_of(residual)[index]


def test_what_does_not_vary_does_not_grow() -> None:
    np.testing.assert_array_equal(compute_growth(np.zeros(50), np.arange(50.0)), 1.0)
    np.testing.assert_array_equal(compute_growth(np.arange(50.0) % 7, np.zeros(50)), 1.0)
