"""Limits tie the models to one another and to closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory, held, torque_history
from biogrip.response.linear import _sample_polynomials, rotation, step_response
from biogrip.sample import MODELS, Network, SampleModel, generalized_maxwell, liquid_drop

TIMES = np.linspace(0.1, 400, 300)


def response_of(gripper: Gripper, steps: TorqueHistory, network: Network) -> np.ndarray:
    return rotation(step_response(gripper, network), steps, TIMES)[0]


def kelvin_voigt(
    gripper: Gripper, steps: TorqueHistory, spring: float, damper: float
) -> np.ndarray:
    """Closed form without inertia: one exponential a step."""
    u = 2 * gripper.lever_m**2
    stiffness = gripper.left.stiffness_Nm_per_rad + u * spring
    rate = stiffness / (gripper.left.damping_Nms_per_rad + u * damper)
    phi = np.zeros_like(TIMES)
    for start, height in zip(steps.time_s, steps.left[:, 0], strict=True):
        elapsed = np.maximum(TIMES - start, 0)
        phi += height / stiffness * -np.expm1(-rate * elapsed)
    return phi


def test_liquid_drop_is_generalized_maxwell_without_its_damper(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    drop = response_of(gripper, steps, liquid_drop([9.5, 0.3, 10.0]))
    general = response_of(gripper, steps, generalized_maxwell([9.5, 0.3, 10.0, 0.0]))
    np.testing.assert_array_equal(drop, general)


def test_a_stiff_branch_is_a_damper_and_only_the_sum_of_dampers_shows(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    """k to infinity: Kelvin-Voigt with c + c_p, however the sum is split."""
    expected = kelvin_voigt(gripper, steps, 0.02, 10.0)
    for c, c_p in ((9.9, 0.1), (2.0, 8.0), (0.1, 9.9)):
        ours = response_of(gripper, steps, generalized_maxwell([1e7, 0.02, c, c_p]))
        # The branch relaxes within c/k = 1e-6 s, and the arms' inertia lags as little.
        np.testing.assert_allclose(ours, expected, atol=1e-6 * expected.max())


def test_a_blocked_damper_leaves_the_springs_in_parallel(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    """c to infinity: k and k_p side by side."""
    ours = response_of(gripper, steps, generalized_maxwell([2.0, 0.5, 1e9, 3.0]))
    # The damper still creeps by t k/c = 1e-6.
    np.testing.assert_allclose(ours, kelvin_voigt(gripper, steps, 2.5, 3.0), rtol=2e-6)


def test_maxwell_liquid_flows_at_the_rate_of_its_damper(gripper: Gripper) -> None:
    """k_p, c_p to 0 and soft arms: phi = tau/u (1/k + t/c)."""
    soft = replace(gripper.left, stiffness_Nm_per_rad=1e-16)
    free = Gripper(gripper.arm_length_m, gripper.reference_angle_deg, soft, soft)
    constant = torque_history((held(400.0, 1.6e-9),))
    ours = response_of(free, constant, liquid_drop([2.0, 0.0, 50.0]))
    expected = 1.6e-9 / (2 * free.lever_m**2) * (1 / 2.0 + TIMES / 50.0)
    # The arm's damper delays the start by c_g / (u k) = 4e-7 s.
    np.testing.assert_allclose(ours, expected, rtol=1e-6)


@pytest.mark.parametrize("model", MODELS.values(), ids=list(MODELS))
def test_a_model_turns_its_parameters_into_a_network(model: SampleModel) -> None:
    samples = np.arange(1.0, 1 + 5 * len(model.parameters)).reshape(5, -1)
    network = model.network(samples)
    for name in model.names:
        element = np.asarray(getattr(network, name)).reshape(5)
        np.testing.assert_array_equal(element, samples[:, model.names.index(name)])


def test_the_printed_equation_6_runs_away_and_the_corrected_one_relaxes() -> None:
    """With both tips held, eq. (6) as printed reads -k x + c x' = 0; balance needs +k x."""
    k, c, start = 35.0, 299.9, 1e-9
    for sign in (+1, -1):
        solved = solve_ivp(
            lambda _, x, sign=sign: sign * k / c * x, (0, 20), [start], rtol=1e-9, atol=0
        )
        assert solved.y[0, -1] == pytest.approx(start * np.exp(sign * k / c * 20), rel=1e-6)
    # The library's sample has the relaxing pole, -k/c, alone: strain it, hold it, watch the force.
    _, q = _sample_polynomials(generalized_maxwell([k, 12.3, c, 1e-3]))
    np.testing.assert_allclose(-q[0, 0] / q[0, 1], -k / c, rtol=1e-15)
