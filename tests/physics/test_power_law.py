"""Power-law samples between the jaws, against numerical inversion."""

from typing import Any

import numpy as np
import pytest

from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.models import MODELS, generalized_maxwell
from biogrip.physics.protocol import Course, hold, join_phases
from biogrip.physics.response import LEFT, RIGHT, step_response, superpose
from biogrip.physics.sample_model import Network
from tests.helpers.laplace import drawn, rotations, series

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
    gripper: Gripper, steps: Course, model: str, sample: list[float], inertia: bool
) -> None:
    """Of the response 1e-6, at times of a trace; arms of their own damping and inertia."""
    exact = rotations(gripper, drawn(model, sample), steps, NEAR, inertia=inertia)[0]
    response = step_response(gripper, MODELS[model].network(sample), inertia=inertia)
    np.testing.assert_allclose(superpose(response, steps, NEAR)[0], exact, rtol=1e-6)


def test_the_ring_against_inversion(gripper: Gripper) -> None:
    """The first milliseconds, with inertia: the contour is wide enough for the ring."""
    name, sample = "fractional_kelvin_voigt", [0.3, 0.02, 0.5]
    step, times = join_phases((hold(1.0, TAU),)), np.geomspace(2e-5, 2e-3, 12)
    response = step_response(gripper, MODELS[name].network(sample))
    exact = rotations(gripper, drawn(name, sample), step, times, inertia=True)[0]
    ours = superpose(response, step, times)[0]
    assert np.any(np.abs(response.rates.imag) > 1e3)
    np.testing.assert_allclose(ours, exact, rtol=0, atol=1e-6 * exact.max())


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
        return (
            k_p + c_p * s + sum(series(*of) for of in zip(k, (s * one for one in c), strict=True))
        )

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
