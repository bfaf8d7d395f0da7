"""Many fits at once: as good as SciPy's of all samples, and none depends on the others."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit import least_squares
from biogrip.fit.levenberg_marquardt import Normal, bounded_step
from biogrip.fit.local_fits import ROUGH, LocalFits, alike
from biogrip.fit.multi_start import best_of_starts, screened
from biogrip.fit.problem import Identification, Problem, silent
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS, Sample
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    SAMPLES,
    SETTINGS,
    TORQUE,
    case_problem,
    clean,
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


def test_a_history_is_of_the_fits_so_far() -> None:
    """Their lowest and their median misfit."""
    (problem,) = of_case("liquid_drop_2", 1)
    starts = starts_of(problem, 6)
    fitted = LocalFits([problem]).fitted(starts, np.zeros(6, dtype=np.int64), ROUGH)
    row = np.exp(starts[0]), 1.0, 1.0, 10
    history = best_of_starts([problem], [starts], [row], silent)[0].history
    for count in range(1, 6):
        so_far = fitted.misfit_rad[:count]
        # In single precision, in which fits are compared.
        assert history.best_misfit[count] == pytest.approx(so_far.min(), rel=1e-7)
        assert history.median_misfit[count] == pytest.approx(np.median(so_far), rel=1e-12)
        assert history.evaluations[count] == 10 + fitted.evaluations[:count].sum()


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


@pytest.mark.parametrize("name", [*MODEL_PARAMETERS, "four branches"])
def test_a_trace_without_noise_gives_every_model_back(name: str) -> None:
    if name in MODELS:
        model, truth = MODELS[name], np.array(MODEL_PARAMETERS[name])
    else:
        model = Sample("generalized_maxwell", 4).model
        truth = np.concatenate((np.ones(5), np.geomspace(3.0, 3e3, 4), [0.1]))
    times = clean("endothelial_cell")[0]
    response = rotation(
        step_response(GRIPPER, model.network([truth]), inertia=False), TORQUE, times
    )
    (problem,) = case_problem(times, response[0], 1, model, level=0.0)
    near = np.log(truth) + 0.1 * np.random.default_rng(1).normal(size=(5, len(truth)))
    found = LocalFits([problem]).fitted(near, np.zeros(5, dtype=np.int64))
    assert np.min(found.misfit_rad) < 1e-6 * np.abs(response).max()
    if name in MODELS and model is not MODEL:
        best = found.x[np.argmin(found.misfit_rad)]
        np.testing.assert_allclose(best, np.log(truth), rtol=0, atol=1e-3)


def same(one: Identification, other: Identification) -> bool:
    """Whether parameters, misfit, evaluations and history are the same byte for byte."""
    histories = zip(vars(one.history).values(), vars(other.history).values(), strict=True)
    return all(np.array_equal(a, b) for a, b in histories)


def mixed() -> list[Problem]:
    """Traces of which some differ in more than the noise, in no order."""
    times, response = clean("liquid_drop_2")
    linear, other = of_case("liquid_drop_2", 3), of_case("liquid_drop_2", 1)
    trace = response + 1e-5 * np.random.default_rng(9).standard_normal(len(times))
    half = times[::2], trace[::2]
    drop = MODELS["liquid_drop"]
    sparse = problem_alone(GRIPPER, MODEL, TORQUE, *half)
    narrow = replace(linear[2], low=linear[2].low + 1)
    of_drop = linear[2].residuals.of_model(drop)
    simple = replace(
        linear[2],
        residuals=of_drop,
        misfit=of_drop.condensed_misfit,
        low=linear[2].low[:3],
        high=linear[2].high[:3],
    )
    return [linear[0], linear[1], sparse, *other, narrow, linear[2], simple]


def test_answers_do_not_depend_on_the_batch_byte_for_byte() -> None:
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
