"""A model never fits worse than one that it contains; and what is said of it beside others."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit import nested_fits
from biogrip.fit.least_squares import LeastSquaresSettings, identify_many
from biogrip.fit.problem import Fit, TraceProblem
from biogrip.physics.models import CANDIDATES, MODELS, contained
from tests.helpers.default import STUDY, seen
from tests.helpers.problems import MODEL, clean, pose_noisy, posed_for, rotation

LADDERS = [name for name, model in MODELS.items() if not model.power_law]
FEW = LeastSquaresSettings(candidates=200, starts=4)
Problems = dict[str, list[TraceProblem]]
Found = dict[str, list[Fit]]


def fitted(
    response: Array, times: Array, tried: Sequence[str], traces: int, level: float
) -> tuple[Problems, Found]:
    models = {name: CANDIDATES[name].model for name in tried}
    given = times, response, traces
    problems = {name: pose_noisy(*given, model, level) for name, model in models.items()}
    rngs = {name: [np.random.default_rng(n) for n in range(traces)] for name in tried}
    found = nested_fits.fit_models(problems, FEW, rngs)
    return problems, {name: [*answers.values()] for name, answers in found.items()}


def assert_none_worse(problems: Problems, found: Found) -> None:
    for richer in found:
        for simpler in {*contained(richer)} & {*found}:
            for problem, a, b in zip(problems[richer], found[richer], found[simpler], strict=True):
                rise = problem.residuals.samples * 2 * np.log(a.misfit / b.misfit)
                assert rise <= 1e-3, (richer, simpler)


@pytest.mark.parametrize(
    ("case", "level", "tried"),
    [
        ("endothelial_cell", 0.002, LADDERS),
        ("liquid_drop_1", 0.1, LADDERS),
        pytest.param("liquid_drop_2", 0.02, MODELS, marks=pytest.mark.nightly),
    ],
)
def test_no_model_fits_worse_than_one_in_it(case: str, level: float, tried: Sequence[str]) -> None:
    """Parameters and misfit are of one point, also of elements that have vanished."""
    times, response = clean(case)
    problems, found = fitted(response, times, tried, 2, level)
    assert_none_worse(problems, found)
    for name, answers in found.items():
        for problem, answer in zip(problems[name], answers, strict=True):
            own = rotation(CANDIDATES[name].model, answer.parameters, times, inertia=False)
            misfit = np.sqrt(np.mean((own - problem.residuals.trace.cleared) ** 2))
            assert answer.misfit == pytest.approx(misfit, rel=1e-9)


def test_what_fits_worse_than_one_in_it_is_fitted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    starts = []

    def poor(*given: Any, **options: Any) -> list[Fit]:
        starts.append(given[-1][0])
        (fit,) = identify_many(*given, **options)
        times = len(starts)
        parameters, misfit = times * fit.parameters, times * fit.misfit
        return [replace(fit, parameters=parameters, misfit=misfit, converged=times == 1)]

    monkeypatch.setattr(nested_fits, "deepen", lambda _, found: found)
    times, response = clean("endothelial_cell")
    monkeypatch.setattr(nested_fits, "identify_many", poor)
    _, found = fitted(response, times, ["liquid_drop", "zener_maxwell"], 1, 0.02)
    assert [len(points) for points in starts] == [0, 1]
    (good,), (again,) = found.values()
    assert again.misfit == pytest.approx(good.misfit, rel=1e-6)
    assert again.converged


def test_elements_vanish_where_the_range_does_not_reach() -> None:
    """A Maxwell liquid between the jaws: no spring as weak as the range allows is weak enough."""
    times = clean("liquid_drop_1")[0]
    response = rotation(MODELS["maxwell"], [9.5, 10.0], times)
    problems, found = fitted(response, times, ("maxwell", "liquid_drop"), 8, 0.1)
    assert_none_worse(problems, found)
    pairs = zip(found["liquid_drop"], found["maxwell"], strict=True)
    without = [pair for pair in pairs if pair[0].parameters[1] == 0]
    assert without
    for answer, simpler in without:
        assert not nested_fits.is_within(answer.parameters, problems["liquid_drop"][0])
        # It is as much the optimum as that of the simpler model is.
        assert simpler.converged
        assert answer.converged


@pytest.mark.parametrize(
    ("inner", "expected"),
    [("kelvin_voigt", [[18, 6, 30], [600, 6, 30]]), ("maxwell", [[6, 2, 30], [6, 0.06, 30]])],
)
def test_what_has_vanished_starts_from_its_like(inner: str, expected: list[list[float]]) -> None:
    """A spring in front that was rigid is 3 and 100 times the other, one that was none is less."""
    found = {inner: {0: seen(parameters=np.array([6.0, 30.0]))}}
    starts = [*nested_fits._of_contained("zener_kelvin", found, 0, 400.0)]
    np.testing.assert_allclose(starts, expected)


def test_a_simpler_model_fits_better_if_nine_digits_say_so() -> None:
    for lower, expected in ((0.0, []), (4e-10, []), (2e-9, [("liquid_drop", "maxwell", 0)])):
        found = {"maxwell": {0: seen(misfit=1 - lower)}, "liquid_drop": {0: seen(misfit=1.0)}}
        assert [*nested_fits._worse(found)] == expected


READINGS = 1000


def test_the_sentence_is_that_of_the_numbers() -> None:
    for gained, said in (
        # chi-squared by which four parameters, and the others, fit better than a spring's one.
        ({"generalized_maxwell": 103.0, "liquid_drop": 102.0}, "A simpler model, Maxwell liqui"),
        ({"generalized_maxwell": 50.0, "fractional_maxwell": 400.0}, "is not adequate: fractional"),
        ({"generalized_maxwell": 50.0, "generalized_maxwell_2": 90.0}, "is not adequate: "),
        ({"generalized_maxwell": 50.0, "burgers": 90.0}, "suits the trace less well: Burgers"),
        ({"generalized_maxwell": 90.0, "burgers": 89.0}, "none of the 2 models tried suits"),
        # By less than is worth a mention.
        (
            {"generalized_maxwell": 90.0, "liquid_drop": 84.0},
            "(--model liquid_drop) suits it as well with 1 parameter less (BIC lower by 0.908).",
        ),
        # By chance another model of as many parameters, or a richer one, fits a little better.
        ({"generalized_maxwell": 90.0, "burgers": 95.9}, "none of the 2 models tried suits"),
        ({"generalized_maxwell": 90.0, "burgers": 96.1}, "less well: Burgers"),
    ):
        misfits = [float(np.exp(-gain / (2 * READINGS))) for gain in gained.values()]
        tried = nested_fits.ranked(list(gained), misfits, READINGS)
        models = nested_fits.FittedModels("generalized_maxwell", tried)
        assert said in models.advice()
        other, advice = models.preferred, replace(models, spared=("",) * 4).advice()
        assert (other is None) == ("none of the 2 models" in advice)
        assert (other is None) == ("better; 4 more could not, however well they fit" in advice)
        words = "None of the 2 models tried is adequate: the best of them, "
        inadequate = replace(models, adequate=False).advice()
        assert inadequate.startswith(words) == (other is not None)


@pytest.mark.parametrize(("gained", "taken"), [(0.005, False), (0.02, True), (5.0, True)])
def test_a_branch_counts_that_lowers_chi_squared_by_a_hundredth(gained: float, taken: bool) -> None:
    """Far less than the 1 that a standard error changes it by."""
    problem = seen(residuals=seen(samples=READINGS))
    before = float(np.sqrt(1 + gained / READINGS))
    assert nested_fits._is_noticeably_lower(1.0, before, problem) == taken


def test_branches_are_added_beside_a_power_law_that_is_not_adequate() -> None:
    """Of five processes over eight decades; misfits are in noises of 110 readings."""
    misfits = {"generalized_maxwell": 29.0, "generalized_maxwell_2": 19.0}
    misfits |= {"generalized_maxwell_3": 11.0, "springpots_in_series": 5.2}
    tried = nested_fits.ranked([*misfits], [*misfits.values()], 110)
    models = nested_fits.FittedModels("generalized_maxwell", tried)
    assert models.one_branch_more() is None
    assert replace(models, adequate=False).one_branch_more() == "generalized_maxwell_4"


def test_a_fit_ends_no_higher_than_with_another_seed() -> None:
    """A drop of which Burgers' model shows one element; one of these seeds misses the basin."""
    times, _ = clean("liquid_drop_1")
    response = rotation(MODEL, [77.0, 1e-9, 1.2, 0.04], times)
    noise = 0.05 * response.max() * np.random.default_rng(8).standard_normal(len(times))
    posed = [posed_for(CANDIDATES["burgers"].model, times, response + noise)] * 2
    rngs = [np.random.default_rng([seed, 8]) for seed in (0, 2)]
    found = identify_many(posed, LeastSquaresSettings(candidates=1000, starts=16), rngs)
    both = found, nested_fits.deepen(posed, found)
    apart, together = (len(times) * ((two.misfit / one.misfit) ** 2 - 1) for one, two in both)
    assert apart > 0.3
    assert abs(together) < 0.01


TIMES, RESPONSE = clean("liquid_drop_2")
TRACE = RESPONSE * np.random.default_rng(3).normal(1.0, 0.1, len(TIMES))


@pytest.mark.parametrize("name", CANDIDATES)
@pytest.mark.parametrize("offset", [False, True])
def test_a_trace_that_is_posed_for_another_model_is_as_if_posed_alone(
    name: str, offset: bool
) -> None:
    experiment = replace(STUDY.cases["liquid_drop_2"].experiment, offset=offset)
    model = CANDIDATES[name].model
    ours = experiment.for_model(experiment.of(TIMES, TRACE), model)
    alone = experiment.of(TIMES, TRACE, model)
    points = np.random.default_rng(4).uniform(alone.low, alone.high, (40, len(alone.low)))
    for one, other in (
        (ours.low, alone.low),
        (ours.high, alone.high),
        *zip(ours.residuals(points[0]), alone.residuals(points[0]), strict=True),
        (each.residuals.misfit(np.exp(points)) for each in (ours, alone)),
    ):
        np.testing.assert_array_equal(one, other)
