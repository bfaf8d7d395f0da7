"""Changes within a trace and lines in its spectrum: how often tests are wrong, what they tell."""

import numpy as np
import pytest
from scipy.stats import f as fisher

from biogrip.arrays import Array
from biogrip.fit.noise_model_fit import absorbed
from biogrip.judging.doubts import DOUBTFUL
from biogrip.judging.levels import FALSE_ALARM
from biogrip.judging.whiteness import compare_halves, find_line, find_step, steps_of
from tests.helpers.identified import told

NOISE, QUIET = 3.6, 1.2
LEVEL = 0.01


def relaxation(times: Array) -> tuple[Array, Array]:
    """A Zener solid's modulus and what its fit absorbs; k_p 100, k 80 Pa, tau 20 s of 100 s."""
    decay = np.exp(-times / 20)
    slopes = np.stack([np.ones_like(times), decay, decay * times])
    return 100 + 80 * decay, absorbed(slopes)


def itself(rows: Array) -> Array:
    return rows


@pytest.mark.parametrize("readings", [8, 20, 100, 400])
@pytest.mark.parametrize("decades", [0, 4])
def test_of_white_noise_both_tests_fail_as_many_as_their_level_says(
    readings: int, decades: int
) -> None:
    """Within four standard deviations of 1 % of 2,000 traces, 0.9 %, and an error of a fifth."""
    even = 100 * np.arange(1, readings + 1) / readings
    times = np.geomspace(100 * 10.0**-decades, 100, readings) if decades else even
    _, basis = relaxation(times)
    steps = steps_of(basis, itself)
    noise = np.random.default_rng(readings + decades).standard_normal((2000, readings))
    left = noise - noise @ basis.T @ basis
    share = (left @ steps.shapes.T / steps.norms) ** 2 / np.sum(left**2, axis=1)[:, None]
    alarms = [
        [steps.chance(own) < LEVEL for own in np.max(share, axis=1).tolist()],
        [compare_halves(own, basis, readings // 2) < LEVEL for own in left],
    ]
    assert np.mean(alarms, axis=1) == pytest.approx(LEVEL, abs=0.011)


@pytest.mark.parametrize(("change", "least"), [("jump", 0.58), ("gain", 0.94), ("start", 0.81)])
def test_steps_are_told_and_timed(change: str, least: float) -> None:
    """A scan tells 65, 97 and 88 %: of 200 traces no less than three standard errors below."""
    times = np.arange(1, 101.0)
    true, basis = relaxation(times)
    wrong = {
        "jump": 2 * NOISE * (times > 50),
        "gain": -0.1 * true * (times > 50),
        "start": 5 * NOISE * (times < 2.5),
    }[change]
    noise = NOISE * np.random.default_rng(3).standard_normal((200, 100))
    left = wrong + noise
    left -= left @ basis.T @ basis
    found = [find_step(own, basis, itself) for own in left]
    seen = [step for step in found if step and step.chance < FALSE_ALARM]
    assert len(seen) > least * 200
    assert np.median([step.before for step in seen]) == pytest.approx(
        2 if change == "start" else 50, abs=1
    )


def test_a_step_is_what_a_fit_with_it_finds() -> None:
    """Ordinary least squares with one regressor more, and what that leaves."""
    times = np.arange(1, 41.0) * 2.5
    true, basis = relaxation(times)
    trace = true + np.random.default_rng(0).standard_normal(40) + 4.0 * (times > 60)
    found = find_step(trace - trace @ basis.T @ basis, basis, itself)
    assert found
    assert found.before == 24
    design: Array = np.vstack((basis, np.where(times > 60, 1.0, 0.0))).T
    amplitudes = np.linalg.lstsq(design, trace, rcond=None)[0]
    assert found.size == pytest.approx(amplitudes[-1])
    assert found.left == pytest.approx(trace - design @ amplitudes, abs=1e-9)


def test_halves_are_compared_as_chow_does() -> None:
    """The F test of one fit against two, each with parameters of its own."""
    times = np.arange(1, 61.0)
    true, basis = relaxation(times)
    trace = true * np.where(times > 25, 0.99, 1.0) + np.random.default_rng(1).standard_normal(60)

    def squares(some: slice) -> float:
        return float(np.linalg.lstsq(basis[:, some].T, trace[some], rcond=None)[1][0])

    apart = squares(slice(25)) + squares(slice(25, None))
    ratio = (squares(slice(None)) - apart) / 3 / (apart / 54)
    chance = compare_halves(trace - trace @ basis.T @ basis, basis, 25)
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
    jump = np.full(100, 3 * QUIET)
    wrong = {"jump": jump, "rate": faster - true}[change]
    readings = true + np.where(times > 50, wrong, 0)
    readings += QUIET * np.random.default_rng(13).standard_normal(100)
    found = told(times, readings, reads="modulus", model="zener_maxwell")
    assert found.status == DOUBTFUL
    assert said in str(found)


def test_white_noise_has_a_line_as_often_as_its_level_says() -> None:
    """Fisher's chance is exact: within four standard deviations of 2 % of 2,000 traces, 1.3 %."""
    rng, times = np.random.default_rng(0), np.arange(100.0)
    found = [find_line(rng.standard_normal(100), times) for _ in range(2000)]
    # The ten lowest of 49 frequencies are not looked at.
    alarms = np.mean([chance < 0.02 for _, chance, _ in found])
    assert alarms == pytest.approx(0.02 * 40 / 49, abs=0.012)


@pytest.mark.parametrize("frequency", [7.0, 7.03, 21.4])
def test_a_line_has_the_frequency_and_amplitude_of_its_sine(frequency: float) -> None:
    """The bound of a frequency is sqrt(6/n) sd / (pi amplitude T), 0.0008 Hz."""
    times = np.arange(2000) / 100
    sine = 1.5 * np.sin(2 * np.pi * frequency * times + 1)
    noise = np.random.default_rng(1).standard_normal(2000)
    found, chance, basis = find_line(sine + noise, times)
    assert found == pytest.approx(frequency, abs=0.003)
    assert chance < 1e-9
    along = basis @ (sine + noise)
    assert np.linalg.norm(along) * np.sqrt(2 / 2000) == pytest.approx(1.5, abs=4 * np.sqrt(1e-3))
    assert np.std(sine + noise - along @ basis) == pytest.approx(1, rel=0.1)
    assert find_line(sine + noise, times**1.1)[1] == 1


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
