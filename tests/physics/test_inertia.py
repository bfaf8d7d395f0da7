"""The ringing of arms, which targets have and fits leave out, and what of it shows in a trace."""

import re
from dataclasses import replace

import numpy as np
import pytest

from biogrip import library
from biogrip.arrays import Array
from biogrip.judging.doubts import DOUBT, Note
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import hold, join_phases
from biogrip.physics.response import step_response, superpose
from biogrip.physics.sample_model import Network
from biogrip.physics.simulation import VISIBLE, elapsed_s, find_ring, ring, ringing_s
from tests.helpers.laplace import drawn, rotations
from tests.helpers.problems import GRIPPER, MODEL, TORQUE

# Dampers between the jaws end a ring before it is seen; a spring in front of them goes on.
RINGING = {
    "generalized_maxwell": {"k": 35.0, "k_p": 12.3, "c": 299.9, "c_p": 1e-6},
    "zener_kelvin": {"k_s": 12.0, "k_v": 20.0, "c_v": 100.0},
}


def test_an_empty_gripper_rings_like_a_damped_oscillator() -> None:
    """In closed form: as far from rest as it is pushed."""
    inertia, damping, stiffness = 1e-14, 3.3e-12, 4.4e-7
    arm = Arm(inertia, damping, stiffness)
    decay = damping / (2 * inertia)
    omega = np.sqrt(stiffness / inertia - decay**2)
    time_s: Array = 1e-4 * np.arange(1.0, 1000.0)
    envelope = np.exp(-decay * time_s)
    swing = envelope * (np.cos(omega * time_s) + decay / omega * np.sin(omega * time_s))
    nothing = Network(np.zeros(1), np.zeros(1), np.zeros((1, 0)), np.zeros((1, 0)))
    torque = join_phases((hold(1.0, 1e-9),))
    found = ring(Gripper(1.5e-3, 75.0, arm, arm), nothing, torque, time_s)[0]
    expected = 1e-9 / stiffness * (np.exp(-stiffness / damping * time_s) - swing)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * 1e-9 / stiffness)


@pytest.mark.parametrize("stiffness", [0.0, 1e-2, 1.0, 1e2, 1e4])
def test_rings_are_over_when_they_are_said_to_be(either_gripper: Gripper, stiffness: float) -> None:
    """Even those of a bare spring, from which only the arms' own dampers take energy."""
    none = np.zeros((1, 0))
    spring = Network(np.array([stiffness]), np.zeros(1), none, none)
    step = join_phases((hold(1.0, 1e-9),))
    after_s = ringing_s(either_gripper) * np.linspace(1.0, 1.5, 500)
    with_it, without = (
        superpose(step_response(either_gripper, spring, inertia=inertia), step, after_s)
        for inertia in (True, False)
    )
    assert np.max(np.abs(with_it - without)) < 1e-14 * np.max(np.abs(without))


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
    torque, times = join_phases((hold(1.0, 1e-9),)), np.geomspace(1e-5, 0.5, 20)
    found = superpose(step_response(damped, MODELS[model].network(sample)), torque, times)[0]
    exact = rotations(damped, drawn(model, sample), torque, times, inertia=True)[0]
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-7 * exact.max())


def test_times_count_from_the_last_change_of_the_torque() -> None:
    torque, times = join_phases((hold(2.0, 1e-9), hold(2.0, 1e-10))), np.array([0.5, 2.0, 3.5])
    np.testing.assert_allclose(elapsed_s(torque, times), [0.5, 0.0, 1.5])


def test_a_ring_shows_by_its_norm_beside_the_noise(gripper: Gripper) -> None:
    """All readings after the one that is named change by less than what counts."""
    time_s = np.random.default_rng(1).permutation(1e-4 * np.arange(1.0, 600.0))
    network = MODEL.sample(RINGING["generalized_maxwell"])
    torque = join_phases((hold(1.0, 1e-9),))
    given = gripper, network, torque, time_s
    # A parallel damper that is seen only while it rings does not end the ring.
    free = replace(network, c_p=np.zeros(1))
    change = np.where(time_s < ringing_s(gripper), ring(gripper, free, torque, time_s)[0], 0.0)
    noise_sd = 0.1 * np.abs(change).max()
    found = find_ring(*given, lambda rows: rows / noise_sd)
    assert found is not None
    assert found.largest == pytest.approx(10.0)
    norms = [
        np.linalg.norm(change[time_s > last]) / noise_sd
        for last in (found.lasts_s, found.lasts_s - 1e-9)
    ]
    assert norms[0] <= VISIBLE < norms[1]
    least = 0.99 * VISIBLE / np.linalg.norm(change)
    assert find_ring(*given, lambda rows: least * rows) is None


def notes_of(model: str, time_s: Array, level: float, truth: dict[str, float]) -> list[Note]:
    """Notes on the ringing of arms in a simulated trace, with the default study's gripper."""
    protocol = (library.hold(200.0, 1.6e-9), library.hold(200.0, 0.32e-9))
    experiment = library.set_up(GRIPPER, protocol, library.Sample(model))
    clean = library.simulate(experiment, truth, time_s)
    trace = clean + level * clean.max() * np.random.default_rng(4).standard_normal(len(time_s))
    found = library.identify_sample(experiment, time_s, trace)
    notes = library.judge(experiment, time_s, trace, found).notes
    return [note for note in notes if note.text.startswith("The arms ring")]


@pytest.mark.parametrize(
    "model", ["zener_kelvin", pytest.param("generalized_maxwell", marks=pytest.mark.nightly)]
)
def test_who_samples_fast_is_told_to_leave_out_the_first_milliseconds(model: str) -> None:
    """Without these readings nothing is said any more."""
    time_s = np.unique([start + 0.017 * np.arange(2000) for start in (0.0, 200.0)])
    (note,) = notes_of(model, time_s, 0.02, RINGING[model])
    assert note.weight == DOUBT
    (milliseconds,) = re.findall(r"the first (\d+) ms after each change", note.text)
    assert 17 <= float(milliseconds) < 1e3 * ringing_s(GRIPPER)
    kept = time_s[elapsed_s(TORQUE, time_s) > 1e-3 * float(milliseconds)]
    assert notes_of(model, kept, 0.02, RINGING[model]) == []


@pytest.mark.parametrize(
    ("model", "truth", "interval_s", "level", "told"),
    [
        # Without inertia a damper between the jaws is the nearest that a fit has to a ring.
        pytest.param(
            *("zener_kelvin", RINGING["zener_kelvin"], 0.002, 0.003, 1), marks=pytest.mark.nightly
        ),
        # A damper that is seen when the ring is over ends it.
        ("kelvin_voigt", {"k_p": 12.3, "c_p": 30.0}, 0.017, 0.02, 0),
    ],
)
def test_a_damper_ends_a_ring_if_it_is_seen_afterwards(
    model: str, truth: dict[str, float], interval_s: float, level: float, told: int
) -> None:
    time_s = np.unique([start + interval_s * np.arange(1000) for start in (0.0, 200.0)])
    assert len(notes_of(model, time_s, level, truth)) == told
