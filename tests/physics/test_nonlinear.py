"""The nonlinear response and the force of the jaws, against Radau and closed forms."""

import math
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.physics.gripper import Arm, Gripper, rotation_of_tip
from biogrip.physics.models import MODELS, generalized_maxwell
from biogrip.physics.protocol import Course, Phase, evaluate, hold, join_phases
from biogrip.physics.response import compute_grip, step_response, superpose
from biogrip_study.gripper.nonlinear import correction, jaw_force, nonlinear_rotation
from tests.helpers.responses import random_samples

ARM = Arm(1.0e-14, 3.3e-12, 4.4e-7)
OTHER = Arm(1.3e-14, 2.5e-12, 5.5e-7)
# In a liquid, where it lags by a tenth of a second and more.
SLOW = Arm(1.0e-14, 1e-7, 4.4e-7)
AFTER = np.geomspace(0.1, np.nextafter(200, 0), 25)
TIMES = np.concatenate((AFTER, 200 + AFTER))


def integrated(
    gripper: Gripper,
    sample: Array,
    torque: Course,
    time_s: Array,
    peak: float,
    *,
    inertia: bool = False,
    max_step_s: float = np.inf,
) -> Array:
    """Rotations and, last, jaw force, (n_arms + 1, n_times), by SciPy's Radau from eqs. (1)-(3).

    Of equal arms one stands for both; errors of states are relative to a peak rotation.
    """
    k, k_p, c, c_p = (float(value) for value in sample)
    arms = [gripper.left] if gripper.left == gripper.right else [gripper.left, gripper.right]
    inertias, dampings, stiffnesses = np.transpose([[*vars(arm).values()] for arm in arms])
    hat, length = math.radians(gripper.reference_angle_deg), gripper.arm_length_m
    n, share = len(arms), 2 / len(arms)

    def motion(t: float, state: Array) -> tuple[Array, float]:
        phi, y = state[:n], state[-1]
        b = length * np.sin(hat - phi)
        delta = share * np.sum(2 * length * np.sin(hat - phi / 2) * np.sin(phi / 2))
        spring = k_p * delta + k * (delta - y)
        rest = float(evaluate(torque, t)) - stiffnesses * phi - b * spring
        rates = state[n:-1]
        if not inertia:
            # Of c_i phi_i' + c_p b_i delta' = rest_i, without a difference of terms with c_p.
            m = share * c_p * b / dampings
            rates = rest + (np.outer(rest, b) - np.outer(b, rest)) @ m
            rates = rates / (dampings * (1 + b @ m))
        viscous = c_p * share * (b @ rates)
        faster = (rest - dampings * rates - b * viscous) / inertias if inertia else []
        return np.concatenate((rates, faster, [k / c * (delta - y)])), spring + viscous

    allowed = 1e-11 * peak * np.append(np.ones(n * (1 + inertia)), length)
    state, found = np.zeros(len(allowed)), []
    for start, end in pairwise([*torque.time_s, torque.end_s]):
        last = np.nextafter(end, start)
        here = np.minimum(time_s[(time_s > start) & (time_s <= end)], last)
        at = np.unique(np.append(here, last))
        given = {"rtol": 1e-8, "atol": allowed, "max_step": max_step_s}

        def moved(t: float, z: Array, last: float = last) -> Array:
            # A step that ends with the phase may round to the next one.
            return motion(min(t, last), z)[0]

        solved = solve_ivp(moved, (start, last), state, "Radau", at, **given)
        assert solved.success, solved.message
        for t, now in zip(here, solved.y.T, strict=False):
            found.append(np.append(now[:n], motion(t, now)[1]))
        state = solved.y[:, -1]
    return np.transpose(found)


@pytest.mark.parametrize(
    ("right", "case", "soft"),
    [
        *((right, case, True) for right in (ARM, SLOW, OTHER) for case in range(4)),
        *((ARM, case, False) for case in range(8)),
        *(pytest.param(ARM, case, False, marks=pytest.mark.nightly) for case in range(8, 50)),
    ],
)
def test_rotations_and_force_against_radau(right: Arm, case: int, soft: bool) -> None:
    """Of any sample, any angle and up to 20 times the paper's torque; of soft ones the force, too.

    Of stiffer ones Radau's own force is a difference of nearly equal displacements.
    """
    rng = np.random.default_rng([50, case])
    gripper = Gripper(1.5e-3, rng.uniform(40, 90), SLOW if right is SLOW else ARM, right)
    factor = rng.uniform(1, 10 if soft else 20)
    torque = join_phases((hold(200.0, 1.6e-9 * factor), hold(200.0, 0.32e-9 * factor)))
    of_soft = 10 ** rng.uniform([-1, -3, 0, -3], [2, 1, 2, 1])
    sample = of_soft if soft else random_samples(1, 1000 + case)[0]
    network = generalized_maxwell(sample)
    linear = step_response(gripper, network, inertia=False)
    more = correction(gripper, network, torque)
    ours = [superpose(linear, torque, TIMES, arm) + more.at(TIMES, arm) for arm in (0, 1)]
    *both, expected = integrated(gripper, sample, torque, TIMES, np.max(np.abs(ours)))
    for one, other in zip(ours, both, strict=False):
        assert np.max(np.abs(one - other)) < 1e-7 * np.max(both)
    if soft:
        force = jaw_force(gripper, network, torque, TIMES, nonlinear=True, inertia=False)[0]
        assert np.max(np.abs(force - expected)) < 1e-6 * np.abs(expected).max()


