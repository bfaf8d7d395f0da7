"""Tests of residuals for white noise: how often each is wrong, whatever the readings."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import beta
from scipy.stats import f as fisher
from scipy.stats import t as student

from biogrip.arrays import Array
from biogrip.fit.trace_noise import absorbed, outliers_of
from biogrip.judging import whiteness
from biogrip.judging.doubts import DOUBTFUL
from tests.fit.test_trace_noise import restricted
from tests.helpers.identified import told

LEVEL = 0.01
NOTHING = np.zeros((0, 4000))


def directions(times: Array) -> Array:
    """What fits of a retarded creep with an offset absorb."""
    retarded = np.exp(-times / 0.2)
    return np.stack([np.ones_like(times), retarded, times * retarded])


def test_chances_are_of_beta_distributions_with_moments_of_dense_matrices() -> None:
    """Of neighbours' differences and of means of four stretches, for a fit of three parameters."""
    basis = absorbed(directions(np.arange(1, 24) / 23))
    leaves = np.eye(23) - basis.T @ basis
    residual = leaves @ np.random.default_rng(0).standard_normal(23)
    differences = np.diff(np.eye(23), axis=0)
    parts = np.array_split(np.eye(23), 4)
    means = np.array([part.sum(axis=0) / len(part) ** 0.5 for part in parts])
    found = []
    for rows, most in ((differences, 4.0), (means, 1.0)):
        of_noise = leaves @ rows.T @ rows
        mean = np.trace(of_noise) / 20
        variance = 2 * (np.trace(of_noise @ of_noise) - 20 * mean**2) / (20 * 22)
        weight = mean * (most - mean) / variance - 1
        ratio = np.sum((rows @ residual) ** 2) / np.sum(residual**2)
        of_beta = beta(mean / most * weight, (1 - mean / most) * weight, 0, most)
        found.append((1 - ratio / mean, of_beta.cdf(ratio)))
    assert whiteness.correlated(residual, basis) == pytest.approx(found[0])
    assert whiteness.wandering(residual, basis) == pytest.approx(1 - found[1][1])


@pytest.mark.parametrize(("away", "doubted"), [(3.5, False), (8.0, True), (50.0, True)])
@pytest.mark.parametrize(("readings", "place"), [(12, 11), (20, 0), (100, 0), (600, 200)])
def test_one_outlier_is_told_by_how_far_it_is_from_the_fit_to_the_others(
    readings: int, place: int, away: float, doubted: bool
) -> None:
    """Twice the chance of Student's t in as many readings; the fit is repeated without it."""
    slopes = directions(np.arange(1, readings + 1) / readings)
    others = np.arange(readings) != place
    trace = np.random.default_rng(1).standard_normal(readings)
    fitted, square_sum = np.linalg.lstsq(slopes[:, others].T, trace[others], rcond=None)[:2]
    scale = np.sqrt(square_sum[0] / (readings - 4))
    inverse = np.linalg.inv(slopes[:, others] @ slopes[:, others].T)
    error = scale * np.sqrt(1 + slopes[:, place] @ inverse @ slopes[:, place])
    trace[place] = slopes[:, place] @ fitted + away * error
    basis = absorbed(slopes)
    residual = trace - trace @ basis.T @ basis
    chance = whiteness.far_out(residual, ~others, basis)
    expected = 2 * -np.expm1(-2 * readings * student.sf(away, readings - 4))
    assert chance == pytest.approx(min(expected, 1.0), rel=1e-6, abs=1e-15)
    assert (chance < 0.003) == doubted
    if doubted:
        assert outliers_of(whiteness.by_leverage(residual, basis))[place]


@pytest.mark.parametrize("place", [0, 1])
def test_a_reading_that_the_fit_follows_is_no_outlier(place: int) -> None:
    """Two directions take the first two readings; nothing tells of their noise."""
    residual = np.append([0.0, 1e-9], np.random.default_rng(2).standard_normal(18))
    assert not outliers_of(whiteness.by_leverage(residual, np.eye(2, 20)))[place]
    assert whiteness.far_out(residual, np.arange(20) == place, np.eye(2, 20)) == 1.0


def test_residuals_are_over_the_share_that_the_fit_leaves() -> None:
    """Of the second reading a tenth of the variance is left; the first is followed, as it is."""
    basis = np.array([[0.99, 0.0, 0.0], [0.0, np.sqrt(0.9), 0.0]])
    found = whiteness.by_leverage(np.ones(3), basis)
    assert found == pytest.approx([1.0, 1 / np.sqrt(0.1), 1.0])


@pytest.mark.parametrize("directions", [1, 5])
def test_white_residuals_count_as_what_the_fit_leaves_of_them(directions: int) -> None:
    """A correlation costs two parameters more: by chance one trace in seven is worth that."""
    basis = absorbed(np.vander(np.linspace(-1, 1, 40), directions, increasing=True).T)
    noise = np.random.default_rng(0).standard_normal((30, 40))
    found = [whiteness.as_correlated(own - own @ basis.T @ basis, basis) for own in noise]
    left = 40 - directions
    assert np.mean([each == pytest.approx((left, left)) for each in found]) > 0.6


