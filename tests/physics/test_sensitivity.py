"""Exact derivatives, against 50 digits and against differences of independent code."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics import modes
from biogrip.physics import residuals as of_residuals
from biogrip.physics.condensed import Condensed
from biogrip.physics.drift import nuisance_basis, with_uncertain, within, without
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.modes import linear_responses
from biogrip.physics.protocol import TorqueHistory, torque_history
from biogrip.physics.residuals import Residuals, Trace
from biogrip.physics.sample_model import SampleModel, with_fixed
from tests.helpers.responses import (
    MODEL_PARAMETERS,
    PROTOCOLS,
    exact_50_digits,
    random_samples,
)

TIMES = np.array([0.1, 1.0, 7.5, 60.0, 199.0, 200.1, 201.0, 230.0, 399.0])
# Without inertia the response itself differs by up to 3.1e-8 s^2 / t^2 (docs/model.md), t the
# time since a step, and its derivatives by some times that.
INERTIA = 5 * 3.1e-8 / np.where(TIMES < 200, TIMES, TIMES - 200) ** 2


def test_against_50_digits(gripper: Gripper, steps: TorqueHistory) -> None:
    """Central differences with a step of 1e-4 of a solution with 50 digits, extrapolated."""
    for sample in random_samples(6, seed=5):
        model = MODELS["generalized_maxwell"]
        slopes = linear_responses(gripper, model, steps, TIMES, sample[None])[0, 1:]
        peak = np.abs(exact_50_digits(gripper, sample, steps, TIMES)[0]).max()
        for index in range(4):
            coarse, fine = (
                _difference(gripper, steps, sample, index, step) for step in (2e-3, 1e-3)
            )
            # The error of a central difference falls with the square of its step.
            exact = (4 * fine - coarse) / 3
            assert np.all(np.abs(slopes[index] - exact) < (1e-9 + INERTIA) * peak)


def _difference(
    gripper: Gripper, steps: TorqueHistory, sample: Array, index: int, step: float
) -> Array:
    ahead, behind = sample.copy(), sample.copy()
    ahead[index] *= np.exp(step)
    behind[index] *= np.exp(-step)
    values = [exact_50_digits(gripper, one, steps, TIMES)[0] for one in (ahead, behind)]
    difference: Array = (values[0] - values[1]) / (2 * step)
    return difference


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_many_samples_are_looked_at_in_parts(
    gripper: Gripper, monkeypatch: pytest.MonkeyPatch, protocol: str
) -> None:
    """Which give what all of them do at once, but for the order of a product's few sums."""
    (sample,) = random_samples(1, seed=8)
    torque, model = torque_history(PROTOCOLS[protocol]), MODELS["generalized_maxwell"]
    time_s = np.linspace(0, torque.end_s, 1001)
    given = gripper, model, torque, time_s, sample[None]
    whole = linear_responses(*given)[0]
    monkeypatch.setattr(modes, "_TIMES_TOGETHER", 90)
    parts = linear_responses(*given)[0]
    np.testing.assert_allclose(parts, whole, rtol=0, atol=1e-14 * np.abs(whole[0]).max())


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("name", MODEL_PARAMETERS)
def test_against_differences(either_gripper: Gripper, name: str, protocol: str) -> None:
    """Every model, equal and unequal arms, every kind of load."""
    model = Sample(name).model
    _check(either_gripper, model, protocol, np.array(MODEL_PARAMETERS[name]))


def test_two_branches_and_a_known_parameter(gripper: Gripper) -> None:
    two = Sample("generalized_maxwell", 2).model
    _check(gripper, two, "steps", np.array([5.0, 0.2, 1.0, 9.0, 99.0, 0.5]))
    known = with_fixed(MODELS["burgers"], {"c_s": 200.0})
    _check(gripper, known, "steps", np.array([3.0, 2.0, 40.0]))


