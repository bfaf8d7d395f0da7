"""Power-law samples as Maxwell branches, against s^alpha and against what they tend to."""

import numpy as np
import pytest
from numpy.typing import NDArray

from biogrip.experiment.network import Network
from biogrip.experiment.sample import MODELS
from biogrip.experiment.springpot import LONGEST_S, SHORTEST_S

Complex = NDArray[np.complexfloating]
EXPONENTS = [1e-9, 1e-3, 0.02, 0.1, 0.25, 0.5, 0.7, 0.9, 0.98, 0.999, 1 - 1e-9]
# Sinusoids of periods up to the longest experiment, and steps at times between both ends.
OMEGA = np.geomspace(2 * np.pi / LONGEST_S, 1 / SHORTEST_S, 200)


def impedance(network: Network, s: Complex) -> Complex:
    rates = (network.k / network.c)[0]
    branches = network.k[0] @ (s / (s + rates[:, None]))
    found: Complex = network.k_p[0] + network.c_p[0] * s + branches
    return found


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_a_springpot_is_one_over_the_whole_band(exponent: float) -> None:
    """2 e^(-pi^2/h) = 1.4e-7 on the imaginary axis; on the real one its square, but at the ends."""
    network = MODELS["fractional_kelvin_voigt"].network([0.0, 3.0, exponent])
    for s, bound in ((1j * OMEGA, 3e-7), (OMEGA + 0j, 3e-8), (np.geomspace(1e-3, 1e3) + 0j, 1e-13)):
        assert np.max(np.abs(impedance(network, s) / (3.0 * s**exponent) - 1)) < bound
    for element in (network.k_p, network.c_p, network.k, network.c):
        assert np.all(element > 0)
    assert np.all(np.diff((network.k / network.c)[0]) > 0)


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("c", [1e-4, 1.0, 1e4])
def test_a_damper_behind_it(exponent: float, c: float) -> None:
    """Compliances add; the error is at most the springpot's, the damper having none."""
    s = 1j * OMEGA
    network = MODELS["fractional_maxwell"].network([3.0, exponent, c])
    expected = 1 / (1 / (3.0 * s**exponent) + 1 / (c * s))
    assert np.max(np.abs(impedance(network, s) / expected - 1)) < 3e-7
    assert np.all(network.k > 0)
    assert np.all(np.diff((network.k / network.c)[0]) > 0)


def test_limits_are_springs_and_dampers() -> None:
    """s^alpha - 1 is alpha ln s, s^alpha - s the same with 1 - alpha: 1e-9 times 12 at most."""
    s = 1j * OMEGA
    for model, elastic, viscous in (
        ("fractional_kelvin_voigt", 0.5 + 3.0 + 0 * s, 0.5 + 3.0 * s),
        ("fractional_maxwell", 1 / (1 / 3.0 + 1 / (2.0 * s)), s / (1 / 3.0 + 1 / 2.0)),
    ):
        for exponent, expected in ((1e-9, elastic), (1 - 1e-9, viscous)):
            given = {"k_p": 0.5, "k_alpha": 3.0, "c": 2.0, "alpha": exponent}
            network = MODELS[model].sample(given)
            assert np.max(np.abs(impedance(network, s) / expected - 1)) < 2e-8