def test_the_restricted_likelihood_is_that_of_dense_matrices() -> None:
    rng = np.random.default_rng(0)
    left, taken = rng.standard_normal(30), np.linalg.qr(rng.standard_normal((30, 5)))[0]
    apart = np.abs(np.subtract.outer(np.arange(30), np.arange(30)))
    covariance = 0.8 * np.exp(-apart / 6) + 0.2 * np.eye(30)
    expected = restricted(covariance, taken.T, left)
    assert whiteness._restricted(covariance, left, taken) == pytest.approx(expected)


def test_independent_residuals_are_counted() -> None:
    """All of white noise, and of an AR(1) process n (1 - a)/(1 + a)."""
    white = np.random.default_rng(5).standard_normal(20_000)
    count, freedom = whiteness.as_correlated(white, NOTHING)
    assert count == pytest.approx(20_000, rel=0.2)
    assert freedom > 100
    slow = lfilter([1.0], [1.0, -0.95], white)
    # Known no better: a low frequency is as rarely seen as there are sums.
    assert whiteness.as_correlated(slow, NOTHING)[0] == pytest.approx(20_000 / 39, rel=0.4)
    short = lfilter([1.0], [1.0, -0.9], white)[200:4200].reshape(20, 200)
    counts = [whiteness.as_correlated(own - own.mean(), NOTHING[:, :200])[0] for own in short]
    # One of them is known to a third, so the median of twenty to a tenth.
    assert np.median(counts) == pytest.approx(200 / 19, rel=0.3)


@pytest.mark.nightly
@pytest.mark.parametrize(("decades", "length"), [(0, 0.04), (3, 0.1)])
@pytest.mark.parametrize("smooth", [True, False])
def test_limits_with_a_misfit_hold_the_truth(decades: int, length: float, smooth: bool) -> None:
    """A linear fit of a relaxation whose model lacks a random function of the reading's number.

    Only what is certainly no noise counts. Of such limits 95 % are to hold, and at least 87 % do
    if what is lacking is not smooth.
    """
    place = np.arange(1, 81) / 80
    times = np.geomspace(10.0**-decades, 1.0, 80) if decades else place
    slopes = directions(times)
    basis = absorbed(slopes)
    apart = np.abs(np.subtract.outer(place, place)) / length
    covariance = np.exp(-0.5 * apart**2) if smooth else np.exp(-apart)
    root = np.linalg.cholesky(covariance + 0.04 * np.eye(80))
    lacking = np.random.default_rng(7).standard_normal((100, 80)) @ root.T
    inverse = np.linalg.inv(slopes @ slopes.T)
    held = []
    for misfit in lacking:
        left = misfit - misfit @ basis.T @ basis
        if whiteness.correlated(left, basis)[1] > 0.001:
            continue
        count, freedom = whiteness.as_correlated(left, basis)
        variance = 80 * np.mean(left**2) / count * np.diag(inverse)
        away = np.abs(inverse @ (slopes @ misfit)) / np.sqrt(variance)
        held.append(away < student.ppf(0.975, freedom))
    assert len(held) > 30
    assert np.mean(held) > (0.93 if smooth else 0.85)


def relaxation(times: Array) -> tuple[Array, Array]:
    """A Zener solid's modulus and what its fit absorbs; k_p 100, k 80 Pa, tau 20 s of 100 s."""
    decay = np.exp(-times / 20)
    slopes = np.stack([np.ones_like(times), decay, decay * times])
    return 100 + 80 * decay, absorbed(slopes)


