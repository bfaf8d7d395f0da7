"""All identifiers on the same problems; many fits at once, as if each were alone; descents."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit import least_squares
from biogrip.fit.least_squares import FINE, PRIOR_WIDTH, ROUGH, LocalFits, Minima, Normal, minimize
from biogrip.fit.problem import TraceProblem, silent
from biogrip.judging.constrained_fits import ConstrainedFits
from biogrip.judging.likelihood import parameters_and_sum
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.residuals import Residuals
from biogrip.physics.sample_model import SampleModel, with_fixed
from biogrip_study.methods import misfit
from biogrip_study.methods.genetic import GeneticSettings
from biogrip_study.methods.registry import METHODS, identify_by
from tests.helpers.default import STUDY, seen, study_of
from tests.helpers.problems import (
    MODEL,
    SAMPLES,
    clean,
    likelihood_of,
    pose_noisy,
    posed_for,
    problem,
    rotation,
    run,
)
from tests.helpers.responses import LOG_RANGES
from tests.helpers.scipy_fits import scipy_fit


@pytest.mark.parametrize("method", METHODS)
def test_an_answer_is_what_it_says(method: str) -> None:
    experiment = problem("liquid_drop_2", 0)
    told: list[float] = []
    settings, rng = STUDY.config.method(method), np.random.default_rng(0)
    (answer,) = identify_by(method, settings, [experiment], [rng], told.append)
    history, logs = answer.history, np.log(answer.parameters)
    (misfit,) = experiment.residuals.misfit(answer.parameters[None])
    assert misfit == pytest.approx(answer.misfit, rel=1e-6)
    assert len(history.best_misfit) == answer.generations + 1
    np.testing.assert_array_equal(history.best_parameters[-1], answer.parameters)
    assert np.all(np.diff(history.best_misfit) <= 1e-7 * answer.misfit)
    assert np.all(np.diff(history.evaluations) >= 0)
    assert history.evaluations[-1] == answer.evaluations
    assert np.all((logs >= experiment.low - 1e-9) & (logs <= experiment.high + 1e-9))
    assert told == sorted(told)
    assert 0 < told[-1] <= 1
    np.testing.assert_array_equal(run(method, experiment).parameters, answer.parameters)


@pytest.mark.parametrize("method", METHODS)
def test_evaluations_are_counted(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A derivative is a response."""
    posed, counted = problem("liquid_drop_2", 1), [0]

    def at_one(residuals: Residuals, x: Array) -> tuple[Array, Array]:
        counted[0] += 1
        return of_one(residuals, x)

    def at_many(residuals: Residuals, x: Array, *, slopes: bool = True) -> Array:
        counted[0] += len(x) * (1 + slopes * x.shape[1])
        return of_many(residuals, x, slopes=slopes)

    of_one, of_many = Residuals.__call__, Residuals.condensed_responses
    monkeypatch.setattr(misfit, "series_of", lambda residuals: None)
    monkeypatch.setattr(Residuals, "__call__", at_one)
    monkeypatch.setattr(Residuals, "condensed_responses", at_many)
    assert run(method, posed).evaluations == counted[0]


@pytest.mark.parametrize("case", SAMPLES)
def test_least_squares_reach_the_global_optimum(case: str) -> None:
    """Against SciPy's fit from the truth, at the study's sampling: in 100 seeds none missed."""
    for seed in range(2):
        experiment = problem(case, seed, rate_Hz=10.0)
        truth = np.log([SAMPLES[case][name] for name in MODEL.names])
        misfit = run("least_squares", experiment, seed).misfit
        best = min(misfit, scipy_fit(experiment, truth))
        assert experiment.residuals.samples * ((misfit / best) ** 2 - 1) < 1


def test_a_history_is_of_the_fits_so_far() -> None:
    """Their lowest and their median misfit."""
    posed = problem("liquid_drop_2", 0)
    starts = np.random.default_rng(11).uniform(posed.low, posed.high, (6, 4))
    fitted = LocalFits([posed]).fitted(starts, np.zeros(6, dtype=np.int64), ROUGH)
    row = np.exp(starts[0]), 1.0, 1.0, 10
    history = least_squares.best_of_starts([posed], [starts], [row], silent)[0].history
    for count in range(1, 6):
        so_far = fitted.misfit[:count]
        # In single precision, in which fits are compared.
        assert history.best_misfit[count] == pytest.approx(so_far.min(), rel=1e-7)
        assert history.median_misfit[count] == pytest.approx(np.median(so_far), rel=1e-12)
        assert history.evaluations[count] == 10 + 5 * fitted.evaluations[:count].sum()


FOUR = Sample("generalized_maxwell", 4).model
# Of these a trace tells not all parameters.
LOOSE = {FOUR: [*np.ones(5), *np.geomspace(3.0, 3e3, 4), 0.1], MODEL: MODEL.example}


