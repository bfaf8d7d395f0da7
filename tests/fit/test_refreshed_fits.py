"""Fits of the nonlinear model by a correction that is expanded: optima of the model itself."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from biogrip.arrays import Array
from biogrip.fit.genome import GeneRange
from biogrip.fit.local_fits import LocalFits
from biogrip.fit.multi_start import fit_from
from biogrip.fit.problem import Problem, make_problem
from biogrip.judging.likelihood import Likelihood, make_likelihood
from biogrip.judging.limits import find_limits
from biogrip.judging.quantities import parameters_and_sum
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.models import MODELS
from biogrip.physics.nonlinear import nonlinear_rotation
from biogrip.physics.protocol import hold, torque_history
from tests.helpers.problems import condensed_of, problem_alone

MODEL, TRUTH = MODELS["liquid_drop"], np.array([1.0, 0.05, 10.0])
RANGES = {
    **dict.fromkeys(("k", "k_p"), GeneRange((-3, 8), (1, 9))),
    **dict.fromkeys(("c", "c_p"), GeneRange((-4, 5), (1, 9))),
}
# The correction is a thousandth of the rotation at the paper's torque, and a percent at ten times.
TORQUES = {"the paper's": 1.6e-9, "ten times": 1.6e-8}


def case_problem(gripper: Gripper, torque_Nm: float, traces: int) -> list[Problem]:
    """Traces with one percent of noise."""
    torque = torque_history((hold(200.0, torque_Nm), hold(200.0, 0.2 * torque_Nm)))
    time_s = np.linspace(0.0, 400.0, 801)
    clean = nonlinear_rotation(gripper, MODEL.network(TRUTH), torque, time_s)[0]
    noise = np.random.default_rng(5).standard_normal((traces, len(time_s)))
    condensed = condensed_of(torque, time_s, nonlinear=True)
    return [
        make_problem(gripper, MODEL, torque, time_s, trace, RANGES, condensed, instrument=GRIPPER)
        for trace in clean + 0.01 * clean.max() * noise
    ]


def lowest(likelihood: Likelihood, held_index: int, value: float) -> float:
    """Rise of chi^2 with a parameter held, by SciPy on all samples of the nonlinear model."""
    problem, best = likelihood.problem, likelihood.best
    free = [index for index in range(len(best)) if index != held_index]

    def at(x: Array) -> Array:
        full = best.copy()
        full[held_index], full[free] = value, x
        return problem.residuals(full)[0] / likelihood.noise_rad

    bounds = problem.low[free], problem.high[free]
    found = least_squares(at, best[free], bounds=bounds, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    at_best = problem.residuals(best)[0] / likelihood.noise_rad
    return float(2 * found.cost - at_best @ at_best)


@pytest.mark.parametrize("torque", TORQUES)
def test_limits_are_those_of_the_nonlinear_model(gripper: Gripper, torque: str) -> None:
    """To a percent of the threshold, by their definition."""
    (problem,) = case_problem(gripper, TORQUES[torque], 1)
    (best,) = fit_from([problem], np.log(TRUTH)).x
    residual, slopes = problem.residuals(best)
    size = np.linalg.norm(slopes, axis=1) * np.linalg.norm(residual)
    assert np.all(np.abs(slopes @ residual) < 1e-5 * size)
    misfit = float(np.sqrt(np.mean(residual**2)))
    likelihood = make_likelihood(problem, best, misfit, confidence=0.95)
    (limits,) = find_limits([likelihood], parameters_and_sum(MODEL))[0]
    assert np.all(np.isfinite(limits))
    for index, ends in enumerate(limits):
        for end in ends:
            increase = lowest(likelihood, index, float(end))
            assert increase == pytest.approx(likelihood.threshold, rel=0.01)


def test_where_the_model_has_no_answer_no_fit_ends(gripper: Gripper) -> None:
    """A start that the torque closes beyond what the model describes stays, infinitely bad."""
    torque = torque_history((hold(200.0, 1e-6), hold(200.0, 1e-7)))
    time_s = np.linspace(0.0, 400.0, 801)
    trace = 0.3 * np.ones(len(time_s))
    beyond = problem_alone(gripper, MODEL, torque, time_s, trace, nonlinear=True)
    start = np.log(np.array([[1e-2, 1e-2, 1e-2]]))
    found = LocalFits([beyond]).fitted(start, np.zeros(1, int))
    assert np.isinf(found.misfit_rad[0])
    np.testing.assert_array_equal(found.x, start)
