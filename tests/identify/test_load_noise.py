"""Noisy and rounded records: held against dense matrices, courses that are known, simulation."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.trace_fit import _shown_of_errors, noise_beside
from biogrip.identify.load_noise import smoothed
from biogrip.judging.whiteness import is_still
from biogrip.library import Sample, set_up
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import hold
from biogrip.physics.response import simulated_response

TIMES: Array = np.arange(300.0) * 0.2
SINE: Array = 5 * np.sin(2 * np.pi * TIMES / 5)


@pytest.mark.nightly
def test_what_a_smoothed_sine_is_off_by_is_what_is_said() -> None:
    """Chi^2 of 20 records over its mean: its standard deviation is 0.05 with some 50 each."""
    rng, ratios, shares = np.random.default_rng(0), [], []
    for _ in range(20):
        found, errors = smoothed(SINE + 0.25 * rng.standard_normal(300))
        ratios.append(np.sum((found - SINE) ** 2) / np.sum(errors**2))
        shares.append(np.sum(errors**2) / (300 * 0.25**2))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.25)
    # It is worth smoothing: less than a third of the noise is left.
    assert np.mean(shares) < 0.33


def test_the_covariance_is_that_of_dense_matrices() -> None:
    """Of noise that is told by the fit, the weight is found again from the course itself."""
    values = SINE[:80] + 0.25 * np.random.default_rng(1).standard_normal(80)
    found, errors = smoothed(values)
    roughness = np.diff(np.eye(80), 3, axis=0)
    weights = 10.0 ** np.arange(-2, 13, 0.5)
    posteriors = [np.linalg.inv(np.eye(80) + w * roughness.T @ roughness) for w in weights]
    smoother = min(posteriors, key=lambda of: np.abs(of @ values - found).max())
    np.testing.assert_allclose(smoother @ values, found, atol=1e-8)
    variance = values @ (values - found) / 77
    dense = variance * np.diagonal(smoother)
    # Directions that are smoothed out by a factor of 30 are left out.
    np.testing.assert_allclose(np.sum(errors**2, axis=0), dense, rtol=0.1)


def test_a_stretch_that_does_not_move_is_held_at_its_mean() -> None:
    rng = np.random.default_rng(2)
    values = np.repeat([0.0, 1.0], (12, 200)) + 0.03 * rng.standard_normal(212)
    found, errors = smoothed(values)
    np.testing.assert_allclose(
        found, np.repeat([values[:12].mean(), values[12:].mean()], (12, 200))
    )
    expected = [0.03 / np.sqrt(12), 0.03 / np.sqrt(200)]
    np.testing.assert_allclose(np.linalg.norm(errors, axis=0)[[0, -1]], expected, rtol=0.3)


@pytest.mark.nightly
def test_a_few_rows_between_steps_are_held_as_the_noise_of_all_rows_tells() -> None:
    """Chi^2 of six rows' mean over 200 records; what rises by far more than noise stays."""
    rng, ratios = np.random.default_rng(5), []
    for _ in range(200):
        values = np.repeat([0.0, 1.0], (6, 200)) + 0.03 * rng.standard_normal(206)
        found, errors = smoothed(values)
        ratios.append(found[0] ** 2 / np.sum(errors[:, 0] ** 2))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.35)
    values[:6] += 0.1 * np.arange(6)
    np.testing.assert_array_equal(smoothed(values)[0][:6], values[:6])


def test_a_rounded_course_is_smoothed_within_half_a_step() -> None:
    course = 1 - np.cos(2 * np.pi * np.arange(300) * 0.04 / 6)
    found, errors = smoothed(np.round(course / 0.1) * 0.1)
    assert np.max(np.abs(found - course)) < 0.05
    assert np.std(found - course) < 0.5 * 0.1 / np.sqrt(12)
    assert np.sqrt(np.mean(np.sum(errors**2, axis=0))) > np.std(found - course) / 2


def test_steps_of_a_staircase_are_none_of_noise() -> None:
    """They are smoothed by no more than the stretches between them, which are exact."""
    stairs = np.repeat([0.0, 2.0, 5.0, 10.0], 40)
    found, errors = smoothed(stairs)
    np.testing.assert_allclose(found, stairs, atol=1e-12)
    assert not errors.any()


def test_an_arc_at_a_crest_is_not_still_and_noise_is() -> None:
    """One record of noise in 300 would move by chance."""
    crest = np.cos(np.linspace(-0.6, 0.6, 12))
    assert not is_still(crest)
    assert not is_still(crest[:3])
    assert is_still(np.full(3, 0.1))
    rng = np.random.default_rng(3)
    assert np.mean([is_still(rng.standard_normal(30)) for _ in range(300)]) > 0.97


def test_noise_beside_functions_is_that_of_dense_matrices() -> None:
    rng = np.random.default_rng(4)
    functions = rng.standard_normal((30, 200))
    residual = 0.5 * rng.standard_normal(200) + rng.standard_normal(30) @ functions
    sd = noise_beside(residual, functions, 200)
    covariance = sd**2 * np.eye(200) + functions.T @ functions
    assert residual @ np.linalg.solve(covariance, residual) == pytest.approx(200.0, rel=1e-6)
    assert sd == pytest.approx(0.5, rel=0.2)


@pytest.mark.parametrize("reads", ["force", "displacement"])
def test_errors_of_a_load_show_as_its_simulation(reads: str) -> None:
    """Of smooth errors: lines from row to row differ from cubics by 1e-3."""
    model = "zener_maxwell" if reads == "force" else "zener_kelvin"
    experiment = set_up(INSTRUMENTS[reads], (hold(60.0, 1.0),), Sample(model))
    errors = np.array([np.cos(TIMES / 3), np.ones(300), TIMES / 60])
    record = np.column_stack((TIMES, np.zeros(300)))
    experiment = replace(experiment, record=record, load_errors=errors)
    sample, time_s = np.array([80.0, 100.0, 240.0]), TIMES[1:] - 0.05
    network = experiment.searched.network(sample)
    for error, shown in zip(errors, _shown_of_errors(experiment, time_s, sample), strict=True):
        alone = replace(experiment, record=np.column_stack((TIMES, error))).torque
        direct = simulated_response(experiment.gripper, network, alone, time_s)[0]
        np.testing.assert_allclose(shown, direct, atol=3e-3 * np.abs(direct).max())
