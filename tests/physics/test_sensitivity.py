"""Exact derivatives, against differences of responses right to 1e-11 (test_protocols.py)."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import NO_ARMS, Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.modes import linear_responses
from biogrip.physics.noise import nuisance_basis, with_uncertain, within, without
from biogrip.physics.protocol import Course, join_phases
from biogrip.physics.residuals import Residuals, Trace
from biogrip.physics.response import step_response, superpose
from biogrip.physics.sample_model import SampleModel, with_fixed
from biogrip.physics.simulation import simulated_response
from tests.helpers.responses import PROTOCOLS, random_samples

TIMES = np.array([0.1, 1.0, 7.5, 60.0, 199.0, 200.1, 201.0, 230.0, 399.0])


MAXWELL, BURGERS = MODELS["generalized_maxwell"], MODELS["burgers"]
SAMPLES: list[tuple[SampleModel, tuple[float, ...]]] = [
    *((model, model.example) for model in MODELS.values()),
    (Sample("generalized_maxwell", 2).model, (5.0, 0.2, 1.0, 9.0, 99.0, 0.5)),
    (with_fixed(BURGERS, {"c_s": 200.0}), (3.0, 2.0, 40.0)),
]
DEVICES = [
    *(("equal arms", "steps"), ("equal arms", "ramps and parabola"), ("unequal arms", "steps")),
    *((device, "ramps and parabola") for device in ("unequal arms", "creep", "relaxation")),
]
DRAWN = [("equal arms", "steps", MAXWELL, tuple(given)) for given in random_samples(12, seed=5)]


@pytest.mark.parametrize(
    ("device", "protocol", "model", "given"),
    [*((*device, *sample) for device in DEVICES for sample in SAMPLES), *DRAWN],
)
def test_against_differences(
    request: pytest.FixtureRequest, device: str, protocol: str, model: SampleModel, given: Array
) -> None:
    torque = join_phases(PROTOCOLS[protocol], deforms=device == "relaxation")
    arms = {"equal arms": "gripper", "unequal arms": "unequal_gripper"}.get(device)
    gripper, sample = request.getfixturevalue(arms) if arms else NO_ARMS, np.array(given)
    phi, *slopes = linear_responses(gripper, model, torque, TIMES, sample[None])[0]

    def simulated(parameters: Array) -> Array:
        network = model.network([parameters])
        if not arms:
            return simulated_response(NO_ARMS, network, torque, TIMES, nonlinear=False)[0]
        return superpose(step_response(gripper, network, inertia=False), torque, TIMES)[0]

    np.testing.assert_allclose(phi, simulated(sample), rtol=1e-12, atol=1e-12 * np.abs(phi).max())
    for index in range(len(sample)):
        unit = np.eye(len(sample))[index]
        ends = [simulated(sample * np.exp(h * unit)) for h in (2e-3, -2e-3, 1e-3, -1e-3)]
        # Extrapolated: h^4 = 1e-12, and rounding 1e-16 / h = 1e-13; derivatives cancel some more.
        exact = (8 * (ends[2] - ends[3]) - (ends[0] - ends[1])) / 12e-3
        assert np.max(np.abs(slopes[index] - exact)) <= 1e-9 * np.abs(phi).max()


@pytest.mark.parametrize(("offset", "drift"), [(True, False), (False, True), (True, True)])
def test_nuisance_takes_out_offset_and_drift_and_nothing_else(offset: bool, drift: bool) -> None:
    times = np.linspace(0.0, 10.0, 101)
    basis = nuisance_basis(times, offset=offset, drift=drift)
    np.testing.assert_allclose(basis @ basis.T, np.eye(offset + drift), atol=1e-14)
    added = 3.0 * offset + 0.2 * drift * times
    wave = without(basis, np.sin(times))
    np.testing.assert_allclose(without(basis, wave + added), wave, atol=1e-12)
    np.testing.assert_allclose(within(basis, wave + added), added, atol=1e-12)


def posed(steps: Course, gripper: Gripper, times: Array, basis: Array) -> Residuals:
    trace = np.random.default_rng(0).standard_normal(len(times)) * 1e-4
    given = Trace(times, trace, Condensed(steps, times, basis))
    return Residuals(gripper, MODELS["maxwell"], steps, given, instrument=GRIPPER)


READ_S = np.arange(401.0)
AT = np.log([2.0, 50.0])


@pytest.mark.parametrize("count", [401, 4001, 60_001])
def test_the_gradient_is_that_of_all_readings(gripper: Gripper, steps: Course, count: int) -> None:
    """Whatever part of an amplitude is taken out, and of many readings through their nodes."""
    times = np.linspace(0.0, 400.0, count)
    offset = nuisance_basis(times, offset=True, drift=False)
    basis = with_uncertain(offset, 0.1 * np.sin(times / 30)[None])
    residuals = posed(steps, gripper, times, basis)
    residual, slopes = residuals(AT)
    np.testing.assert_array_equal(residuals.left(AT), residual)
    (gradient,), (misfit,) = residuals.gradients(AT[None], [residuals])
    np.testing.assert_allclose(gradient, slopes @ residual, rtol=1e-11)
    assert misfit == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-12)


def test_a_later_protocol_is_one_of_earlier_readings(gripper: Gripper, steps: Course) -> None:
    nothing, both = np.zeros((0, 401)), (READ_S, READ_S - 3.0)
    here, there = (posed(steps, gripper, times, nothing) for times in both)
    moved, parameters = here.later(3.0), np.exp(AT)[None]
    np.testing.assert_array_equal(moved(AT)[0], there(AT)[0])
    expected = there.misfit(parameters)
    assert moved.misfit(parameters) == pytest.approx(expected, rel=1e-12)
    assert moved.noise_scale == here.noise_scale
