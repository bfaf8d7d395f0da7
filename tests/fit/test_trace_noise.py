"""Noise of residuals: its likelihood against dense matrices, growth, outliers; shares."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import spearmanr

from biogrip.arrays import Array
from biogrip.fit.any_sample import fit_any_sample
from biogrip.fit.share_noise import proportional_deviations
from biogrip.fit.trace_noise import (
    NoiseModel,
    NoiseModelLikelihood,
    _logarithms,
    compute_growth,
    outliers_of,
    significance_of_growth,
)
from biogrip.library import set_up
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.models import Sample
from biogrip.physics.noise import AR1, Noise, add_noise
from biogrip.physics.protocol import hold
from tests.helpers.default import STUDY
from tests.helpers.problems import clean
from tests.physics.test_noise import correlation

TIMES = np.cumsum(np.random.default_rng(0).exponential(1.0, 200))
DIRECTIONS = np.stack((np.ones(200), TIMES, np.exp(-TIMES / 40)))


def restricted(matrix: Array, rows: Array, left: Array) -> tuple[float, float]:
    """Minus twice the restricted likelihood, from dense matrices; and the scale, profiled out."""
    inverse = np.linalg.inv(matrix)
    information = rows @ inverse @ rows.T
    taken = inverse - inverse @ rows.T @ np.linalg.solve(information, rows @ inverse)
    count = len(left) - len(rows)
    scale = float(left @ taken @ left) / count
    determinants = sum(np.linalg.slogdet(each)[1] for each in (matrix, information))
    return count * float(np.log(scale)) + float(determinants), scale


def test_the_likelihood_is_that_of_dense_matrices() -> None:
    """Differences between colours, less the prior; of twelve digits the matrices take four."""
    for colours, growing in (
        ([(0.3, 5, 0.2, 0, 0.1), (0.9, 1, 0.05, 0, 1e-3), (0.01, 100, 0.6, 0, 0.3)], None),
        ([(0.3, 5, 0.2, 0.4, 0.05), (0.01, 9, 0.6, 0.37, 0.01)], np.linspace(0.1, 2.0, 200)),
    ):
        left = np.random.default_rng(1).standard_normal(200)
        likelihood = NoiseModelLikelihood(TIMES, left, DIRECTIONS, growing)
        found, expected = [], []
        for noise_model in (NoiseModel(*shares) for shares in colours):
            x = _logarithms(noise_model)
            # The prior is on 1/f noise and a third of a walk.
            found.append(likelihood._deviance(x) + np.log(np.exp(x[2]) + np.exp(x[3]) / 3))
            matrix = correlation(TIMES, noise_model, growing)
            expected.append(restricted(matrix, DIRECTIONS, left)[0])
        np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=1e-8)


def test_degrees_of_freedom_are_those_of_satterthwaite() -> None:
    """2 over the variance of a logarithm of a variance: dense matrices and priors have 5.72.

    Beside an offset, of parameters so well known that their prior of one e-fold counts for nothing.
    """
    noise = Noise("gaussian", 1.0, "peak", ar1=AR1(0.9, 2.0))
    left = add_noise(np.ones(200), noise, np.random.default_rng(1), TIMES)
    likelihood = NoiseModelLikelihood(TIMES, left, DIRECTIONS)
    nuisance, sensitivity = DIRECTIONS[:1] / np.sqrt(200), 1e4 * DIRECTIONS[1:]
    found = likelihood.freedom(likelihood.best(), sensitivity, nuisance)
    assert found == pytest.approx(5.719, rel=0.01)


def test_information_is_half_the_curvature_and_the_prior(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a quadratic form all of it; along what curves the other way there is the prior alone."""
    form = np.array([[2.0, 1, 0, 0], [1, 2, 0, 0], [0, 0, 4, 0], [0, 0, 0, -1]])
    likelihood = NoiseModelLikelihood(TIMES, np.ones(200), DIRECTIONS)
    monkeypatch.setattr(likelihood, "_deviance", lambda x: 7 + x @ form @ x)
    expected = np.maximum(form, 0) + np.eye(4) / 9
    found = likelihood._information(np.array([0.3, -0.2, 0.1, 0.5]))
    np.testing.assert_allclose(found, expected, atol=1e-9)


ROTATION = np.geomspace(0.004, 1.0, 400)


def test_noise_that_is_the_same_everywhere_seldom_grows() -> None:
    """Of 500 traces one or two seem to grow, and at most four standard deviations more."""
    rng = np.random.default_rng(0)
    growths = (compute_growth(rng.standard_normal(400), ROTATION) for _ in range(500))
    assert sum(bool(np.ptp(growth)) for growth in growths) <= 1.5 + 4 * np.sqrt(1.5)


