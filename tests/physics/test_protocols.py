"""The linear response against 50 digits; protocols, and zeros between poles."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.optimize import brentq

from biogrip.arrays import Array
from biogrip.library import set_up
from biogrip.physics.gripper import Gripper
from biogrip.physics.gripper import torque as torque_of_voltage
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.misfit import SeriesMisfit, make_misfit
from biogrip.physics.models import Sample, generalized_maxwell
from biogrip.physics.protocol import (
    SWEEP,
    Course,
    Phase,
    evaluate,
    hold,
    join_phases,
    largest_load,
    ramp,
    sample_times,
)
from biogrip.physics.response import phi_functions, step_response, superpose
from biogrip.physics.roots import SMALLEST_GAP, interlaced_zeros, separate
from biogrip.physics.simulation import jaw_force
from biogrip.study.experiment_blocks import PhaseBlock, ProtocolBlock
from tests.helpers.responses import exact_50_digits, random_samples
from tests.physics.test_contact import TABLE_2

BLOCKS = (
    PhaseBlock(5.0, torque_Nm=0.0, to_torque_Nm=2e-9),
    PhaseBlock(10.0, voltage_V=12.0),
    PhaseBlock(4.0, voltage_V=3.0, to_voltage_V=15.0),
    PhaseBlock(5.0, torque_Nm=1e-9, to_torque_Nm=2e-10),
    PhaseBlock(5.0, torque_Nm=0.5e-9),
)
TORQUE = join_phases(ProtocolBlock(BLOCKS).make_phases(GRIPPER, TABLE_2))
PER_SQUARE_VOLT = float(torque_of_voltage(TABLE_2, 1.0))
# The protocol's torque until some times, phase by phase.
WRITTEN_OUT: list[tuple[float, Callable[[float], float]]] = [
    (5.0, lambda t: 4e-10 * t),
    (15.0, lambda _: PER_SQUARE_VOLT * 12**2),
    (19.0, lambda t: PER_SQUARE_VOLT * (3 + 3 * (t - 15)) ** 2),
    (24.0, lambda t: 1e-9 - 1.6e-10 * (t - 19)),
    (29.0, lambda _: 0.5e-9),
]


def test_torque_and_voltage_become_the_torque_they_say() -> None:
    """At a step it is what follows it."""
    time_s = np.linspace(0, 28.99, 2000)
    time_s[100:104] = 5.0, 15.0, 19.0, 24.0
    expected = [next(torque(t) for end, torque in WRITTEN_OUT if t < end) for t in time_s]
    np.testing.assert_allclose(evaluate(TORQUE, time_s), expected, rtol=0, atol=1e-22)
    assert evaluate(TORQUE, -1.0) == 0


def test_phi_functions_against_50_digits() -> None:
    with mp.workdps(50):
        for order in (1, 2, 3):
            for z in (-1e-12, -1e-3, -0.3, -0.9999, -1.0001, -7.0, -300.0, -1e8):
                first = mp.fsum(mpf(z) ** k / mp.factorial(k) for k in range(order))
                exact = (mp.exp(mpf(z)) - first) / mpf(z) ** order
                ours = float(phi_functions(max(order, 1), np.array([z]))[order][0])
                assert ours == pytest.approx(float(exact), rel=1e-13)


EVENLY = np.arange(0, 41, 2.0)


HELD = (hold(40.0, 1e-9),)


@pytest.mark.parametrize(
    ("name", "phases", "time_s", "offset"),
    [
        ("maxwell", HELD, EVENLY, False),
        ("maxwell", HELD, np.sqrt(EVENLY), False),
        ("maxwell", HELD, EVENLY, True),
        ("maxwell", (hold(3.0, 1e-9), hold(37.0, 2e-9)), EVENLY, False),
        ("maxwell", (ramp(40.0, 0.0, 4e-9),), EVENLY, False),
        ("burgers", HELD, EVENLY, False),
    ],
)
def test_no_response_is_needed_of_steps_that_are_sampled_evenly(
    gripper: Gripper, name: str, phases: tuple[Phase, ...], time_s: Array, offset: bool
) -> None:
    """By the sample with one branch, whose readings have no offset: the first alone."""
    experiment = set_up(gripper, phases, Sample(name))
    problem = replace(experiment, offset=offset).of(time_s, np.zeros_like(time_s))
    by_series = (name, phases, offset) == ("maxwell", HELD, False) and time_s is EVENLY
    misfit = make_misfit(problem.residuals)
    assert isinstance(misfit, SeriesMisfit) == by_series
    assert by_series or misfit == problem.residuals.misfit


def test_rounding_does_not_lose_the_last_sample() -> None:
    """4.35 * 100 is 434.99999999999994 in doubles."""
    assert len(sample_times(4.35, 100.0)) == 436
    assert len(sample_times(4.349, 100.0)) == 435


@pytest.mark.parametrize("lasts_s", [3.0, 5.0])
def test_rounding_makes_no_step_between_ramps(lasts_s: float) -> None:
    """The second ends at 0.3 but for 6e-17."""
    course = join_phases(tuple(ramp(lasts_s, *ends) for ends in pairwise((0.0, 0.1, 0.3, 0.7))))
    assert [order for _, order, _ in course.jumps] == [1, 1, 1]


def test_the_largest_load_is_that_of_the_largest_magnitude() -> None:
    assert largest_load((hold(1.0, -5.0), hold(1.0, 1.0))) == -5.0
    assert largest_load((ramp(1.0, 0.0, -2.0), hold(1.0, 1.0))) == -2.0


# From 0.1 s after the start to the end, close to the step and far from it.
TIMES = np.array([0.1, 0.2, 0.7, 3.3, 20.0, 90.0, 199.9, 200.1, 200.5, 210.0, 290.0, 400.0])


def worst_error(gripper: Gripper, steps: Course, samples: Array) -> float:
    """Of rotation and jaw force, as a share of each sample's largest, against 50 digits."""
    network = generalized_maxwell(samples)
    response = step_response(gripper, network)
    force = jaw_force(gripper, network, steps, TIMES, nonlinear=False)
    ours = np.stack((superpose(response, steps, TIMES), force), axis=1)
    exact = np.array([exact_50_digits(gripper, sample, steps, TIMES) for sample in samples])
    return float(np.max(np.abs(ours - exact) / np.abs(exact).max(axis=2, keepdims=True)))


