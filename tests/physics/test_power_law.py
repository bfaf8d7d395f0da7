"""Power-law samples between the jaws, against numerical inversion."""

import numpy as np
import pytest

from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.linear import LEFT, RIGHT, StepResponse, rotation, step_response
from biogrip.physics.many_branches import modes_of_many
from biogrip.physics.maxwell_models import generalized_maxwell
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import TorqueHistory, hold, torque_history
from biogrip.physics.sample_model import Network
from biogrip.physics.simulation import jaw_force_response
from tests.helpers.laplace import drawn, rotations

TAU = 1.6e-9
# A trace's: soon after each step, and late.
NEAR = np.array([0.1, 0.3, 2.0, 30.0, 199.9, 200.1, 201.0, 260.0, 400.0])
SAMPLES = [
    ("fractional_kelvin_voigt", [0.3, 10.0, 0.4]),
    ("fractional_kelvin_voigt", [1e-3, 0.05, 0.12]),
    ("fractional_kelvin_voigt", [20.0, 300.0, 0.85]),
    ("fractional_maxwell", [10.0, 0.3, 300.0]),
    ("fractional_maxwell", [0.1, 0.6, 0.4]),
]


@pytest.mark.parametrize(("model", "sample"), SAMPLES)
@pytest.mark.parametrize("inertia", [False, True])
def test_equal_arms_against_inversion(
    gripper: Gripper, steps: TorqueHistory, model: str, sample: list[float], inertia: bool
) -> None:
    """Of the response 1e-6, at times of a trace; arms of their own damping and inertia."""
    exact = rotations(gripper, drawn(model, sample), steps, NEAR, inertia=inertia)[0]
    response = step_response(gripper, MODELS[model].network(sample), inertia=inertia)
    np.testing.assert_allclose(rotation(response, steps, NEAR)[0], exact, rtol=1e-6)


def test_the_ring_against_inversion(gripper: Gripper) -> None:
    """The first milliseconds, with inertia: the contour is wide enough for the ring."""
    name, sample = "fractional_kelvin_voigt", [0.3, 0.02, 0.5]
    step, times = torque_history((hold(1.0, TAU),)), np.geomspace(2e-5, 2e-3, 12)
    response = step_response(gripper, MODELS[name].network(sample))
    exact = rotations(gripper, drawn(name, sample), step, times, inertia=True)[0]
    ours = rotation(response, step, times)[0]
    assert np.any(np.abs(response.rates.imag) > 1e3)
    np.testing.assert_allclose(ours, exact, rtol=0, atol=1e-6 * exact.max())


# Rates in no order.
FEW = [2.0, 5.0, 1.0, 0.2, 30.0, 1e3, 0.3, 0.5]


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("inertia", [True, False])
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper", "damped"])
def test_few_branches_are_solved_like_many(
    request: pytest.FixtureRequest, arms: str, symmetric: bool, inertia: bool
) -> None:
    """Three branches, once by polynomials and once between poles; arms in a liquid, too."""
    damped = Gripper(1.5e-3, 75.0, Arm(1e-14, 3e-10, 4.4e-7), Arm(1.3e-14, 2e-10, 5.5e-7))
    given: Gripper = damped if arms == "damped" else request.getfixturevalue(arms)
    network = generalized_maxwell(FEW)
    tau = (1.6e-9,) if symmetric else (1.6e-9, 1.0e-9)
    torque = torque_history((hold(200.0, *tau), hold(200.0, *(0.2 * t for t in tau))))
    times = np.geomspace(1e-5, 400, 60)
    by_polynomials = step_response(given, network, symmetric=symmetric, inertia=inertia)
    between_poles = StepResponse(
        *modes_of_many(given, network, symmetric=symmetric, inertia=inertia)
    )
    for arm in (LEFT, RIGHT):
        theirs = rotation(by_polynomials, torque, times, arm)
        ours = rotation(between_poles, torque, times, arm)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())
    forces = [
        jaw_force_response(given, network, symmetric=symmetric, inertia=inertia),
        StepResponse(
            *modes_of_many(given, network, symmetric=symmetric, inertia=inertia, force=True)
        ),
    ]
    decays = [
        one.static[..., None] + one.weights @ np.exp(one.rates[:, :, None] * times)[:, None]
        for one in forces
    ]
    np.testing.assert_allclose(decays[0], decays[1], rtol=0, atol=1e-12 * np.abs(decays).max())


@pytest.mark.parametrize(("copies", "rtol"), [(2, 1e-9), (6, 1e-5)])
@pytest.mark.parametrize("inertia", [False, True])
def test_equal_branches_add_up(
    gripper: Gripper, steps: TorqueHistory, inertia: bool, copies: int, rtol: float
) -> None:
    """Double roots of polynomials cancel; between poles equal rates are moved apart by 1e-6."""
    k_p, c_p, k, c = np.array([0.2]), np.array([0.5]), np.array([1.0, 2.0]), np.array([5.0, 400.0])
    shares = np.full(copies, 1 / copies)
    many = Network(k_p, c_p, np.kron(shares, k)[None], np.kron(shares, c)[None])
    ours, theirs = (
        rotation(step_response(gripper, network, inertia=inertia), steps, NEAR)[0]
        for network in (many, Network(k_p, c_p, k[None], c[None]))
    )
    np.testing.assert_allclose(ours, theirs, rtol=rtol)
