"""Jaws that press but do not pull: what comes out fulfils the equations."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics import models
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.protocol import Course, Phase, evaluate, hold, join_phases
from biogrip.physics.response import step_response, superpose
from biogrip_study.gripper.nonlinear import jaw_force
from biogrip_study.gripper.unilateral import (
    UnilateralResponse,
    _after,
    unilateral_response,
)
from tests.helpers.responses import random_samples

# Slow arms, which differences can follow through contact and flight.
SLOW = Arm(1e-14, 4e-8, 4.4e-7)
OTHER = Arm(1e-14, 7e-8, 6.0e-7)
THREE = join_phases((hold(20.0, 1.6e-9), hold(20.0, 0.2e-9), hold(20.0, 2.4e-9)))
FALLING, RISING = Phase(2.0, 1.95e-9, -9.5e-10), Phase(2.0, 5e-11, 9.5e-10)
LAST = Phase(10.0, 2e-9, -6e-10, 6e-11)
RAMPS = join_phases((hold(5.0, 1.6e-9), *(FALLING, RISING) * 6, LAST))


@pytest.mark.parametrize(
    ("k_p", "c_p", "torque", "right"),
    [
        *((k_p, c_p, THREE, SLOW) for k_p in (0.0, 0.02) for c_p in (0.0, 0.04)),
        (0.02, 0.0, RAMPS, OTHER),
        (0.0, 0.04, RAMPS, OTHER),
    ],
)
def test_the_jaws_press_or_the_gap_is_open(
    k_p: float, c_p: float, torque: Course, right: Arm
) -> None:
    """By differences arms, spring and dampers move as their forces say; no other motion does."""
    gripper, (k, c) = Gripper(1.5e-3, 75.0, SLOW, right), (0.5, 1.5)
    network = models.generalized_maxwell([k, k_p, c, c_p])

    def seen(time_s: Array) -> tuple[Array, UnilateralResponse]:
        found = unilateral_response(gripper, network, torque, time_s)
        return np.vstack((found.rotation, found.shortening_m, found.dampers_m)), found

    step = 1e-4
    time_s = np.arange(2e-3, torque.end_s, 0.05)
    states, found = seen(np.add.outer(time_s, step * np.arange(-2, 3)).ravel())
    states, force = (each.reshape(-1, len(time_s), 5) for each in (states, found.jaw_force_N))
    rates = states @ np.array([1, -8, 0, 8, -1]) / (12 * step)
    (*phi, delta, y), force, touching = states[..., 2], force[0, :, 2], found.touching[2::5]
    ends = np.array(sorted({*torque.time_s, *found.changes_s}))
    smooth = np.all(np.abs(np.subtract.outer(time_s, ends)) > 2 * step, axis=1)
    b, largest = gripper.lever_m, 2e-9
    for arm, own, rate in zip((SLOW, right), phi, rates, strict=False):
        moment = arm.damping_Nms_per_rad * rate + arm.stiffness_Nm_per_rad * own + b * force
        assert np.max(np.abs(moment - evaluate(torque, time_s))[smooth]) < 1e-9 * largest
    pressed = k_p * delta + c_p * rates[2] + k * (delta - y)
    assert np.max(np.abs(pressed - force)[smooth]) < 1e-9 * largest / b
    assert np.max(np.abs(c * rates[3] - k * (delta - y))[smooth]) < 1e-9 * largest / b
    gap = delta - b * np.sum(phi, axis=0)
    assert np.all(gap[~touching] > 0)
    assert np.max(np.abs(gap[touching])) < 1e-12 * delta.max()
    assert np.all(force >= 0)
    assert np.all(force[~touching] == 0)
    # From rest, without a jump wherever a stretch ends.
    both, _ = seen(np.add.outer(ends, [-1e-9, 1e-9]).ravel().clip(0))
    jumps = np.abs(np.diff(both.reshape(4, -1, 2))[..., 0]).max(axis=1)
    assert np.all(jumps < 1e-6 * np.abs(states).max(axis=(1, 2)))
    assert np.all(both[:, 0] == 0)
    assert len(found.changes_s) >= 1


def test_over_the_whole_range_the_jaws_never_pull(either_gripper: Gripper, steps: Course) -> None:
    """Up to the first loss of contact it is the bilateral response."""
    time_s = np.concatenate((np.geomspace(1e-3, 200, 40), 200 + np.geomspace(1e-3, 200, 40)))
    every_model = [model.network([model.example]) for model in models.MODELS.values()]
    for network in (*map(models.generalized_maxwell, random_samples(30, 77)), *every_model):
        found = unilateral_response(either_gripper, network, steps, time_s)
        both = jaw_force(either_gripper, network, steps, time_s, nonlinear=False, inertia=False)[0]
        assert np.all(found.jaw_force_N >= 0)
        gap = found.shortening_m - either_gripper.lever_m * found.rotation.sum(axis=0)
        assert np.all(gap > -1e-9 * found.shortening_m.max())
        until = time_s < (found.changes_s[0] if found.changes_s else 400.0)
        assert np.max(np.abs(found.jaw_force_N - both)[until]) < 1e-6 * both.max()
        response = step_response(either_gripper, network, inertia=False)
        for arm in (0, 1):
            expected = superpose(response, steps, time_s, arm)[0]
            away = np.abs(found.rotation[arm] - expected)
            # And to rounding of arms that nothing is between.
            assert np.max(away[until]) < 1e-10 * expected.max() + 1e-14 * 1.6e-9 / 4.4e-7
        assert bool(found.changes_s) == bool(both.min() < -1e-9 * both.max())


def test_a_torque_is_counted_from_within_its_phase() -> None:
    """Of 1 + 2 t + 3 t^2/2 after 2 s: 1 + 4 + 6, 2 + 6, and 3."""
    assert _after(np.array([1.0, 2.0, 3.0]), 2.0).tolist() == [11.0, 8.0, 3.0]