def _check(gripper: Gripper, model: SampleModel, protocol: str, sample: Array) -> None:
    torque = torque_history(PROTOCOLS[protocol])
    phi, *slopes = linear_responses(gripper, model, torque, TIMES, sample[None])[0]

    def simulated(parameters: Array) -> Array:
        response = step_response(
            gripper, model.network(parameters), symmetric=torque.symmetric, inertia=False
        )
        return rotation(response, torque, TIMES)[0]

    np.testing.assert_allclose(phi, simulated(sample), rtol=1e-12, atol=1e-12 * np.abs(phi).max())
    for index in range(len(sample)):
        unit = np.eye(len(sample))[index]
        pairs = [
            (simulated(sample * np.exp(h * unit)) - simulated(sample * np.exp(-h * unit))) / (2 * h)
            for h in (2e-3, 1e-3)
        ]
        # Extrapolated: h^4 = 1e-12, and rounding 1e-16 / h = 1e-13; derivatives cancel some more.
        exact = (4 * pairs[1] - pairs[0]) / 3
        assert np.max(np.abs(slopes[index] - exact)) < 1e-9 * np.abs(phi).max()


@pytest.mark.parametrize(("offset", "drift"), [(True, False), (False, True), (True, True)])
def test_nuisance_takes_out_offset_and_drift_and_nothing_else(offset: bool, drift: bool) -> None:
    times = np.linspace(0.0, 10.0, 101)
    basis = nuisance_basis(times, offset=offset, drift=drift)
    np.testing.assert_allclose(basis @ basis.T, np.eye(offset + drift), atol=1e-14)
    added = 3.0 * offset + 0.2 * drift * times
    wave = without(basis, np.sin(times))
    np.testing.assert_allclose(without(basis, wave + added), wave, atol=1e-12)
    np.testing.assert_allclose(within(basis, wave + added), added, atol=1e-12)
    degree = 1 if drift else 0
    if offset:
        fitted = np.polyval(np.polyfit(times, np.cos(times), degree), times)
        np.testing.assert_allclose(within(basis, np.cos(times)), fitted, atol=1e-12)


def test_residuals_do_not_see_what_the_instrument_added(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    model, x = MODELS["maxwell"], np.log([2.0, 50.0])
    times = np.arange(401.0)
    trace = np.random.default_rng(0).standard_normal(len(times)) * 1e-4
    basis = nuisance_basis(times, offset=True, drift=True)
    condensed = Condensed(steps, times, basis)
    plain, shifted = (
        Residuals(gripper, model, steps, Trace(times, trace + added, condensed), instrument=GRIPPER)
        for added in (0.0, 5e-3 + 1e-5 * times)
    )
    np.testing.assert_allclose(plain(x)[0], shifted(x)[0], atol=1e-15)
    assert np.all(np.abs(plain(x)[1] @ basis.T) < 1e-12)
    assert plain.free == len(times) - 2


def test_the_gradient_of_many_samples_is_summed_in_parts(
    gripper: Gripper, steps: TorqueHistory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever part of an amplitude is taken out, and whatever the residual leaves."""
    model, x = MODELS["maxwell"], np.log([2.0, 50.0])
    times = np.arange(401.0)
    trace = np.random.default_rng(0).standard_normal(len(times)) * 1e-4
    basis = with_uncertain(
        nuisance_basis(times, offset=True, drift=False), 0.1 * np.sin(times / 30)[None]
    )
    given = Trace(times, trace, Condensed(steps, times, basis))
    residuals = Residuals(gripper, model, steps, given, instrument=GRIPPER)
    residual, slopes = residuals(x)
    np.testing.assert_array_equal(residuals.left(x), residual)
    for at_once in (1000, 90):
        monkeypatch.setattr(of_residuals, "_SAMPLES_AT_ONCE", at_once)
        (gradient,), (misfit_rad,) = residuals.gradients(x[None], [residuals])
        np.testing.assert_allclose(gradient, slopes @ residual, rtol=1e-11)
        assert misfit_rad == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-12)


def test_a_later_protocol_is_one_of_earlier_readings(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    model, parameters = MODELS["maxwell"], np.array([[2.0, 50.0]])
    trace = np.random.default_rng(0).standard_normal(401) * 1e-4
    here, there = (
        Residuals(
            gripper,
            model,
            steps,
            Trace(times, trace, Condensed(steps, times, np.zeros((0, 401)))),
            instrument=GRIPPER,
        )
        for times in (np.arange(401.0), np.arange(401.0) - 3.0)
    )
    moved = here.later(3.0)
    np.testing.assert_array_equal(moved(np.log(parameters[0]))[0], there(np.log(parameters[0]))[0])
    expected = there.condensed_misfit(parameters)
    assert moved.condensed_misfit(parameters) == pytest.approx(expected, rel=1e-12)
    assert moved.noise_scale_rad == here.noise_scale_rad
