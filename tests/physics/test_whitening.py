"""Noise made white against matrices of all samples."""

import numpy as np
import pytest
from scipy.linalg import cholesky

from biogrip.arrays import Array
from biogrip.physics.condensed import Condensed
from biogrip.physics.modes import linear_responses
from biogrip.physics.noise import flicker_rates
from biogrip.physics.protocol import hold, sample_times, torque_history
from biogrip.physics.whitening import WEIGHTED, NoiseModel, Whitening, drift_is_flow, nuisance_basis
from tests.helpers.problems import MODEL, SAMPLES, TORQUE, posed_for

UNEVEN = np.cumsum(np.random.default_rng(3).exponential(1.0, 300))
COLOURS = [
    NoiseModel(0.3, 5.0, 0.2),
    NoiseModel(0.999, 0.2, 0.0),
    NoiseModel(1e-5, 100.0, 0.9),
    NoiseModel(0.2, 5.0, 0.1, 0.6),
]


def correlation(time_s: Array, noise_model: NoiseModel, growing: Array | None = None) -> Array:
    """The matrix as it is defined."""
    grown = np.ones(len(time_s)) if growing is None else growing**2 / np.mean(growing**2)
    apart = np.abs(np.subtract.outer(time_s, time_s))
    rates = flicker_rates(time_s)
    flicker = np.mean([np.exp(-rate * apart) for rate in rates], axis=0)
    matrix: Array = (
        noise_model.white * np.eye(len(time_s))
        + noise_model.proportional * np.diag(grown)
        + noise_model.ar1 * np.exp(-apart / noise_model.time_s)
        + noise_model.flicker * flicker
    )
    return matrix


@pytest.mark.parametrize("noise_model", COLOURS)
def test_noise_of_the_colour_becomes_white(noise_model: NoiseModel) -> None:
    """Also what grows; matrices are of condition 1e5 at most, so that ten digits are left."""
    growing = np.linspace(-3.0, 0.5, 300) ** 3 if noise_model.proportional else None
    matrix = correlation(UNEVEN, noise_model, growing)
    whitening = Whitening(UNEVEN, noise_model, np.zeros((0, 300)), growing=growing)
    white = whitening(cholesky(matrix, lower=True).T)
    np.testing.assert_allclose(white.T @ white, np.eye(300), atol=1e-8)
    assert whitening.log_determinant == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-10)
    assert np.mean(np.diagonal(matrix)) == pytest.approx(1.0)


def test_given_deviations_divide() -> None:
    rng = np.random.default_rng(5)
    deviations, rows = rng.uniform(0.1, 9.0, 300), rng.standard_normal((2, 300))
    white = Whitening(UNEVEN, WEIGHTED, np.zeros((0, 300)), growing=deviations)(rows)
    expected = rows / deviations * np.sqrt(np.mean(deviations**2))
    np.testing.assert_allclose(white, expected, rtol=1e-12)


def test_nuisance_and_what_is_uncertain_are_parts_of_the_noise() -> None:
    """A flat prior is one of a huge variance; the dense matrix has both."""
    noise_model, time_s = COLOURS[0], UNEVEN
    nuisance = nuisance_basis(time_s, offset=True, drift=True)
    uncertain = 3 * np.random.default_rng(1).standard_normal((2, 300)) / np.sqrt(300)
    whitening = Whitening(time_s, noise_model, nuisance, uncertain)
    matrix = (
        correlation(time_s, noise_model) + uncertain.T @ uncertain + 1e8 * nuisance.T @ nuisance
    )
    rows = np.random.default_rng(2).standard_normal((3, 300))
    expected = rows @ np.linalg.solve(matrix, rows.T)
    white = whitening(rows)
    np.testing.assert_allclose(white @ white.T, expected, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(whitening(nuisance), 0, atol=1e-12)


@pytest.mark.parametrize("rate_Hz", [1.0, 10.0])
def test_few_rows_stand_for_all_whitened_samples(rate_Hz: float) -> None:
    """To 1e-10 of the trace's, as without a colour (test_condensed.py)."""
    time_s = sample_times(400.0, rate_Hz)
    nuisance = nuisance_basis(time_s, offset=True, drift=True)
    whitening = Whitening(time_s, COLOURS[0], nuisance)
    condensed = Condensed(TORQUE, time_s, nuisance, whitening=whitening)
    trace = np.random.default_rng(6).standard_normal(len(time_s))
    plain = posed_for(MODEL, time_s, trace).residuals
    sample = SAMPLES["endothelial_cell"]
    x = np.log([sample[name] for name in MODEL.names])
    residual, slopes = plain(x)
    residual, slopes = whitening(residual), whitening(slopes)
    simulated = linear_responses(plain.gripper, MODEL, TORQUE, condensed.time_s, np.exp(x)[None])[0]
    response, sensitivity = simulated[0], simulated[1:]
    rows = response @ condensed.to_rows - condensed.of_trace(whitening(trace))
    of_slopes = sensitivity @ condensed.to_rows
    assert rows @ rows == pytest.approx(residual @ residual, rel=1e-10)
    np.testing.assert_allclose(of_slopes @ rows, slopes @ residual, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(of_slopes @ of_slopes.T, slopes @ slopes.T, rtol=1e-9)


def test_a_drift_is_flow_only_under_a_constant_torque() -> None:
    sampled = np.linspace(0.0, 100.0, 201)
    assert drift_is_flow(torque_history((hold(100.0, 1e-9),)), sampled)
    changing = torque_history((hold(50.0, 1e-9), hold(50.0, 0.2e-9)))
    assert not drift_is_flow(changing, sampled)
    assert drift_is_flow(changing, sampled[:100])
