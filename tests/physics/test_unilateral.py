"""Jaws that press but do not pull, against the equations integrated with events."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from biogrip.arrays import Array
from biogrip.physics import models
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.protocol import Course, Phase, evaluate, hold, join_phases
from biogrip.physics.response import step_response, superpose
from biogrip.physics.simulation import jaw_force
from biogrip.physics.unilateral import _Forcing, unilateral_response
from tests.helpers.responses import random_samples

# Slow arms, which an integrator can follow through contact and flight.
SLOW = Arm(1e-14, 4e-8, 4.4e-7)
OTHER = Arm(1e-14, 7e-8, 6.0e-7)
THREE = join_phases((hold(20.0, 1.6e-9), hold(20.0, 0.2e-9), hold(20.0, 2.4e-9)))
FALLING, RISING = Phase(2.0, 1.95e-9, -9.5e-10), Phase(2.0, 5e-11, 9.5e-10)
RAMPS = join_phases((hold(5.0, 1.6e-9), *(FALLING, RISING) * 6, Phase(10.0, 2e-9, -1.5e-10)))


def integrated(
    gripper: Gripper, sample: Array, torque: Course, time_s: Array
) -> tuple[Array, list[float]]:
    """phi_2, phi_4, delta, y and force by SciPy, regime by regime; and when they change."""
    k, k_p, c, c_p = (float(value) for value in sample)
    b, arms = gripper.lever_m, (gripper.left, gripper.right)
    _, dampings, stiffnesses = np.transpose([[*vars(arm).values()] for arm in arms])

    def motion(t: float, z: Array, touching: bool) -> tuple[Array, float]:
        rates = (float(evaluate(torque, t)) - stiffnesses * z[:2]) / dampings
        spring, y_rate, force = k_p * z[2] + k * (z[2] - z[3]), k / c * (z[2] - z[3]), 0.0
        if touching:
            # phi_i' = free_i - b F/c_i and F = spring + c_p b (phi_2' + phi_4').
            force = spring + c_p * b * np.sum(rates)
            force /= 1 + c_p * b * b * np.sum(1 / dampings)
            rates = rates - b * force / dampings
            delta_rate = b * np.sum(rates)
        else:
            delta_rate = -spring / c_p if c_p else k / (k + k_p) * y_rate
        return np.array([*rates, delta_rate, y_rate]), force

    def lets_go(t: float, z: Array) -> float:
        return motion(t, z, True)[1]

    def meets(t: float, z: Array) -> float:
        return float(z[2] - b * (z[0] + z[1]))

    for event in (lets_go, meets):
        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
    given = {"rtol": 1e-12, "atol": [1e-15, 1e-15, 1e-18, 1e-18], "max_step": 0.1}
    z, touching, found, changes = np.zeros(4), True, [], []
    for here, end in pairwise([*torque.time_s, torque.end_s]):
        end = np.nextafter(end, 0)
        if touching and lets_go(here, z) < 0:
            touching = False
            changes.append(here)
        while here < end:
            solved = solve_ivp(
                lambda t, z, touching=touching: motion(t, z, touching)[0],
                *((here, end), z, "LSODA"),
                events=lets_go if touching else meets,
                dense_output=True,
                **given,
            )
            for t in time_s[(time_s >= here) & (time_s < solved.t[-1])]:
                state = solved.sol(t)
                found.append([*state, motion(t, state, touching)[1]])
            here, z = float(solved.t[-1]), solved.y[:, -1]
            if solved.status == 1:
                touching = not touching
                changes.append(here)
    return np.transpose(found), changes


@pytest.mark.parametrize(
    ("k_p", "c_p", "torque", "right"),
    [
        (0.0, 0.0, THREE, SLOW),
        (0.02, 0.0, THREE, SLOW),
        (0.0, 0.04, THREE, SLOW),
        (0.02, 0.04, THREE, SLOW),
        (0.02, 0.0, RAMPS, OTHER),
        (0.0, 0.04, RAMPS, OTHER),
    ],
)
def test_against_lsoda_with_events(k_p: float, c_p: float, torque: Course, right: Arm) -> None:
    gripper = Gripper(1.5e-3, 75.0, SLOW, right)
    sample = np.array([0.5, k_p, 1.5, c_p])
    time_s = np.linspace(0, torque.end_s, 401)[:-1] + 1e-3
    expected, changes = integrated(gripper, sample, torque, time_s)
    ours = unilateral_response(gripper, models.generalized_maxwell(sample), torque, time_s)
    states = np.vstack((ours.rotation, ours.shortening_m, ours.dampers_m, ours.jaw_force_N))
    scale = np.abs(expected).max(axis=1, keepdims=True)
    # The integrator's tolerance over some hundred steps and a few events.
    assert np.max(np.abs(states - expected) / scale) < 1e-7
    assert len(changes) >= 2
    np.testing.assert_allclose(sorted(ours.parted_s + ours.met_s), changes, rtol=0, atol=1e-6)
    assert not np.all(ours.touching)
    assert np.all(ours.jaw_force_N >= 0)
    assert np.all(ours.jaw_force_N[~ours.touching] == 0)


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
        until = time_s < (found.parted_s[0] if found.parted_s else 400.0)
        assert np.max(np.abs(found.jaw_force_N - both)[until]) < 1e-6 * both.max()
        response = step_response(either_gripper, network, inertia=False)
        for arm in (0, 1):
            expected = superpose(response, steps, time_s, arm)[0]
            away = np.abs(found.rotation[arm] - expected)
            # And to rounding of arms that nothing is between.
            assert np.max(away[until]) < 1e-10 * expected.max() + 1e-14 * 1.6e-9 / 4.4e-7
        assert bool(found.parted_s) == bool(both.min() < -1e-9 * both.max())


def test_loads_go_on_from_a_later_instant() -> None:
    """1 + 2 t + 3 t^2 / 2 from t = 4 on: 33 + 14 s + 3 s^2 / 2."""
    later = _Forcing(np.array([[1.0, 2.0, 3.0]])).later(4.0)
    assert later.powers.tolist() == [[33.0, 14.0, 3.0]]
    assert later.at(np.array([2.0])).tolist() == [[67.0]]


def test_samples_that_lack_elements(gripper: Gripper, steps: Course) -> None:
    time_s = np.array([199.9, 200.1, 400.0])
    for network in (
        models.maxwell([1.0, 10.0]),
        models.damper([10.0]),
        models.liquid_drop([1.0, 0.0, 10.0]),
    ):
        found = unilateral_response(gripper, network, steps, time_s)
        assert found.touching.tolist() == [True, False, False]
        # No spring brings a liquid back.
        assert found.shortening_m[2] == pytest.approx(found.shortening_m[1], rel=1e-12)
    spring = unilateral_response(gripper, models.kelvin_voigt([0.05, 0.0]), steps, time_s)
    assert np.all(spring.touching)


def test_ends_do_not_depend_on_when_one_looks(gripper: Gripper) -> None:
    time_s, given = np.linspace(0, 40, 1000), (gripper, models.liquid_drop([1.0, 0.1, 10.0]), RAMPS)
    whole, some = (unilateral_response(*given, times) for times in (time_s, time_s[::37]))
    np.testing.assert_allclose(whole.rotation[:, ::37], some.rotation, rtol=1e-13)
    assert whole.parted_s == some.parted_s
    assert len(whole.parted_s) > 3