@pytest.mark.parametrize("model", [*MODELS.values(), FOUR], ids=[*MODELS, "four branches"])
def test_a_trace_without_noise_gives_every_model_back(model: SampleModel) -> None:
    truth, times = np.array(LOOSE.get(model, model.example)), clean("endothelial_cell")[0]
    response = rotation(model, truth, times, inertia=False)
    near = np.log(truth) + 0.1 * np.random.default_rng(1).normal(size=(5, len(truth)))
    found = LocalFits([posed_for(model, times, response)]).fitted(near, np.zeros(5, dtype=int))
    assert np.min(found.misfit) < 1e-6 * np.abs(response).max()
    if model not in LOOSE:
        best = found.x[np.argmin(found.misfit)]
        np.testing.assert_allclose(best, np.log(truth), rtol=0, atol=1e-3)


def test_answers_do_not_depend_on_the_batch_byte_for_byte() -> None:
    """Fits share responses: of one model, at the same times; search ranges may differ."""
    times, response = clean("liquid_drop_2")
    linear = pose_noisy(times, response, 4)
    (offset,) = pose_noisy(times, response, 1, offset=True)
    (sparse,) = pose_noisy(times[::2], response[::2], 1)
    narrow = replace(linear[2], low=linear[2].low + 1)
    simple = posed_for(MODELS["liquid_drop"], times, response)
    problems = [linear[0], linear[1], sparse, offset, narrow, linear[3], simple]
    groups = least_squares.alike(problems)
    assert [group.tolist() for group in groups] == [[0, 1, 4, 5], [2], [3], [6]]
    assert least_squares.alike([]) == []
    rngs = [[np.random.default_rng(seed) for seed in range(7)] for _ in range(2)]
    few = least_squares.LeastSquaresSettings(5, 2)
    together = least_squares.identify_many(problems, few, rngs[0])
    for each, rng, answer in zip(problems, rngs[1], together, strict=True):
        (alone,) = least_squares.identify_many([each], few, [rng])
        for name, own in vars(answer.history).items():
            np.testing.assert_array_equal(own, getattr(alone.history, name))


MODELS_SETTLED = [MODELS["burgers"], MODELS["zener_kelvin"], Sample("generalized_maxwell", 2).model]
TIMES = np.linspace(0.0, 400.0, 201)


def noisy(model: SampleModel, count: int) -> list[tuple[TraceProblem, Array]]:
    """Traces of samples from the middle of the search range, with some noise."""
    low, high = np.array([LOG_RANGES[each.kind] for each in model.parameters]).T
    rng = np.random.default_rng(len(low))
    problems = []
    for _ in range(count):
        sample = 0.5 * (low + high) + 0.25 * rng.uniform(-1, 1, len(low)) * (high - low)
        trace = rotation(model, np.exp(sample), TIMES, inertia=False)
        noise_sd = 10 ** rng.uniform(-3, -1) * np.abs(trace).max()
        trace = trace + noise_sd * rng.normal(size=len(TIMES))
        problems.append((posed_for(model, TIMES, trace), sample))
    return problems


def gradient(posed: TraceProblem, x: Array) -> Array:
    """Half of that of what is minimized, on all samples."""
    residual, slopes = posed.residuals(x)
    away = (x - 0.5 * (posed.low + posed.high)) / PRIOR_WIDTH**2
    return slopes @ residual / posed.residuals.noise_scale**2 + away


@pytest.mark.parametrize("model", MODELS_SETTLED)
def test_gradients_are_those_of_what_is_minimized(model: SampleModel) -> None:
    """On condensed rows as on all samples; away from optima."""
    for posed, sample in noisy(model, 6):
        x = sample + 0.3
        normal = LocalFits([posed]).normal(x[None], np.zeros(1, dtype=np.int64))
        atol = 1e-8 * np.abs(normal.gradient).max()
        np.testing.assert_allclose(normal.gradient[0], gradient(posed, x), rtol=1e-6, atol=atol)


def test_an_optimum_is_the_same_from_wherever_one_comes() -> None:
    """In some thousandths of a standard deviation, on whose grid points lie."""
    posed = problem("endothelial_cell", 3)
    best = np.log(run("least_squares", posed).parameters)
    starts = best + 0.01 * np.random.default_rng(0).standard_normal((4, 4))
    ends = np.array([least_squares.fit_from([posed], start).x[0] for start in starts])
    information = LocalFits([posed]).normal(ends[:1], np.zeros(1, dtype=np.int64)).information[0]
    apart = ends - ends.mean(axis=0)
    assert np.all(np.einsum("ni,ij,nj->n", apart, information, apart) < 0.01**2)
    uphill = gradient(posed, ends[0])
    assert uphill @ np.linalg.solve(information, uphill) < 0.01**2


def moved_last_bits(function: Any) -> Any:
    """A function whose results differ by one in the last bit, up or down, as on a processor."""

    def on_another(x: Any, **options: Any) -> Any:
        exact = np.asarray(function(x, **options))
        if exact.dtype != np.float64:
            return exact
        up = np.ascontiguousarray(exact).view(np.int64).reshape(exact.shape) % 3 - 1
        return np.where(np.isfinite(exact), exact * (1 + up * 2.0**-52), exact)

    return on_another


