"""Many fits at once: as good as SciPy's one by one, and none depends on the others."""

import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.experiment.sample import MODELS, model_named
from biogrip.identify import genetic_refined, least_squares, settling
from biogrip.identify.answer import Identification
from biogrip.identify.levenberg_marquardt import Normal, bounded_step
from biogrip.identify.local_fit import FINE, ROUGH, local_fit
from biogrip.identify.many_fits import ManyFits, fit_together
from biogrip.identify.multi_start import screened
from biogrip.identify.problem import Problem
from biogrip.identify.settling import settled
from biogrip.response.linear import rotation, step_response
from tests.helpers.default import STUDY
from tests.helpers.places import ROOT
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    SAMPLES,
    SETTINGS,
    TORQUE,
    clean,
    identified,
    of_case,
    posed,
)
from tests.helpers.responses import MODEL_PARAMETERS


def starts_of(problem: Problem, count: int) -> Array:
    rng = np.random.default_rng(11)
    found: Array = rng.uniform(problem.low, problem.high, (count, len(problem.low)))
    return found


@pytest.mark.parametrize("case", SAMPLES)
def test_the_best_of_the_study_s_starts_is_that_of_scipy(case: str) -> None:
    """And not much fewer of them lead there; in 600 traces of each case none did in none."""
    (problem,) = of_case(case, 1)
    starts = screened(problem.misfit, starts_of(problem, SETTINGS.candidates))[0][: SETTINGS.starts]
    trace = np.zeros(len(starts), dtype=np.int64)
    many = ManyFits([problem]).fitted(starts, trace, ROUGH).misfit_rad
    one = np.array([local_fit(problem, start, ROUGH).misfit_rad for start in starts])
    rises = problem.residuals.samples * ((np.stack((many, one)) / one.min()) ** 2 - 1)
    assert rises[0].min() < 0.1
    reached = np.sum(rises < 1, axis=1)
    assert reached[0] >= 0.7 * reached[1]


@pytest.mark.parametrize("case", SAMPLES)
def test_fits_from_near_by_are_those_of_scipy(case: str) -> None:
    problems = of_case(case, 4)
    truth = np.log([SAMPLES[case][name] for name in MODEL.names])
    found = ManyFits(problems).fitted(np.tile(truth, (4, 1)), np.arange(4), FINE)
    for problem, misfit_rad in zip(problems, found.misfit_rad, strict=True):
        best = local_fit(problem, truth).misfit_rad
        assert problem.residuals.samples * ((misfit_rad / best) ** 2 - 1) < 1e-3


def test_bounds_hold() -> None:
    """A trace that asks for a far weaker k_p than the bounds allow, and one fixed parameter."""
    (problem,) = of_case("liquid_drop_1", 1)
    low, high = problem.low.copy(), problem.high.copy()
    low[1] = high[2] = 2.0
    low[3] = high[3] = -6.0
    starts = starts_of(problem, 20)
    trace = np.zeros(20, dtype=np.int64)
    found = ManyFits([problem]).fitted(starts, trace, low=low, high=high).x
    assert np.all((found >= low) & (found <= high))
    np.testing.assert_array_equal(found[:, 3], -6.0)
    assert np.all(found[:, 1] == 2.0)


