"""Responses and exact derivatives with the arms' inertia, from the first instant on."""

import numpy as np
import pytest

from biogrip.arrays import Array, ComplexArray
from biogrip.experiment.protocol import TorqueHistory, hold, torque_history
from biogrip.experiment.sample import MODELS, Sample, SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.inertia import ringing_s, while_ringing
from biogrip.response.linear import poles, rotation, step_response, transfer_functions
from biogrip.response.nonlinear import nonlinear_rotation
from biogrip.response.ringing import ringing_responses
from biogrip.response.sensitivity import rotation_and_sensitivity
from tests.helpers.problems import condensed_rows, problem_alone
from tests.helpers.responses import (
    MODEL_PARAMETERS,
    PROTOCOLS,
    random_samples,
    rotation_50_digits,
    sensitivity_50_digits,
)

MODEL = MODELS["generalized_maxwell"]
STEPS = torque_history((hold(0.5, 1.6e-9), hold(1.0, 0.4e-9), hold(5.0, 1e-9), hold(100.0, 0.0)))
# From far within the ring's first period to when it is long over, after every step.
AFTER = np.append(0.0, np.geomspace(1e-7, 0.4, 12))
TIMES = np.sort(np.concatenate([start + AFTER for start in STEPS.time_s]))
CELL = np.array([35.0, 12.3, 299.9, 1e-3])
DROP = np.array([9.5, 1e-4, 10.0, 1e-4])


@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_against_50_digits(request: pytest.FixtureRequest, arms: str) -> None:
    """Samples of the whole search range: from an overdamped creep to a ring of 100 MHz."""
    samples = np.concatenate(([CELL, DROP], random_samples(6, seed=11)))
    _check_digits(request.getfixturevalue(arms), samples)


@pytest.mark.parametrize("away", [0.0, 1e-12, 1e-6, -1e-6, 5e-5, 1e-3, -1e-3, 0.03])
def test_critical_damping(gripper: Gripper, away: float) -> None:
    """Where two poles meet, their weights and slopes have no limit; the response does not care."""
    critical = _critically_damped(gripper, CELL)
    _check_digits(gripper, critical[None] * [1, 1, 1, 1 + away])


def _check_digits(gripper: Gripper, samples: Array) -> None:
    found = ringing_responses(gripper, MODEL, STEPS, TIMES, samples)
    for sample, rows in zip(samples, found, strict=True):
        exact = rotation_50_digits(gripper, sample, STEPS, TIMES)
        peak = np.abs(exact).max()
        assert np.max(np.abs(rows[0] - exact)) < 1e-12 * peak
        # A derivative may be larger than the response: a ring's phase is its rate times time.
        slopes = sensitivity_50_digits(gripper, sample, STEPS, TIMES)
        assert np.max(np.abs(rows[1:] - slopes)) < 1e-9 * peak


def _critically_damped(gripper: Gripper, sample: Array) -> Array:
    """The sample with the c_p at which its fast poles meet, by bisection on whether they ring."""
    low, high = 1e-6, 1e-2
    for _ in range(100):
        middle = np.sqrt(low * high)
        rates = _poles(gripper, np.append(sample[:3], middle))
        rings = np.any(np.abs(rates.imag) > 1e-4 * np.abs(rates))
        low, high = (middle, high) if rings else (low, middle)
    return np.append(sample[:3], low)


def _poles(gripper: Gripper, sample: Array) -> ComplexArray:
    network = MODEL.network(sample)
    _, denominator = transfer_functions(gripper, network, symmetric=True, inertia=True)
    return np.sort_complex(poles(denominator, real=False)[0])


def test_poles_do_meet_there(gripper: Gripper) -> None:
    """They part with the root of what c_p is away; found to where that is 1e-4 of them."""
    rates = _poles(gripper, _critically_damped(gripper, CELL))
    assert abs(rates[0] - rates[1]) < 3e-4 * abs(rates[0])


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("name", MODEL_PARAMETERS)
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_every_model_and_protocol(
    request: pytest.FixtureRequest, arms: str, name: str, protocol: str
) -> None:
    """Against what targets are made with, and differences of it."""
    gripper, model = request.getfixturevalue(arms), Sample(name).model
    torque, sample = torque_history(PROTOCOLS[protocol]), np.array(MODEL_PARAMETERS[name])
    times = np.sort(np.concatenate([start + AFTER for start in (*torque.time_s, 300.0)]))
    phi, slopes = rotation_and_sensitivity(gripper, model, torque, times, sample, inertia=True)
    exact = _target(gripper, model, torque, times, sample)
    peak = np.abs(exact).max()
    # Springpots without inertia from when the ring is over: that costs 3.1e-8 s^2 / t^2 at most.
    ringing = while_ringing(gripper, torque, times) | (not model.power_law)
    allowed = np.where(ringing, 1e-12, 3.1e-8 / ringing_s(gripper) ** 2)
    assert np.all(np.abs(phi - exact) < allowed * peak)
    for index in range(len(sample)):
        unit = np.eye(len(sample))[index]
        pairs = [
            (
                _target(gripper, model, torque, times, sample * np.exp(h * unit))
                - _target(gripper, model, torque, times, sample * np.exp(-h * unit))
            )
            / (2 * h)
            for h in (4e-5, 2e-5)
        ]
        # Extrapolated: h^4 times the fourth power of the some thousand radians of a ring that only
        # the arms' own damping ends; and rounding, 1e-13 / h.
        assert np.max(np.abs(slopes[index] - (4 * pairs[1] - pairs[0]) / 3)) < 1e-6 * peak


def _target(
    gripper: Gripper, model: SampleModel, torque: TorqueHistory, times: Array, sample: Array
) -> Array:
    response = step_response(gripper, model.network(sample), symmetric=torque.symmetric)
    return rotation(response, torque, times)[0]


