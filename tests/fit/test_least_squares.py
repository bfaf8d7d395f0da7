"""Which fits are continued and have converged; steps of a descent; the order of branches."""

from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit import least_squares, levenberg_marquardt
from biogrip.fit.least_squares import FINE
from biogrip.fit.levenberg_marquardt import Minima, Normal, minimize
from biogrip.fit.problem import METHODS, Fit, TraceProblem, identifier, silent
from biogrip.judging.constrained_fits import ConstrainedFits
from biogrip.judging.quantities import parameters_and_sum
from biogrip.physics.models import Sample
from biogrip.physics.sample_model import with_fixed
from tests.helpers.default import STUDY, seen, study_of
from tests.helpers.problems import (
    MODEL,
    clean,
    likelihood_of,
    pose_noisy,
    posed_for,
    problem,
    rotation,
)


def test_four_rough_fits_are_continued() -> None:
    """Of six basins that with the fourth best of the rough fits is the deepest."""
    fine = np.array([3.0, 3.0, 3.0, 1.0, 0.5, 3.0])

    def fitted(starts: Array, trace: IntArray, tolerance: float = 0.0) -> Minima:
        basins = starts[:, 0].astype(int)
        misfit = starts[:, 0] + 4 if tolerance == least_squares.ROUGH else fine[basins]
        return Minima(starts, misfit, np.ones_like(trace), np.ones(len(trace), dtype=bool))

    fits: Any = seen(fitted=fitted)
    starts = np.array([[5.0], [3.0], [1.0], [0.0], [4.0], [2.0]])
    _, _, finished, trace = least_squares._finished(fits, [starts])
    assert sorted(finished.x[:, 0]) == [0.0, 1.0, 2.0, 3.0]
    assert finished.misfit.min() == 1.0
    assert trace.tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize(("rise", "converged"), [(1e-4, True), (0.1, False)])
def test_a_fit_that_stops_short_has_converged_if_no_data_tell(
    rise: float, converged: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After one step from where chi^2 is by so much higher; limits are where it is by 4."""
    posed, one = problem("endothelial_cell", 0), np.zeros(1, dtype=np.int64)
    best = least_squares.fit_from([posed], np.log([35.0, 12.3, 299.9, 1e-3])).x
    fits = least_squares.LocalFits([posed])
    curvature = fits.normal(best, one, curved=True).information[0, 0, 0]
    start = best + np.sqrt(rise / curvature) * np.eye(4)[:1]
    short = Minima(start, np.full(1, np.inf), one, np.ones(1, dtype=bool))
    monkeypatch.setattr(least_squares, "minimize", lambda *_: short)
    monkeypatch.setattr(least_squares, "_MOST_STEPS", 1)
    assert least_squares.refine_optima(fits, short, one).converged == [converged]


@pytest.mark.parametrize(
    ("x", "gradient", "held"),
    [(-1.0, 1.0, True), (-1.0, -1.0, False), (1.0, -1.0, True), (1.0, 1.0, False), (0, 1.0, False)],
)
def test_what_is_pushed_to_a_bound_has_no_curvature(x: float, gradient: float, held: bool) -> None:
    """Bounds are -1 and 1; a gradient is uphill."""
    whole, without = [[2.0, 1.0], [1.0, 2.0]], [[1.0, 0.0], [0.0, 2.0]]
    normal = Normal(np.ones(1), np.array([[gradient, 0.5]]), np.array([whole]), np.ones(1))
    bounds = {"low": np.full((1, 2), -1.0), "high": np.full((1, 2), 1.0)}
    fits: Any = seen(normal=lambda x, trace, curved: normal, **bounds)
    found = least_squares._convex(fits, np.array([[x, 0.0]]), np.zeros(1, dtype=np.int64))
    assert found.information[0].tolist() == (without if held else whole)


def test_beside_a_parameter_at_its_bound_the_others_reach_their_optimum() -> None:
    """From wherever they start, in a trace that is only rounded and whose k_p is below the range.

    Of it c has a standard deviation of 2e-4, and c_p none that is worth the name: what stops short
    differs, and differs between processors, in digits that are written.
    """
    times, response = clean("liquid_drop_2", 0.5)
    posed = posed_for(MODEL, times, np.round(response, 8))
    starts = [[1.0, 1e-4, 10.0, 1e-3], [0.98, 3e-4, 9.8, 0.2], [0.9, 1e-3, 9.0, 0.9]]
    first, *others = (
        least_squares.identify_from(posed, np.log(start)).parameters for start in starts
    )
    assert np.log(first[1]) == posed.low[1]
    for other in others:
        np.testing.assert_allclose(other, first, rtol=1e-7)


SLOPES = np.array([[3.0, 1.0], [1.0, 2.0], [0.0, 1.0]])


def linear(x: Array, _: IntArray) -> Normal:
    """Of three residuals that are linear in two parameters, zero at 0.5 and -0.25."""
    residuals = (x - [0.5, -0.25]) @ SLOPES.T
    square_sum = np.sum(residuals**2, axis=1)
    information = np.repeat((SLOPES.T @ SLOPES)[None], len(x), axis=0)
    return Normal(square_sum, residuals @ SLOPES, information, np.sqrt(square_sum / 3))


def test_of_linear_residuals_the_decrease_is_as_predicted(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the grid on which points lie, a thousandth of a standard deviation."""
    told: list[tuple[float, float]] = []
    damp = levenberg_marquardt._damp

    def damped(state: object, gained: Array, predicted: Array) -> None:
        told.append((gained[0], predicted[0]))
        damp(state, gained, predicted)  # type: ignore[arg-type]

    monkeypatch.setattr(levenberg_marquardt, "_damp", damped)
    bounds = np.full((1, 2), -2.0), np.full((1, 2), 2.0)
    found = minimize(linear, np.array([[-1.0, 1.0]]), *bounds, 1e-8)
    assert found.x[0] == pytest.approx([0.5, -0.25], abs=1e-3)
    assert told[0][0] == pytest.approx(told[0][1], rel=1e-2)
    assert told[0][0] > 10


class UpTo:
    """A constraint that no point fulfils beyond a value of the first parameter."""

    def eliminated(self, normal: Normal, x: Array, problem: IntArray) -> tuple[Normal, BoolArray]:
        return normal, np.zeros(x.shape, dtype=bool)

    def restored(self, x: Array, problem: IntArray, eliminated: BoolArray) -> Array:
        return np.where(x[:, :1] > 0.4, np.nan, x)


def test_a_step_that_is_impossible_is_shortened() -> None:
    bounds = np.full((1, 2), -2.0), np.full((1, 2), 2.0)
    found = minimize(linear, np.array([[-1.0, 1.0]]), *bounds, 1e-8, UpTo())  # type: ignore[arg-type]
    assert 0.3 < found.x[0, 0] <= 0.4


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
