"""The gripper's uncertainty in the limits, against the model's own symmetries and simulations."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import chdtri
from scipy.stats import binom

from biogrip.arrays import Array
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.multi_start import identify_from
from biogrip.fit.problem import Identification, Problem
from biogrip.fit.trace_fit import gripper_functions, trace_fit
from biogrip.judging.likelihood import make_likelihood
from biogrip.physics.noise import Noise, add_noise
from biogrip.physics.simulation import simulated_rotation
from tests.helpers.default import STUDY

CASE = STUDY.cases["liquid_drop_2"]
# Two parameters: the branch, which arms of about its stiffness squeeze.
EXPERIMENT = replace(CASE.problem, fixed={"k_p": 1e-4, "c_p": 1e-3})
TIMES = np.linspace(0.0, 400.0, 101)
TRUTH = EXPERIMENT.logs(CASE.parameters)
TRACES = 40


def simulated(case_problem: CaseProblem, logs: Array = TRUTH, torque: float = 1.0) -> Array:
    network = case_problem.searched.network(np.exp(logs))
    history = case_problem.torque.times(torque)
    return simulated_rotation(case_problem.gripper, network, history, TIMES, nonlinear=False)[0]


def functions(uncertainty: Mapping[str, Mapping[str, float]], **changes: Any) -> Array:
    gripper = replace(EXPERIMENT.gripper, **changes)
    case_problem = replace(EXPERIMENT, gripper=gripper, uncertainty=uncertainty)
    return gripper_functions(case_problem, TIMES, np.exp(TRUTH))


def test_the_torque_is_a_factor_of_the_rotation() -> None:
    odd, even = functions({"torque": {"share": 0.03}})
    np.testing.assert_allclose(odd, 0.03 * simulated(EXPERIMENT), rtol=1e-9)
    np.testing.assert_allclose(even, 0.0, atol=1e-12 * odd.max())


def test_an_uncertain_length_is_that_of_all_elements() -> None:
    """A length enters as its square, by which every element of the sample is multiplied."""
    length, wholly = EXPERIMENT.gripper.arm_length_m, replace(CASE.problem)
    share, logs = 0.05, wholly.logs(CASE.parameters)
    uncertain = replace(wholly, uncertainty={"gripper": {"arm_length_m": share * length}})
    odd, even = gripper_functions(uncertain, TIMES, np.exp(logs))
    above, nominal, below = (simulated(wholly, logs + 2 * np.log1p(e)) for e in (share, 0, -share))
    np.testing.assert_allclose(odd, 0.5 * (above - below), rtol=1e-9, atol=1e-12)
    bent = 0.5 * (above + below) - nominal
    assert even @ bent / np.linalg.norm(even) / np.linalg.norm(bent) == pytest.approx(1.0)


def test_only_the_sine_of_the_angle_counts() -> None:
    """Its change by an angle has a slope of cos/sin; at a right angle it has none."""
    degree = {"gripper": {"reference_angle_deg": 1.0}}
    odd, _ = functions(degree)
    length = EXPERIMENT.gripper.arm_length_m / np.tan(np.radians(75.0)) * np.radians(1.0)
    same, _ = functions({"gripper": {"arm_length_m": length}})
    # To the third order in an angle of a degree.
    np.testing.assert_allclose(odd, same, atol=1e-3 * np.abs(odd).max())
    right, _ = functions(degree, reference_angle_deg=90.0)
    np.testing.assert_allclose(right, 0.0, atol=1e-12)


def drawn(uncertainty: Mapping[str, Mapping[str, float]], rng: np.random.Generator) -> Array:
    """Simulate a trace of a gripper that is randomly wrong; noise is a thousandth of the peak."""
    gripper, own = EXPERIMENT.gripper, uncertainty["gripper"]
    changed = {key: getattr(gripper, key) + own[key] * rng.standard_normal() for key in own}
    torque = 1 + uncertainty["torque"]["share"] * rng.standard_normal()
    wrong = replace(EXPERIMENT, gripper=replace(gripper, **changed))
    clean = simulated(wrong, torque=torque)
    return add_noise(clean, Noise("gaussian", 0.001, "peak"), rng, TIMES)


def increase_at_truth(case_problem: CaseProblem, trace: Array) -> float:
    """Return the increase of chi^2 from the best fit to the truth."""

    def find(problem: Problem) -> Identification:
        return identify_from(problem, TRUTH)

    fit = trace_fit(case_problem, TIMES, trace, find)
    best = np.log(fit.found.parameters)
    likelihood = make_likelihood(fit.problem, best, fit.found.misfit_rad, confidence=0.95)
    return likelihood.increase(float(fit.problem.misfit(np.exp(TRUTH)[None])[0]))


@pytest.mark.nightly
def test_limits_allow_for_a_gripper_that_is_wrong() -> None:
    """Length, angle and torque are off at random; Wilks' theorem holds, with 95 % confidence.

    With a gripper taken as exact it does not. Bounds are those of a binomial distribution, left
    once in a thousand times.
    """
    length = 0.05 * EXPERIMENT.gripper.arm_length_m
    own = {"arm_length_m": length, "reference_angle_deg": 1.0}
    uncertainty = {"gripper": own, "torque": {"share": 0.05}}
    rng = np.random.default_rng(5)
    traces = [drawn(uncertainty, rng) for _ in range(TRACES)]
    uncertain = replace(EXPERIMENT, uncertainty=uncertainty)
    inside = [increase_at_truth(uncertain, trace) < chdtri(2, 0.05) for trace in traces]
    assert sum(inside) >= binom.ppf(1e-3, TRACES, 0.95)
    inside = [increase_at_truth(EXPERIMENT, trace) < chdtri(2, 0.05) for trace in traces[::2]]
    assert sum(inside) <= 0.3 * len(inside)
