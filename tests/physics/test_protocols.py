"""The linear response against 50 digits; protocols, and zeros between poles."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf

from biogrip.arrays import Array
from biogrip.config.trace_blocks import PhaseBlock, ProtocolBlock
from biogrip.library import set_up
from biogrip.physics.gripper import Gripper
from biogrip.physics.gripper import torque as of_voltage
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.models import Sample, generalized_maxwell
from biogrip.physics.modes import phi_functions
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
from biogrip.physics.response import step_response, superpose
from biogrip.physics.roots import SMALLEST_GAP, separate
from biogrip_study.gripper.nonlinear import jaw_force
from biogrip_study.methods.misfit import SeriesMisfit, series_of
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


def test_torque_and_voltage_become_the_torque_they_say() -> None:
    """At a step it is what follows it."""
    t = np.linspace(0, 28.99, 2000)
    t[100:104] = 5.0, 15.0, 19.0, 24.0
    written: list[tuple[float, Array | float]] = [
        (5.0, 4e-10 * t),
        (15.0, of_voltage(TABLE_2, 12.0)),
        (19.0, of_voltage(TABLE_2, 3 + 3 * (t - 15))),
        (24.0, 1e-9 - 1.6e-10 * (t - 19)),
    ]
    expected = np.select([t < end for end, _ in written], [each for _, each in written], 0.5e-9)
    np.testing.assert_allclose(evaluate(TORQUE, t), expected, rtol=0, atol=1e-22)
    assert evaluate(TORQUE, -1.0) == 0


def test_phi_functions_against_50_digits() -> None:
    with mp.workdps(50):
        for order in (1, 2, 3):
            for z in (-1e-12, -1e-3, -0.3, -0.9999, -1.0001, -7.0, -300.0, -1e8):
                first = mp.fsum(mpf(z) ** k / mp.factorial(k) for k in range(order))
                exact = (mp.exp(mpf(z)) - first) / mpf(z) ** order
                ours = float(phi_functions(max(order, 1), np.array([z]))[order][0])
                assert ours == pytest.approx(float(exact), rel=1e-13)


EVENLY, HELD = np.arange(0, 41, 2.0), (hold(40.0, 1e-9),)


def test_no_response_is_needed_of_steps_that_are_sampled_evenly(gripper: Gripper) -> None:
    """By a sample with one branch, whose readings have no offset."""
    for name, phases, time_s, offset, by_series in (
        ("maxwell", HELD, EVENLY, False, True),
        ("maxwell", HELD, np.sqrt(EVENLY), False, False),
        ("maxwell", HELD, EVENLY, True, False),
        ("maxwell", (hold(3.0, 1e-9), hold(37.0, 2e-9)), EVENLY, False, False),
        ("maxwell", (ramp(40.0, 0.0, 4e-9),), EVENLY, False, False),
        ("burgers", HELD, EVENLY, False, False),
    ):
        experiment = replace(set_up(gripper, phases, Sample(name)), offset=offset)
        residuals = experiment.of(time_s, np.zeros_like(time_s)).residuals
        misfit = series_of([residuals]) or residuals.misfit
        assert isinstance(misfit, SeriesMisfit) == by_series
        assert by_series or misfit == residuals.misfit


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


def test_equations_hold_over_the_whole_search_range(either_gripper: Gripper, steps: Course) -> None:
    """200 rotations and jaw forces against 50 digits, as shares of the largest of each sample."""
    samples = random_samples(200, 1)
    network = generalized_maxwell(samples)
    phi = superpose(step_response(either_gripper, network), steps, TIMES)
    force = jaw_force(either_gripper, network, steps, TIMES, nonlinear=False)
    exact = np.array([exact_50_digits(either_gripper, each, steps, TIMES) for each in samples])
    errors = np.abs(np.stack((phi, force), axis=1) - exact)
    assert np.max(errors / np.abs(exact).max(axis=2, keepdims=True)) < 1e-11


def test_inertia_may_be_left_out_of_the_misfit(gripper: Gripper, steps: Course) -> None:
    """From 0.1 s after a step it changes 27 e^-3 I/(k t^2) + e^(-c t / 2 I) of the peak at most."""
    network = generalized_maxwell(random_samples(2000, 7))
    full, without = (
        superpose(step_response(gripper, network, inertia=inertia), steps, TIMES)
        for inertia in (True, False)
    )
    difference = np.abs(full - without).max(axis=1) / np.abs(full).max(axis=1)
    most = 27 * math.exp(-3) * 1e-14 / (4.4e-7 * 0.1**2) + math.exp(-3.3e-12 * 0.1 / 2e-14)
    assert difference.max() < most < 3.2e-6
    assert np.median(difference) < 1e-13


def test_coinciding_roots_are_moved_apart_about_their_mean() -> None:
    found = separate(np.array([[-3.0, -3.0, -1.0]], dtype=complex))[0].real
    assert abs(found[0] - found[1]) == pytest.approx(3 * SMALLEST_GAP, rel=1e-6)
    assert found[:2].mean() == pytest.approx(-3.0, rel=1e-12)
    assert found[2] == -1.0
    near = separate(np.array([[-3.0, -3.0 - 1e-6, -1.0]], dtype=complex))
    assert (near[0, 1] - near[0, 0]).real == pytest.approx(3 * SMALLEST_GAP, rel=1e-6)
    two_pairs = np.array([[-3.0, -1.0, -3.0, -1.0]], dtype=complex)
    apart = np.sort(separate(two_pairs)[0].real)
    assert np.diff(apart)[[0, 2]] == pytest.approx([3 * SMALLEST_GAP, SMALLEST_GAP], rel=1e-6)


def test_the_torque_of_a_ramp_of_voltage_is_its_square() -> None:
    """0.5 (3 + 2 t)^2 at 0, 1 and 4 s, and a quarter of it."""
    torque = Phase(5.0, 3.0, 2.0).squared(0.5)
    assert torque.at([0.0, 1.0, 4.0]).tolist() == [4.5, 12.5, 60.5]
    assert torque.divided(4.0).at(4.0) == 60.5 / 4


def test_a_place_in_a_sweep_names_modulus_and_frequency() -> None:
    places = [SWEEP.place(omega) for omega in (2.0, -0.5)]
    assert places == ["2 rad/s (storage)", "0.5 rad/s (loss)"]
