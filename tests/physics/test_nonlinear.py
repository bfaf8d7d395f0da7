"""The nonlinear response and the force of the jaws, against Radau and closed forms."""

import math

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.physics.gripper import Arm, Gripper, displacement_of_tip, rotation_of_tip
from biogrip.physics.models import damper, generalized_maxwell, kelvin_voigt, maxwell
from biogrip.physics.nonlinear import correction, nonlinear_rotation
from biogrip.physics.protocol import Course, Phase, evaluate, hold, join_phases
from biogrip.physics.response import linear_jaw_force, step_response, superpose
from biogrip.physics.simulation import compute_grip, jaw_force
from tests.helpers.radau import TOLERANCE, equal_arms, tip
from tests.helpers.responses import random_samples
from tests.physics.test_protocols import TORQUE

ARM = Arm(1.0e-14, 3.3e-12, 4.4e-7)
OTHER = Arm(1.3e-14, 2.5e-12, 5.5e-7)
TIMES = np.concatenate((np.geomspace(0.1, 200, 25), 200 + np.geomspace(0.1, 200, 25)))


def unequal_arms(gripper: Gripper, sample: Array, torques: list[tuple[float, float]]) -> Array:
    """Corrected eqs. (1)-(3) without inertia, both arms, by SciPy, to 1e-9 of the peak.

    The damper c_p couples the rates: [c_2 + c_p b_2^2, c_p b_2 b_4; ...] phi' = rest.
    """
    k, k_p, c, c_p = (float(value) for value in sample)
    arms = gripper.left, gripper.right

    def slope(_: float, state: Array, tau: float) -> list[float]:
        (u, v), (b_2, b_4) = zip(*(tip(gripper, phi) for phi in state[:2]), strict=True)
        y = state[2]
        force = k_p * (u + v) + k * (u + v - y)
        rest = [
            tau - arm.stiffness_Nm_per_rad * phi - b * force
            for arm, phi, b in zip(arms, state[:2], (b_2, b_4), strict=True)
        ]
        m_22 = arms[0].damping_Nms_per_rad + c_p * b_2**2
        m_44 = arms[1].damping_Nms_per_rad + c_p * b_4**2
        # Determinant and adjugate without the difference c_p^2 - c_p^2.
        c_2, c_4 = (arm.damping_Nms_per_rad for arm in arms)
        determinant = c_2 * c_4 + c_p * (c_2 * b_4**2 + c_4 * b_2**2)
        mixed = c_p * b_2 * b_4
        return [
            (m_44 * rest[0] - mixed * rest[1]) / determinant,
            (m_22 * rest[1] - mixed * rest[0]) / determinant,
            k / c * (u + v - y),
        ]

    state, found, start = np.zeros(3), [], 0.0
    for end, torque in torques:
        here = TIMES[(start < TIMES) & (end >= TIMES)]
        solved = solve_ivp(
            slope,
            (start, end),
            state,
            "Radau",
            np.unique(np.append(here, end)),
            args=(torque,),
            rtol=TOLERANCE,
            atol=[1e-15, 1e-15, 1e-18],
        )
        found.append(solved.y[:2, : len(here)])
        state, start = solved.y[:, -1], end
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize(
    "case", [*range(8), *(pytest.param(n, marks=pytest.mark.nightly) for n in range(8, 50))]
)
def test_against_radau(case: int) -> None:
    """50 random samples, hat-theta_2 from 40 to 90 degrees, up to 20 times the paper's torque."""
    rng = np.random.default_rng([50, case])
    gripper = Gripper(1.5e-3, rng.uniform(40, 90), ARM, ARM)
    sample, factor = random_samples(1, 1000 + case)[0], rng.uniform(1, 20)
    taus = 1.6e-9 * factor, 0.32e-9 * factor
    network, torque = (
        generalized_maxwell(sample),
        join_phases(tuple(hold(200.0, tau) for tau in taus)),
    )
    linear = step_response(gripper, network, inertia=False)
    ours = superpose(linear, torque, TIMES)[0] + correction(gripper, network, torque).at(TIMES)[0]
    ends = [(200.0, taus[0]), (400.0, taus[1])]
    expected = equal_arms(gripper, sample, ends, TIMES, float(np.abs(ours).max()))[0]
    assert np.max(np.abs(ours - expected)) < 1e-7 * np.abs(expected).max()


# Samples that Radau follows in a second: in others it takes steps without end, at a residual of
# the force that rounding does not let it lower.
@pytest.mark.parametrize("case", [4, 8, 11])
def test_unequal_arms_against_radau(case: int) -> None:
    rng = np.random.default_rng([51, case])
    gripper = Gripper(1.5e-3, rng.uniform(40, 90), ARM, OTHER)
    sample = 10 ** rng.uniform([-1, -2, 0, -2], [2, 1, 2, 1])
    factor = 1e-9 * rng.uniform(1, 20)
    first, second = 1.6 * factor, 0.3 * factor
    network = generalized_maxwell(sample)
    torque = join_phases((hold(200.0, first), hold(200.0, second)))
    linear = step_response(gripper, network, inertia=False)
    found = correction(gripper, network, torque)
    both = unequal_arms(gripper, sample, [(200.0, first), (400.0, second)])
    for arm, expected in enumerate(both):
        ours = superpose(linear, torque, TIMES, arm)[0] + found.at(TIMES, arm)[0]
        assert np.max(np.abs(ours - expected)) < 1e-7 * np.abs(both).max()


