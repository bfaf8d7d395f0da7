"""Residuals that are correlated for long are misfit; noise of a filter is not."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.doubts import (
    DOUBT,
    DOUBTFUL,
    REJECTED,
    REJECTION,
    compute_status,
    find_slow_misfit,
)
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.noise import draw_ornstein_uhlenbeck
from biogrip.physics.protocol import torque_history
from biogrip.physics.whitening import NoiseModel
from tests.helpers.default import STUDY
from tests.helpers.problems import MODEL, SAMPLES, clean, posed_for, run

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
