"""Sample models are the networks of their drawings; limits tie them to closed forms."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.models import (
    CANDIDATES,
    MODELS,
    Sample,
    as_richer,
    contained,
    different_in,
    generalized_maxwell,
)
from biogrip.physics.protocol import Course, hold, join_phases
from biogrip.physics.response import step_response, superpose
from biogrip.physics.sample_model import complex_modulus, with_fixed
from tests.helpers.laplace import series

TIMES = np.linspace(0.1, 400, 300)


def test_a_stiff_branch_is_a_damper_and_only_the_sum_of_dampers_shows(
    gripper: Gripper, steps: Course
) -> None:
    """k to infinity: Kelvin-Voigt with c + c_p, one exponential a step, however it is split."""
    u, spring, damper = 2 * gripper.lever_m**2, 0.02, 10.0
    stiffness = gripper.left.stiffness_Nm_per_rad + u * spring
    rate = stiffness / (gripper.left.damping_Nms_per_rad + u * damper)
    expected = np.zeros_like(TIMES)
    for start, height in zip(steps.time_s, steps.changes[:, 0], strict=True):
        expected -= height / stiffness * np.expm1(-rate * np.maximum(TIMES - start, 0))
    for c, c_p in ((9.9, 0.1), (2.0, 8.0), (0.1, 9.9)):
        response = step_response(gripper, generalized_maxwell([1e7, spring, c, c_p]))
        # The branch relaxes within c/k = 1e-6 s, and the arms' inertia lags as little.
        ours = superpose(response, steps, TIMES)[0]
        np.testing.assert_allclose(ours, expected, atol=1e-6 * expected.max())


def test_more_branches_add_up() -> None:
    model, omega = Sample("generalized_maxwell", branches=3).model, np.geomspace(1e-4, 1e3, 15)
    s = 1j * omega
    given = {"k_1": 1.0, "k_2": 2.0, "k_3": 3.0, "k_p": 0.5}
    given |= {"c_1": 10.0, "c_2": 0.1, "c_3": 700.0, "c_p": 0.02}
    assert model.names == tuple(given)
    storage, loss = complex_modulus(model.sample(given), omega)
    branches = sum(series(given[f"k_{j}"], given[f"c_{j}"] * s) for j in (1, 2, 3))
    np.testing.assert_allclose(storage[0] + 1j * loss[0], 0.5 + 0.02 * s + branches, rtol=1e-12)


def test_fixing_a_parameter_leaves_the_others() -> None:
    model = MODELS["generalized_maxwell"]
    fixed = with_fixed(model, {"c_p": 1e-3, "k": 35.0})
    assert fixed.names == ("k_p", "c")
    ours, theirs = fixed.network([[12.3, 299.9]]), model.network([35.0, 12.3, 299.9, 1e-3])
    for one, other in zip(vars(ours).values(), vars(theirs).values(), strict=True):
        np.testing.assert_array_equal(one, other)
    assert with_fixed(model, {}) is model


TORQUE = join_phases((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)))
TIME_S = np.linspace(0.0, 400.0, 101)
DECADES = {"stiffness": (0, 2), "damping": (0, 3), "springpot": (0, 2), "exponent": (-0.6, -0.2)}
TRIED = [name for name in CANDIDATES if name[-1] not in "5678"]
PAIRS = [(richer, simpler) for richer in TRIED for simpler in contained(richer)]


def drawn(candidate: str, rng: np.random.Generator) -> Array:
    kinds = [parameter.kind for parameter in CANDIDATES[candidate].model.parameters]
    return np.array([10 ** rng.uniform(*DECADES[kind]) for kind in kinds])


def response(gripper: Gripper, candidate: str, parameters: Array, inertia: bool) -> Array:
    network = CANDIDATES[candidate].model.network(parameters)
    found: Array = superpose(step_response(gripper, network, inertia=inertia), TORQUE, TIME_S)[0]
    return found


@pytest.mark.parametrize("inertia", [False, True], ids=["without inertia", "with inertia"])
@pytest.mark.parametrize(("richer", "simpler"), PAIRS)
def test_a_richer_model_becomes_the_simpler_one(
    gripper: Gripper, richer: str, simpler: str, inertia: bool
) -> None:
    """To rounding, of as many as eight branches."""
    rng = np.random.default_rng(0)
    for _ in range(3):
        parameters = drawn(simpler, rng)
        expected = response(gripper, simpler, parameters, inertia)
        found = response(gripper, richer, as_richer(richer, simpler, parameters), inertia)
        assert np.max(np.abs(found - expected)) < 2e-11 * np.abs(expected).max()


def test_of_equal_models_one_leads_on() -> None:
    others = ["liquid_drop", "damper", "kelvin_voigt", "maxwell", "zener_maxwell", "zener_kelvin"]
    assert set(others) <= set(contained("burgers"))
    found = different_in("burgers", others)
    assert found == ["maxwell", "zener_kelvin", "damper", "kelvin_voigt"]
