"""Branches are exchangeable; everywhere they are counted from the one that relaxes fastest."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.least_squares import FINE
from biogrip.fit.problem import METHODS, Fit, TraceProblem, identifier, silent
from biogrip.judging.constrained_fits import ConstrainedFits
from biogrip.judging.quantities import parameters_and_sum
from biogrip.physics.models import Sample
from biogrip.physics.sample_model import with_fixed
from tests.helpers.default import STUDY, study_of
from tests.helpers.problems import clean, likelihood_of, pose_noisy, rotation

TIMES = clean("endothelial_cell")[0]
TWO = Sample("generalized_maxwell", 2).model
# A fast and a slow branch, which the traces tell apart.
SAMPLE = {"k_1": 30.0, "k_2": 10.0, "k_p": 12.3, "c_1": 150.0, "c_2": 600.0, "c_p": 0.01}


def problems(count: int, level: float) -> list[TraceProblem]:
    response = rotation(TWO, [*SAMPLE.values()], TIMES, inertia=False)
    return pose_noisy(TIMES, response, count, TWO, level)


def identified(method: str, experiment: list[TraceProblem]) -> list[Fit]:
    rngs = [np.random.default_rng([seed, 3]) for seed in range(len(experiment))]
    settings = STUDY.config.method(method)
    return identifier(method, settings)(experiment, rngs, silent)


def assert_in_order(parameters: Array) -> None:
    springs, dampers = np.array(TWO.free_branches).T
    times = parameters[..., dampers] / parameters[..., springs]
    assert np.all(np.diff(times, axis=-1) >= 0)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.nightly
def test_every_method_counts_branches_as_they_relax(method: str) -> None:
    """Of a population some half would come out the other way round."""
    for answer in identified(method, problems(4, 1e-3)):
        assert_in_order(answer.parameters)
        assert_in_order(answer.history.best_parameters)


def test_names_change_nothing_else() -> None:
    """The responses of an answer and of its branches in any order are the same."""
    (problem,) = problems(1, 1e-3)
    rng = np.random.default_rng(5)
    drawn = np.exp(rng.uniform(problem.low, problem.high, (200, 6)))
    ordered = np.take_along_axis(drawn, TWO.in_order(drawn), axis=1)
    assert_in_order(ordered)
    misfit = problem.residuals.misfit
    np.testing.assert_allclose(misfit(ordered), misfit(drawn), rtol=1e-9)


def test_a_branch_that_is_partly_known_keeps_its_name() -> None:
    model = with_fixed(TWO, {"k_1": 10.0})
    slow_first = np.array([[30.0, 12.3, 600.0, 20.0, 0.01]])
    assert model.free_branches == ((0, 3),)
    np.testing.assert_array_equal(model.in_order(slow_first), np.arange(5)[None])


def test_another_name_of_the_optimum_is_none_of_its_neighbours() -> None:
    """With names free, the fit with a branch at the value of the other is as good as the best."""
    (problem,) = problems(1, 3e-3)
    fits = ConstrainedFits([likelihood_of(problem)], parameters_and_sum(TWO))
    swapped = fits.best[:1, [1, 0, 2, 4, 3, 5]]
    for which in (0, 1, 3, 4):
        increases, _ = fits.at(np.array([which]), swapped[:, which], swapped, FINE)
        assert np.all(increases > 10)


def test_the_truth_is_counted_in_the_same_order() -> None:
    study = study_of("""
cases:
  two: {sample: {model: generalized_maxwell, branches: 2,
                 k_1: 10, k_2: 30, k_p: 12.3, c_1: 600, c_2: 150, c_p: 0.01}}
  known: {sample: {model: generalized_maxwell, branches: 2,
                   k_1: 10, k_2: 30, k_p: 12.3, c_1: 600, c_2: 150, c_p: 0.01}, fixed: {k_1: 10}}
""")
    assert study.cases["two"].parameters == SAMPLE
    assert study.cases["known"].parameters["k_1"] == 10