@pytest.mark.parametrize("model", MODELS_SETTLED)
def test_last_bits_of_a_processor_change_no_digit(
    model: SampleModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what a trace determines or not: nine digits of optima are the same."""
    posed = [noisy_trace for noisy_trace, _ in noisy(model, 3)]
    budget = least_squares.LeastSquaresSettings(100, 4)

    def fitted() -> list[str]:
        rngs = [np.random.default_rng(seed) for seed in range(3)]
        fits = least_squares.identify_many(posed, budget, rngs)
        return [f"{n:.8e}" for fit in fits for n in (*fit.parameters, fit.misfit)]

    here = fitted()
    for name in ("exp", "expm1", "log1p"):
        monkeypatch.setattr(np, name, moved_last_bits(getattr(np, name)))
    assert np.exp(np.arange(9.0)).tolist() != [math.exp(n) for n in range(9)]
    assert fitted() == here


def test_four_rough_fits_are_continued(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of six basins that with the fourth best of the rough fits is the deepest."""
    fine = np.array([3.0, 3.0, 3.0, 1.0, 0.5, 3.0])

    def fitted(starts: Array, trace: IntArray, tolerance: float = 0.0) -> Minima:
        basins = starts[:, 0].astype(int)
        misfit = starts[:, 0] + 4 if tolerance == least_squares.ROUGH else fine[basins]
        return Minima(starts, misfit, np.ones_like(trace), np.ones(len(trace), dtype=bool))

    fits: Any = seen(fitted=fitted, in_order=lambda minima: minima)
    monkeypatch.setattr(least_squares, "LocalFits", lambda _: fits)
    monkeypatch.setattr(least_squares, "alike", lambda _: [np.array([0])])
    starts = np.array([[5.0], [3.0], [1.0], [0.0], [4.0], [2.0]])
    before = starts[0], 9.0, 9.0, 0
    (fit,) = least_squares.best_of_starts([seen()], [starts], [before], silent)
    assert (fit.parameters, fit.misfit) == (np.exp(3.0), 1.0)
    # A response and a derivative of each.
    assert fit.evaluations == 2 * 6 + 2 * 4


SLOPES = np.array([[3.0, 1.0], [1.0, 2.0], [0.0, 1.0]])
# A start, bounds, and a tolerance.
GIVEN = np.array([[-1.0, 1.0]]), np.full((1, 2), -2.0), np.full((1, 2), 2.0), 1e-8


def linear(x: Array, _: IntArray) -> Normal:
    """Of three residuals that are linear in two parameters, zero at 0.5 and -0.25."""
    residuals = (x - [0.5, -0.25]) @ SLOPES.T
    square_sum = np.sum(residuals**2, axis=1)
    information = np.repeat((SLOPES.T @ SLOPES)[None], len(x), axis=0)
    return Normal(square_sum, residuals @ SLOPES, information, np.sqrt(square_sum / 3))


def test_of_linear_residuals_the_decrease_is_as_predicted(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the grid on which points lie, a thousandth of a standard deviation."""
    told: list[tuple[float, float]] = []
    damp = least_squares._damp

    def damped(state: object, gained: Array, predicted: Array) -> None:
        told.append((gained[0], predicted[0]))
        damp(state, gained, predicted)  # type: ignore[arg-type]

    monkeypatch.setattr(least_squares, "_damp", damped)
    found = minimize(linear, *GIVEN)
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
    found = minimize(linear, *GIVEN, UpTo())  # type: ignore[arg-type]
    assert 0.3 < found.x[0, 0] <= 0.4


READ_S = clean("endothelial_cell")[0]
TWO = Sample("generalized_maxwell", 2).model
# A fast and a slow branch, which the traces tell apart.
SAMPLE = {"k_1": 30.0, "k_2": 10.0, "k_p": 12.3, "c_1": 150.0, "c_2": 600.0, "c_p": 0.01}


def problems(count: int, level: float) -> list[TraceProblem]:
    response = rotation(TWO, [*SAMPLE.values()], READ_S, inertia=False)
    return pose_noisy(READ_S, response, count, TWO, level)


def assert_in_order(parameters: Array) -> None:
    springs, dampers = np.array(TWO.free_branches).T
    times = parameters[..., dampers] / parameters[..., springs]
    assert np.all(np.diff(times, axis=-1) >= 0)


def test_a_method_counts_branches_as_they_relax() -> None:
    """This population would come out the other way round."""
    settings = GeneticSettings(60, 30, "pairs", "once", 1, 0.5, 1, 4, 6, 12)
    rngs = [np.random.default_rng(0)]
    (answer,) = identify_by("genetic", settings, problems(1, 1e-3), rngs, silent)
    assert_in_order(answer.parameters)
    assert_in_order(answer.history.best_parameters)


def test_a_branch_that_is_partly_known_keeps_its_name() -> None:
    model, slow_first = with_fixed(TWO, {"k_1": 10.0}), [[30.0, 12.3, 600.0, 20.0, 0.01]]
    assert model.free_branches == ((0, 3),)
    np.testing.assert_array_equal(model.in_order(np.array(slow_first)), [[*range(5)]])
    drawn = np.random.default_rng(5).lognormal(0.0, 3.0, (200, 6))
    assert_in_order(np.take_along_axis(drawn, TWO.in_order(drawn), axis=1))


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