def test_many_steps(gripper: Gripper) -> None:
    """What is carried on from step to step, against what is superposed."""
    rng = np.random.default_rng(3)
    torque = torque_history(tuple(hold(*pair) for pair in rng.uniform(0, [0.02, 1e-9], (200, 2))))
    times = np.sort(rng.uniform(0, torque.end_s, 2000))
    found = ringing_responses(gripper, MODEL, torque, times, DROP[None], slopes=False)[0, 0]
    exact = _target(gripper, MODEL, torque, times, DROP)
    assert np.max(np.abs(found - exact)) < 1e-12 * np.abs(exact).max()


def test_a_sample_does_not_depend_on_the_others(gripper: Gripper) -> None:
    samples = np.concatenate(([CELL, DROP], random_samples(40, seed=4)))
    samples[7] = _critically_damped(gripper, CELL)
    together = ringing_responses(gripper, MODEL, STEPS, TIMES, samples)
    for index in range(len(samples)):
        alone = ringing_responses(gripper, MODEL, STEPS, TIMES, samples[index][None])[0]
        np.testing.assert_array_equal(together[index], alone)


def test_when_the_ring_is_over_it_is_as_without_inertia(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    times = np.linspace(0.1, 400.0, 800)
    for sample in (CELL, DROP):
        full, without = (
            rotation_and_sensitivity(gripper, MODEL, steps, times, sample, inertia=inertia)
            for inertia in (True, False)
        )
        # Dropping the inertia costs 3.1e-8 s^2 / t^2 at most (docs/model.md).
        np.testing.assert_allclose(full[0], without[0], atol=4e-6 * without[0].max())
        np.testing.assert_allclose(full[1], without[1], atol=2e-5 * without[0].max())


def test_a_trace_that_is_seen_ringing_tells_all_four(gripper: Gripper) -> None:
    """Without noise all parameters come back, c_p too; the misfit is the RMS of the residual."""
    times = np.unique(np.concatenate([start + np.geomspace(1e-5, 4.0, 60) for start in (0.0, 5.0)]))
    torque = torque_history((hold(5.0, 1.6e-9), hold(5.0, 0.32e-9)))
    trace = _target(gripper, MODEL, torque, times, CELL)
    problem = problem_alone(
        gripper, MODEL, torque, times, trace, ringing_s=ringing_s(gripper), noise_rad=3e-6
    )
    x = np.log(CELL * [1.3, 0.9, 1.2, 1.6])
    residual, _ = problem.residuals(x)
    misfit = problem.misfit(np.exp(x)[None])[0]
    assert misfit == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-12)
    # So few samples have a row each, and nothing is left over.
    rows, _ = condensed_rows(problem.residuals, x)
    np.testing.assert_allclose(rows[:-1], residual, atol=1e-15 * np.abs(trace).max())
    assert rows[-1] == 0
    for _ in range(20):
        residual, slopes = problem.residuals(x)
        x = x - np.linalg.lstsq(slopes.T, residual, rcond=None)[0]
    np.testing.assert_allclose(np.exp(x), CELL, rtol=1e-6)


def test_the_nonlinear_model_rings_too(gripper: Gripper) -> None:
    """What it has over the linear model is quasi-static, in targets as in what is fitted."""
    torque = torque_history((hold(5.0, 1.6e-9), hold(5.0, 0.8e-9)))
    times = np.unique(np.concatenate([start + np.geomspace(1e-5, 4.9, 40) for start in (0.0, 5.0)]))
    sample = np.array([1.0, 0.05, 10.0, 0.5])
    problem = problem_alone(
        gripper,
        MODEL,
        torque,
        times,
        np.zeros_like(times),
        nonlinear=True,
        ringing_s=ringing_s(gripper),
        noise_rad=3e-6,
    )
    exact = nonlinear_rotation(gripper, MODEL.network(sample), torque, times)[0]
    phi, slopes = problem.residuals(np.log(sample))
    # The population's mesh is coarse: 1e-6 of the peak (see test_nonlinear).
    assert np.max(np.abs(phi - exact)) < 3e-6 * exact.max()
    rows, of_slopes = condensed_rows(problem.residuals, np.log(sample))
    np.testing.assert_allclose(rows[:-1], phi, atol=1e-9 * exact.max())
    np.testing.assert_allclose(of_slopes[:, :-1], slopes, atol=1e-9 * exact.max())
    for index in range(4):
        h = 1e-4 * np.eye(4)[index]
        ahead, behind = (
            nonlinear_rotation(gripper, MODEL.network(sample * np.exp(s)), torque, times)[0]
            for s in (h, -h)
        )
        assert np.max(np.abs(slopes[index] - (ahead - behind) / 2e-4)) < 1e-4 * exact.max()


def test_no_pole_counts_twice_in_a_chain_of_close_ones(gripper: Gripper) -> None:
    """A third pole is close to two that are closer still, and is not one of them."""
    springs = [0.001695449432135559, 0.001695449432135559, 0.0016074925290405196]
    dampers = [0.001100299656249389, 0.001100299656249389, 0.0010955884267022612]
    model = Sample("generalized_maxwell", 3).model
    sample = np.array([*springs, 0.0007309809396061109, *dampers, 0.024581999807570486])
    times, torque = np.linspace(0.0, 6.0, 600), torque_history((hold(3.0, 1e-9), hold(3.0, 2e-10)))
    phi, _ = rotation_and_sensitivity(gripper, model, torque, times, sample, inertia=True)
    exact = _target(gripper, model, torque, times, sample)
    assert np.max(np.abs(phi - exact)) < 1e-9 * np.abs(exact).max()