@pytest.mark.parametrize("readings", [8, 20, 100, 400])
@pytest.mark.parametrize("decades", [0, 4])
def test_of_white_noise_both_tests_fail_as_often_as_they_say(
    readings: int, decades: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Within four standard deviations of 1 % of 2,000 traces, 0.9 %, and an error of a fifth."""
    even = 100 * np.arange(1, readings + 1) / readings
    times = np.geomspace(100 * 10.0**-decades, 100, readings) if decades else even
    _, basis = relaxation(times)
    steps = whiteness.steps_of(basis, np.asarray)
    apart = whiteness.parts_apart(basis, readings // 2)
    monkeypatch.setattr(whiteness, "parts_apart", lambda *_: apart)
    noise = np.random.default_rng(readings + decades).standard_normal((2000, readings))
    left = noise - noise @ basis.T @ basis
    most = [np.max(steps.along(own) ** 2) / np.sum(own**2) for own in left]
    of_steps = [steps.chance(float(own)) for own in most]
    chances = np.array(
        [of_steps, [whiteness.compare_halves(own, basis, readings // 2) for own in left]]
    )
    assert np.mean(chances < LEVEL, axis=1) == pytest.approx(LEVEL, abs=0.011)


def test_a_step_is_what_a_fit_with_it_finds() -> None:
    """Ordinary least squares with one regressor more, and what that leaves; absorbed it is none."""
    times = np.arange(1, 41.0) * 2.5
    true, basis = relaxation(times)
    step = np.where(times > 60, 1.0, 0.0)
    trace = true + np.random.default_rng(0).standard_normal(40) - 4.0 * step
    found = whiteness.find_step(trace - trace @ basis.T @ basis, basis, np.asarray)
    assert found
    assert found.before == 24
    design: Array = np.vstack((basis, step)).T
    amplitudes = np.linalg.lstsq(design, trace, rcond=None)[0]
    assert found.size == pytest.approx(amplitudes[-1])
    assert found.left == pytest.approx(trace - design @ amplitudes, abs=1e-9)
    assert 24 not in whiteness.steps_of(absorbed(np.vstack((basis, step))), np.asarray).before


def test_halves_are_compared_as_chow_does() -> None:
    """The F test of one fit against two, each with parameters of its own."""
    times = np.arange(1, 61.0)
    true, basis = relaxation(times)
    trace = true * np.where(times > 25, 0.99, 1.0) + np.random.default_rng(1).standard_normal(60)

    def squares(some: slice) -> float:
        return float(np.linalg.lstsq(basis[:, some].T, trace[some], rcond=None)[1][0])

    apart = squares(slice(25)) + squares(slice(25, None))
    ratio = (squares(slice(None)) - apart) / 3 / (apart / 54)
    chance = whiteness.compare_halves(trace - trace @ basis.T @ basis, basis, 25)
    assert chance == pytest.approx(fisher.sf(ratio, 3, 54), rel=1e-6)


@pytest.mark.parametrize(
    ("change", "said"),
    [("jump", "change at about 50.5 s"), ("rate", "each fitted by itself, differ")],
)
def test_what_changed_is_said(change: str, said: str) -> None:
    """A jump of three noises; a sample that relaxes twice as fast from 50 s on."""
    times = np.arange(1, 101.0)
    true, _ = relaxation(times)
    faster = 100 + 80 * np.exp(-2.5 - (times - 50) / 9)
    wrong = {"jump": np.full(100, 3.6), "rate": faster - true}[change]
    readings = true + np.where(times > 50, wrong, 0)
    readings += 1.2 * np.random.default_rng(13).standard_normal(100)
    found = told(times, readings, reads="modulus", model="zener_maxwell")
    assert found.status == DOUBTFUL
    assert said in str(found)


def test_white_noise_has_a_line_as_often_as_its_level_says() -> None:
    """Fisher's chance is exact: within four standard deviations of 2 % of 2,000 traces, 1.3 %."""
    rng, times = np.random.default_rng(0), np.arange(100.0)
    found = [whiteness.find_line(rng.standard_normal(100), times) for _ in range(2000)]
    # The ten lowest of 49 frequencies are not looked at.
    alarms = np.mean([chance < 0.02 for _, chance, _ in found])
    assert alarms == pytest.approx(0.02 * 40 / 49, abs=0.012)


@pytest.mark.parametrize("frequency", [7.0, 7.03, 21.4])
def test_a_line_has_the_frequency_and_amplitude_of_its_sine(frequency: float) -> None:
    """The bound of a frequency is sqrt(6/n) sd / (pi amplitude T), 0.0008 Hz."""
    times = np.arange(2000) / 100
    sine = 1.5 * np.sin(2 * np.pi * frequency * times + 1)
    noise = np.random.default_rng(1).standard_normal(2000)
    found, chance, basis = whiteness.find_line(sine + noise, times)
    assert found == pytest.approx(frequency, abs=0.003)
    assert chance < 1e-9
    along = basis @ (sine + noise)
    assert np.linalg.norm(along) * np.sqrt(2 / 2000) == pytest.approx(1.5, abs=4 * np.sqrt(1e-3))
    assert np.std(sine + noise - along @ basis) == pytest.approx(1, rel=0.1)
    assert whiteness.find_line(sine + noise, times**1.1)[1] == 1


def test_hum_is_named_with_its_harmonic_and_counts_no_residual_twice() -> None:
    """50 Hz of five times the noise and 150 Hz of twice; the limits of the others' noise hold."""
    times = np.arange(1, 2001) / 1000
    hum = 0.05 * np.sin(2 * np.pi * 50 * times) + 0.02 * np.sin(2 * np.pi * 150 * times + 1)
    readings = 1 - 0.5 * np.exp(-times / 0.7) + hum
    readings += 0.01 * np.random.default_rng(2).standard_normal(len(times))
    found = told(times, readings, reads="compliance", model="zener_kelvin")
    assert found.status == DOUBTFUL
    assert "a line in its spectrum, at 50 Hz (0.05" in found.data["reasons"][0]
    assert " and 150 Hz (0.02" in found.data["reasons"][0]
    assert "average the readings over 0.02 s" in found.data["reasons"][0]
    assert "independent ones" not in str(found)
    limits = found.to_frame().loc[["k_s", "k_v", "tau_v"]]
    assert np.all((limits["low"] < [2, 2, 0.7]) & (limits["high"] > [2, 2, 0.7]))
