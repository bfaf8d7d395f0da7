"""What an instrument does to a trace, by dense matrices and by symmetries."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit import trace_fit
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import _solved, identify_from
from biogrip.fit.problem import Fit, TraceProblem
from biogrip.fit.trace_fit import TraceFit, _has_settled, gripper_functions
from biogrip.fit.trace_noise import NoiseModel
from biogrip.levels import OUTLYING
from biogrip.physics.gripper import Gripper
from biogrip.physics.noise import AR1, Drift, Noise, Outliers, add_noise
from biogrip.physics.response import simulated_response
from tests.helpers.default import STUDY

CASE = STUDY.cases["liquid_drop_2"]
POSED = CASE.experiment
COLOURED = replace(POSED, coloured=True, offset=True, drift=True)
TIMES = np.linspace(0, POSED.torque.end_s, 801)
TRUTH = POSED.logs(CASE.parameters)
ARM, HINGE = POSED.gripper.left, "stiffness_Nm_per_rad"


def simulated(gripper: Gripper, x: Array) -> Array:
    network = POSED.searched.network(np.exp(x))
    return simulated_response(gripper, network, POSED.torque, TIMES)[0]


CLEAN = simulated(POSED.gripper, TRUTH)


def find(problem: TraceProblem) -> Fit:
    return identify_from(problem, TRUTH)


def fitted(experiment: Experiment, trace: Array, times: Array = TIMES) -> TraceFit:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace_fit, "identify_many", lambda some, *_: list(map(find, some)))
        patch.setattr(trace_fit, "deepen", lambda _, found: found)
        given = [experiment], [(times, trace)], [np.random.default_rng(0)]
        (fit,) = trace_fit.fit_least_squares(*given)
    return fit


def noisy(noise: Noise, seed: int = 0) -> Array:
    return add_noise(CLEAN, noise, np.random.default_rng([seed, 3]), TIMES)


def test_noise_models_are_alike_if_shares_and_times_are() -> None:
    """Of a time, its logarithm counts, by its share."""
    one = NoiseModel(0.5, 20.0, 0.1)
    assert _has_settled(one, replace(one, time_s=20.3, flicker=0.102))
    assert not _has_settled(one, replace(one, time_s=20.5))
    assert not _has_settled(one, replace(one, flicker=0.111))


def test_white_noise_and_a_known_gripper_leave_the_fit_as_it_is() -> None:
    trace = noisy(Noise("gaussian", 0.02, "peak"))
    fit = fitted(POSED, trace)
    expected = find(POSED.of(TIMES, trace))
    np.testing.assert_array_equal(fit.found.parameters, expected.parameters)
    assert fit.noise_model is None
    assert not fit.outliers.any()
    assert fit.notes() == []


@pytest.mark.parametrize(("every", "known"), [(1, True), (80, False)])
def test_an_uncertain_gripper_is_a_part_of_the_noise(every: int, known: bool) -> None:
    """By dense matrices; of ten readings and four parameters six tell the noise."""
    times, trace = TIMES[40::every], noisy(Noise("gaussian", 0.02, "peak"))[40::every]
    level = float(0.03 * CLEAN.max()) if known else None
    experiment = replace(POSED, uncertainty={"left": {HINGE: 9e-9}}, noise_sd=level)
    fit = fitted(experiment, trace, times)
    best = np.log(fit.found.parameters)
    residual, slopes = POSED.of(times, trace).residuals(best)
    _, own = fit.problem.residuals(best)
    changes = gripper_functions(experiment, times, fit.found.parameters)
    noise_sd = level or find(POSED.of(times, trace)).misfit * np.sqrt(10 / 6)
    inverse = np.linalg.inv(np.eye(len(times)) + changes.T @ changes / noise_sd**2)
    told = [0, 2]  # k and c: nothing is told of c_p, and next to nothing of k_p.
    expected, found = (slopes @ inverse @ slopes.T)[told], (own @ own.T)[told]
    np.testing.assert_allclose(found[:, told], expected[:, told], rtol=0.02)
    steps = (slopes @ inverse @ residual)[told] / np.sqrt(np.diag(expected[:, told]))
    assert np.all(np.abs(steps) < 0.05 * noise_sd)


def test_an_uncertain_hinge_is_half_the_difference_of_a_stiffer_and_a_softer_one() -> None:
    odd, _ = functions({"left": {HINGE: 0.05 * 4.4e-7}})
    left = (replace(ARM, **{HINGE: 4.4e-7 * (1 + error)}) for error in (0.05, -0.05))
    above, below = (simulated(replace(POSED.gripper, left=arm), TRUTH) for arm in left)
    np.testing.assert_allclose(odd, 0.5 * (above - below), rtol=1e-9)


def test_noise_is_found_and_said() -> None:
    noise = Noise("gaussian", 0.02, "peak", ar1=AR1(0.5, 5.0), drift=Drift(2.0))
    noise = replace(noise, outliers=Outliers(0.01, 30.0))
    fit = fitted(COLOURED, noisy(noise))
    assert fit.noise_model is not None
    assert fit.noise_model.ar1 + fit.noise_model.flicker == pytest.approx(0.5, abs=0.25)
    away = np.abs(noisy(noise) - noisy(replace(noise, outliers=None))) / (0.02 * CLEAN.max())
    # What is only just outside of the noise may be missed, or not.
    assert set(np.flatnonzero(away > 2 * OUTLYING)) <= set(np.flatnonzero(fit.outliers))
    assert np.count_nonzero(fit.outliers & (away == 0)) <= 1
    model, outliers = fit.notes()
    assert "correlated over some" in model
    assert f"{np.count_nonzero(fit.outliers)} samples of 801" in outliers
    assert fit.problem.residuals.freedom < 1000
    other = COLOURED.for_model(fit.problem, POSED.searched)
    np.testing.assert_array_equal(other.residuals(TRUTH)[0], fit.problem.residuals(TRUTH)[0])


@pytest.mark.nightly
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


@pytest.mark.filterwarnings("error")
def test_a_singular_step_is_no_number_and_no_warning() -> None:
    matrices = np.array([np.ones((2, 2)), np.eye(2)])
    solved = _solved(matrices, np.array([[1.0, 2.0], [1.0, 2.0]]))
    assert not np.isfinite(solved[0]).any()
    assert solved[1].tolist() == [1.0, 2.0]
