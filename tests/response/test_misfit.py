import numpy as np
import pytest

from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory, held, sample_times, torque_history
from biogrip.response.linear import rotation, step_response
from biogrip.response.misfit_series import SeriesMisfit
from biogrip.sample import MODELS
from tests.response.reference import random_samples

MODEL = MODELS["generalized_maxwell"]
TRUTH = np.array([35.0, 12.3, 299.9, 1e-3])

PROTOCOLS = {
    "paper": ((held(200.0, 1.6e-9), held(200.0, 0.32e-9)), 10.0),
    "one phase": ((held(300.0, 1.6e-9),), 3.0),
    "step between samples": ((held(33.37, 1e-9), held(60.0, 2e-9)), 1.7),
    "phase shorter than a sample": (
        (held(20.0, 1e-9), held(0.05, 9e-9), held(30.0, 0.0)),
        2.0,
    ),
    "unequal torques": ((held(50.0, 1e-9, 2e-9), held(50.0, 2e-9, 0.0)), 5.0),
}


def direct(
    gripper: Gripper,
    steps: TorqueHistory,
    time_s: np.ndarray,
    trace: np.ndarray,
    samples: np.ndarray,
) -> np.ndarray:
    """Form every response, subtract, square, average."""
    response = step_response(
        gripper, MODEL.network(samples), symmetric=steps.symmetric, inertia=False
    )
    return np.sqrt(np.mean((rotation(response, steps, time_s) - trace) ** 2, axis=1))


@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
@pytest.mark.parametrize("name", PROTOCOLS)
def test_agrees_with_forming_the_responses(
    name: str, arms: str, request: pytest.FixtureRequest
) -> None:
    gripper = request.getfixturevalue(arms)
    phases, rate_Hz = PROTOCOLS[name]
    steps = torque_history(phases)
    time_s = sample_times(steps.end_s, rate_Hz)
    response = step_response(gripper, MODEL.network(TRUTH), symmetric=steps.symmetric)
    noise = np.random.default_rng(1).standard_normal(len(time_s))
    clean = rotation(response, steps, time_s)[0]
    trace = clean + 0.1 * np.abs(clean).max() * noise
    samples = np.vstack((TRUTH, random_samples(500, 3)))
    misfit = SeriesMisfit(gripper, MODEL, steps, 1 / rate_Hz, trace)
    expected = direct(gripper, steps, time_s, trace, samples)
    # Large sums cancel: eps times (squares summed / squares left), 1e6 for the
    # stiffest samples under this much noise.
    np.testing.assert_allclose(misfit(samples), expected, rtol=1e-9)


def test_a_perfect_fit_is_zero_up_to_cancellation(gripper: Gripper, steps: TorqueHistory) -> None:
    """Without noise the sums cancel to sqrt(eps) of the signal."""
    time_s = np.arange(4001) / 10
    response = step_response(gripper, MODEL.network(TRUTH), inertia=False)
    trace = rotation(response, steps, time_s)[0]
    misfit = SeriesMisfit(gripper, MODEL, steps, 0.1, trace)
    assert misfit(TRUTH[None, :])[0] < 1e-7 * trace.max()


def test_an_individual_does_not_depend_on_its_company(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    """To far fewer bits than the ranking keeps."""
    trace = np.random.default_rng(2).standard_normal(4001) * 1e-5
    samples = random_samples(300, 4)
    misfit = SeriesMisfit(gripper, MODEL, steps, 0.1, trace)
    alone = np.concatenate([misfit(sample[None, :]) for sample in samples])
    np.testing.assert_allclose(misfit(samples), alone, rtol=1e-10)
