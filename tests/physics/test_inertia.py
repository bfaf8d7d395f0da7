"""The ringing of arms and what of it shows in a trace; power laws between the jaws."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip import library
from biogrip.arrays import Array
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.doubts import DOUBT, Note
from biogrip.levels import VISIBLE
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.models import MODELS, generalized_maxwell
from biogrip.physics.protocol import Course, hold, join_phases
from biogrip.physics.response import (
    LEFT,
    RIGHT,
    elapsed_s,
    ring,
    ringing_s,
    step_response,
    superpose,
)
from biogrip.physics.sample_model import Network
from tests.helpers.laplace import drawn, rotations, series
from tests.helpers.problems import GRIPPER, MODEL, TORQUE
from tests.physics.test_residuals import posed

STEP, NONE = join_phases((hold(1.0, 1e-9),)), np.zeros((1, 0))
RINGING = {"k": 35.0, "k_p": 12.3, "c": 299.9, "c_p": 1e-6}


def test_an_empty_gripper_rings_like_a_damped_oscillator() -> None:
    """In closed form: as far from rest as it is pushed."""
    inertia, damping, stiffness = 1e-14, 3.3e-12, 4.4e-7
    arm = Arm(inertia, damping, stiffness)
    decay = damping / (2 * inertia)
    omega = np.sqrt(stiffness / inertia - decay**2)
    time_s: Array = 1e-4 * np.arange(1.0, 1000.0)
    envelope = np.exp(-decay * time_s)
    swing = envelope * (np.cos(omega * time_s) + decay / omega * np.sin(omega * time_s))
    nothing = Network(np.zeros(1), np.zeros(1), NONE, NONE)
    found = ring(Gripper(1.5e-3, 75.0, arm, arm), nothing, STEP, time_s)[0]
    expected = 1e-9 / stiffness * (np.exp(-stiffness / damping * time_s) - swing)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * 1e-9 / stiffness)


@pytest.mark.parametrize("stiffness", [0.0, 1e-2, 1.0, 1e2, 1e4])
def test_rings_are_over_when_they_are_said_to_be(either_gripper: Gripper, stiffness: float) -> None:
    """Even those of a bare spring, from which only the arms' own dampers take energy."""
    spring = Network(np.array([stiffness]), np.zeros(1), NONE, NONE)
    after_s = ringing_s(either_gripper) * np.linspace(1.0, 1.5, 500)
    turned = superpose(step_response(either_gripper, spring), STEP, after_s)
    assert np.max(np.abs(ring(either_gripper, spring, STEP, after_s))) < 1e-14 * turned.max()


@pytest.mark.parametrize("beyond", [0.0, 1e-12, 1e-10, 1e-8, 1e-6])
@pytest.mark.parametrize("model", ["kelvin_voigt", "generalized_maxwell"])
def test_arms_that_are_critically_damped(model: str, beyond: float) -> None:
    """Two roots coincide, or nearly; the branch that makes a third is far away."""
    inertia, hinge, k_p, damper = 1e-14, 4.4e-7, 0.3, 1e-6
    sample = [k_p, damper] if model == "kelvin_voigt" else [1e-12, k_p, 10.0, damper]
    lever = 1.5e-3 * np.sin(np.radians(75.0))
    both = 2 * np.sqrt(inertia * (hinge + 2 * lever**2 * k_p)) * (1 + beyond)
    arm = Arm(inertia, both - 2 * lever**2 * damper, hinge)
    damped = Gripper(1.5e-3, 75.0, arm, arm)
    times = np.geomspace(1e-5, 0.5, 20)
    found = superpose(step_response(damped, MODELS[model].network(sample)), STEP, times)[0]
    exact = rotations(damped, drawn(model, sample), STEP, times, inertia=True)[0]
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-7 * exact.max())


def test_times_count_from_the_last_change_of_the_torque() -> None:
    torque, times = join_phases((hold(2.0, 1e-9), hold(2.0, 1e-10))), np.array([0.5, 2.0, 3.5])
    np.testing.assert_allclose(elapsed_s(torque, times), [0.5, 0.0, 1.5])


def test_a_ring_shows_by_its_norm_beside_the_noise(gripper: Gripper) -> None:
    """All readings after the one that is named change by less than what counts."""
    time_s = np.random.default_rng(1).permutation(1e-4 * np.arange(1.0, 600.0))
    network = MODEL.sample(RINGING)
    # A parallel damper that is seen only while it rings does not end the ring.
    free = replace(network, c_p=np.zeros(1))
    change = np.where(time_s < ringing_s(gripper), ring(gripper, free, STEP, time_s)[0], 0.0)
    noise_sd = 0.1 * np.abs(change).max()
    residuals = posed(gripper, MODEL, Condensed(STEP, time_s, np.zeros((0, len(time_s)))), change)
    found = residuals.ring(network, noise_sd)
    assert found is not None
    assert found.largest == pytest.approx(10.0)
    lasts = found.lasts_s, found.lasts_s - 1e-9
    after, before = (np.linalg.norm(change[time_s > last]) / noise_sd for last in lasts)
    assert after <= VISIBLE < before
    assert residuals.ring(network, float(np.linalg.norm(change)) / (0.99 * VISIBLE)) is None


