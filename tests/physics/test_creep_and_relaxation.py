"""Creep and relaxation without a gripper; networks with springpots against impedances by hand."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S, on_clock
from biogrip.physics.gripper import NO_ARMS, Gripper
from biogrip.physics.models import CANDIDATES, MODELS, as_richer, contained, different_in
from biogrip.physics.protocol import Course, Phase, hold, join_phases, ramp
from biogrip.physics.response import simulated_response, step_response, superpose
from biogrip.physics.sample_model import Network, SampleModel, complex_modulus, with_fixed
from tests.helpers.laplace import IMPEDANCES, Impedance, drawn, inverted

DRIVEN = pytest.mark.parametrize("deforms", [False, True], ids=["creep", "relaxation"])


# A ramp of finite rate, a hold, a parabola, a ramp down that ends with a jump, recovery.
PHASES = (
    ramp(0.5, 0.0, 2.0),
    hold(2.0, 2.0),
    Phase(1.0, 2.0, 0.5, -0.8),
    ramp(2.0, 1.0, 0.7),
    hold(2.0, 0.0),
)


def simulated(network: Network, history: Course, time_s: Array) -> Array:
    return simulated_response(NO_ARMS, network, history, time_s)[0]


def example(model: SampleModel) -> Network:
    return model.network([model.example])


def by_laplace(given: Impedance, history: Course, time_s: float) -> float:
    """Response by numerical inversion: of each change of what is held, by itself."""

    def response(height: float, order: int) -> Impedance:
        return lambda s: height / s ** (order + 1) * (given(s) if history.deforms else 1 / given(s))

    return sum(
        inverted(response(height, order), time_s - start)
        for start, order, height in history.jumps
        if start < time_s
    )


@DRIVEN
@pytest.mark.parametrize("name", ["kelvin_voigt", "generalized_maxwell", "burgers", "zener_kelvin"])
def test_responses_to_ramps_are_inverse_laplace_transforms(name: str, deforms: bool) -> None:
    model, history = MODELS[name], join_phases(PHASES, deforms=deforms)
    times = np.array([0.2, 0.5001, 2.9, 3.5001, 4.4, 6.8])
    found = simulated(example(model), history, times)
    given = drawn(name, model.example)
    expected = [by_laplace(given, history, float(time)) for time in times]
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-11 * np.max(np.abs(expected)))


def test_a_reading_at_the_instant_of_a_step_is_taken_before_it() -> None:
    network = example(MODELS["zener_maxwell"])
    history = join_phases((hold(1.0, 1.0), hold(1.0, 3.0)), deforms=True)
    found = simulated(network, history, np.array([0.0, 1.0, np.nextafter(1.0, 2.0)]))
    assert found[0] == 0
    at_once = network.k_p[0] + network.k[0, 0]
    assert found[2] - found[1] == pytest.approx(2 * at_once)


# Sinusoids of periods up to the longest experiment, and steps at times between both ends.
OMEGA = np.geomspace(2 * np.pi / LONGEST_S, 1 / SHORTEST_S, 60)
POWER_LAWS = [name for name, model in MODELS.items() if model.power_law]


def exponents_of(model: str) -> list[int]:
    kinds = [parameter.kind for parameter in MODELS[model].parameters]
    return [index for index, kind in enumerate(kinds) if kind == "exponent"]


def sample_of(model: str, seed: int) -> Array:
    """Draw a sample around the example, its springpots in order; no exponent near zero or one."""
    rng = np.random.default_rng(seed)
    spread = rng.normal(size=len(MODELS[model].names))
    values = np.array(MODELS[model].example) * np.exp(1.5 * spread)
    values[exponents_of(model)] = rng.uniform(0.05, 0.95, len(exponents_of(model)))
    return np.take_along_axis(values[None], MODELS[model].in_order(values[None]), 1)[0]


def modulus(network: Network, omega: Array = OMEGA) -> Array:
    storage, loss = complex_modulus(network, omega)
    return storage[0] + 1j * loss[0]


ENDS = [(model, 0, end) for model in POWER_LAWS for end in (1e-9, 1 - 1e-9)]


@pytest.mark.parametrize(
    ("model", "seed", "end"), [*((model, n, None) for model in MODELS for n in range(5)), *ENDS]
)
def test_a_model_is_the_network_that_its_drawing_shows(
    model: str, seed: int, end: float | None
) -> None:
    """A springpot has an error of 3e-7; at an end of its exponent it is a spring or a damper.

    Elements in series or in parallel have none above that.
    """
    sample = sample_of(model, seed)
    exact = sample.copy()
    if end is not None:
        sample[exponents_of(model)[0]], exact[exponents_of(model)[0]] = end, round(end)
    network = MODELS[model].network(sample)
    rtol = 3e-7 if MODELS[model].power_law else 1e-11
    np.testing.assert_allclose(modulus(network), IMPEDANCES[model](1j * OMEGA, *exact), rtol=rtol)
    assert end or np.all(network.k > 0)
    assert end or np.all(network.c > 0)


@pytest.mark.parametrize("model", POWER_LAWS)
@pytest.mark.parametrize("unit_s", [1e4, 1e-5])
def test_a_power_law_holds_on_a_clock_of_another_unit(model: str, unit_s: float) -> None:
    sample, omega = sample_of(model, 1), OMEGA / unit_s
    found = modulus(on_clock(MODELS[model], unit_s).network(sample), omega)
    np.testing.assert_allclose(found, IMPEDANCES[model](1j * omega, *sample), rtol=1e-6)


@pytest.mark.parametrize("name", ["springpots_in_series", "springpots_in_parallel"])
def test_two_springpots_are_in_the_order_of_their_exponents(name: str) -> None:
    """Equal ones in series are one of half the modulus: zeros of the sum are no rates then."""
    model = MODELS[name]
    given = {"k_alpha": 3.0, "alpha": 0.2, "k_beta": 7.0, "beta": 0.6}
    ordered = model.named_in_order(given)
    assert ordered == {"k_alpha": 7.0, "alpha": 0.6, "k_beta": 3.0, "beta": 0.2}
    ours, theirs = (modulus(model.sample(each)) for each in (given, ordered))
    np.testing.assert_allclose(ours, theirs, rtol=1e-12)
    equal, one = model.network([6.0, 0.4, 6.0, 0.4]), 3.0 if name.endswith("series") else 12.0
    springpot = MODELS["springpot"].network([one, 0.4])
    np.testing.assert_allclose(modulus(equal), modulus(springpot), rtol=1e-12)


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


def response(gripper: Gripper, candidate: str, parameters: Array, inertia: bool) -> Array:
    network = CANDIDATES[candidate].model.network(parameters)
    return superpose(step_response(gripper, network, inertia=inertia), TORQUE, TIME_S)[0]


@pytest.mark.parametrize("inertia", [False, True], ids=["without inertia", "with inertia"])
@pytest.mark.parametrize(("richer", "simpler"), PAIRS)
def test_a_richer_model_becomes_the_simpler_one(
    gripper: Gripper, richer: str, simpler: str, inertia: bool
) -> None:
    """To rounding, of as many as eight branches."""
    rng, kinds = np.random.default_rng(0), [p.kind for p in CANDIDATES[simpler].model.parameters]
    for _ in range(3):
        parameters = np.array([10 ** rng.uniform(*DECADES[kind]) for kind in kinds])
        expected = response(gripper, simpler, parameters, inertia)
        found = response(gripper, richer, as_richer(richer, simpler, parameters), inertia)
        assert np.max(np.abs(found - expected)) < 2e-11 * np.abs(expected).max()


def test_of_equal_models_one_leads_on() -> None:
    others = ["liquid_drop", "damper", "kelvin_voigt", "maxwell", "zener_maxwell", "zener_kelvin"]
    assert set(others) <= set(contained("burgers"))
    found = different_in("burgers", others)
    assert found == ["maxwell", "zener_kelvin", "damper", "kelvin_voigt"]
