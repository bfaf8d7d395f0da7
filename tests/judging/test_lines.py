"""Lines in the spectrum of residuals: how often they are seen in noise, and what is said of hum."""

import numpy as np
import pytest

from biogrip.judging.doubts import DOUBTFUL
from biogrip.judging.whiteness import find_line
from tests.helpers.identified import told


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
