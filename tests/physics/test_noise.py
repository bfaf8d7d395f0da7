import itertools
from typing import Any

import numpy as np
import pytest
from scipy.linalg import cholesky

from biogrip.arrays import Array
from biogrip.fit.trace_noise import WEIGHTED, NoiseModel, Whitening
from biogrip.physics.noise import (
    AR1,
    KINDS,
    Drift,
    Flicker,
    Noise,
    Outliers,
    add_noise,
    drift_is_flow,
    estimate_noise,
    flicker_rates,
    nuisance_basis,
    rms,
    stream,
)
from biogrip.physics.protocol import hold, join_phases

CLEAN = np.concatenate((np.zeros(100_000), np.full(100_000, 2.0)))


@pytest.mark.parametrize(
    ("noise", "size", "first", "second"),
    [
        # Over the largest rotation, either way: unequal torques can turn an arm the other way.
        *((Noise(kind, 0.1, "peak"), sign, 0.2, 0.2) for kind in KINDS for sign in (1, -1)),
        (Noise("gaussian", 0.1, "signal"), 1, 0.0, 0.2),
        # An instrument's does not depend on the sample.
        (Noise("uniform", 0.1, "peak", 3e-6), 1e-5, 3e-6, 3e-6),
        (Noise("uniform", 0.1, "peak", 3e-6), 3e-3, 3e-6, 3e-6),
        (Noise("gaussian", 0.0, "peak"), 1, 0.0, 0.0),
        (Noise("gaussian", 0.1, "peak", 0.0), 1, 0.0, 0.0),
    ],
)
def test_a_level_is_a_deviation(noise: Noise, size: float, first: float, second: float) -> None:
    """Of the first half, which does not turn, and of the second, to four times 0.2 %."""
    found = add_noise(size * CLEAN, noise, np.random.default_rng(0)) - size * CLEAN
    assert [rms(half) for half in np.split(found, 2)] == pytest.approx([first, second], rel=9e-3)
    # The mean is known to a 450th of the level.
    assert abs(found.mean()) <= 0.01 * second
    assert noise.absent == (second == 0)


TIMES: Array = np.linspace(0, 399.9, 4000)


def noises(count: int = 200, times: np.ndarray = TIMES, **parts: Any) -> np.ndarray:
    """Unit noise on a trace of ones, a row a seed."""
    noise, clean = Noise("gaussian", 1.0, "peak", **parts), np.ones(len(times))
    rngs = [np.random.default_rng(seed) for seed in range(count)]
    return np.array([add_noise(clean, noise, rng, times) - clean for rng in rngs])


def test_a_drift_goes_either_way() -> None:
    """From nothing at the first reading, whatever the clock is then."""
    late = TIMES + 7.0
    course = noises(40, late, drift=Drift(3.0)) - noises(40, late)
    np.testing.assert_allclose(course[:, 0], 0, atol=1e-12)
    np.testing.assert_allclose(np.abs(course[:, -1]), 3.0, rtol=1e-12)
    np.testing.assert_allclose(np.diff(course, 2), 0, atol=1e-12)
    assert 10 < np.sum(course[:, -1] > 0) < 30


def test_outliers_are_few_and_far() -> None:
    away = noises(40, outliers=Outliers(0.02, 50.0)) - noises(40)
    struck = np.abs(away) > 0
    # 160,000 samples: a share of 0.02 is known to 0.00035, a standard deviation to 1.3 %.
    assert struck.mean() == pytest.approx(0.02, abs=0.0015)
    assert away[struck].std() == pytest.approx(50.0, rel=0.06)


def test_parts_are_no_more_than_the_whole() -> None:
    noise = Noise("gaussian", 0.1, "peak", ar1=AR1(0.7, 1.0), flicker=Flicker(0.4))
    ((path, text),) = noise.complaints()
    assert path == ("flicker", "share")
    assert "found 1.1" in text


HALVES = np.linspace(0.0, 400.0, 801)
STEPPED = 1 - np.exp(-HALVES / 60) - 0.6 * (HALVES > 200)
SIGMA = 0.01


@pytest.mark.parametrize("step", [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0, 30.0])
def test_rounding_is_a_part_of_the_noise(step: float) -> None:
    """The root mean square of what is added, to 20 %: residuals 1.2 times as large are misfit."""
    rng = np.random.default_rng(1)
    trace = STEPPED + SIGMA * rng.standard_normal(len(HALVES))
    if step:
        trace = step * SIGMA * np.rint(trace / (step * SIGMA))
    # As a file has it.
    trace = np.array([float(f"{value:.9g}") for value in trace])
    added = np.sqrt(np.mean((trace - STEPPED) ** 2))
    assert added / 1.2 < estimate_noise(trace) < 1.2 * added


def test_a_smooth_trace_has_next_to_none() -> None:
    assert estimate_noise(STEPPED) < 1e-5
    assert estimate_noise(np.concatenate((np.zeros(100), STEPPED))) < 1e-5
    assert estimate_noise(np.zeros(50)) == estimate_noise(np.zeros(1)) == 0