def test_steps_within_a_box_are_those_of_exhaustive_search() -> None:
    """Of a convex quadratic, with at most one parameter that wants to leave."""
    rng = np.random.default_rng(0)
    shapes = rng.normal(size=(50, 3, 5))
    information = shapes @ shapes.swapaxes(1, 2)
    gradient = rng.normal(size=(50, 3))
    none = np.zeros(50)
    below, above = np.full((50, 3), -np.inf), np.full((50, 3), np.inf)
    below[:, 0] = above[:, 0] = 0.0
    step = bounded_step(Normal(none, gradient, information, none), none, below, above)
    assert np.all(step[:, 0] == 0)
    rest = np.linalg.solve(information[:, 1:, 1:], -gradient[:, 1:, None])[:, :, 0]
    np.testing.assert_allclose(step[:, 1:], rest, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", [*MODEL_PARAMETERS, "two branches", "four branches"])
def test_a_trace_without_noise_gives_every_model_back(name: str) -> None:
    branches = {"two branches": 2, "four branches": 4}.get(name)
    if branches is None:
        model, truth = MODELS[name], np.array(MODEL_PARAMETERS[name])
    else:
        model = model_named("generalized_maxwell", branches)
        dampers = np.geomspace(3.0, 3e3, branches)
        truth = np.concatenate((np.ones(branches + 1), dampers, [0.1]))
    times = clean("endothelial_cell")[0]
    response = rotation(
        step_response(GRIPPER, model.network([truth]), inertia=False), TORQUE, times
    )
    (problem,) = posed(times, response[0], 1, model, level=0.0)
    near = np.log(truth) + 0.1 * np.random.default_rng(1).normal(size=(5, len(truth)))
    found = ManyFits([problem]).fitted(near, np.zeros(5, dtype=np.int64))
    assert np.min(found.misfit_rad) < 1e-6 * np.abs(response).max()
    if branches is None and model is not MODEL:
        best = found.x[np.argmin(found.misfit_rad)]
        np.testing.assert_allclose(best, np.log(truth), rtol=0, atol=1e-3)


def test_an_optimum_is_settled_from_wherever_it_was_found() -> None:
    """To 1e-8, with what the traces say nothing of as well."""
    problems = of_case("liquid_drop_1", 6)
    fits, traces = ManyFits(problems), np.arange(6)
    best = np.log([answer.parameters for answer in identified(problems, [0] * 6)])
    beside = fits.fitted(best + 0.02 * np.random.default_rng(3).normal(size=best.shape), traces)
    np.testing.assert_allclose(settled(fits, beside, traces).x, best, rtol=0, atol=1e-8)


def test_steps_that_lead_away_are_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the curvatures are not those of the way ahead, what was found before counts."""
    problems = of_case("endothelial_cell", 2)
    fits, traces = ManyFits(problems), np.arange(2)
    truth = np.log([SAMPLES["endothelial_cell"][name] for name in MODEL.names])
    near = fits.fitted(np.tile(truth, (2, 1)), traces, FINE)
    monkeypatch.setattr(settling, "_newton_step", lambda fits, curved, x: np.full(x.shape, 0.5))
    kept = settled(fits, near, traces)
    # k_p to 1e-5: of the others the traces tell less.
    np.testing.assert_allclose(kept.x[:, 1], near.x[:, 1], rtol=0, atol=1e-5)
    np.testing.assert_allclose(kept.misfit_rad, near.misfit_rad, rtol=1e-9)


def same(one: Identification, other: Identification) -> bool:
    return all(
        np.array_equal(a, b)
        for a, b in (
            (one.parameters, other.parameters),
            (one.misfit_rad, other.misfit_rad),
            (one.evaluations, other.evaluations),
            (one.history.best_parameters, other.history.best_parameters),
            (one.history.median_misfit, other.history.median_misfit),
        )
    )


def test_answers_do_not_depend_on_the_batch() -> None:
    """Byte for byte, in any order and in batches of any size."""
    problems = of_case("endothelial_cell", 7)
    together = identified(problems, list(range(7)))
    for chosen in ([0], [6], [3, 1], [5, 0, 2, 6, 4]):
        apart = identified([problems[i] for i in chosen], chosen)
        assert all(same(one, together[i]) for one, i in zip(apart, chosen, strict=True))


def test_fits_do_not_depend_on_the_batch() -> None:
    problems = of_case("liquid_drop_2", 3)
    fits, starts = ManyFits(problems), starts_of(problems[0], 60)
    trace = np.arange(60) % 3
    together = fits.fitted(starts, trace)
    rng = np.random.default_rng(2)
    for count in (1, 2, 17, 60):
        chosen = rng.permutation(60)[:count]
        apart = fits.fitted(starts[chosen], trace[chosen])
        expected = together.of(chosen)
        np.testing.assert_array_equal(apart.x, expected.x)
        np.testing.assert_array_equal(apart.misfit_rad, expected.misfit_rad)
        np.testing.assert_array_equal(apart.evaluations, expected.evaluations)


@pytest.mark.parametrize("case", SAMPLES)
def test_answers_are_those_of_one_at_a_time(case: str) -> None:
    problems = of_case(case, 3)
    for seed, (problem, answer) in enumerate(
        zip(problems, identified(problems, [0, 1, 2]), strict=True)
    ):
        alone = least_squares.identify(problem, SETTINGS, np.random.default_rng(seed))
        rise = problem.residuals.samples * ((answer.misfit_rad / alone.misfit_rad) ** 2 - 1)
        assert rise < 0.01
        assert answer.generations == alone.generations
        assert answer.stop_reason == alone.stop_reason
        history, other = answer.history, alone.history
        assert history.best_parameters.shape == other.best_parameters.shape
        np.testing.assert_array_equal(history.best_parameters[0], other.best_parameters[0])
        assert history.evaluations[0] == other.evaluations[0]
        assert history.evaluations[-1] == answer.evaluations
        assert np.all(np.diff(history.evaluations) > 0)
        assert np.all(np.diff(history.best_misfit) <= 1e-7 * answer.misfit_rad)
        np.testing.assert_array_equal(history.best_parameters[-1], answer.parameters)
        exact = problem.misfit(answer.parameters[None])[0]
        assert exact == pytest.approx(answer.misfit_rad, rel=1e-6)


def test_the_genetic_algorithm_is_polished_alike() -> None:
    problems = of_case("liquid_drop_2", 2)
    settings: Any = STUDY.config.of_methods.of("genetic_refined")
    rngs = [np.random.default_rng(seed) for seed in range(2)]
    for seed, answer in enumerate(genetic_refined.identify_many(problems, settings, rngs)):
        alone = genetic_refined.identify(problems[seed], settings, np.random.default_rng(seed))
        assert answer.misfit_rad == pytest.approx(alone.misfit_rad, rel=1e-6)
        assert answer.generations == alone.generations
        assert len(answer.history.evaluations) == len(alone.history.evaluations)


def test_what_cannot_be_fitted_together_is_fitted_one_by_one() -> None:
    few = least_squares.LeastSquaresSettings(3, 1)
    times = np.array([1.0, 10.0, 100.0, 199.0, 205.0, 250.0, 390.0])
    network = MODEL.network([[SAMPLES["liquid_drop_2"][name] for name in MODEL.names]])
    response = rotation(step_response(GRIPPER, network, inertia=False), TORQUE, times)[0]
    problems = posed(times, response, 2, nonlinear=True)
    assert not fit_together(problems)
    rngs = [np.random.default_rng(seed) for seed in range(2)]
    for seed, answer in enumerate(least_squares.identify_many(problems, few, rngs)):
        alone = least_squares.identify(problems[seed], few, np.random.default_rng(seed))
        assert same(answer, alone)


DIGITS = """
from tests.helpers.problems import identified, of_case
for case in ("endothelial_cell", "liquid_drop_1"):
    for answer in identified(of_case(case, 2), [0, 1]):
        print(" ".join(f"{value:.8e}" for value in (*answer.parameters, answer.misfit_rad)))
"""


def test_digits_do_not_depend_on_the_processor() -> None:
    """Under other code paths of NumPy and of its BLAS the same digits come out."""
    others: tuple[dict[str, str], ...] = (
        {},
        {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"},
        {"OPENBLAS_CORETYPE": "Nehalem"},
    )
    told = [
        subprocess.run(
            [sys.executable, "-c", DIGITS],
            env={**os.environ, **other},
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for other in others
    ]
    assert told[0] == told[1] == told[2]
    assert len(told[0].splitlines()) == 4
