"""Networks with springpots against impedances put together by hand."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S
from biogrip.physics.gripper import NO_ARMS
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import hold, torque_history
from biogrip.physics.sample_model import Network, complex_modulus
from biogrip.physics.simulation import simulated_rotation
from tests.helpers.laplace import IMPEDANCES, drawn, inverted

TIMES = np.geomspace(1e-3, 1e3, 13)
# Sinusoids of periods up to the longest experiment, and steps at times between both ends.
OMEGA = np.geomspace(2 * np.pi / LONGEST_S, 1 / SHORTEST_S, 60)
POWER_LAWS = [name for name, model in MODELS.items() if model.power_law]
EVERY_SAMPLE = pytest.mark.parametrize(
    ("model", "seed"), [(model, seed) for model in POWER_LAWS for seed in range(4)]
)


def exponents_of(model: str) -> list[int]:
    kinds = [parameter.kind for parameter in MODELS[model].parameters]
    return [index for index, kind in enumerate(kinds) if kind == "exponent"]


def sample_of(model: str, seed: int) -> Array:
    """Draw a sample around the example, its springpots in order; no exponent near zero or one."""
    rng = np.random.default_rng(seed)
    spread = rng.normal(size=len(MODELS[model].names))
    values = np.array(MODELS[model].example) * np.exp(1.5 * spread)
    values[exponents_of(model)] = rng.uniform(0.05, 0.95, len(exponents_of(model)))
    ordered: Array = np.take_along_axis(values[None], MODELS[model].in_order(values[None]), 1)[0]
    return ordered


def modulus(network: Network) -> Array:
    storage, loss = complex_modulus(network, OMEGA)
    found: Array = storage[0] + 1j * loss[0]
    return found


@EVERY_SAMPLE
def test_a_model_is_the_network_that_its_drawing_shows(model: str, seed: int) -> None:
    """Of elements in series or in parallel, none has an error above a springpot's, 3e-7."""
    sample = sample_of(model, seed)
    network = MODELS[model].network(sample)
    np.testing.assert_allclose(modulus(network), IMPEDANCES[model](1j * OMEGA, *sample), rtol=3e-7)
    assert np.all(network.k > 0)
    assert np.all(network.c > 0)


@pytest.mark.parametrize("deforms", [False, True], ids=["creep", "relaxation"])
@EVERY_SAMPLE
def test_creep_and_relaxation_are_inverse_laplace_transforms(
    model: str, seed: int, deforms: bool
) -> None:
    """After a step, whose impulse dampers take; to 1e-6 of it, or of what a springpot has alone."""
    sample = sample_of(model, seed)
    given, held = drawn(model, sample), torque_history((hold(2e3, 1.0),), deforms=deforms)
    network = MODELS[model].network(sample)
    found = simulated_rotation(NO_ARMS, network, held, TIMES, nonlinear=False)[0]
    expected = np.array(
        [inverted(lambda s: given(s) / s if deforms else 1 / (s * given(s)), t) for t in TIMES]
    )
    scale = expected
    named = dict(zip(MODELS[model].names, sample, strict=True))
    if deforms and "c" in named:
        # Most of the springpot's modulus is taken away by a damper, but for its error.
        alone = drawn("springpot", [named["k_alpha"], named["alpha"]])
        scale = np.maximum(expected, [inverted(lambda s: alone(s) / s, t) for t in TIMES])
    assert np.max(np.abs(found - expected) / scale) < 1e-6


@pytest.mark.parametrize("model", POWER_LAWS)
@pytest.mark.parametrize("end", [1e-9, 1 - 1e-9])
def test_springpots_become_springs_and_dampers(model: str, end: float) -> None:
    """s^alpha - 1 is alpha ln s, s^alpha - s the same with 1 - alpha: 1e-9 times 12 at most."""
    sample = sample_of(model, 0)
    sample[exponents_of(model)[0]] = end
    exact = np.where(sample == end, round(end), sample)
    ours = modulus(MODELS[model].network(sample))
    np.testing.assert_allclose(ours, IMPEDANCES[model](1j * OMEGA, *exact), rtol=3e-7)


def test_two_springpots_are_in_the_order_of_their_exponents() -> None:
    for name in ("springpots_in_series", "springpots_in_parallel"):
        model = MODELS[name]
        given = {"k_alpha": 3.0, "alpha": 0.2, "k_beta": 7.0, "beta": 0.6}
        ordered = model.named_in_order(given)
        assert ordered == {"k_alpha": 7.0, "alpha": 0.6, "k_beta": 3.0, "beta": 0.2}
        ours, theirs = (modulus(model.sample(each)) for each in (given, ordered))
        np.testing.assert_allclose(ours, theirs, rtol=1e-12)


def test_equal_springpots_in_series_are_one_of_half_the_modulus() -> None:
    """The zeros of the sum are no rates then: their branches vanish."""
    network = MODELS["springpots_in_series"].network([6.0, 0.4, 6.0, 0.4])
    one = MODELS["springpot"].network([3.0, 0.4])
    np.testing.assert_allclose(modulus(network), modulus(one), rtol=1e-12)
