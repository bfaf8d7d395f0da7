"""Ramps, parabolas and sinusoids: the linear response is exact in every phase."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

from biogrip.arrays import Array
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.gripper import torque as torque_of_voltage
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.linear import phi_function, rotation, step_response
from biogrip.physics.maxwell_models import generalized_maxwell
from biogrip.physics.misfit import SeriesMisfit
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import (
    Harmonic,
    Load,
    Phase,
    TorqueHistory,
    hold,
    sample_times,
    torque_at,
    torque_history,
)
from biogrip.study.experiment_blocks import PhaseBlock, ProtocolBlock
from tests.helpers.problems import problem_alone
from tests.physics.test_actuator import TABLE_2

PROTOCOL = ProtocolBlock(
    (
        PhaseBlock(20.0, torque_Nm=0.0, to_torque_Nm=2e-9),
        PhaseBlock(30.0, voltage_V=12.0, amplitude_V=5.0, frequency_Hz=0.3),
        PhaseBlock(10.0, voltage_V=3.0, to_voltage_V=15.0),
        PhaseBlock(15.0, torque_Nm=1e-9, amplitude_Nm=5e-10, frequency_Hz=1.1),
        PhaseBlock(15.0, torque_Nm=0.5e-9),
    )
)
TORQUE = torque_history(PROTOCOL.make_phases(GRIPPER, TABLE_2))
PER_SQUARE_VOLT = float(torque_of_voltage(TABLE_2, 1.0))
EDGES = np.array([0.0, 20.0, 50.0, 60.0, 75.0, 90.0])


def written_out(t: float) -> float:
    """The protocol's torque, phase by phase."""
    if t < 20:
        return 1e-10 * t
    if t < 50:
        return PER_SQUARE_VOLT * (12 + 5 * math.sin(2 * math.pi * 0.3 * (t - 20))) ** 2
    if t < 60:
        return PER_SQUARE_VOLT * (3 + 1.2 * (t - 50)) ** 2
    if t < 75:
        return 1e-9 + 5e-10 * math.sin(2 * math.pi * 1.1 * (t - 60))
    return 0.5e-9


def test_torque_and_voltage_become_the_torque_they_say() -> None:
    time_s = np.linspace(0, 89.99, 2000)
    expected = [written_out(t) for t in time_s]
    np.testing.assert_allclose(torque_at(TORQUE, time_s), expected, rtol=0, atol=1e-22)


@pytest.mark.parametrize("inertia", [False, True])
def test_every_phase_against_radau(inertia: bool) -> None:
    arm = Arm(1e-9, 2e-8, 4.4e-7) if inertia else Arm(1e-14, 3.3e-10, 4.4e-7)
    gripper = Gripper(1.5e-3, 75.0, arm, arm)
    k, k_p, c, c_p = sample = np.array([0.3, 0.05, 0.5, 0.02])
    b = gripper.lever_m

    def slope(t: float, state: np.ndarray) -> list[float]:
        phi, rate, y = state
        delta = 2 * b * phi
        rest = written_out(t) - arm.stiffness_Nm_per_rad * phi - b * (k_p * delta + k * (delta - y))
        damping = arm.damping_Nms_per_rad + 2 * c_p * b * b
        if inertia:
            return [rate, (rest - damping * rate) / arm.inertia_kgm2, k / c * (delta - y)]
        return [rest / damping, 0.0, k / c * (delta - y)]

    time_s, expected, state = np.linspace(0, 90, 361), [np.zeros(1)], np.zeros(3)
    for start, end in pairwise(EDGES):
        here = time_s[(time_s > start) & (time_s <= end)]
        inside = np.minimum(here, np.nextafter(end, 0))
        solved = solve_ivp(
            slope,
            (start, np.nextafter(end, 0)),
            state,
            "Radau",
            inside,
            rtol=1e-8,
            atol=[1e-14, 1e-14, 1e-17],
            max_step=0.2,
        )
        expected.append(solved.y[0])
        state = solved.y[:, -1]
    response = step_response(gripper, generalized_maxwell(sample), inertia=inertia)
    ours = rotation(response, TORQUE, time_s)[0]
    # The integrator's tolerance; 3e-9 is left of it, 3e-10 of a tenth of it.
    assert np.max(np.abs(ours - np.concatenate(expected))) < 1e-7 * np.abs(ours).max()


