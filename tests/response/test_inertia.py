"""Whether arms are seen ringing is a matter of sampling and noise, and never underestimated."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.experiment.network import Network
from biogrip.experiment.noise import Noise, add_noise
from biogrip.experiment.protocol import TorqueHistory, hold, torque_history
from biogrip.experiment.sample import MODELS
from biogrip.instrument.gripper import Arm, Gripper
from biogrip.response.inertia import (
    VISIBLE,
    change_by_inertia,
    inertia_shows,
    ringing_s,
    while_ringing,
)
from biogrip.response.linear import rotation, step_response
from biogrip.response.sensitivity import linear_responses
from biogrip.response.simulation import simulated_rotation
from tests.helpers.default import STUDY
from tests.helpers.problems import MODEL, SAMPLES, TORQUE
from tests.helpers.responses import MODEL_PARAMETERS, log_range, random_samples

BURST_S = 1e-5 * np.arange(1, 200)
SAMPLING = {
    "17 ms": np.arange(0.0, 400.0, 0.017),
    "30 ms": np.arange(0.0, 400.0, 0.030),
    "1 ms at first": np.arange(0.0, 4.0, 1e-3),
    "bursts": np.concatenate((BURST_S, 200 + BURST_S)),
}


def both_ways(gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array) -> Array:
    """Rotations with inertia and without, (2, n, n_times)."""
    symmetric = torque.symmetric
    return np.array(
        [
            rotation(
                step_response(gripper, network, symmetric=symmetric, inertia=inertia),
                torque,
                time_s,
            )
            for inertia in (True, False)
        ]
    )


@pytest.mark.parametrize("times", SAMPLING)
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_no_sample_rings_more_than_is_reckoned_with(
    request: pytest.FixtureRequest, arms: str, times: str
) -> None:
    """Of many from all over the search range, of which most are overdamped."""
    gripper, time_s = request.getfixturevalue(arms), SAMPLING[times]
    network = MODEL.network(random_samples(150, seed=3))
    with_it, without = both_ways(gripper, network, TORQUE, time_s)
    size = np.sqrt(np.mean(without**2, axis=1))
    changes = np.linalg.norm(with_it - without, axis=1) / size
    assert np.max(changes) < change_by_inertia(gripper, TORQUE, time_s)


def test_an_empty_gripper_is_reckoned_with() -> None:
    """A damped oscillator in closed form: as far from rest as it is pushed, after either step."""
    inertia, damping, stiffness = 1e-14, 3.3e-12, 4.4e-7
    arm = Arm(inertia, damping, stiffness)
    gripper = Gripper(1.5e-3, 75.0, arm, arm)
    decay = damping / (2 * inertia)
    omega = np.sqrt(stiffness / inertia - decay**2)
    slow = stiffness / damping
    time_s: Array = 1e-4 * np.arange(1.0, 1000.0)
    ring = np.exp(-decay * time_s) * (
        np.cos(omega * time_s) + decay / omega * np.sin(omega * time_s)
    )
    change = np.linalg.norm(np.exp(-slow * time_s) - ring)
    size = np.sqrt(np.mean((1 - np.exp(-slow * time_s)) ** 2))
    found = change_by_inertia(gripper, torque_history((hold(1.0, 1e-9),)), time_s)
    # The size is that at every other sample.
    assert found >= change / size * (1 - 1e-3)


@pytest.mark.parametrize("stiffness", [0.0, 1e-2, 1.0, 1e2, 1e4])
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_rings_are_over_when_they_are_said_to_be(
    request: pytest.FixtureRequest, arms: str, stiffness: float
) -> None:
    """Even those of a bare spring, from which only the arms' own dampers take energy."""
    gripper, none = request.getfixturevalue(arms), np.zeros((1, 0))
    spring = Network(np.array([stiffness]), np.zeros(1), none, none)
    step = torque_history((hold(1.0, 1e-9),))
    after_s = ringing_s(gripper) * np.linspace(1.0, 1.5, 500)
    with_it, without = both_ways(gripper, spring, step, after_s)
    assert np.max(np.abs(with_it - without)) < 1e-14 * np.max(np.abs(without))


