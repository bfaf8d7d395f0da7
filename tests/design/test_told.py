"""What traces told: information adds up, and what they tell badly is drawn from all that fits."""

from functools import cache

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.design.earlier_traces import Earlier, estimate_from_traces, information_at
from biogrip.experiment.protocol import hold, torque_history
from biogrip.experiment.sample import MODELS
from biogrip.groups.replicates import joint_problem
from biogrip.identify.answer import Identification
from biogrip.identify.multi_start import identify_from
from biogrip.identify.problem import Problem
from biogrip.response.inertia import ringing_s
from biogrip.response.simulation import simulated_rotation
from tests.helpers.default import STUDY
from tests.helpers.problems import problem_alone

CASE = STUDY.cases["endothelial_cell"]
MODEL = MODELS["generalized_maxwell"]
NOISE_RAD = 3e-6
TRUTH = np.log([35.0, 12.3, 299.9, 1e-2])
STEPS = torque_history((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)))
PULSES = torque_history((hold(0.2, 1.6e-9), hold(0.2, 0.8e-9)))
SLOW = np.arange(1, 800) / 2
FAST = np.concatenate((np.arange(1, 60) * 1e-5, 0.2 + np.arange(1, 60) * 1e-5))


@cache
def case_problem(name: str) -> Problem:
    """A trace of the paper's protocol, seldom sampled, or one of pulses, in bursts."""
    torque, times = (STEPS, SLOW) if name == "slow" else (PULSES, FAST)
    network = MODEL.network(np.exp(TRUTH)[None])
    clean = simulated_rotation(CASE.gripper, network, torque, times, nonlinear=False)[0]
    noisy = clean + NOISE_RAD * np.random.default_rng(len(name)).standard_normal(len(times))
    rings_s = ringing_s(CASE.gripper)
    return problem_alone(
        CASE.gripper, MODEL, torque, times, noisy, ringing_s=rings_s, noise_rad=NOISE_RAD
    )


def from_truth(problem: Problem) -> Identification:
    return identify_from(problem, TRUTH)


def sensitivity(problem: Problem, drawn: int, before: Earlier | None = None) -> Earlier:
    ends = problem.low, problem.high
    rng = np.random.default_rng(3)
    return estimate_from_traces(problem, NOISE_RAD, from_truth, ends, drawn, rng, before)


def differenced(name: str, x: Array) -> Array:
    """Information by central differences of simulated rotations."""
    torque, times = (STEPS, SLOW) if name == "slow" else (PULSES, FAST)

    def rotation(logs: Array) -> Array:
        network = MODEL.network(np.exp(logs)[None])
        return simulated_rotation(CASE.gripper, network, torque, times, nonlinear=False)[0]

    step = 1e-4 * np.eye(len(x))
    slopes = np.array([(rotation(x + one) - rotation(x - one)) / 2e-4 for one in step])
    return slopes @ slopes.T / NOISE_RAD**2


def test_information_of_two_experiments_is_the_sum_of_both() -> None:
    """At the same parameters, which are not the truth; central differences err by 1e-8 of it."""
    x = TRUTH + np.array([0.1, -0.1, 0.2, 0.5])
    both = joint_problem([case_problem("slow"), case_problem("fast")], 2 * [NOISE_RAD])
    found = information_at(both, NOISE_RAD, x[None])[0]
    parts = [differenced(name, x) for name in ("slow", "fast")]
    size = np.sqrt(np.outer(*2 * [np.diag(found)]))
    np.testing.assert_allclose(found / size, sum(parts) / size, atol=1e-6)
    # Neither alone is all of it.
    for part in parts:
        assert np.any(np.diag(part) < 0.5 * np.diag(found))


def test_what_a_trace_tells_badly_is_anywhere_where_it_still_fits() -> None:
    """c_p need only be small: draws lie over decades of it, and none is excluded by the trace."""
    problem = case_problem("slow")
    found = sensitivity(problem, 60)
    logs = np.log(found.parameters)
    assert len(logs) > 20
    c_p = logs[:, MODEL.names.index("c_p")]
    assert np.ptp(c_p) > np.log(1e3)
    # The lower end of the search range is 1e-4, and a c_p of 100 N s/m fits no more.
    assert c_p.max() < np.log(100)
    misfit = problem.misfit(found.parameters)
    rise = len(SLOW) * (misfit**2 - found.misfit_rad**2) / NOISE_RAD**2
    # Chi-squared of four parameters: below 30 in all but one of 200 000.
    assert rise.max() < 30
    assert rise[1:].mean() == pytest.approx(4, abs=2)


def test_the_next_experiment_determines_what_the_first_does_not() -> None:
    first = sensitivity(case_problem("slow"), 8)
    both = joint_problem([case_problem("slow"), case_problem("fast")], 2 * [NOISE_RAD])
    second = sensitivity(both, 8, first)
    index = MODEL.names.index("c_p")
    before, after = (np.ptp(np.log(each.parameters[:, index])) for each in (first, second))
    assert before > np.log(100)
    assert after < np.log(3)
    assert np.exp(second.best - TRUTH)[index] == pytest.approx(1, rel=0.5)


def test_a_fit_starts_from_what_was_told_before() -> None:
    """An identifier that is lost alone is brought back by samples that were plausible before."""
    problem = joint_problem([case_problem("slow"), case_problem("fast")], 2 * [NOISE_RAD])
    right = sensitivity(problem, 4)
    lost = identify_from(problem, np.array([problem.low[0], *TRUTH[1:3], problem.high[3]]))
    assert lost.misfit_rad > 1.05 * right.misfit_rad
    ends = problem.low, problem.high
    rng = np.random.default_rng(0)
    alone = estimate_from_traces(problem, NOISE_RAD, lambda _: lost, ends, 2, rng)
    helped = estimate_from_traces(problem, NOISE_RAD, lambda _: lost, ends, 2, rng, right)
    assert alone.misfit_rad == lost.misfit_rad
    assert helped.misfit_rad == pytest.approx(right.misfit_rad, rel=1e-6)