@pytest.mark.parametrize("decimals", [0, 1, 8])
def test_significance_is_scipys(decimals: int) -> None:
    rng = np.random.default_rng(2)
    for count in (4, 30, 300):
        size = np.round(rng.standard_normal(count), decimals)
        for apart in (rng.random(count), rng.random(count) + 0.3 * size, -size):
            theirs = spearmanr(size, apart, alternative="greater").pvalue
            assert significance_of_growth(apart, size) == pytest.approx(theirs, abs=1e-12)


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


def test_outliers_are_as_rare_as_gaussian_noise_has_them() -> None:
    """Of a million samples beyond 4.5 standard deviations there are 7."""
    rng = np.random.default_rng(0)
    assert sum(outliers_of(rng.standard_normal(10_000)).sum() for _ in range(100)) <= 20
    slow = rng.standard_normal(1000) + 100 * np.sin(np.arange(1000) / 100)
    struck = [0, 30, 500, 999]
    slow[struck] += np.array([-50.0, 9.0, 9.0, 50.0])
    np.testing.assert_array_equal(np.flatnonzero(outliers_of(slow)), struck)
    assert not outliers_of(np.zeros(100)).any()


def test_the_next_step_of_rounding_is_neither_far_nor_growth() -> None:
    """Readings that stand still, or are on the next step here and there, but for the smallest."""
    step, residual = 1e-3, np.zeros(400)
    residual[200::5] = step
    assert np.ptp(compute_growth(residual, ROTATION)) > 0
    np.testing.assert_array_equal(compute_growth(residual, ROTATION, step), 1.0)
    residual[200] += step
    still = residual + 1e-6 * np.arange(400)
    assert np.flatnonzero(outliers_of(still, step)).tolist() == [200]
    assert 205 in np.flatnonzero(outliers_of(still))
    np.testing.assert_array_equal(compute_growth(np.zeros(50), np.arange(50.0)), 1.0)
    np.testing.assert_array_equal(compute_growth(np.arange(50.0) % 7, np.zeros(50)), 1.0)


CLEAN_S, CLEAN = clean("endothelial_cell", 2.0)


def deviations(trace: Array, share: float = 0.05, **given: Any) -> Array:
    problem = replace(STUDY.cases["endothelial_cell"].experiment, noise_share=share, **given)
    return proportional_deviations(problem, CLEAN_S, trace)


def test_deviations_follow_the_rotation_without_its_noise_or_offset() -> None:
    """Each reading has noise of 5 %; the smooth rotation is known far better."""
    rng = np.random.default_rng(0)
    noisy = CLEAN * (1 + 0.05 * rng.standard_normal(len(CLEAN_S)))
    large = np.quantile(CLEAN, 0.1) < CLEAN
    for given in ({}, {"offset": True}):
        found = deviations(noisy + 3 * CLEAN.max() * bool(given), **given)
        errors = np.abs(found[large] / (0.05 * CLEAN[large]) - 1)
        assert np.median(errors) < 0.05 / 3
        assert np.quantile(errors, 0.99) < 0.05
    floor = 0.3 * float(CLEAN.max())
    known = deviations(CLEAN, noise_sd=floor)
    np.testing.assert_allclose(known, np.hypot(0.05 * CLEAN, floor), rtol=1e-3)


def test_no_reading_is_certain() -> None:
    """Of a trace without noise: the first rotation is zero, and counts as one of the smallest."""
    assert CLEAN[0] == 0
    smallest = np.sort(CLEAN)[: len(CLEAN) // 10]
    assert deviations(CLEAN).min() == pytest.approx(0.05 * np.median(smallest), rel=0.01)


@pytest.mark.parametrize(("share", "of_peak"), [(1e-3, 0.3), (0.02, 0.02)])
def test_other_noise_shows_where_the_rotation_is_small(share: float, of_peak: float) -> None:
    """Far above the share, and by so much that chance does not explain it."""
    rng = np.random.default_rng(1)
    floor = of_peak * float(CLEAN.max())
    proportional = CLEAN * (1 + share * rng.standard_normal(len(CLEAN_S)))
    found = deviations(proportional + floor * rng.standard_normal(len(CLEAN_S)), share)
    # Some eighty readings tell the scatter.
    assert found.min() == pytest.approx(floor, rel=0.3)


def test_of_readings_against_the_load_nothing_is_fitted() -> None:
    residuals = STUDY.cases["endothelial_cell"].experiment.of(CLEAN_S, -CLEAN).residuals
    fit = fit_any_sample(residuals)
    assert not fit.amplitudes.any()
    left, basis = fit.left_of_readings()
    np.testing.assert_array_equal(left, -CLEAN)
    assert basis.shape == (0, len(CLEAN))


def test_a_plateau_is_no_noise() -> None:
    times = np.geomspace(1.0, 1e3, 100)
    smooth = 800 + 700 * np.exp(-times / 20)
    relaxation = set_up(INSTRUMENTS["modulus"], (hold(1e3, 1.0),), Sample("zener_maxwell"))
    found = proportional_deviations(replace(relaxation, noise_share=0.01), times, smooth)
    assert found == pytest.approx(0.01 * smooth, rel=0.01)
