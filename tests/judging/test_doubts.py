"""Tests of residuals: how often they are wrong, what they see, and what is misfit."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

from biogrip.arrays import Array
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.doubts import (
    DOUBT,
    DOUBTFUL,
    FALSE_ALARM,
    REJECTED,
    REJECTION,
    doubts_about_noise,
    find_slow_misfit,
    uneven,
)
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.noise import AR1, Noise, Outliers, add_noise, draw_ornstein_uhlenbeck
from biogrip.physics.whitening import NoiseModel
from tests.helpers.problems import MODEL, clean, posed_for, run

TIMES: Array = np.linspace(0, 400, 4001)
SAME = np.ones(4001)


def test_the_cumulative_periodogram_is_kolmogorovs() -> None:
    """SciPy's test of the same shares, as if they were a sample of a uniform distribution."""
    for seed in range(5):
        residual = np.random.default_rng(seed).standard_normal(4000)
        power = np.abs(np.fft.rfft(residual)[1:-1]) ** 2
        shares = np.cumsum(power)[:-1] / power.sum()
        expected = kstest(shares, "uniform", method="asymp").pvalue
        # SciPy has steps of 1/1999 where there are steps of 1/2000.
        assert uneven(residual) == pytest.approx(expected, rel=0.15, abs=0.02)
    assert uneven(np.ones(3)) == 1.0


def test_white_noise_is_seldom_doubted() -> None:
    """Three tests of 0.003 and one of next to nothing: of 800 traces 7 or so are wrong."""
    rng, expected = np.random.default_rng(1), 3 * FALSE_ALARM * 800
    doubted = sum(
        any(doubts_about_noise(rng.standard_normal(501), SAME[:501], instrument=GRIPPER))
        for _ in range(800)
    )
    assert doubted <= expected + 4 * np.sqrt(expected)


@pytest.mark.parametrize(("count", "doubted"), [(0, False), (1, False), (2, True)])
def test_one_outlier_among_500_readings_is_chance_and_two_are_not(
    count: int, doubted: bool
) -> None:
    """Beyond 4.5 standard deviations white noise has one in 300 traces, two in 200,000."""
    residual = np.clip(np.random.default_rng(2).standard_normal(501), -3, 3)
    residual[[100, 400][:count]] = 8.0
    doubts = doubts_about_noise(residual, SAME[:501], instrument=GRIPPER)
    assert any("outlier" in said for said in doubts) == doubted


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"ar1": AR1(1.0, 0.1)}, "Neighbouring residuals"),
        ({"ar1": AR1(0.08, 2.0)}, "more of some frequencies"),
        ({"ar1": AR1(0.05, 20.0)}, "The residual wanders"),
        ({"outliers": Outliers(0.005, 20.0)}, "outliers, as of Gaussian noise"),
    ],
)
def test_what_is_not_white_is_said(parts: dict[str, Any], said: str) -> None:
    noise = Noise("gaussian", 1.0, "peak", **parts)
    clean = np.ones(len(TIMES))
    for seed in range(4):
        residual = add_noise(clean, noise, np.random.default_rng(seed), TIMES) - clean
        doubts = " ".join(doubts_about_noise(residual, SAME, instrument=GRIPPER))
        # Where neighbours are correlated enough, too, that is what is said.
        assert said in doubts or (said.startswith("more") and "Neighbouring residuals" in doubts)


def test_noise_that_grows_is_said_and_nothing_else() -> None:
    """Its tails and its power vary along the trace; without the growth it is white."""
    growth = np.linspace(0.02, 1.0, len(TIMES))
    residual = growth * np.random.default_rng(4).standard_normal(len(TIMES))
    assert any(
        "outliers" in said for said in doubts_about_noise(residual, SAME, instrument=GRIPPER)
    )
    (said,) = doubts_about_noise(residual, growth, instrument=GRIPPER)
    assert "The noise grows with the rotation: it is 14 times as large" in said


@pytest.mark.parametrize(
    ("share", "time_s", "weight"),
    [
        (0.6, 10.0, REJECTION),
        (0.6, 7.0, None),
        (0.4, 100.0, DOUBT),
        (0.4, 70.0, None),
        (0.3, 400.0, None),
    ],
)
def test_share_and_time_decide(share: float, time_s: float, weight: str | None) -> None:
    note = find_slow_misfit(NoiseModel(share, time_s, 0.0), 400.0, instrument=GRIPPER)
    assert (note and note.weight) == weight


@pytest.mark.parametrize(
    ("time_s", "share_of_peak", "status"),
    [(3.0, 0.02, DOUBTFUL), (20.0, 0.02, REJECTED), (20.0, 2e-4, REJECTED)],
)
def test_fast_correlated_noise_is_doubted_and_slow_one_rejects(
    time_s: float, share_of_peak: float, status: str
) -> None:
    """Over less or more than 2 % of the trace; however small it is, for there is no other."""
    times, response = clean("endothelial_cell")
    rng = np.random.default_rng([0, 40])
    noise = draw_ornstein_uhlenbeck(times, np.ones(1), np.array([1 / time_s]), rng)
    problem = posed_for(MODEL, times, response + share_of_peak * response.max() * noise)
    found = run("least_squares", problem)
    diagnosis = diagnose(problem, MODEL, found, confidence=0.95)
    assert diagnosis.status == status
    assert any("residuals are correlated" in note.text for note in diagnosis.notes)