def test_with_inertia_against_radau_for_a_damped_gripper() -> None:
    """Arms that do not ring (quality factor 0.2): Radau integrates eqs. (1)-(3) as they are."""
    arm = Arm(1.0e-14, 3.3e-10, 4.4e-7)
    gripper, sample = Gripper(1.5e-3, 50.0, arm, arm), np.array([2.0, 0.05, 20.0, 0.01])
    network, torque = generalized_maxwell(sample), join_phases((hold(100.0, 1.6e-8),))
    time_s = np.geomspace(0.1, 100, 40)
    ours = nonlinear_rotation(gripper, network, torque, time_s)[0]
    expected = equal_arms(
        gripper, sample, [(100.0, 1.6e-8)], time_s, 1e-3 * ours.max(), inertia=True
    )[0]
    assert np.max(np.abs(ours - expected)) < 1e-7 * ours.max()
    # The nonlinearity is there to be seen.
    linear = superpose(step_response(gripper, network), torque, time_s)[0]
    assert np.max(np.abs(ours - linear)) > 1e-3 * ours.max()


def test_ramps_and_parabolas_against_radau() -> None:
    gripper = Gripper(1.5e-3, 55.0, ARM, ARM)
    sample = np.array([2.0, 0.2, 20.0, 1.0])
    phases = Phase(10.0, 0.0, 2e-9), Phase(10.0, 2e-8, -1e-9, 1.6e-10), hold(10.0, 5e-9)
    torque = join_phases(phases)
    torques = [
        (10.0, lambda t: 2e-9 * t),
        (20.0, lambda t: 2e-8 - 1e-9 * (t - 10) + 8e-11 * (t - 10) ** 2),
        (30.0, lambda _: 5e-9),
    ]
    time_s = np.linspace(0.1, 29.9, 60)
    expected, force = equal_arms(gripper, sample, torques, time_s, 0.05)
    network = generalized_maxwell(sample)
    ours = nonlinear_rotation(gripper, network, torque, time_s)[0]
    assert np.max(np.abs(ours - expected)) < 1e-6 * np.abs(expected).max()
    linear = superpose(step_response(gripper, network), torque, time_s)[0]
    assert np.max(np.abs(ours - linear)) > 1e-3 * np.abs(expected).max()
    ours = jaw_force(gripper, network, torque, time_s, nonlinear=True, inertia=False)[0]
    assert np.max(np.abs(ours - force)) < 1e-6 * np.abs(force).max()


def test_rotation_of_a_tip_against_50_digits(gripper: Gripper) -> None:
    with mp.workdps(50):
        hat = mp.radians(mpf(75))
        for size in (1e-14, 1e-9, 1e-6, 1e-4, 5e-4):
            exact = hat - mp.acos(mp.cos(hat) + mpf(size) / mpf(1.5e-3))
            ours = float(rotation_of_tip(gripper, np.array(size)))
            assert ours == pytest.approx(float(exact), rel=4e-15)
            assert displacement_of_tip(gripper, np.array(ours)) == pytest.approx(size, rel=1e-14)


def test_too_large_a_torque_is_refused(gripper: Gripper) -> None:
    network = generalized_maxwell(np.array([1e-3, 1e-4, 1e-3, 1e-3]))
    with pytest.raises(BiogripError, match="closes the arms so far"):
        nonlinear_rotation(gripper, network, join_phases((hold(100.0, 1e-5),)), TIMES[:10])


DROPS = np.array([[9.5, 1e-4, 10.0, 1e-4], [1.0, 1e-4, 10.0, 1e-3]])
CELL = np.array([[35.0, 12.3, 299.9, 1e-3]])


@pytest.mark.parametrize("inertia", [False, True])
@pytest.mark.parametrize(
    "samples",
    [
        np.concatenate((DROPS, CELL, random_samples(20, 5))),
        np.array([[2.0, 5.0, 1.0, 0.2, 30.0, 1e3, 0.3, 0.5]]),
    ],
    ids=["one branch", "three branches"],
)
def test_the_arms_equation_closes_under_ramps_and_parabolas(
    either_gripper: Gripper, samples: Array, inertia: bool
) -> None:
    """b F = tau - k phi - c phi' (- I phi'', which is nothing beside these a moment later)."""
    gripper, network = either_gripper, generalized_maxwell(samples)
    time_s, arm = np.linspace(0.3, TORQUE.end_s - 0.2, 301), gripper.left
    response = step_response(gripper, network, inertia=False)
    rest = evaluate(TORQUE, time_s) - arm.stiffness_Nm_per_rad * superpose(response, TORQUE, time_s)
    rest -= arm.damping_Nms_per_rad * superpose(response, TORQUE, time_s, rate=True)
    of_steps = step_response(gripper, network, inertia=inertia, force=True)
    force = linear_jaw_force(of_steps, TORQUE, time_s)
    largest = evaluate(TORQUE, time_s).max()
    np.testing.assert_allclose(
        gripper.lever_m * force, rest, rtol=0, atol=(3e-6 if inertia else 1e-12) * largest
    )


