"""All identifiers on the same problems, and many fits at once, none of which depends on others."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit import genetic, least_squares
from biogrip.fit.least_squares import PRIOR_WIDTH, ROUGH, LocalFits
from biogrip.fit.problem import METHODS, TraceProblem, identifier, silent
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.residuals import Residuals
from biogrip.physics.sample_model import SampleModel
from tests.helpers.default import STUDY
from tests.helpers.problems import (
    MODEL,
    SAMPLES,
    clean,
    pose_noisy,
    posed_for,
    problem,
    rotation,
    run,
)
from tests.helpers.responses import LOG_RANGES
from tests.helpers.scipy_fits import scipy_fit

SURE = [name for name, method in METHODS.items() if method.sure]


@pytest.mark.parametrize("method", METHODS)
def test_an_answer_is_what_it_says(method: str) -> None:
    experiment = problem("liquid_drop_2", 0)
    told: list[tuple[int, float]] = []
    identify = identifier(method, STUDY.config.method(method))
    rng = np.random.default_rng(0)
    (answer,) = identify([experiment], [rng], lambda n, misfit: told.append((n, misfit)))
    history, logs = answer.history, np.log(answer.parameters)
    (misfit,) = experiment.residuals.misfit(answer.parameters[None])
    assert misfit == pytest.approx(answer.misfit, rel=1e-6)
    assert len(history.best_misfit) == answer.generations + 1
    np.testing.assert_array_equal(history.best_parameters[-1], answer.parameters)
    assert np.all(np.diff(history.best_misfit) <= 1e-7 * answer.misfit)
    assert np.all(np.diff(history.evaluations) >= 0)
    assert history.evaluations[-1] == answer.evaluations
    assert np.all((logs >= experiment.low - 1e-9) & (logs <= experiment.high + 1e-9))
    assert told[-1][0] <= answer.evaluations
    np.testing.assert_array_equal(run(method, experiment).parameters, answer.parameters)


@pytest.mark.parametrize("method", METHODS)
def test_evaluations_are_counted(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A derivative is a response; not counted is what settles an optimum, by the processor."""
    posed, counted = problem("liquid_drop_2", 1), [0]

    def settled_silently(*given: Any) -> Any:
        before = counted[0]
        found = refine(*given)
        counted[0] = before
        return found

    def at_one(residuals: Residuals, x: Array) -> tuple[Array, Array]:
        counted[0] += 1
        return of_one(residuals, x)

    def at_many(residuals: Residuals, x: Array, *, slopes: bool = True) -> Array:
        counted[0] += len(x) * (1 + slopes * x.shape[1])
        return of_many(residuals, x, slopes=slopes)

    of_one, of_many = Residuals.__call__, Residuals.condensed_responses
    refine = least_squares.refine_optima
    monkeypatch.setattr(least_squares, "refine_optima", settled_silently)
    monkeypatch.setattr(genetic, "make_misfit", lambda residuals: residuals.misfit)
    monkeypatch.setattr(Residuals, "__call__", at_one)
    monkeypatch.setattr(Residuals, "condensed_responses", at_many)
    assert run(method, posed).evaluations == counted[0]


@pytest.mark.parametrize("case", SAMPLES)
def test_what_is_sure_of_it_reaches_the_global_optimum(case: str) -> None:
    """Against the best of both and SciPy's fit from the truth, at the study's sampling.

    In 100 seeds of each case neither missed once.
    """
    for seed in range(2):
        experiment = problem(case, seed, rate_Hz=10.0)
        truth = np.log([SAMPLES[case][name] for name in MODEL.names])
        found = [run(method, experiment, seed).misfit for method in SURE]
        best = min(*found, scipy_fit(experiment, truth))
        increases = experiment.residuals.samples * ((np.array(found) / best) ** 2 - 1)
        assert np.all(increases < 1)


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
    few = least_squares.LeastSquaresSettings(5, 2)

    def rngs() -> list[np.random.Generator]:
        return [np.random.default_rng(seed) for seed in range(len(problems))]

    together = least_squares.identify_many(problems, few, rngs())
    for each, rng, answer in zip(problems, rngs(), together, strict=True):
        (alone,) = least_squares.identify_many([each], few, [rng])
        histories = zip(vars(answer.history).values(), vars(alone.history).values(), strict=True)
        assert all(np.array_equal(one, other) for one, other in histories)


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
def test_curvatures_are_those_of_what_is_minimized(model: SampleModel) -> None:
    """All second derivatives, against differences of gradients on all samples; away from optima."""
    for posed, sample in noisy(model, 6):
        x = sample + 0.3
        found = LocalFits([posed]).normal(x[None], np.zeros(1, dtype=np.int64), curved=True)
        atol = 1e-8 * np.abs(found.gradient).max()
        np.testing.assert_allclose(found.gradient[0], gradient(posed, x), rtol=1e-6, atol=atol)
        units = 1e-4 * np.eye(len(x))
        second = [(gradient(posed, x + u) - gradient(posed, x - u)) / 2e-4 for u in units]
        # Of what the trace says nothing of, nearly all is rounding.
        allowed = 1e-6 * np.abs(second).max() + 1e-8
        np.testing.assert_allclose(found.information[0], second, rtol=0, atol=allowed)


def test_the_optimum_is_settled_to_the_last_digits() -> None:
    """Where the gradient on all samples vanishes, from wherever one comes."""
    experiment = problem("endothelial_cell", 3)
    best = np.log(run("least_squares", experiment).parameters)
    starts = best + 0.01 * np.random.default_rng(0).standard_normal((4, 4))
    ends = [least_squares.fit_from([experiment], start).x[0] for start in starts]
    assert np.max(np.ptp(ends, axis=0)) < 1e-9
    assert np.max(np.abs(gradient(experiment, ends[0]))) < 1e-6