def test_equations_hold_over_the_whole_search_range(either_gripper: Gripper, steps: Course) -> None:
    """200 chromosomes against 50 digits; 1e-9 of the peak is asked, 1e-11 is held."""
    assert worst_error(either_gripper, steps, random_samples(200, 1)) < 1e-11


def test_inertia_may_be_left_out_of_the_misfit(gripper: Gripper, steps: Course) -> None:
    """From 0.1 s after a step, what inertia changes is bounded.

    A slow pole p = k/c moves by the share p I/c = p^2 I/k, which changes its
    decay at time t by p t e^(-pt) times that: at most 27 e^-3 I/(k t^2), and the
    arms alone give the smallest k. The ring has decayed to e^(-c t / 2 I).
    """
    t, arm = 0.1, gripper.left
    shift = 27 * math.exp(-3) * arm.inertia_kgm2 / (arm.stiffness_Nm_per_rad * t**2)
    ring = math.exp(-arm.damping_Nms_per_rad * t / (2 * arm.inertia_kgm2))
    network = generalized_maxwell(random_samples(2000, 7))
    full = superpose(step_response(gripper, network), steps, TIMES)
    without = superpose(step_response(gripper, network, inertia=False), steps, TIMES)
    difference = np.abs(full - without).max(axis=1) / np.abs(full).max(axis=1)
    assert difference.max() < shift + ring
    assert shift + ring < 3.2e-6
    assert np.median(difference) < 1e-13


def test_coinciding_roots_are_moved_apart_about_their_mean() -> None:
    """Whatever they are counted from."""
    origin = np.array([[0.0, 4.0, 0.0]])
    beyond = separate(np.array([[-3.0, 1.0, -1.0]], dtype=complex), origin)
    found = (beyond - origin)[0].real
    assert abs(found[0] - found[1]) == pytest.approx(3 * SMALLEST_GAP, rel=1e-6)
    assert found[:2].mean() == pytest.approx(-3.0, rel=1e-12)
    assert found[2] == -1.0


RANDOM = np.random.default_rng(0)
POLES: Array = np.cumsum(RANDOM.lognormal(0, 2, (9, 200)), axis=0)
POLES[0] = 0.0
WEIGHTS, LEVEL = RANDOM.lognormal(0, 2, (9, 200)), RANDOM.lognormal(0, 1, 200)


def test_zeros_are_those_of_a_bracketing_search() -> None:
    found = interlaced_zeros(WEIGHTS[:, :3], POLES[:, :3], LEVEL[:3]).from_pole(np.zeros(3))
    for zeros, weights, poles, level in zip(found.T, WEIGHTS.T, POLES.T, LEVEL, strict=False):
        ends = [*poles, poles[-1] + 2 * np.sum(weights) / level]
        for zero, low, high in zip(zeros, ends, ends[1:], strict=False):
            inside = low * (1 + 1e-12) + 1e-12, high * (1 - 1e-12)
            given = {"args": (weights, poles, level), "xtol": 1e-14}
            alone = brentq(lambda x, w, p, b: np.sum(w / (x - p)) - b, *inside, **given)
            assert zero == pytest.approx(alone, rel=1e-9)


def test_a_place_in_a_sweep_names_modulus_and_frequency() -> None:
    places = [SWEEP.place(omega) for omega in (2.0, -0.5)]
    assert places == ["2 rad/s (storage)", "0.5 rad/s (loss)"]
