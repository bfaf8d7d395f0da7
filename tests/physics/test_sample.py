"""Sample models are the networks of their drawings; limits tie them to closed forms."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.models import CANDIDATES, MODELS, as_richer, contained, different_in
from biogrip.physics.protocol import hold, join_phases
from biogrip.physics.response import step_response, superpose
from biogrip.physics.sample_model import with_fixed


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
    return superpose(step_response(gripper, network, inertia=inertia), TORQUE, TIME_S)[0]


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