def test_what_is_seldom_sampled_shows_no_ring(gripper: Gripper) -> None:
    time_s = np.arange(1.0, 400.0)
    assert change_by_inertia(gripper, TORQUE, time_s[time_s != 200]) == 0.0
    # Nothing has moved when the torque has just changed, but by the time of the next sample.
    assert 0 < change_by_inertia(gripper, TORQUE, np.arange(4001) / 10) < 1e-5


def test_a_change_is_weighed_against_the_noise() -> None:
    trace = 1e-4 * np.ones(100)
    assert inertia_shows(0.02, trace, 1.9e-6 / VISIBLE)
    assert not inertia_shows(0.02, trace, 2.1e-6 / VISIBLE)
    # No instrument has none at all: one of 14 bits is as good as those are.
    assert inertia_shows(1.1 * VISIBLE / 2**10, trace, 0.0)
    assert not inertia_shows(0.9 * VISIBLE / 2**10, trace, 0.0)


@pytest.mark.parametrize("case", SAMPLES)
def test_the_default_study_does_not_show_it(case: str) -> None:
    """At 10 Hz, beside a tenth of noise, and beside a thousandth."""
    problem = STUDY.cases[case].problem
    time_s = STUDY.cases[case].sampling.over(400.0)
    sample = problem.searched.network([[SAMPLES[case][name] for name in MODEL.names]])
    clean = simulated_rotation(problem.gripper, sample, TORQUE, time_s, nonlinear=False)[0]
    for level in (0.1, 1e-3):
        noisy = add_noise(clean, Noise("gaussian", level, "peak"), np.random.default_rng(1))
        assert not problem.shows_inertia(time_s, noisy)
        assert not problem.of(time_s, noisy).residuals.inertia


@pytest.mark.parametrize("interval_s", [0.017, 0.021, 0.025, 0.030])
@pytest.mark.parametrize("level", [0.02, 0.04])
def test_the_same_arms_sampled_fast_show_it(interval_s: float, level: float) -> None:
    problem = STUDY.cases["endothelial_cell"].problem
    time_s = np.arange(0.0, 400.0, interval_s)
    sample = MODEL.network([[SAMPLES["endothelial_cell"][name] for name in MODEL.names]])
    clean = simulated_rotation(problem.gripper, sample, TORQUE, time_s, nonlinear=False)[0]
    noisy = add_noise(clean, Noise("gaussian", level, "peak"), np.random.default_rng(1))
    assert problem.shows_inertia(time_s, noisy)
    case_problem = problem.of(time_s, noisy)
    assert case_problem.residuals.inertia
    assert not case_problem.residuals.plain
    # Noise that is given counts, not that which neighbours suggest.
    assert not problem.shows_inertia(time_s, noisy, noise_rad=1e4 * float(clean.max()))


@pytest.mark.parametrize("name", [name for name in MODELS if MODELS[name].power_law])
def test_power_laws_ring_whoever_else_does(gripper: Gripper, name: str) -> None:
    """Byte for byte; of any samples, what targets are made with while arms ring.

    Then the inertia is dropped, which costs 3.1e-8 s^2 / t^2 at most (docs/model.md).
    """
    model = MODELS[name]
    near = np.log(MODEL_PARAMETERS[name])
    rng = np.random.default_rng(2)
    logs = np.clip(near + rng.normal(size=(8, len(near))), *log_range(model))
    step = torque_history((hold(0.5, 1.6e-9), hold(1.0, 0.4e-9)))
    time_s = np.sort(np.concatenate([start + np.geomspace(1e-7, 0.4, 15) for start in (0, 0.5)]))
    ringing = while_ringing(gripper, step, time_s)
    allowed = np.where(ringing, 1e-12, 3.1e-8 / ringing_s(gripper) ** 2)
    together = linear_responses(gripper, model, step, time_s, np.exp(logs), inertia=True)
    for own, rows in zip(np.exp(logs), together, strict=True):
        alone = linear_responses(gripper, model, step, time_s, own[None], inertia=True)[0]
        np.testing.assert_array_equal(alone, rows)
        network = model.network(own[None])
        exact = simulated_rotation(gripper, network, step, time_s, nonlinear=False)[0]
        assert np.all(np.abs(rows[0] - exact) <= allowed * np.abs(exact).max())
        few = linear_responses(gripper, model, step, time_s, own[None], inertia=True, slopes=False)[
            0
        ]
        np.testing.assert_allclose(few[0], rows[0], rtol=0, atol=1e-12 * np.abs(exact).max())
