"""Many fits at once: as good as SciPy's of all samples, and none depends on the others."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit import least_squares
from biogrip.fit.levenberg_marquardt import Normal, bounded_step
from biogrip.fit.local_fits import FINE, ROUGH, LocalFits, alike
from biogrip.fit.multi_start import screened
from biogrip.fit.problem import Identification, Problem
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS, Sample
from tests.helpers.places import ROOT
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    SAMPLES,
    SETTINGS,
    TORQUE,
    case_problem,
    clean,
    identified,
    of_case,
    problem_alone,
)
from tests.helpers.responses import MODEL_PARAMETERS
from tests.helpers.scipy_fits import scipy_fit


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
    many = LocalFits([problem]).fitted(starts, trace, ROUGH).misfit_rad
    one = np.array([scipy_fit(problem, start, ROUGH, prior=True).misfit_rad for start in starts])
    increases = problem.residuals.samples * ((np.stack((many, one)) / one.min()) ** 2 - 1)
    assert increases[0].min() < 0.1
    reached = np.sum(increases < 1, axis=1)
    assert reached[0] >= 0.7 * reached[1]


@pytest.mark.parametrize("case", SAMPLES)
def test_fits_from_near_by_are_those_of_scipy(case: str) -> None:
    problems = of_case(case, 4)
    truth = np.log([SAMPLES[case][name] for name in MODEL.names])
    found = LocalFits(problems).fitted(np.tile(truth, (4, 1)), np.arange(4), FINE)
    for problem, misfit_rad in zip(problems, found.misfit_rad, strict=True):
        best = scipy_fit(problem, truth, prior=True).misfit_rad
        assert problem.residuals.samples * ((misfit_rad / best) ** 2 - 1) < 1e-3


def test_bounds_hold() -> None:
    """A trace that asks for a far weaker k_p than the bounds allow, and one fixed parameter."""
    (problem,) = of_case("liquid_drop_1", 1)
    low, high = problem.low.copy(), problem.high.copy()
    low[1] = high[2] = 2.0
    low[3] = high[3] = -6.0
    starts = starts_of(problem, 20)
    trace = np.zeros(20, dtype=np.int64)
    found = LocalFits([problem]).fitted(starts, trace, low=low, high=high).x
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
        model = Sample("generalized_maxwell", branches).model
        dampers = np.geomspace(3.0, 3e3, branches)
        truth = np.concatenate((np.ones(branches + 1), dampers, [0.1]))
    times = clean("endothelial_cell")[0]
    response = rotation(
        step_response(GRIPPER, model.network([truth]), inertia=False), TORQUE, times
    )
    (problem,) = case_problem(times, response[0], 1, model, level=0.0)
    near = np.log(truth) + 0.1 * np.random.default_rng(1).normal(size=(5, len(truth)))
    found = LocalFits([problem]).fitted(near, np.zeros(5, dtype=np.int64))
    assert np.min(found.misfit_rad) < 1e-6 * np.abs(response).max()
    if branches is None and model is not MODEL:
        best = found.x[np.argmin(found.misfit_rad)]
        np.testing.assert_allclose(best, np.log(truth), rtol=0, atol=1e-3)


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


def mixed() -> list[Problem]:
    """Traces of which some differ in more than the noise, in no order."""
    times, response = clean("liquid_drop_2")
    linear, other = of_case("liquid_drop_2", 3), of_case("liquid_drop_2", 1)
    trace = response + 1e-5 * np.random.default_rng(9).standard_normal(len(times))
    half = times[::2], trace[::2]
    drop = MODELS["liquid_drop"]
    sparse = problem_alone(GRIPPER, MODEL, TORQUE, *half)
    narrow = replace(linear[2], low=linear[2].low + 1)
    simple = replace(
        linear[2],
        residuals=linear[2].residuals.of_model(drop),
        low=linear[2].low[:3],
        high=linear[2].high[:3],
    )
    return [linear[0], linear[1], sparse, *other, narrow, linear[2], simple]


def test_what_cannot_be_fitted_together_is_fitted_in_groups() -> None:
    """Fits share responses: of one model, at the same times; search ranges may differ."""
    problems = mixed()
    groups = alike(problems)
    assert [group.tolist() for group in groups] == [[0, 1, 4, 5], [2], [3], [6]]
    assert alike([]) == []
    few = least_squares.LeastSquaresSettings(5, 2)

    def rngs() -> list[np.random.Generator]:
        return [np.random.default_rng(seed) for seed in range(len(problems))]

    together = least_squares.identify_many(problems, few, rngs())
    for problem, rng, answer in zip(problems, rngs(), together, strict=True):
        assert same(answer, *least_squares.identify_many([problem], few, [rng]))


DIGITS = """
from tests.helpers.problems import identified, of_case
for case in ("endothelial_cell", "liquid_drop_1"):
    for answer in identified(of_case(case, 2), [0, 1]):
        print(*(repr(float(value)) for value in (*answer.parameters, answer.misfit_rad)))
"""


def test_digits_do_not_depend_on_the_processor() -> None:
    """Under other code paths of NumPy and of its BLAS the same nine come out.

    Compared as numbers: of one that lies on the border of two roundings, digits may differ.
    """
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
    first, *rest = (np.array([line.split() for line in each.splitlines()], float) for each in told)
    assert first.shape == (4, 5)
    for each in rest:
        np.testing.assert_allclose(each, first, rtol=1e-9)
