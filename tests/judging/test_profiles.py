"""Quantities held exactly in many fits at once, against SciPy's fits of all samples."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import norm, t

from biogrip.arrays import Array, IntArray
from biogrip.fit.levenberg_marquardt import Normal
from biogrip.judging.constrained_fits import ConstrainedFits, QuantityConstraint
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.likelihood import Likelihood, make_likelihood
from biogrip.judging.onset import _at, profile_over_onset
from biogrip.judging.profiles import Points, _limits, compute_profiles
from biogrip.judging.quantities import Quantity, find_combinations, parameters_and_sum
from biogrip.library import set_up, simulate
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.protocol import hold
from biogrip.physics.response import step_response, superpose
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    TORQUE,
    clean,
    likelihood_of,
    pose_noisy,
    posed_for,
    run,
)
from tests.helpers.scipy_fits import rise_with_held

PARAMETERS = parameters_and_sum(MODEL)


def likelihoods(case: str, count: int, **assumed: Any) -> list[Likelihood]:
    return [likelihood_of(each) for each in pose_noisy(*clean(case), count, **assumed)]


def labelled(*labels: str) -> list[Quantity]:
    return [quantity for quantity in PARAMETERS if quantity.label in labels]


BURGERS = MODELS["burgers"]
TWO, THREE = (Sample("generalized_maxwell", branches).model for branches in (2, 3))
FORMS = {
    "one branch": (MODEL, find_combinations(MODEL, [0, 1, 2])),
    "two branches": (TWO, parameters_and_sum(TWO)[-1:]),
    "three branches": (THREE, find_combinations(THREE, [0, 1, 4])),
    "burgers": (
        BURGERS,
        [q for pair in ([0, 2], [0, 3]) for q in find_combinations(BURGERS, pair)],
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_points_are_moved_to_where_quantities_are_held(form: str) -> None:
    """Within bounds, from anywhere, for targets all over the ranges and at their very ends."""
    model, combined = FORMS[form]
    quantities = [*parameters_and_sum(model), *combined]
    low = np.full(len(model.names), -3.0)
    high = np.linspace(2.0, 5.0, len(low))
    ends = np.array([quantity.range(low, high) for quantity in quantities])
    rng = np.random.default_rng(0)
    which = rng.integers(len(quantities), size=3000)
    share = rng.choice([0.0, 1.0, *rng.uniform(size=8)], size=3000)
    targets = ends[which, 0] + share * (ends[which, 1] - ends[which, 0])
    bounds = np.tile(low, (3000, 1)), np.tile(high, (3000, 1))
    held = QuantityConstraint(quantities, which, targets, *bounds, 400.0, np.ones(3000))
    # Points out of bounds are moved into them first.
    x = held.started(np.clip(rng.uniform(low - 1, high + 1, (3000, len(low))), low, high))
    assert np.all((x >= low) & (x <= high))
    values = [quantities[q].log(point) for q, point in zip(which, x, strict=True)]
    assert np.max(np.abs(values - targets)) < 1e-6
    with pytest.raises(ValueError, match="outside its range"):
        QuantityConstraint(
            quantities, which, targets + 20, *bounds, 400.0, np.ones(len(x))
        ).started(x)


def test_along_a_constraint_the_eliminated_parameter_follows() -> None:
    """Of c = 3 and c_p = 1 with a held sum: log c falls by a third of what log c_p rises."""
    sums, ends, none = labelled("c + c_p"), np.full((1, 4), 9.0), np.zeros(1, dtype=np.int64)
    held = QuantityConstraint(sums, none, np.log([4.0]), -ends, ends, 400.0, np.ones(1))
    information = np.array([[2.0, 0, 6, 0], [0, 3, 0, 0], [6, 0, 9, 3], [0, 0, 3, 4]])
    gradient = np.array([[1.0, 2.0, 6.0, 5.0]])
    normal = Normal(np.zeros(1), gradient, information[None], np.zeros(1))
    found, eliminated = held.eliminated(normal, np.log([[5.0, 7.0, 3.0, 1.0]]), none)
    assert eliminated.tolist() == [[False, False, True, False]]
    np.testing.assert_allclose(found.gradient, [[1, 2, 0, 5 - 6 / 3]])
    expected = [[2.0, 0, 0, -6 / 3], [0, 3, 0, 0], [0, 0, 1, 0], [-6 / 3, 0, 0, 4 - 2 * 3 / 3 + 1]]
    np.testing.assert_allclose(found.information[0], np.array(expected), atol=1e-12)


def test_limits_do_not_depend_on_the_batch() -> None:
    """Byte for byte, in any order, of one or several experiments."""
    each = [*likelihoods("endothelial_cell", 2), *likelihoods("liquid_drop_2", 1, offset=True)]
    quantities = labelled("c + c_p")
    together = compute_profiles(each, quantities)
    for chosen in ([2], [1, 0]):
        some = compute_profiles([each[index] for index in chosen], quantities)
        for index, profiles in zip(chosen, some, strict=True):
            for one, other in zip(profiles, together[index], strict=True):
                assert (one.low, one.high) == (other.low, other.high)
                np.testing.assert_array_equal(one.increases, other.increases)


@pytest.mark.parametrize("case", ["endothelial_cell", "liquid_drop_1"])
def test_profiles_are_as_low_as_fits_with_the_parameter_known(case: str) -> None:
    """Against SciPy's from the optimum and from the profile's own fits."""
    (likelihood,) = likelihoods(case, 1)
    quantities = labelled("k", "c_p")
    (profiles,) = compute_profiles([likelihood], quantities)
    for quantity, found in zip(quantities, profiles, strict=True):
        (index,) = quantity.members
        ends = likelihood.problem.low[index], likelihood.problem.high[index]
        np.testing.assert_allclose(found.log_values[[0, -1]], ends)
        assert np.min(found.increases) > -1e-3
        # Points are close enough for a curve, and at the limits, where it crosses the threshold.
        assert {found.low, found.high} - {None} <= {*found.log_values}
        shown = np.sqrt(np.clip(found.increases, 0.0, 16.0))
        assert np.max(np.abs(np.diff(shown))) <= 0.3
        for value, increase in zip(found.log_values[::12], found.increases[::12], strict=True):
            alone = rise_with_held(likelihood, quantity, value, likelihood.best)[0]
            assert increase < alone + 1e-3 * (1 + alone)


def test_the_search_range_determines_no_combination() -> None:
    """Loud noise leaves only that the sample is not stiffer; two springs in series likewise.

    Softer than the softest spring of the search range they could be only if both were at its end.
    """
    sample = np.array([[20.0, 5.0, 80.0, 1e-3]])
    times = np.linspace(0.0, 400.0, 801)
    clean_rad = superpose(step_response(GRIPPER, MODEL.network(sample)), TORQUE, times)[0]
    noise = 4e-6 * np.random.default_rng(1).standard_normal(len(times))
    problem = posed_for(MODEL, times, clean_rad + noise)
    found, k_and_k_p = run("least_squares", problem), find_combinations(MODEL, [0, 1])
    told = diagnose(problem, MODEL, found, confidence=0.95, noise_sd=1e-4)
    series = next(q for q in k_and_k_p if q.sense < 0)
    # To first order it is known well enough to be looked at.
    assert told.likelihood.deviation(series) < 0.5
    ((one,),) = compute_profiles([told.likelihood], [series])
    assert one.low is None
    assert one.high is not None
    assert told.trades == []
    # With one spring as soft as it may be, and the other any, it is lower than any limit.
    soft, best = problem.low[0], told.likelihood.best
    assert series.log(np.array([soft, *best[1:]])) < soft + 1e-3
    assert rise_with_held(told.likelihood, PARAMETERS[0], soft, best)[0] < told.likelihood.threshold


@pytest.mark.parametrize("taken_out", [{}, {"offset": True}, {"offset": True, "drift": True}])
def test_noise_and_threshold_are_those_of_a_regression(taken_out: dict[str, bool]) -> None:
    """Of n readings and p parameters, offset and drift included, n - p are left; Student's t.

    Of known noise it is the normal distribution.
    """
    times = np.arange(0.0, 400.0, 40.0)
    (problem,) = pose_noisy(times, 1e-6 * times, 1, MODELS["maxwell"], **taken_out)
    left = len(times) - 2 - len(taken_out)
    found = make_likelihood(problem, np.zeros(2), 1e-6, confidence=0.95)
    assert found.noise_sd == pytest.approx(1e-6 * np.sqrt(len(times) / left))
    assert found.threshold == pytest.approx(t.ppf(0.975, left) ** 2)
    known = make_likelihood(problem, np.zeros(2), 1e-6, confidence=0.95, noise_sd=1e-6)
    assert known.threshold == pytest.approx(norm.ppf(0.975) ** 2)


def test_a_fitted_onset_leaves_the_limits_that_every_onset_has() -> None:
    """With the best onset alone the damper would be known from below, too."""
    experiment = set_up(GRIPPER, (hold(20.0, 1e-9), hold(40.0, 0.4e-9)), Sample("kelvin_voigt"))
    times = np.arange(61.0)
    exact = simulate(experiment, {"k_p": 6.0, "c_p": 30.0}, times)
    trace = exact + 9e-6 * np.random.default_rng(1).standard_normal(len(times))
    problem = experiment.of(times, trace)
    found = run("least_squares", problem)
    alone = diagnose(problem, experiment.model, found, confidence=0.95)
    merged, _ = profile_over_onset(alone, times)
    # What a later onset costs is taken off the threshold, and off what a limit takes.
    later, best = _at(alone.likelihood, 0.2), alone.likelihood
    cost = best.increase(later.misfit)
    assert cost > 0.1
    assert later.threshold == pytest.approx(best.threshold - cost)
    assert later.certainty == pytest.approx(best.certainty - cost)
    certainty = alone.likelihood.certainty
    for low_of, diagnosis in (([True, True], alone), ([True, False], merged)):
        assert [finding.low is not None for finding in diagnosis.findings] == low_of
        at_the_end = [finding.profile.increases[0] for finding in diagnosis.findings]
        assert [increase > certainty for increase in at_the_end] == low_of


class TwoBasins:
    """Fits of two quantities, each its own profile, in two basins that are never left by chance.

    In the first basin chi^2 rises as the square of what is held; in the second it jumps, from 1 up
    to 9, where 3 is exceeded. Only the second profile, beyond 4, leads into the second basin.
    """

    best, at_best = np.zeros((2, 1)), np.zeros(2)
    threshold, certainty, trace = np.full(2, 4.0), np.full(2, 8.0), np.zeros(2, dtype=np.int64)
    likelihoods = (None,)

    def at(self, profile: IntArray, targets: Array, near: Array, _: float) -> tuple[Array, Array]:
        second = (near[:, 0] > 0.9) | (profile == 1) & (targets > 4)
        rises = np.where(second, np.where(targets > 3, 9.0, 1.0), targets**2)
        return rises, second[:, None].astype(float)

    from_each = ConstrainedFits.from_each


def test_a_limit_is_in_the_deepest_basin_that_any_profile_knows() -> None:
    """Not where the first is left, at -2 and 2: at the jump at 3, and nowhere."""
    points = Points(TwoBasins(), [np.linspace(-5.0, 5.0, 11)] * 2)  # type: ignore[arg-type]
    points.from_optimum()
    points.from_neighbours(points.profile == 0)
    assert _limits(points)[:, 0] == pytest.approx([np.nan, 3.0], abs=1e-6, nan_ok=True)
