"""Limits tie the models to one another and to closed forms."""

from collections.abc import Callable

import numpy as np
import pytest

from biogrip.physics.gripper import Gripper
from biogrip.physics.linear import rotation, sample_polynomials, step_response
from biogrip.physics.maxwell_models import generalized_maxwell
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.sample_model import Network, complex_modulus, with_fixed

TIMES = np.linspace(0.1, 400, 300)


def response_of(gripper: Gripper, steps: TorqueHistory, network: Network) -> np.ndarray:
    return rotation(step_response(gripper, network), steps, TIMES)[0]


def kelvin_voigt(
    gripper: Gripper, steps: TorqueHistory, spring: float, damper: float
) -> np.ndarray:
    """Closed form without inertia: one exponential a step."""
    u = 2 * gripper.lever_m**2
    stiffness = gripper.left.stiffness_Nm_per_rad + u * spring
    rate = stiffness / (gripper.left.damping_Nms_per_rad + u * damper)
    phi = np.zeros_like(TIMES)
    for start, height in zip(steps.time_s, steps.left[:, 0], strict=True):
        elapsed = np.maximum(TIMES - start, 0)
        phi += height / stiffness * -np.expm1(-rate * elapsed)
    return phi


def test_a_stiff_branch_is_a_damper_and_only_the_sum_of_dampers_shows(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    """k to infinity: Kelvin-Voigt with c + c_p, however the sum is split."""
    expected = kelvin_voigt(gripper, steps, 0.02, 10.0)
    for c, c_p in ((9.9, 0.1), (2.0, 8.0), (0.1, 9.9)):
        ours = response_of(gripper, steps, generalized_maxwell([1e7, 0.02, c, c_p]))
        # The branch relaxes within c/k = 1e-6 s, and the arms' inertia lags as little.
        np.testing.assert_allclose(ours, expected, atol=1e-6 * expected.max())


SPRING_OR_DAMPER: dict[str, Callable[..., complex]] = {
    "generalized_maxwell": lambda s, k, k_p, c, c_p: k_p + c_p * s + series(k, c * s),
    "liquid_drop": lambda s, k, k_p, c: k_p + series(k, c * s),
    "damper": lambda s, c_p: c_p * s,
    "kelvin_voigt": lambda s, k_p, c_p: k_p + c_p * s,
    "maxwell": lambda s, k, c: series(k, c * s),
    "zener_maxwell": lambda s, k, k_p, c: k_p + series(k, c * s),
    "zener_kelvin": lambda s, k_s, k_v, c_v: series(k_s, k_v + c_v * s),
    "burgers": lambda s, k_s, c_s, k_v, c_v: series(k_s, c_s * s, k_v + c_v * s),
}


def series(*impedances: complex) -> complex:
    """Elements behind one another: compliances add."""
    return 1 / sum(1 / impedance for impedance in impedances)


def impedance(network: Network, s: complex) -> complex:
    """The library's sample, P/Q, at a complex frequency."""
    p, q = sample_polynomials(network)
    return complex(np.polyval(p[::-1, 0], s) / np.polyval(q[::-1, 0], s))


def test_every_model_without_a_springpot_is_drawn_by_hand() -> None:
    assert set(SPRING_OR_DAMPER) == {name for name, model in MODELS.items() if not model.power_law}


@pytest.mark.parametrize("name", SPRING_OR_DAMPER)
def test_a_model_is_the_network_that_its_drawing_shows(name: str) -> None:
    """Complex moduli over ten decades, from springs and dampers put together by hand."""
    rng = np.random.default_rng(0)
    model = MODELS[name]
    for _ in range(50):
        values = 10 ** rng.uniform(-3, 3, len(model.parameters))
        for s in 1j * np.geomspace(1e-5, 1e5, 21):
            expected = SPRING_OR_DAMPER[name](s, *values)
            assert impedance(model.network(values), s) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("name", SPRING_OR_DAMPER)
def test_storage_and_loss_modulus_are_the_parts_of_the_same_complex_modulus(name: str) -> None:
    rng, omega = np.random.default_rng(1), np.geomspace(1e-5, 1e5, 21)
    model = MODELS[name]
    values = 10 ** rng.uniform(-3, 3, (5, len(model.parameters)))
    storage, loss = complex_modulus(model.network(values), omega)
    expected = [[SPRING_OR_DAMPER[name](1j * w, *own) for w in omega] for own in values]
    np.testing.assert_allclose(storage + 1j * loss, expected, rtol=1e-11)


def test_more_branches_add_up() -> None:
    model = Sample("generalized_maxwell", branches=3).model
    assert model.names == ("k_1", "k_2", "k_3", "k_p", "c_1", "c_2", "c_3", "c_p")
    values = [1.0, 2.0, 3.0, 0.5, 10.0, 0.1, 700.0, 0.02]
    for s in 1j * np.geomspace(1e-4, 1e3, 15):
        branches = sum(series(values[j], values[4 + j] * s) for j in range(3))
        expected = 0.5 + 0.02 * s + branches
        assert impedance(model.network(values), s) == pytest.approx(expected, rel=1e-12)


def test_fixing_a_parameter_leaves_the_others(gripper: Gripper, steps: TorqueHistory) -> None:
    model = MODELS["generalized_maxwell"]
    fixed = with_fixed(model, {"c_p": 1e-3, "k": 35.0})
    assert fixed.names == ("k_p", "c")
    ours = response_of(gripper, steps, fixed.network([[12.3, 299.9]]))
    theirs = response_of(gripper, steps, model.network([35.0, 12.3, 299.9, 1e-3]))
    np.testing.assert_array_equal(ours, theirs)
    assert with_fixed(model, {}) is model