def test_a_stream_depends_on_all_that_names_it_and_on_nothing_else() -> None:
    """By very numbers, so that a change of the derivation cannot go unnoticed."""
    keys = itertools.product([1, 2], ["a", "b", "ab"], [0, 1, 2**31], ["noise", "genetic"])
    assert len({stream(*key).random() for key in keys}) == 36
    drawn = stream(1, "endothelial_cell", 0, "noise").integers(0, 1000, 5)
    assert drawn.tolist() == [755, 598, 652, 576, 539]


UNEVEN = np.cumsum(np.random.default_rng(3).exponential(1.0, 300))
COLOURS = [
    NoiseModel(0.3, 5.0, 0.2),
    NoiseModel(0.999, 0.2, 0.0),
    NoiseModel(1e-5, 100.0, 0.9),
    NoiseModel(0.2, 5.0, 0.1, 0.6),
    NoiseModel(0.1, 5.0, 0.1, walk=0.7),
    WEIGHTED,
]


def correlation(time_s: Array, noise_model: NoiseModel, growing: Array | None = None) -> Array:
    grown = np.ones(len(time_s)) if growing is None else growing**2 / np.mean(growing**2)
    apart, since = np.abs(np.subtract.outer(time_s, time_s)), time_s - time_s[0]
    matrix = np.diag(noise_model.white + noise_model.proportional * grown)
    matrix += noise_model.ar1 * np.exp(-apart / noise_model.time_s)
    flicker = [np.exp(-rate * apart) for rate in flicker_rates(time_s)]
    matrix += noise_model.flicker * np.mean(flicker, axis=0)
    return matrix + noise_model.walk * np.minimum.outer(since, since) / np.mean(since)


@pytest.mark.parametrize(("ar1", "flicker"), [(1.0, 0.0), (0.0, 1.0), (0.3, 0.2)])
def test_noise_has_the_correlation_of_its_parts(ar1: float, flicker: float) -> None:
    """A covariance of 5,000 pairs is known to 0.02."""
    times = np.array([0.0, 0.3, 0.4, 2.0, 7.0])
    parts = {"ar1": AR1(ar1, 2.0)} if ar1 else {}
    seen = noises(5000, times, **parts, **({"flicker": Flicker(flicker)} if flicker else {}))
    expected = correlation(times, NoiseModel(ar1, 2.0, flicker))
    np.testing.assert_allclose(np.cov(seen.T), expected, atol=4 * 0.02)


def test_flicker_has_equal_power_in_every_octave() -> None:
    """Of rates that are 1.5 e-folds apart at most; a rate fewer would be further."""
    rates, omega = flicker_rates(TIMES), 2 * np.pi * np.geomspace(0.01, 0.5, 100)
    power = np.sum(rates / (rates**2 + omega[:, None] ** 2), axis=1)
    slope = np.polyfit(np.log(omega), np.log(power), 1)[0]
    assert slope == pytest.approx(-1, abs=0.02)
    steps = np.diff(np.log(rates))
    assert steps.max() <= 1.5 < steps.sum() / (len(steps) - 1)


@pytest.mark.parametrize("noise_model", COLOURS)
def test_noise_of_the_colour_becomes_white(noise_model: NoiseModel) -> None:
    """Also what grows; matrices are of condition 1e5 at most, so that ten digits are left."""
    growing = np.linspace(-3.0, -0.5, 300) ** 3 if noise_model.proportional else None
    matrix = correlation(UNEVEN, noise_model, growing)
    whitening = Whitening(UNEVEN, noise_model, np.zeros((0, 300)), growing=growing)
    white = whitening(cholesky(matrix, lower=True).T)
    np.testing.assert_allclose(white.T @ white, np.eye(300), atol=1e-8)
    assert whitening.log_determinant == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-10)
    assert np.mean(np.diagonal(matrix)) == pytest.approx(1.0)


def test_nuisance_and_what_is_uncertain_are_parts_of_the_noise() -> None:
    """A flat prior is one of a huge variance; the dense matrix has both."""
    noise_model, time_s = COLOURS[0], UNEVEN
    nuisance = nuisance_basis(time_s, offset=True, drift=True)
    uncertain = 3 * np.random.default_rng(1).standard_normal((2, 300)) / np.sqrt(300)
    whitening = Whitening(time_s, noise_model, nuisance, uncertain)
    matrix = correlation(time_s, noise_model) + uncertain.T @ uncertain
    matrix += 1e8 * nuisance.T @ nuisance
    rows = np.random.default_rng(2).standard_normal((3, 300))
    expected = rows @ np.linalg.solve(matrix, rows.T)
    white = whitening(rows)
    np.testing.assert_allclose(white @ white.T, expected, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(whitening(nuisance), 0, atol=1e-12)


def test_a_drift_is_flow_only_under_a_constant_torque() -> None:
    """Until it changes."""
    changing = join_phases((hold(50.0, 1e-9), hold(50.0, 0.2e-9)))
    sampled = np.linspace(0.0, 100.0, 201)
    assert [drift_is_flow(changing, sampled[:n]) for n in (201, 100)] == [False, True]
