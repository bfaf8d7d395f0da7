"""Networks with springpots against impedances put together by hand and Mittag-Leffler functions."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import rgamma

from biogrip.arrays import Array
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import hold, torque_history
from biogrip.physics.sample_model import Network
from tests.helpers.power_law import inverted, mittag_leffler

TIMES = np.geomspace(1e-3, 1e3, 13)
# Sinusoids of periods up to the longest experiment, and steps at times between both ends.
OMEGA = np.geomspace(2 * np.pi / LONGEST_S, 1 / SHORTEST_S, 60)


def series(*impedances: Any) -> Any:
    """Elements behind one another: compliances add."""
    return 1 / sum(1 / impedance for impedance in impedances)


IMPEDANCES: dict[str, Callable[..., Any]] = {
    "springpot": lambda s, v, a: v * s**a,
    "fractional_kelvin_voigt": lambda s, k_p, v, a: k_p + v * s**a,
    "springpot_beside_damper": lambda s, v, a, c_p: v * s**a + c_p * s,
    "springpots_in_parallel": lambda s, v, a, g, b: v * s**a + g * s**b,
    "fractional_maxwell": lambda s, v, a, c: series(v * s**a, c * s),
    "fractional_maxwell_gel": lambda s, k, v, a: series(k, v * s**a),
    "springpots_in_series": lambda s, v, a, g, b: series(v * s**a, g * s**b),
    "fractional_zener": lambda s, k, k_p, v, a: k_p + series(k, v * s**a),
    "fractional_solid": lambda s, k_p, v, a, c: k_p + series(v * s**a, c * s),
    "fractional_jeffreys": lambda s, v, a, c, c_p: c_p * s + series(v * s**a, c * s),
}


def power(t: float, exponent: float) -> float:
    """t^p/Gamma(1+p): the compliance of a springpot, and with -p its modulus."""
    return float(t**exponent * rgamma(1 + exponent))


def ml(a: float, b: float, x: float) -> float:
    """E_(a,b)(-x): by its series, or its Laplace transform where terms would be too large."""
    if x ** (1 / a) < 40:
        return mittag_leffler(a, b, x)
    return inverted(lambda s: s ** (a - b) / (s**a + x), 1.0)


def relaxing(t: float, v: float, a: float, g: float, b: float) -> float:
    """Two springpots in series, a > b; with a of one a damper, with b of zero a spring."""
    return g * t**-b * ml(a - b, 1 - b, g / v * t ** (a - b))


MODULI: dict[str, Callable[..., float]] = {
    "springpot": lambda t, v, a: v * power(t, -a),
    "fractional_kelvin_voigt": lambda t, k_p, v, a: k_p + v * power(t, -a),
    "springpot_beside_damper": lambda t, v, a, c_p: v * power(t, -a),
    "springpots_in_parallel": lambda t, v, a, g, b: v * power(t, -a) + g * power(t, -b),
    "fractional_maxwell": lambda t, v, a, c: relaxing(t, c, 1.0, v, a),
    "fractional_maxwell_gel": lambda t, k, v, a: relaxing(t, v, a, k, 0.0),
    "springpots_in_series": relaxing,
    "fractional_zener": lambda t, k, k_p, v, a: k_p + relaxing(t, v, a, k, 0.0),
    "fractional_solid": lambda t, k_p, v, a, c: k_p + relaxing(t, c, 1.0, v, a),
    "fractional_jeffreys": lambda t, v, a, c, c_p: relaxing(t, c, 1.0, v, a),
}
"""Relaxation moduli after a step, whose impulse the dampers take."""


def creeping(t: float, v: float, a: float, g: float, b: float) -> float:
    """Two springpots in parallel, a > b."""
    return t**a / v * ml(a - b, 1 + a, g / v * t ** (a - b))


def zener_creep(t: float, k: float, k_p: float, v: float, a: float) -> float:
    x = t**a / (v * (1 / k + 1 / k_p))
    return 1 / k_p - (1 / k_p - 1 / (k + k_p)) * ml(a, 1.0, x)


def solid_creep(t: float, k_p: float, v: float, a: float, c: float) -> float:
    return inverted(lambda s: 1 / (s * (k_p + series(v * s**a, c * s))), t)


def jeffreys_creep(t: float, v: float, a: float, c: float, c_p: float) -> float:
    x = v * (1 / c + 1 / c_p) * t ** (1 - a)
    return t / (c + c_p) + t * (1 / c_p - 1 / (c + c_p)) * ml(1 - a, 2.0, x)


COMPLIANCES: dict[str, Callable[..., float]] = {
    "springpot": lambda t, v, a: power(t, a) / v,
    "fractional_kelvin_voigt": lambda t, k_p, v, a: creeping(t, v, a, k_p, 0.0),
    "springpot_beside_damper": lambda t, v, a, c_p: creeping(t, c_p, 1.0, v, a),
    "springpots_in_parallel": creeping,
    "fractional_maxwell": lambda t, v, a, c: power(t, a) / v + t / c,
    "fractional_maxwell_gel": lambda t, k, v, a: 1 / k + power(t, a) / v,
    "springpots_in_series": lambda t, v, a, g, b: power(t, a) / v + power(t, b) / g,
    "fractional_zener": zener_creep,
    "fractional_solid": solid_creep,
    "fractional_jeffreys": jeffreys_creep,
}


def drawn(model: str, seed: int) -> Array:
    """Draw a sample around the example, its springpots in order; no exponent near zero or one."""
    rng = np.random.default_rng(seed)
    spread = rng.normal(size=len(MODELS[model].names))
    kinds = [parameter.kind for parameter in MODELS[model].parameters]
    values = np.array(MODELS[model].example) * np.exp(1.5 * spread)
    for index in [i for i, kind in enumerate(kinds) if kind == "exponent"]:
        values[index] = rng.uniform(0.05, 0.95)
    ordered: Array = np.take_along_axis(values[None], MODELS[model].in_order(values[None]), 1)[0]
    return ordered


SAMPLES = [(model, seed) for model in IMPEDANCES for seed in range(4)]


def impedance(network: Network, s: Any) -> Any:
    rates = (network.k / network.c)[0]
    return network.k_p[0] + network.c_p[0] * s + network.k[0] @ (s / (s + rates[:, None]))


def modulus(network: Network) -> Any:
    decays = np.exp(-(network.k / network.c)[0][:, None] * TIMES)
    return network.k_p[0] + network.k[0] @ decays


def scale(model: str, sample: Array) -> Array:
    """Modulus; where a damper takes most of it away, the springpot's, whose error remains."""
    whole = np.array([MODULI[model](t, *sample) for t in TIMES])
    given = dict(zip(MODELS[model].names, sample, strict=True))
    if "c" not in given:
        return whole
    alone = [given["k_alpha"] * power(t, -given["alpha"]) for t in TIMES]
    return np.maximum(whole, alone)