def test_rate_is_the_derivative_of_the_rotation() -> None:
    gripper = Gripper(1.5e-3, 75.0, Arm(1e-14, 3.3e-10, 4.4e-7), Arm(1e-14, 3.3e-10, 4.4e-7))
    response = step_response(gripper, generalized_maxwell([0.3, 0.05, 0.5, 0.02]), inertia=False)
    time_s, h = np.array([5.0, 19.0, 33.3, 57.0, 66.6, 80.0]), 1e-4
    lower, upper = (rotation(response, TORQUE, time_s + d) for d in (-h, h))
    # The central difference errs by h^2/6 of the third derivative, 1e-8 of the rate here.
    rate = rotation(response, TORQUE, time_s, rate=True)
    np.testing.assert_allclose((upper - lower) / (2 * h), rate, rtol=0, atol=1e-6 * rate.max())


def test_phi_functions_against_50_digits() -> None:
    with mp.workdps(50):
        for order in (1, 2, 3):
            for z in (-1e-12, -1e-3, -0.3, -0.9999, -1.0001, -7.0, -300.0, -1e8):
                series = mp.exp(mpf(z)) - mp.fsum(
                    mpf(z) ** k / mp.factorial(k) for k in range(order)
                )
                exact = series / mpf(z) ** order
                ours = float(phi_function(order, np.array([z]))[0])
                assert ours == pytest.approx(float(exact), rel=1e-13)


def test_the_fastest_way_is_chosen(gripper: Gripper) -> None:
    model, uniform = MODELS["maxwell"], np.arange(0, 41, 2.0)
    steps = torque_history((Phase(40.0, Load(1e-9), Load(1e-9)),))
    ramp = torque_history((Phase(40.0, Load(0.0, 1e-10), Load(0.0, 1e-10)),))
    swing = Load(1e-9, 0.0, 0.0, (Harmonic(1e-10, 1.0, 0.0),))
    swings = torque_history((Phase(40.0, swing, swing),))
    trace = np.zeros_like(uniform)

    def needs_no_response(torque: TorqueHistory, time_s: Array, **assumed: Any) -> bool:
        problem = problem_alone(gripper, model, torque, time_s, trace, **assumed)
        by_series = isinstance(problem.misfit, SeriesMisfit)
        assert by_series or problem.misfit == problem.residuals.condensed_misfit
        return by_series

    assert needs_no_response(steps, uniform)
    assert not needs_no_response(steps, np.sqrt(uniform))
    assert not needs_no_response(ramp, uniform)
    assert not needs_no_response(swings, uniform)
    assert not needs_no_response(steps, uniform, offset=True)


PAPER = (hold(200.0, 1.6e-9), hold(200.0, 0.32e-9))


def test_steps_add_up_to_the_torque() -> None:
    steps = torque_history(PAPER)
    np.testing.assert_array_equal(steps.time_s, [0.0, 200.0])
    np.testing.assert_allclose(np.cumsum(steps.left[:, 0]), [1.6e-9, 0.32e-9], rtol=1e-15)
    assert steps.symmetric


def test_torque_at_a_step_is_the_one_after_it() -> None:
    torque = torque_at(torque_history(PAPER), [-1.0, 0.0, 199.9, 200.0, 400.0])
    np.testing.assert_allclose(torque, [0.0, 1.6e-9, 1.6e-9, 0.32e-9, 0.32e-9], rtol=1e-12)


def test_rounding_does_not_lose_the_last_sample() -> None:
    """0.3 s at 10 Hz: 0.3 * 10 is 2.9999999999999996 in doubles."""
    assert len(sample_times(0.1 + 0.2, 10.0)) == 4
    assert len(sample_times(0.3, 10.0)) == 4


def test_sinusoids_of_one_frequency_add_up_on_each_arm() -> None:
    one, other = Harmonic(1e-10, 2.0, 0.3), Harmonic(3e-10, 2.0, 1.9)
    left, right = Load(1e-9, 0.0, 0.0, (one, other)), Load(2e-9, 0.0, 0.0, (other,))
    history = torque_history((hold(1.5, 0.0), Phase(4.0, left, right), hold(2.0, 1e-9)))
    inside, time_s = np.linspace(0.01, 3.99, 50), np.linspace(1.51, 5.49, 50)
    assert len(history.omega_rad_per_s) == 2
    for arm, own in (("left", left), ("right", right)):
        np.testing.assert_allclose(torque_at(history, time_s, arm), own.at(inside), rtol=1e-12)
        np.testing.assert_allclose(torque_at(history, [6.0, 7.0], arm), 1e-9, rtol=1e-12)
