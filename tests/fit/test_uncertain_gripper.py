"""The gripper's uncertainty in the limits, against the model's own symmetries and simulations."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.problem import CaseProblem
from biogrip.fit.trace_fit import gripper_functions
from biogrip.physics.simulation import simulated_rotation
from tests.helpers.default import STUDY

CASE = STUDY.cases["liquid_drop_2"]
# Two parameters: the branch, which arms of about its stiffness squeeze.
EXPERIMENT = replace(CASE.problem, fixed={"k_p": 1e-4, "c_p": 1e-3})
TIMES = np.linspace(0.0, 400.0, 101)
TRUTH = EXPERIMENT.logs(CASE.parameters)


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
