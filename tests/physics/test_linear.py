import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from biogrip.arrays import Array
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.maxwell_models import generalized_maxwell
from biogrip.physics.protocol import TorqueHistory, hold, torque_history
from biogrip.physics.sample_model import Network
from tests.helpers.responses import random_samples, rotation_50_digits

# From 0.1 s after the start to the end, close to the step and far from it.
TIMES = np.array([0.1, 0.2, 0.7, 3.3, 20.0, 90.0, 199.9, 200.1, 200.5, 210.0, 290.0, 400.0])


def worst_error(gripper: Gripper, steps: TorqueHistory, samples: Array) -> float:
    response = step_response(gripper, generalized_maxwell(samples), symmetric=steps.symmetric)
    ours = rotation(response, steps, TIMES)
    exact = np.array([rotation_50_digits(gripper, sample, steps, TIMES) for sample in samples])
    return float(np.max(np.abs(ours - exact) / np.abs(exact).max(axis=1, keepdims=True)))


@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_corrected_equations_over_the_whole_search_range(
    request: pytest.FixtureRequest, arms: str, steps: TorqueHistory
) -> None:
    """200 chromosomes against 50 digits; 1e-9 of the peak is asked, 1e-11 is held."""
    assert worst_error(request.getfixturevalue(arms), steps, random_samples(200, 1)) < 1e-11


def test_unequal_torques(gripper: Gripper, unequal_gripper: Gripper) -> None:
    steps = torque_history(
        (hold(50.0, 1.6e-9, 0.9e-9), hold(150.0, 0.0, 0.4e-9), hold(200.0, 0.32e-9))
    )
    for arms in (gripper, unequal_gripper):
        assert worst_error(arms, steps, random_samples(25, 999)) < 1e-10


def test_against_radau_with_inertia() -> None:
    """A damped gripper, whose ring SciPy can follow, integrated from its forces."""
    left, right = Arm(1e-9, 2e-8, 4.4e-7), Arm(2e-9, 3e-8, 6e-7)
    gripper = Gripper(1.5e-3, 60.0, left, right)
    k, k_p, c, c_p = sample = np.array([0.3, 0.05, 0.2, 0.01])
    b = gripper.lever_m
    # State: phi_2, phi_4, their rates, x; forces of the network on the tips.
    force = np.array([(k + k_p) * b, k_p * b, c_p * b, c_p * b, -k])
    system = np.zeros((5, 5))
    system[0, 2] = system[1, 3] = 1
    for row, arm in ((2, left), (3, right)):
        system[row] = -b * force / arm.inertia_kgm2
        system[row, row - 2] -= arm.stiffness_Nm_per_rad / arm.inertia_kgm2
        system[row, row] -= arm.damping_Nms_per_rad / arm.inertia_kgm2
    system[4] = [k / c * b, 0, 0, -b, -k / c]
    push = np.array([0, 0, 1 / left.inertia_kgm2, 1 / right.inertia_kgm2, 0])

    grid, state, integrated = np.linspace(0, 4, 81), np.zeros(5), [np.zeros(1)]
    for torque in (1.6e-9, 0.32e-9):
        load = torque * push
        solved = solve_ivp(
            lambda _, y, load=load: system @ y + load,
            (0, 4),
            state,
            "Radau",
            grid,
            rtol=1e-9,
            atol=1e-16,
            jac=system,
        )
        state = solved.y[:, -1]
        integrated.append(solved.y[0, 1:])
    steps = torque_history((hold(4.0, 1.6e-9), hold(4.0, 0.32e-9)))
    time_s = np.concatenate((grid, 4 + grid[1:]))
    ours = rotation(step_response(gripper, generalized_maxwell(sample)), steps, time_s)[0]
    # Radau's local tolerance, over a few thousand steps.
    assert np.max(np.abs(ours - np.concatenate(integrated))) < 1e-7 * np.abs(ours).max()


def test_inertia_may_be_left_out_of_the_misfit(gripper: Gripper, steps: TorqueHistory) -> None:
    """From 0.1 s after a step, what inertia changes is bounded.

    A slow pole p = k/c moves by the share p I/c = p^2 I/k, which changes its
    decay at time t by p t e^(-pt) times that: at most 27 e^-3 I/(k t^2), and the
    arms alone give the smallest k. The ring has decayed to e^(-c t / 2 I).
    """
    t, arm = 0.1, gripper.left
    shift = 27 * math.exp(-3) * arm.inertia_kgm2 / (arm.stiffness_Nm_per_rad * t**2)
    ring = math.exp(-arm.damping_Nms_per_rad * t / (2 * arm.inertia_kgm2))
    network = generalized_maxwell(random_samples(2000, 7))
    full = rotation(step_response(gripper, network), steps, TIMES)
    without = rotation(step_response(gripper, network, inertia=False), steps, TIMES)
    difference = np.abs(full - without).max(axis=1) / np.abs(full).max(axis=1)
    assert difference.max() < shift + ring
    assert shift + ring < 3.2e-6
    assert np.median(difference) < 1e-13


def test_starts_at_rest_and_ends_at_the_springs(gripper: Gripper, steps: TorqueHistory) -> None:
    samples = random_samples(500, 13)
    response = step_response(gripper, generalized_maxwell(samples))
    peak = np.abs(rotation(response, steps, TIMES)).max(axis=1)
    assert np.all(np.abs(rotation(response, steps, np.array([0.0]))[:, 0]) < 1e-6 * peak)
    # At infinity only the arm's spring and k_p carry the torque.
    expected = 1 / (gripper.left.stiffness_Nm_per_rad + 2 * gripper.lever_m**2 * samples[:, 1])
    np.testing.assert_allclose(response.static[:, 0, 0], expected, rtol=1e-14)


def test_identical_branches_make_no_trouble(gripper: Gripper, steps: TorqueHistory) -> None:
    """Two equal Maxwell branches are one of twice the spring and damper: a double root cancels."""
    one = Network(np.array([1.0]), np.array([0.1]), np.array([[4.0]]), np.array([[20.0]]))
    two = Network(
        np.array([1.0]), np.array([0.1]), np.array([[2.0, 2.0]]), np.array([[10.0, 10.0]])
    )
    single, double = (rotation(step_response(gripper, n), steps, TIMES)[0] for n in (one, two))
    np.testing.assert_allclose(double, single, rtol=1e-9)
