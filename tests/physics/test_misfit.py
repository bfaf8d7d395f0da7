import numpy as np
import pytest

from biogrip.physics.gripper import Gripper
from biogrip.physics.misfit import SeriesMisfit
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import Course, hold, join_phases, sample_times
from biogrip.physics.response import step_response, superpose
from tests.helpers.responses import random_samples

MODEL = MODELS["generalized_maxwell"]
TRUTH = np.array([35.0, 12.3, 299.9, 1e-3])

PROTOCOLS = {
    "paper": ((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)), 10.0),
    "one phase": ((hold(300.0, 1.6e-9),), 3.0),
    "three samples": ((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)), 1 / 200),
    "five samples": ((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)), 1 / 100),
}


def direct(
    gripper: Gripper, steps: Course, time_s: np.ndarray, trace: np.ndarray, samples: np.ndarray
) -> np.ndarray:
    """Form every response, subtract, square, average."""
    response = step_response(gripper, MODEL.network(samples), inertia=False)
    return np.sqrt(np.mean((superpose(response, steps, time_s) - trace) ** 2, axis=1))


@pytest.mark.parametrize("name", PROTOCOLS)
def test_agrees_with_forming_the_responses(name: str, gripper: Gripper) -> None:
    phases, rate_Hz = PROTOCOLS[name]
    steps = join_phases(phases)
    time_s = sample_times(steps.end_s, rate_Hz)
    response = step_response(gripper, MODEL.network(TRUTH))
    noise = np.random.default_rng(1).standard_normal(len(time_s))
    clean = superpose(response, steps, time_s)[0]
    trace = clean + 0.1 * np.abs(clean).max() * noise
    samples = np.vstack((TRUTH, random_samples(500, 3)))
    misfit = SeriesMisfit(gripper, MODEL, steps, 1 / rate_Hz, trace)
    expected = direct(gripper, steps, time_s, trace, samples)
    # Large sums cancel: eps times (squares summed / squares left), 1e6 for the
    # stiffest samples under this much noise.
    np.testing.assert_allclose(misfit(samples), expected, rtol=1e-9)


@pytest.mark.parametrize(("level", "rtol"), [(1e-4, 1e-9), (0.0, 1e-8)])
def test_a_constant_trace(level: float, rtol: float, gripper: Gripper, steps: Course) -> None:
    """Against zero the misfit is the response itself, in the slowest samples what is left of it.

    Of their way to rest, 1e6 s, they go a fraction 4e-4; constant and mode cancel to its square.
    """
    trace = np.full(4001, level)
    samples = np.vstack((TRUTH, random_samples(500, 13)))
    misfit = SeriesMisfit(gripper, MODEL, steps, 0.1, trace)
    expected = direct(gripper, steps, np.arange(4001) / 10, trace, samples)
    np.testing.assert_allclose(misfit(samples), expected, rtol=rtol)


def test_parameters_that_are_not_numbers_have_no_misfit(gripper: Gripper, steps: Course) -> None:
    misfit = SeriesMisfit(gripper, MODEL, steps, 0.1, np.ones(4001))
    assert np.isnan(misfit(np.vstack((TRUTH, np.full(4, np.nan))))).tolist() == [False, True]
