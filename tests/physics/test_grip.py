import math

import numpy as np
import pytest

from biogrip.physics.gripper import Gripper
from biogrip.physics.maxwell_models import damper, generalized_maxwell, kelvin_voigt
from biogrip.physics.protocol import Harmonic, Load, Phase, TorqueHistory, hold, torque_history
from biogrip.physics.simulation import compute_grip


def test_a_damper_is_pulled_from_the_drop_on(gripper: Gripper, steps: TorqueHistory) -> None:
    """F = c_p delta': tau/b at first; after the drop (tau_2 - k phi)/b."""
    grip = compute_grip(gripper, damper(10.0), steps, nonlinear=False)
    b, k_g = gripper.lever_m, 4.4e-7
    phi = 1.6e-9 / k_g * -math.expm1(-k_g * 200 / (2 * 10 * b * b))
    assert grip.largest_N == pytest.approx(1.6e-9 / b, rel=1e-5)
    assert grip.lowest_N == pytest.approx((0.32e-9 - k_g * phi) / b, rel=1e-5)
    assert grip.pulls_from_s == pytest.approx(200, abs=1e-5)
    assert grip.words() == (
        "the jaws would have to pull the sample from 200 s on (with 0.75 µN at 200 s, where they "
        "press with 1.1 µN at most)"
    )


def test_pressed_throughout(gripper: Gripper, steps: TorqueHistory) -> None:
    for network in (generalized_maxwell([35.0, 12.3, 299.9, 1e-3]), kelvin_voigt([1.0, 0.0])):
        grip = compute_grip(gripper, network, steps, nonlinear=False)
        assert grip.pulls_from_s is None
        assert grip.words() is None
        # The start, when nothing presses yet, is not meant.
        assert 0.1 * grip.largest_N < grip.lowest_N < grip.largest_N


def test_a_pull_within_a_period_is_found(gripper: Gripper) -> None:
    swing = Load(1e-9, 0.0, 0.0, (Harmonic(0.99e-9, 2 * np.pi * 0.5, 0.0),))
    torque = torque_history((Phase(200.0, swing, swing), hold(10.0, 2e-9)))
    grip = compute_grip(gripper, damper(5.0), torque, nonlinear=False)
    assert grip.lowest_N < 0 < grip.largest_N
    assert grip.pulls_from_s is not None
    assert grip.pulls_from_s < 200


def test_no_torque_no_force(gripper: Gripper) -> None:
    grip = compute_grip(gripper, damper(5.0), torque_history((hold(10.0, 0.0),)), nonlinear=False)
    assert (grip.largest_N, grip.lowest_N, grip.pulls_from_s) == (0, 0, None)
