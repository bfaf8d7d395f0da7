"""Averages over an exposure, against quadrature of torques and of responses."""

import numpy as np
import pytest
from scipy.integrate import quad

from biogrip.arrays import Array
from biogrip.experiment.exposure import average
from biogrip.experiment.models import MODELS
from biogrip.experiment.protocol import Harmonic, Load, Phase, hold, torque_at, torque_history
from biogrip.instrument.gripper import Gripper
from biogrip.response.simulation import simulated_rotation

RAMP = Load(1.0, -0.4)
SWING = Load(0.5, harmonics=(Harmonic(0.3, 9.0, 0.4), Harmonic(0.1, 18.0, -1.0)))
PROTOCOLS = {
    "steps": (hold(0.5, 1.0), hold(0.3, 0.2), hold(1.2, 0.7)),
    "ramps": (Phase(1.0, RAMP, Load(1.0, 0.3)), Phase(1.0, Load(0.6, 0.1), RAMP)),
    "sinusoids": (Phase(0.7, SWING, Load(0.2)), hold(0.3, 0.4), Phase(1.0, RAMP, SWING)),
}
# Shorter than all phases, as long as one, and longer than most.
EXPOSURES_S = (0.02, 0.3, 0.9)


@pytest.mark.parametrize("exposure_s", EXPOSURES_S)
@pytest.mark.parametrize("name", PROTOCOLS)
@pytest.mark.parametrize("arm", ["left", "right"])
def test_the_torque_is_a_mean(name: str, arm: str, exposure_s: float) -> None:
    phases = PROTOCOLS[name]
    history, averaged = torque_history(phases), torque_history(average(phases, exposure_s))
    edges = np.append(history.time_s, history.end_s)
    assert averaged.end_s == pytest.approx(history.end_s)
    for time_s in np.linspace(0.01, history.end_s - 0.01, 37):

        def torque(at_s: float) -> float:
            return float(torque_at(history, np.array([at_s]), arm)[0])

        begin_s = max(time_s - exposure_s, 0.0)
        inside = edges[(edges > begin_s) & (edges < time_s)]
        whole = quad(torque, begin_s, time_s, points=inside, limit=200)[0]
        found = float(torque_at(averaged, np.array([time_s]), arm)[0])
        assert found == pytest.approx(whole / exposure_s, abs=1e-10)


@pytest.mark.parametrize("exposure_s", [0.001, 0.05])
@pytest.mark.parametrize("name", PROTOCOLS)
def test_readings_are_means_of_responses(gripper: Gripper, name: str, exposure_s: float) -> None:
    """By Gauss and Legendre in pieces shorter than the periods in which the arms ring."""
    phases = PROTOCOLS[name]
    network = MODELS["zener_maxwell"].sample({"k": 1.0, "k_p": 1e-4, "c": 1.0, "c_p": 0.01})
    history = torque_history(phases)
    time_s = np.linspace(0.1, history.end_s, 23)

    def rotation(by: tuple[Phase, ...], at_s: Array) -> Array:
        return simulated_rotation(gripper, network, torque_history(by), at_s, nonlinear=False)[0]

    nodes, weights = np.polynomial.legendre.leggauss(10)
    expected = np.zeros_like(time_s)
    for row, end_s in enumerate(time_s):
        edges = history.time_s[(history.time_s > end_s - exposure_s) & (history.time_s < end_s)]
        edges = np.sort(np.append(edges, np.linspace(end_s - exposure_s, end_s, 1001)))
        at_s = edges[:-1] + (nodes[:, None] + 1) / 2 * np.diff(edges)
        read = rotation(phases, at_s.T.ravel()).reshape(-1, len(nodes)) @ weights / 2
        expected[row] = read @ np.diff(edges) / exposure_s
    found = rotation(average(phases, exposure_s), time_s)
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_an_instant_is_no_exposure() -> None:
    assert average(PROTOCOLS["steps"], 0.0) == PROTOCOLS["steps"]


def test_the_mean_of_a_curved_torque_is_refused() -> None:
    curved = Load(1.0, 0.1, 0.2)
    with pytest.raises(ValueError, match="curved"):
        average((Phase(1.0, curved, curved),), 0.1)