def notes_of(model: str, time_s: Array, truth: dict[str, float]) -> list[Note]:
    """Notes on the ringing of arms in a simulated trace, with the default study's gripper."""
    protocol = (library.hold(200.0, 1.6e-9), library.hold(200.0, 0.32e-9))
    experiment = library.set_up(GRIPPER, protocol, library.Sample(model))
    clean = library.simulate(experiment, truth, time_s)
    trace = clean + 0.02 * clean.max() * np.random.default_rng(4).standard_normal(len(time_s))
    found = library.identify_sample(experiment, time_s, trace)
    problem = experiment.of(time_s, trace)
    notes = diagnose(problem, found, confidence=0.95).notes
    return [note for note in notes if note.text.startswith("The arms ring")]


def test_who_samples_fast_is_told_to_leave_out_the_first_milliseconds() -> None:
    """Without these readings nothing is said any more; a spring in front of dampers rings on."""
    time_s = np.unique([start + 0.017 * np.arange(2000) for start in (0.0, 200.0)])
    solid = {"k_s": 12.0, "k_v": 20.0, "c_v": 100.0}
    (note,) = notes_of("zener_kelvin", time_s, solid)
    assert note.weight == DOUBT
    (milliseconds,) = re.findall(r"the first (\d+) ms after each change", note.text)
    assert 17 <= float(milliseconds) < 1e3 * ringing_s(GRIPPER)
    kept = time_s[elapsed_s(TORQUE, time_s) > 1e-3 * float(milliseconds)]
    assert notes_of("zener_kelvin", kept, solid) == []


def test_a_damper_ends_a_ring_if_it_is_seen_afterwards() -> None:
    time_s = np.unique([start + 0.017 * np.arange(1000) for start in (0.0, 200.0)])
    assert notes_of("kelvin_voigt", time_s, {"k_p": 12.3, "c_p": 30.0}) == []


# A trace's: soon after each step, and late; and the first milliseconds, with inertia.
NEAR = np.array([0.1, 0.3, 2.0, 30.0, 199.9, 200.1, 201.0, 260.0, 400.0])
AT_ONCE = np.geomspace(2e-5, 2e-3, 12)
SAMPLES = [
    ("fractional_kelvin_voigt", [0.3, 10.0, 0.4]),
    ("fractional_kelvin_voigt", [1e-3, 0.05, 0.12]),
    ("fractional_kelvin_voigt", [20.0, 300.0, 0.85]),
    ("fractional_maxwell", [10.0, 0.3, 300.0]),
    ("fractional_maxwell", [0.1, 0.6, 0.4]),
]


@pytest.mark.parametrize(
    ("model", "sample", "times", "inertia"),
    [
        *((*sample, NEAR, inertia) for sample in SAMPLES for inertia in (False, True)),
        # The contour is wide enough for the ring.
        ("fractional_kelvin_voigt", [0.3, 0.02, 0.5], AT_ONCE, True),
    ],
)
def test_power_laws_against_inversion(
    gripper: Gripper, steps: Course, model: str, sample: list[float], times: Array, inertia: bool
) -> None:
    """Of the response 1e-6; arms of their own damping and inertia."""
    exact = rotations(gripper, drawn(model, sample), steps, times, inertia=inertia)[0]
    response = step_response(gripper, MODELS[model].network(sample), inertia=inertia)
    atol = 1e-6 * exact.max() if times is AT_ONCE else 0.0
    np.testing.assert_allclose(superpose(response, steps, times)[0], exact, rtol=1e-6, atol=atol)
    assert times is NEAR or np.any(np.abs(response.rates.imag) > 1e3)


@pytest.mark.parametrize("inertia", [True, False])
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper", "damped"])
def test_three_branches_against_inversion(
    request: pytest.FixtureRequest, steps: Course, arms: str, inertia: bool
) -> None:
    """Of rates in no order; arms in a liquid, too. The contour misses the end of a ring."""
    damped = Gripper(1.5e-3, 75.0, Arm(1e-14, 3e-10, 4.4e-7), Arm(1.3e-14, 2e-10, 5.5e-7))
    given: Gripper = damped if arms == "damped" else request.getfixturevalue(arms)
    k, k_p, c, c_p = [2.0, 5.0, 1.0], 0.2, [30.0, 1e3, 0.3], 0.5
    network = generalized_maxwell([*k, k_p, *c, c_p])

    def impedance(s: Any) -> Any:
        return k_p + c_p * s + sum(series(k_j, c_j * s) for k_j, c_j in zip(k, c, strict=True))

    exact = rotations(given, impedance, steps, NEAR, inertia=inertia)
    response = step_response(given, network, inertia=inertia)
    for arm in (LEFT, RIGHT):
        ours = superpose(response, steps, NEAR, arm)[0]
        np.testing.assert_allclose(ours, exact[arm], rtol=0, atol=1e-10 * exact[arm].max())


@pytest.mark.parametrize(("copies", "rtol"), [(2, 1e-10), (6, 1e-9)])
@pytest.mark.parametrize("inertia", [False, True])
def test_equal_branches_add_up(
    gripper: Gripper, steps: Course, inertia: bool, copies: int, rtol: float
) -> None:
    """Equal rates are moved apart by 1e-10."""
    k_p, c_p, k, c = np.array([0.2]), np.array([0.5]), np.array([1.0, 2.0]), np.array([5.0, 400.0])
    shares = np.full(copies, 1 / copies)
    many = Network(k_p, c_p, np.kron(shares, k)[None], np.kron(shares, c)[None])
    ours, theirs = (
        superpose(step_response(gripper, network, inertia=inertia), steps, NEAR)[0]
        for network in (many, Network(k_p, c_p, k[None], c[None]))
    )
    np.testing.assert_allclose(ours, theirs, rtol=rtol)
