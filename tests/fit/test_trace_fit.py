"""What an instrument does to a trace, against least squares with all of it and by symmetries."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import identify_from
from biogrip.fit.noise_model_fit import FAR
from biogrip.fit.problem import Fit, TraceProblem
from biogrip.fit.trace_fit import TraceFit, fit_traces, gripper_functions
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import Gripper
from biogrip.physics.noise import AR1, MOST_SAMPLES, Drift, Noise, Outliers, add_noise
from biogrip.physics.simulation import simulated_response
from tests.helpers.default import STUDY

CASE = STUDY.cases["liquid_drop_2"]
POSED = CASE.experiment
COLOURED = replace(POSED, coloured=True, offset=True, drift=True)
TIMES = np.linspace(0, POSED.torque.end_s, 801)
TRUTH = POSED.logs(CASE.parameters)


def simulated(gripper: Gripper, x: Array) -> Array:
    network = POSED.searched.network(np.exp(x))
    return simulated_response(gripper, network, POSED.torque, TIMES, nonlinear=False)[0]


CLEAN = simulated(POSED.gripper, TRUTH)


def find(problem: TraceProblem) -> Fit:
    return identify_from(problem, TRUTH)


def fitted(experiment: Experiment, trace: Array, times: Array = TIMES) -> TraceFit:
    (fit,) = fit_traces([experiment], [(times, trace)], lambda some, _: list(map(find, some)))
    return fit


def noisy(noise: Noise, seed: int = 0) -> Array:
    return add_noise(CLEAN, noise, np.random.default_rng([seed, 3]), TIMES)


def test_white_noise_and_a_known_gripper_leave_the_fit_as_it_is() -> None:
    trace = noisy(Noise("gaussian", 0.02, "peak"))
    fit = fitted(POSED, trace)
    expected = find(POSED.of(TIMES, trace))
    np.testing.assert_array_equal(fit.found.parameters, expected.parameters)
    assert fit.noise_model is None
    assert not fit.outliers.any()
    assert fit.notes() == []


def test_an_uncertain_gripper_is_one_more_parameter_with_a_prior() -> None:
    """SciPy fits both arms' stiffness along, each held by what is known of it.

    Estimates and standard deviations of the logarithms agree to a twentieth of the latter:
    what is taken for straight is 2 % of a stiffness.
    """
    share, level, key = 0.02, float(0.02 * CLEAN.max()), "stiffness_Nm_per_rad"
    arms = {"left": POSED.gripper.left, "right": POSED.gripper.right}
    uncertainty = {name: {key: share * getattr(arm, key)} for name, arm in arms.items()}
    trace = noisy(Noise("gaussian", 0.02, "peak"))
    fit = fitted(replace(POSED, uncertainty=uncertainty, noise_sd=level), trace)
    best, low, high = np.log(fit.found.parameters), fit.problem.low, fit.problem.high
    _, slopes = fit.problem.residuals(best)
    told = [0, 2]  # k and c: nothing is told of c_p, and next to nothing of k_p.

    def residuals(z: Array) -> Array:
        softer: dict[str, Any] = {
            name: replace(arm, stiffness_Nm_per_rad=getattr(arm, key) * (1 + share * y))
            for (name, arm), y in zip(arms.items(), z[4:], strict=True)
        }
        gripper = replace(POSED.gripper, **softer)
        return np.append((simulated(gripper, z[:4]) - trace) / level, z[4:])

    start = np.append(np.clip(best, low + 1e-6, high - 1e-6), [0, 0])
    bounds = np.append(low, [-5, -5]), np.append(high, [5, 5])
    both = least_squares(residuals, start, bounds=bounds, x_scale="jac")

    def deviations(rows: Array) -> Array:
        return np.sqrt(np.diagonal(np.linalg.inv(rows.T @ rows + 1e-6 * np.eye(rows.shape[1]))))

    own, expected = deviations(slopes[told].T / level), deviations(both.jac[:, [*told, 4, 5]])[:2]
    np.testing.assert_allclose(own, expected, rtol=0.05)
    assert np.all(own > 1.2 * deviations(both.jac[:-2, told]))
    assert np.all(np.abs(best - both.x[:4])[told] < 0.05 * expected + 1e-3)


def test_an_uncertain_gripper_is_held_against_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of ten readings and four parameters, six: the noise is the misfit times sqrt(10 / 6)."""
    uncertainty = {"left": {"stiffness_Nm_per_rad": 1e-8}}
    experiment, condense = replace(POSED, uncertainty=uncertainty), Experiment.in_noise
    times, trace = TIMES[40::80], noisy(Noise("gaussian", 0.02, "peak"))[40::80]
    plain = find(POSED.of(times, trace))
    over_noise: list[Array] = []

    def condensed(self: Experiment, *given: Any, **more: Any) -> Condensed:
        over_noise.append(given[2])
        return condense(self, *given, **more)

    monkeypatch.setattr(Experiment, "in_noise", condensed)
    fitted(experiment, trace, times)
    changes = gripper_functions(experiment, times, plain.parameters)
    first = next(each for each in over_noise if len(each))
    np.testing.assert_allclose(first, changes / (plain.misfit * np.sqrt(10 / 6)), rtol=1e-9)


