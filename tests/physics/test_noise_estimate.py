"""The noise of a trace is estimated without a model, also where the readings are rounded."""

import numpy as np
import pytest

from biogrip.physics.whitening import estimate_noise

TIMES = np.linspace(0.0, 400.0, 801)
CLEAN = 1 - np.exp(-TIMES / 60) - 0.6 * (TIMES > 200)
SIGMA = 0.01


@pytest.mark.parametrize("step", [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0, 30.0])
def test_rounding_is_a_part_of_the_noise(step: float) -> None:
    """The root mean square of what is added, to 20 %: residuals 1.2 times as large are misfit."""
    rng = np.random.default_rng(1)
    trace = CLEAN + SIGMA * rng.standard_normal(len(TIMES))
    if step:
        trace = step * SIGMA * np.rint(trace / (step * SIGMA))
    # As a file has it.
    trace = np.array([float(f"{value:.9g}") for value in trace])
    added = np.sqrt(np.mean((trace - CLEAN) ** 2))
    assert added / 1.2 < estimate_noise(trace) < 1.2 * added


def test_a_smooth_trace_has_next_to_none() -> None:
    assert estimate_noise(CLEAN) < 1e-5
    assert estimate_noise(np.concatenate((np.zeros(100), CLEAN))) < 1e-5
    assert estimate_noise(np.zeros(50)) == estimate_noise(np.zeros(1)) == 0