# Arms that do not ring (quality factor 0.2), and none that have inertia; phases of all kinds.
DAMPED = Arm(1.0e-14, 3.3e-10, 4.4e-7)
PHASES = Phase(10.0, 0.0, 2e-9), Phase(10.0, 2e-8, -1e-9, 1.6e-10), hold(10.0, 5e-9)


@pytest.mark.parametrize(
    ("arm", "angle_deg", "sample", "phases", "inertia"),
    [
        (DAMPED, 50.0, [2.0, 0.05, 20.0, 0.01], (hold(100.0, 1.6e-8),), True),
        (ARM, 55.0, [2.0, 0.2, 20.0, 1.0], PHASES, False),
    ],
)
def test_inertia_ramps_and_parabolas_against_radau(
    arm: Arm, angle_deg: float, sample: list[float], phases: tuple[Phase, ...], inertia: bool
) -> None:
    gripper, torque = Gripper(1.5e-3, angle_deg, arm, arm), join_phases(phases)
    network, time_s = generalized_maxwell(sample), np.geomspace(0.1, torque.end_s, 60)
    ours = nonlinear_rotation(gripper, network, torque, time_s)[0]
    most = {"max_step_s": np.inf if inertia else 0.2}
    expected, force = integrated(
        gripper, np.array(sample), torque, time_s, 1e-3 * ours.max(), inertia=inertia, **most
    )
    assert np.max(np.abs(ours - expected)) < (1e-7 if inertia else 1e-6) * ours.max()
    # The nonlinearity is there to be seen.
    linear = superpose(step_response(gripper, network), torque, time_s)[0]
    assert np.max(np.abs(ours - linear)) > 1e-3 * ours.max()
    ours = jaw_force(gripper, network, torque, time_s, nonlinear=True, inertia=inertia)[0]
    assert np.max(np.abs(ours - force)) < 1e-6 * np.abs(force).max()


def test_rotation_of_a_tip_against_50_digits(gripper: Gripper) -> None:
    with mp.workdps(50):
        hat = mp.radians(mpf(75))
        for size in (1e-14, 1e-9, 1e-6, 1e-4, 5e-4):
            exact = hat - mp.acos(mp.cos(hat) + mpf(size) / mpf(1.5e-3))
            ours = float(rotation_of_tip(gripper, np.array(size)))
            assert ours == pytest.approx(float(exact), rel=4e-15)


def test_too_large_a_torque_is_refused(gripper: Gripper) -> None:
    network = generalized_maxwell(np.array([1e-3, 1e-4, 1e-3, 1e-3]))
    with pytest.raises(BiogripError, match="closes the arms so far"):
        nonlinear_rotation(gripper, network, join_phases((hold(100.0, 1e-5),)), TIMES[:10])


CELL = np.array([[35.0, 12.3, 299.9, 1e-3]])


def test_of_a_liquid_nothing_is_left_in_the_end(gripper: Gripper) -> None:
    liquid, torque = MODELS["maxwell"].network([1.0, 10.0]), join_phases((hold(5000.0, 1.6e-9),))
    late_s = np.array([1000.0, 2000.0])
    late = jaw_force(gripper, liquid, torque, late_s, nonlinear=False)[0]
    slow = step_response(gripper, liquid).rates.real.max()
    assert late[1] / late[0] == pytest.approx(np.exp(1000 * slow), rel=1e-12)
    assert 0 < late[1] < 1e-14


def test_without_inertia_the_force_jumps(gripper: Gripper, steps: Course) -> None:
    """The damper takes nearly the whole torque at once: c_p u over c_g + c_p u."""
    network, start = generalized_maxwell(CELL), np.zeros(1)
    for nonlinear in (False, True):
        force = jaw_force(gripper, network, steps, start, nonlinear=nonlinear)
        assert abs(force[0, 0]) < 1e-20
    jumping = jaw_force(gripper, network, steps, start, nonlinear=False, inertia=False)
    share = 1e-3 * 2 * gripper.lever_m**2
    expected = share / (share + 3.3e-12) * 1.6e-9 / gripper.lever_m
    assert jumping[0, 0] == pytest.approx(expected, rel=1e-12)


def test_a_damper_is_pulled_from_the_drop_on(gripper: Gripper, steps: Course) -> None:
    """F = c_p delta': tau/b at first; after the drop (tau_2 - k phi)/b."""
    grip = compute_grip(gripper, MODELS["damper"].network(10.0), steps)
    b, k_g = gripper.lever_m, 4.4e-7
    phi = 1.6e-9 / k_g * -math.expm1(-k_g * 200 / (2 * 10 * b * b))
    assert grip.largest_N == pytest.approx(1.6e-9 / b, rel=1e-5)
    assert grip.lowest_N == pytest.approx((0.32e-9 - k_g * phi) / b, rel=1e-5)
    assert grip.pulls_from_s == pytest.approx(200, abs=1e-5)
    assert grip.words() == (
        "the jaws would have to pull the sample from 200 s on (with 0.75 µN at 200 s, where they "
        "press with 1.1 µN at most)"
    )


def test_pressed_throughout_or_never(gripper: Gripper, steps: Course) -> None:
    spring = MODELS["kelvin_voigt"].network([1.0, 0.0])
    for network in (generalized_maxwell(CELL), spring):
        grip = compute_grip(gripper, network, steps)
        assert (grip.pulls_from_s, grip.words()) == (None, None)
        # The start, when nothing presses yet, is not meant.
        assert 0.1 * grip.largest_N < grip.lowest_N < grip.largest_N
    nothing = join_phases((hold(10.0, 0.0),))
    grip = compute_grip(gripper, spring, nothing)
    assert (grip.largest_N, grip.lowest_N, grip.pulls_from_s) == (0, 0, None)