def test_noise_is_found_and_said() -> None:
    noise = Noise("gaussian", 0.02, "peak", ar1=AR1(0.5, 5.0), drift=Drift(2.0))
    noise = replace(noise, outliers=Outliers(0.01, 30.0))
    fit = fitted(COLOURED, noisy(noise))
    assert fit.noise_model is not None
    assert fit.noise_model.ar1 + fit.noise_model.flicker == pytest.approx(0.5, abs=0.25)
    away = np.abs(noisy(noise) - noisy(replace(noise, outliers=None))) / (0.02 * CLEAN.max())
    # What is only just outside of the noise may be missed, or not.
    assert set(np.flatnonzero(away > 2 * FAR)) <= set(np.flatnonzero(fit.outliers))
    assert np.count_nonzero(fit.outliers & (away == 0)) <= 1
    model, outliers = fit.notes()
    assert "correlated over some" in model
    assert f"{np.count_nonzero(fit.outliers)} samples of 801" in outliers
    assert fit.problem.residuals.freedom < 1000
    other = COLOURED.for_model(fit.problem, POSED.searched)
    np.testing.assert_array_equal(other.residuals(TRUTH)[0], fit.problem.residuals(TRUTH)[0])


def test_noise_that_grows_with_the_rotation_leaves_good_samples_in() -> None:
    """Three spikes are struck, each of fifteen times the noise of its sample."""
    trace, spikes = noisy(Noise("gaussian", 0.05, "signal")), [200, 500, 700]
    spiked = trace.copy()
    spiked[spikes] += 15 * 0.05 * CLEAN[spikes]
    assert not fitted(COLOURED, trace).outliers.any()
    fit = fitted(COLOURED, spiked)
    np.testing.assert_array_equal(np.flatnonzero(fit.outliers), spikes)
    assert fit.noise_model is not None
    assert fit.noise_model.proportional > 0.9
    assert "that grows with the rotation" in fit.notes()[0]
    assert fit.noise_data()["proportional"] > 0.9  # type: ignore[index, operator]


def test_too_many_samples_for_a_colour_are_refused() -> None:
    times = np.linspace(0, 400, MOST_SAMPLES + 1)
    with pytest.raises(BiogripError, match="allowed are at most 50000 with a coloured"):
        fitted(COLOURED, times, times)


def functions(uncertainty: Mapping[str, Mapping[str, float]]) -> Array:
    return gripper_functions(replace(POSED, uncertainty=uncertainty), TIMES, np.exp(TRUTH))


def test_the_torque_is_a_factor_of_the_rotation() -> None:
    odd, even = functions({"torque": {"share": 0.03}})
    np.testing.assert_allclose(odd, 0.03 * CLEAN, rtol=1e-9)
    np.testing.assert_allclose(even, 0.0, atol=1e-12 * odd.max())


def test_an_uncertain_length_is_that_of_all_elements() -> None:
    """A length enters as its square, by which every element of the sample is multiplied."""
    share, length = 0.05, POSED.gripper.arm_length_m
    odd, even = functions({"gripper": {"arm_length_m": share * length}})
    errors = np.log1p([share, 0, -share])
    above, nominal, below = (simulated(POSED.gripper, TRUTH + 2 * error) for error in errors)
    np.testing.assert_allclose(odd, 0.5 * (above - below), rtol=1e-9, atol=1e-12)
    bent = 0.5 * (above + below) - nominal
    assert even @ bent / np.linalg.norm(even) / np.linalg.norm(bent) == pytest.approx(1.0)