def test_every_model_with_a_springpot_is_drawn_by_hand() -> None:
    names = {name for name, model in MODELS.items() if model.power_law}
    assert set(IMPEDANCES) == set(MODULI) == set(COMPLIANCES) == names


@pytest.mark.parametrize(("model", "seed"), SAMPLES)
def test_a_model_is_the_network_that_its_drawing_shows(model: str, seed: int) -> None:
    """Of elements in series or in parallel, none has an error above a springpot's, 3e-7."""
    sample, s = drawn(model, seed), 1j * OMEGA
    network = MODELS[model].network(sample)
    expected = IMPEDANCES[model](s, *sample)
    assert np.max(np.abs(impedance(network, s) / expected - 1)) < 3e-7
    assert np.all(network.k > 0)
    assert np.all(network.c > 0)


@pytest.mark.parametrize(("model", "seed"), SAMPLES)
def test_relaxation_is_a_mittag_leffler_function(model: str, seed: int) -> None:
    sample = drawn(model, seed)
    expected = np.array([MODULI[model](t, *sample) for t in TIMES])
    away = np.abs(modulus(MODELS[model].network(sample)) - expected)
    assert np.max(away / scale(model, sample)) < 1e-6


@pytest.mark.parametrize(("model", "seed"), SAMPLES)
def test_creep_is_a_mittag_leffler_function(model: str, seed: int) -> None:
    """Between arms of no stiffness, which a constant torque turns as a force shortens."""
    sample = drawn(model, seed)
    arm = Arm(inertia_kgm2=1e-14, damping_Nms_per_rad=1e-25, stiffness_Nm_per_rad=1e-25)
    gripper = Gripper(arm_length_m=1.5e-3, reference_angle_deg=75.0, left=arm, right=arm)
    response = step_response(gripper, MODELS[model].network(sample), inertia=False)
    turned = rotation(response, torque_history((hold(2e3, 1e-9),)), TIMES)[0]
    expected = [COMPLIANCES[model](t, *sample) for t in TIMES]
    np.testing.assert_allclose(turned / 1e-9 * 2 * gripper.lever_m**2, expected, rtol=1e-6)


@pytest.mark.parametrize("model", list(IMPEDANCES))
@pytest.mark.parametrize("end", [1e-9, 1 - 1e-9])
def test_springpots_become_springs_and_dampers(model: str, end: float) -> None:
    """s^alpha - 1 is alpha ln s, s^alpha - s the same with 1 - alpha: 1e-9 times 12 at most."""
    parameters, s = MODELS[model].parameters, 1j * OMEGA
    kinds = np.array([parameter.kind for parameter in parameters])
    sample = drawn(model, 0)
    sample[np.flatnonzero(kinds == "exponent")[0]] = end
    exact = np.where(sample == end, round(end), sample)
    ours = impedance(MODELS[model].network(sample), s)
    assert np.max(np.abs(ours / IMPEDANCES[model](s, *exact) - 1)) < 3e-7


def test_two_springpots_are_in_the_order_of_their_exponents() -> None:
    for name in ("springpots_in_series", "springpots_in_parallel"):
        model = MODELS[name]
        given = {"k_alpha": 3.0, "alpha": 0.2, "k_beta": 7.0, "beta": 0.6}
        ordered = model.named_in_order(given)
        assert ordered == {"k_alpha": 7.0, "alpha": 0.6, "k_beta": 3.0, "beta": 0.2}
        ours, theirs = (impedance(model.sample(each), 1j * OMEGA) for each in (given, ordered))
        np.testing.assert_allclose(ours, theirs, rtol=1e-12)


def test_equal_springpots_in_series_are_one_of_half_the_modulus() -> None:
    """The zeros of the sum are no rates then: their branches vanish."""
    network = MODELS["springpots_in_series"].network([6.0, 0.4, 6.0, 0.4])
    one = MODELS["springpot"].network([3.0, 0.4])
    s = 1j * OMEGA
    np.testing.assert_allclose(impedance(network, s), impedance(one, s), rtol=1e-12)
