"""All identifiers on the same problems, and which runs end near the noise."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from biogrip.arrays import Array
from biogrip.fit import multi_start
from biogrip.fit.methods import (
    ALL,
    METHODS,
    basins,
    identifier,
    near_noise,
    near_noise_words,
)
from biogrip.fit.multi_start import refine_optima
from biogrip.physics.noise import rms
from biogrip.physics.residuals import Residuals
from tests.helpers.default import STUDY
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    SAMPLES,
    TORQUE,
    clean,
    posed_for,
    problem,
    problem_alone,
    run,
)
from tests.helpers.scipy_fits import scipy_fit

EXACT = [name for name, method in METHODS.items() if method.exact]
SURE = [name for name, method in METHODS.items() if method.sure]


@pytest.mark.parametrize("method", METHODS)
def test_an_answer_is_what_it_says(method: str) -> None:
    case_problem = problem("liquid_drop_2", 0)
    told: list[tuple[int, float]] = []
    identify = identifier(method, STUDY.config.method(method))
    rng = np.random.default_rng(0)
    (answer,) = identify([case_problem], [rng], lambda n, misfit: told.append((n, misfit)))
    history = answer.history
    assert case_problem.misfit(answer.parameters[None])[0] == pytest.approx(
        answer.misfit_rad, rel=1e-6
    )
    assert len(history.best_misfit) == answer.generations + 1
    np.testing.assert_array_equal(history.best_parameters[-1], answer.parameters)
    assert np.all(np.diff(history.best_misfit) <= 1e-7 * answer.misfit_rad)
    assert np.all(np.diff(history.evaluations) >= 0)
    assert history.evaluations[-1] == answer.evaluations
    assert np.all(np.log(answer.parameters) >= case_problem.low - 1e-9)
    assert np.all(np.log(answer.parameters) <= case_problem.high + 1e-9)
    assert told
    assert told[-1][0] <= answer.evaluations
    again = run(method, case_problem)
    np.testing.assert_array_equal(again.parameters, answer.parameters)


@pytest.mark.parametrize("method", METHODS)
def test_evaluations_are_counted(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """All but those that settle an optimum: their number depends on the processor."""
    posed, counted = problem("liquid_drop_2", 1), [0]

    def settled_silently(*given: Any) -> Any:
        before = counted[0]
        found = refine_optima(*given)
        counted[0] = before
        return found

    def misfit(parameters: Array) -> Array:
        counted[0] += len(parameters)
        return posed.misfit(parameters)

    def at_one(residuals: Residuals, x: Array) -> tuple[Array, Array]:
        counted[0] += 1
        return of_one(residuals, x)

    def at_many(residuals: Residuals, x: Array, *, slopes: bool = True) -> Array:
        counted[0] += len(x)
        return of_many(residuals, x, slopes=slopes)

    of_one, of_many = Residuals.__call__, Residuals.condensed_responses
    monkeypatch.setattr(multi_start, "refine_optima", settled_silently)
    monkeypatch.setattr(Residuals, "__call__", at_one)
    monkeypatch.setattr(Residuals, "condensed_responses", at_many)
    assert run(method, replace(posed, misfit=misfit)).evaluations == counted[0]


@pytest.mark.parametrize("case", SAMPLES)
def test_what_is_sure_of_it_reaches_the_global_optimum(case: str) -> None:
    """Against the best of both and SciPy's fit from the truth, at the study's sampling.

    In 100 seeds of each case neither missed once.
    """
    for seed in range(4):
        case_problem = problem(case, seed, rate_Hz=10.0)
        truth = np.log([SAMPLES[case][name] for name in MODEL.names])
        found = [run(method, case_problem, seed).misfit_rad for method in SURE]
        best = min(*found, scipy_fit(case_problem, truth).misfit_rad)
        increases = case_problem.residuals.samples * ((np.array(found) / best) ** 2 - 1)
        assert np.all(increases < 1)


@pytest.mark.parametrize("method", EXACT)
def test_a_trace_without_noise_gives_the_truth_back(method: str) -> None:
    case_problem = problem("endothelial_cell", 0, level=0.0)
    answer = run(method, case_problem)
    k, k_p, c, _ = (SAMPLES["endothelial_cell"][name] for name in MODEL.names)
    # Any c_p below some N s/m makes a mode that dies out within 0.1 s, before the second
    # sample; the other parameters make up for it exactly, by up to 1 %.
    np.testing.assert_allclose(answer.parameters[:3], [k, k_p, c], rtol=1e-2)
    assert answer.parameters[1] == pytest.approx(k_p, rel=1e-5)
    assert answer.misfit_rad < 1e-7 * np.abs(clean("endothelial_cell")[1]).max()


def test_what_a_trace_says_nothing_of_ends_in_the_middle_of_its_range() -> None:
    """A liquid's damper dominates: the range of k_p that fits is flat, and the prior decides."""
    case_problem = problem("endothelial_cell", 2)
    answer = run("least_squares", case_problem)
    c_p = np.log(answer.parameters[3])
    assert case_problem.low[3] + 3 < c_p < case_problem.high[3] - 3


def test_offset_and_drift_are_fitted_along() -> None:
    times, response = clean("liquid_drop_2")
    noise = 1e-5 * np.random.default_rng(0).standard_normal(len(times))
    trace = response + 2e-3 - 4e-6 * times + noise
    case_problem = problem_alone(GRIPPER, MODEL, TORQUE, times, trace, offset=True, drift=True)
    without = run("least_squares", posed_for(MODEL, times, trace)).misfit_rad
    assert without > 10 * rms(noise)
    for method in EXACT:
        answer = run(method, case_problem)
        assert answer.misfit_rad < 1.1 * rms(noise)
        k, _, c, c_p = answer.parameters
        assert k == pytest.approx(1.0, rel=0.05)
        assert c + c_p == pytest.approx(10.0, rel=0.03)


def found(misfit: list[float], noise: list[float | None]) -> pd.DataFrame:
    runs = pd.DataFrame({"seed": range(len(misfit)), "misfit": misfit, "noise_rms": noise})
    return runs.astype({"noise_rms": float})


def test_two_basins_have_a_tenth_of_the_runs_each() -> None:
    """And none is told where the noise is unknown, or absent."""
    one = basins(found([1.05, 1.01, *[1.2] * 18], [1.0, 1.0, *[1.19] * 18]), 0.02)
    assert {name: len(runs) for name, runs in one.items()} == {ALL: 20}
    two = basins(found([1.05, 1.06, *[1.2] * 18], [1.0, 1.0, *[1.19] * 18]), 0.02)
    assert two["above the noise"]["seed"].tolist() == [0, 1]
    assert two["near the noise"]["seed"].tolist() == list(range(2, 20))
    for noise in (None, 0.0):
        assert list(basins(found([3.0, 1.0], [noise, noise]), 0.02)) == [ALL]


def test_near_the_noise_is_a_share_of_it() -> None:
    runs = found([1.019, 1.021, 2.03, 1.0], [1.0, 1.0, 2.0, None])
    np.testing.assert_array_equal(near_noise(runs, 0.02), [True, False, True, False])
    assert near_noise_words(0.025) == "within 2.5 % of the noise"