# Arms in air, and in a liquid where they lag by a tenth of a second and more.
@pytest.mark.parametrize("damping", [3.3e-12, 1e-7])
@pytest.mark.parametrize("case", range(4))
def test_nonlinear_against_radau(case: int, damping: float) -> None:
    rng = np.random.default_rng([52, case])
    arm = Arm(1.0e-14, damping, 4.4e-7)
    gripper = Gripper(1.5e-3, rng.uniform(40, 90), arm, arm)
    # Of stiffer samples Radau's own force is a difference of nearly equal displacements.
    sample, factor = 10 ** rng.uniform([-1, -3, 0, -3], [2, 1, 2, 1]), rng.uniform(1, 10)
    taus = 1.6e-9 * factor, 0.32e-9 * factor
    torque = join_phases(tuple(hold(200.0, tau) for tau in taus))
    time_s = np.concatenate((np.geomspace(0.1, 200, 25), 200 + np.geomspace(0.1, 200, 25)))
    time_s[24] = np.nextafter(200, 0)
    network = generalized_maxwell(sample)
    ours = jaw_force(gripper, network, torque, time_s, nonlinear=True, inertia=False)[0]
    ends = [(200.0, taus[0]), (400.0, taus[1])]
    _, expected = equal_arms(gripper, sample, ends, time_s, taus[0] / 4.4e-7)
    assert np.max(np.abs(ours - expected)) < 1e-6 * np.abs(expected).max()
    linear = jaw_force(gripper, network, torque, time_s, nonlinear=False, inertia=False)[0]
    assert np.max(np.abs(ours - linear)) > 1e-5 * np.abs(expected).max()


def test_nonlinear_force_follows_the_work_of_unequal_arms(unequal_gripper: Gripper) -> None:
    """Of a bare damper the force's impulse is what it gave way times c_p."""
    c_p = 20.0
    torque = join_phases((hold(40.0, 3e-9),))
    x, weights = np.polynomial.legendre.leggauss(40)
    edges = np.concatenate(([0.0], np.geomspace(1e-6, 40.0, 40)))
    half = 0.5 * np.diff(edges)
    time_s = (edges[:-1, None] + half[:, None] * (1 + x)).ravel()
    force = jaw_force(unequal_gripper, damper(c_p), torque, time_s, nonlinear=True, inertia=False)
    impulse = np.sum(half[:, None] * weights * force.reshape(len(half), -1))
    end, hat = np.array([40.0]), np.radians(unequal_gripper.reference_angle_deg)
    shortening = 0.0
    for arm in (0, 1):
        phi = float(nonlinear_rotation(unequal_gripper, damper(c_p), torque, end, arm)[0, 0])
        shortening += 2 * 1.5e-3 * np.sin(hat - phi / 2) * np.sin(phi / 2)
    assert impulse == pytest.approx(c_p * shortening, rel=1e-8)


def test_what_is_left_in_the_end(gripper: Gripper) -> None:
    """The springs' share of a held torque; nothing for a liquid, without a digit lost."""
    samples = random_samples(300, 12)
    response = step_response(gripper, generalized_maxwell(samples), force=True)
    b, k_p = gripper.lever_m, samples[:, 1]
    expected = 2 * b * k_p / (gripper.left.stiffness_Nm_per_rad + 2 * b**2 * k_p)
    np.testing.assert_allclose(response.static[:, 0], expected, rtol=1e-14)
    liquid = step_response(gripper, maxwell([[1.0, 10.0]]), force=True)
    assert liquid.static[0, 0] == 0
    torque = join_phases((hold(5000.0, 1.6e-9),))
    late = linear_jaw_force(liquid, torque, np.array([1000.0, 2000.0]))[0]
    slow = liquid.rates.real.max()
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


def test_pressed_throughout(gripper: Gripper, steps: Course) -> None:
    for network in (generalized_maxwell([35.0, 12.3, 299.9, 1e-3]), kelvin_voigt([1.0, 0.0])):
        grip = compute_grip(gripper, network, steps, nonlinear=False)
        assert grip.pulls_from_s is None
        assert grip.words() is None
        # The start, when nothing presses yet, is not meant.
        assert 0.1 * grip.largest_N < grip.lowest_N < grip.largest_N


def test_no_torque_no_force(gripper: Gripper) -> None:
    grip = compute_grip(gripper, damper(5.0), join_phases((hold(10.0, 0.0),)), nonlinear=False)
    assert (grip.largest_N, grip.lowest_N, grip.pulls_from_s) == (0, 0, None)
