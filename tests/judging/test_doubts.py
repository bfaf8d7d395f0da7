"""Tests of residuals: how often they are wrong, what they see, and what is misfit."""

from dataclasses import replace
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
    compute_status,
    doubts_about_noise,
    find_slow_misfit,
    uneven,
)
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.noise import AR1, Noise, Outliers, add_noise, draw_ornstein_uhlenbeck
from biogrip.physics.protocol import torque_history
from biogrip.physics.whitening import NoiseModel
from tests.helpers.default import STUDY
from tests.helpers.problems import MODEL, SAMPLES, clean, posed_for, run

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


CASE = "endothelial_cell"


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


def _status(times: Array, trace: Array) -> str:
    problem = posed_for(MODEL, times, trace)
    found = run("least_squares", problem)
    return compute_status(diagnose(problem, MODEL, found, confidence=0.95).notes)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.nightly
def test_a_filter_makes_a_fit_doubtful_and_a_late_step_wrong(seed: int) -> None:
    """Both have misfits far above the scatter of neighbouring readings."""
    times, response = clean(CASE)
    rng = np.random.default_rng([seed, 40])
    sigma = 0.02 * float(np.max(response))
    filtered = sigma * draw_ornstein_uhlenbeck(times, np.ones(1), np.array([1 / 3.0]), rng)
    assert _status(times, response + filtered) == DOUBTFUL
    network = MODEL.network([[SAMPLES[CASE][name] for name in MODEL.names]])
    first, second = STUDY.phases
    late = torque_history(
        (
            replace(first, duration_s=first.duration_s + 10),
            replace(second, duration_s=second.duration_s - 10),
        )
    )
    other = rotation(step_response(STUDY.gripper, network), late, times)[0]
    assert _status(times, other + 0.2 * sigma * rng.standard_normal(len(times))) == REJECTED
