"""Quantities held exactly in many fits at once, against SciPy's fits of all samples; limits."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array, IntArray
from biogrip.fit.least_squares import FINE, Normal
from biogrip.fit.trace_fit import TraceFit
from biogrip.judging.constrained_fits import ConstrainedFits, QuantityConstraint
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.doubts import DOUBT, RING, Note
from biogrip.judging.likelihood import Likelihood, Quantity, find_combinations, parameters_and_sum
from biogrip.judging.onset import _at, profile_over_onset
from biogrip.judging.profiles import (
    DETERMINED,
    Finding,
    Points,
    _find_crossings,
    compute_findings,
    find_gaps,
    keep_lower,
)
from biogrip.library import set_up, simulate
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.protocol import hold
from biogrip.physics.sample_model import with_fixed
from biogrip_study.stages.judgement import judge_quantities
from tests.helpers.identified import told
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    clean,
    diagnosis_of,
    likelihood_of,
    pose_noisy,
    posed_for,
    problem,
    rotation,
    run,
)
from tests.helpers.scipy_fits import rise_of_held

QUANTITIES = parameters_and_sum(MODEL)
SOFT = [20.0, 5.0, 80.0, 1e-3]


def likelihoods(case: str, count: int, **assumed: Any) -> list[Likelihood]:
    return [likelihood_of(each) for each in pose_noisy(*clean(case), count, **assumed)]


def labelled(*labels: str) -> list[Quantity]:
    return [quantity for quantity in QUANTITIES if quantity.label in labels]


BURGERS, PAIRS = MODELS["burgers"], ([0, 2], [0, 3])
TWO, THREE = (Sample("generalized_maxwell", branches).model for branches in (2, 3))
FORMS = {
    "one branch": (MODEL, find_combinations(MODEL, [0, 1, 2])),
    "two branches": (TWO, parameters_and_sum(TWO)[-1:]),
    "three branches": (THREE, find_combinations(THREE, [0, 1, 4])),
    "burgers": (BURGERS, [q for pair in PAIRS for q in find_combinations(BURGERS, pair)]),
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
    beyond = QuantityConstraint(quantities, which, targets + 20, *bounds, 400.0, np.ones(3000))
    with pytest.raises(ValueError, match="outside its range"):
        beyond.started(x)


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
    together = compute_findings(each, quantities)
    for chosen in ([2], [1, 0]):
        some = compute_findings([each[index] for index in chosen], quantities)
        for index, limits in zip(chosen, some, strict=True):
            for one, other in zip(limits, together[index], strict=True):
                assert (one.low, one.high) == (other.low, other.high)
                np.testing.assert_array_equal(one.increases, other.increases)


@pytest.mark.parametrize("case", ["endothelial_cell", "liquid_drop_1"])
def test_profiles_are_as_low_as_fits_with_the_parameter_known(case: str) -> None:
    """Against SciPy's from the optimum and from the profile's own fits."""
    (likelihood,) = likelihoods(case, 1)
    quantities = labelled("k", "c_p")
    (profiles,) = compute_findings([likelihood], quantities)
    for quantity, found in zip(quantities, profiles, strict=True):
        (index,) = quantity.members
        ends = likelihood.problem.low[index], likelihood.problem.high[index]
        np.testing.assert_allclose(found.log_values[[0, -1]], ends)
        assert np.min(found.increases) > -1e-3
        # The curve passes the limits, where it crosses the threshold.
        assert {found.log_low, found.log_high} - {None} <= {*found.log_values}
        for value, increase in zip(found.log_values[::12], found.increases[::12], strict=True):
            alone = rise_of_held(likelihood, quantity, value, likelihood.best)
            assert increase < alone + 1e-3 * (1 + alone)


def test_the_search_range_determines_no_combination() -> None:
    """Loud noise leaves only that the sample is not stiffer; two springs in series likewise.

    Softer than the softest spring of the search range they could be only if both were at its end.
    """
    times = np.linspace(0.0, 400.0, 801)
    noise = 4e-6 * np.random.default_rng(1).standard_normal(len(times))
    problem = posed_for(MODEL, times, rotation(MODEL, SOFT, times) + noise, noise_sd=1e-4)
    judged = diagnosis_of(problem)
    series = next(q for q in find_combinations(MODEL, [0, 1]) if q.sense < 0)
    # To first order it is known well enough to be looked at.
    assert judged.likelihood.deviation(series) < 0.5
    ((one,),) = compute_findings([judged.likelihood], [series])
    assert (one.low is None, one.high is None, judged.trades) == (True, False, [])
    # With one spring as soft as it may be, and the other any, it is lower than any limit.
    soft, best = problem.low[0], judged.likelihood.best
    assert series.log(np.array([soft, *best[1:]])) < soft + 1e-3
    assert rise_of_held(judged.likelihood, QUANTITIES[0], soft, best) < judged.likelihood.threshold


def test_the_search_range_determines_no_relaxation_time() -> None:
    """A solid flows by a damper above any limit, however well its spring is known."""
    times = np.arange(0.5, 60, 0.5)
    values = 5 - 3 * np.exp(-times / 8) + 0.02 * np.random.default_rng(1).normal(size=119)
    found = told(times, values, reads="compliance", model="burgers").to_frame()
    assert [*found.loc[["c_s", "tau_s"], "verdict"]] == ["bounded below"] * 2
    assert found.loc["tau_s", "low"] > 100


@pytest.mark.nightly
def test_a_fitted_onset_leaves_the_limits_that_every_onset_has() -> None:
    """With the best onset alone the damper would be known from below, too."""
    experiment = set_up(GRIPPER, (hold(20.0, 1e-9), hold(40.0, 0.4e-9)), Sample("kelvin_voigt"))
    times = np.arange(61.0)
    exact = simulate(experiment, {"k_p": 6.0, "c_p": 30.0}, times)
    trace = exact + 9e-6 * np.random.default_rng(1).standard_normal(len(times))
    alone = diagnosis_of(experiment.of(times, trace))
    notes = [Note(DOUBT, "Something else."), Note(DOUBT, "Arms ring.", RING)]
    merged = profile_over_onset(replace(alone, notes=notes), times)
    # Of milliseconds after a step nothing is told where it is known to tenths of a second.
    assert merged.notes == notes[:1]
    assert merged.onset_limits_s
    assert merged.onset_limits_s[0] < -0.05 < 0.05 < merged.onset_limits_s[1]
    # What a later onset costs is taken off the threshold, and off what a limit takes.
    later, best = _at(alone.likelihood, 0.2), alone.likelihood
    cost = best.increase(later.misfit)
    assert cost > 0.1
    assert later.threshold == pytest.approx(best.threshold - cost)
    assert later.certainty == pytest.approx(best.certainty - cost)
    certainty = alone.likelihood.certainty
    for low_of, diagnosis in (([True, True], alone), ([True, False], merged)):
        assert [finding.low is not None for finding in diagnosis.findings] == low_of
        at_the_end = [finding.increases[0] for finding in diagnosis.findings]
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
    points.from_neighbours()
    assert _find_crossings(points)[0][:, 0] == pytest.approx([np.nan, 3.0], abs=1e-6, nan_ok=True)


def test_an_optimum_that_was_missed_is_judged_again() -> None:
    maxwell = MODELS["maxwell"]
    times, response = clean("liquid_drop_2")
    noise = 0.1 * response.max() * np.random.default_rng(2).standard_normal(len(times))
    experiment = posed_for(maxwell, times, response + noise)
    found = run("least_squares", experiment)
    elsewhere = found.parameters * np.array([1.1, 1.02])
    misfit = float(experiment.residuals.misfit(elsewhere[None])[0])
    missed = replace(found, parameters=elsewhere, misfit=misfit)
    right, again = (diagnose(experiment, f, confidence=0.95) for f in (found, missed))
    assert again.likelihood.misfit == pytest.approx(right.likelihood.misfit, rel=1e-9)
    # Coverage is tested with limits of the same fit.
    fit = TraceFit(experiment, missed, None, np.zeros(len(times), bool))
    (alike,) = judge_quantities([fit], parameters_and_sum(maxwell), 0.95)
    assert alike.likelihood.misfit == again.likelihood.misfit
    limits = [[(it.low, it.high) for it in own.findings] for own in (alike, again)]
    assert limits[0] == limits[1]
    for one, other in zip(right.findings, again.findings, strict=True):
        assert one.verdict == DETERMINED
        assert other.log_low == pytest.approx(one.log_low, abs=1e-6)
        assert other.log_high == pytest.approx(one.log_high, abs=1e-6)


@pytest.mark.parametrize("label", ["k", "c", "c_p", "c + c_p"])
def test_a_held_fit_is_scipys(label: str) -> None:
    likelihood = likelihood_of(problem("endothelial_cell", 1, rate_Hz=10.0), 1)
    (quantity,) = labelled(label)
    fits, one = ConstrainedFits([likelihood], [quantity]), np.zeros(1, dtype=np.int64)
    for away in (-0.3, 0.1):
        target = quantity.log(likelihood.best) + away
        (increase,), (x,) = fits.at(one, np.array([target]), likelihood.best[None], FINE)
        assert quantity.log(x) == pytest.approx(target, abs=1e-11)
        scipys = rise_of_held(likelihood, quantity, target, likelihood.best)
        assert increase == pytest.approx(scipys, abs=0.02)


def test_a_set_in_two_parts_has_a_gap_that_its_verdict_names() -> None:
    """Two basins about -2 and 2, whose square roots are straight."""
    values = np.linspace(-5, 5, 101)
    parabolas = np.minimum((values + 2) ** 2, (values - 2) ** 2)
    (gap,) = find_gaps(values, parabolas, 1.0)
    assert gap == pytest.approx((-1.0, 1.0))
    assert find_gaps(values, parabolas, 4.5) == ()
    # What is above the threshold by no more than fits are good to, a hundredth of it, is none.
    assert find_gaps(values, np.minimum(parabolas, 1.005), 1.0) == ()
    assert len(find_gaps(values, np.minimum(parabolas, 1.02), 1.0)) == 1
    whole = Finding(QUANTITIES[0], values, parabolas, 2.0, -3.0, 3.0, np.zeros(4), 0.1)
    others: tuple[dict[str, Any], ...] = (
        *({}, {"log_gaps": (gap,)}, {"log_high": None}, {"log_low": None}),
    )
    said = [replace(whole, **other).words() for other in others]
    gapped = replace(whole, log_gaps=(gap,))
    allowed = [gapped.allows(np.full(4, at)) for at in (-4.0, 0.0, 2.0, 4.0)]
    assert allowed == [False, False, True, False]
    determined = "determined only to 2.6 decades: 7.4 N/m (0.05 to 20)"
    assert said == [
        determined,
        f"{determined}, except 0.368 to 2.72 N/m",
        "only bounded below: at least 0.05 N/m",
        "only bounded above: at most 20 N/m",
    ]


@pytest.mark.parametrize(("k_p", "stated"), [(0.0, False), (5.0, True)])
def test_a_sum_whose_condition_the_best_fit_breaks_is_not_stated(k_p: float, stated: bool) -> None:
    """A branch of 4 s beside a spring that is declared to be none: the branch takes its part."""
    times, model = clean("liquid_drop_1")[0], with_fixed(MODEL, {"k_p": k_p})
    noise = 3e-6 * np.random.default_rng(0).standard_normal(len(times))
    judged = diagnosis_of(posed_for(model, times, rotation(MODEL, SOFT, times) + noise))
    total = next(each for each in judged.findings if each.quantity.label == "c + c_p")
    assert (total.verdict == DETERMINED) == stated
    assert ("a branch of the best fit relaxes in" in total.words()) != stated
    if total.low and total.high:
        assert total.low < 80.001 < total.high
        assert total.high > 1.001 * total.low


def test_what_is_hardly_worse_at_the_end_of_the_range_has_no_limit() -> None:
    """A profile that ends between 95 and 99.9 %, or below, sets none."""
    likelihood = likelihood_of(problem("liquid_drop_1", 0, rate_Hz=10.0))
    k = QUANTITIES[:1]
    ((plain,),) = compute_findings([likelihood], k)
    rise = max(plain.increases[[0, -1]])
    for wanted in (2.0, 7.0):
        noise_sd = likelihood.noise_sd * np.sqrt(rise / wanted)
        ((found,),) = compute_findings([replace(likelihood, noise_sd=noise_sd)], k)
        assert (found.low, found.high) == (None, None)
        assert max(found.increases[[0, -1]]) == pytest.approx(wanted, rel=0.05)
        assert found.words() == "not determined: the trace sets no limit within the search range"


SOLID = {"k_s": 300.0, "k_v": 200.0, "c_v": 900.0}
MANY, FEW = np.arange(0.2, 60.0, 0.2), np.arange(0.2, 60.0, 5.0)
TWO_HALVES = np.where(MANY < 30, 2e-4, 8e-4)
OFFSET, SD = {"offset": True}, {"sd": TWO_HALVES}


@pytest.mark.parametrize(
    ("times", "sd", "given", "limits"),
    [
        (FEW, 2e-4, {}, [(292.896, 307.1144), (196.9109, 203.4328), (855.9672, 938.3086)]),
        (MANY, 2e-4, OFFSET, [(198.0489, 200.8776), (876.6844, 905.8058)]),
        (MANY, TWO_HALVES, SD, [(298.1084, 304.6402), (198.088, 200.8429), (877.5449, 907.939)]),
    ],
    ids=["few", "offset", "sd"],
)
def test_limits_are_lmfits(
    times: Array, sd: float | Array, given: dict[str, Any], limits: list[tuple[float, float]]
) -> None:
    """To a relative 3e-5: the root search of lmfit 1.3.4 ends within some 1e-5.

    Under 5 Pa a spring and a Kelvin-Voigt element in series yield.
    `conf_interval(fit, fit, p_names=["k_s", "k_v", "c_v"], sigmas=[0.95])` gave the numbers, where
    `fit` starts from `SOLID` with `min=1e-6`. Deviations are `weights` with `scale_covar=False` and
    `prob_func=lambda best, it: chi2.cdf(it.chisqr - best.chisqr, 1)`. Beside an offset, one
    parameter more, nothing is told of k_s.
    """
    k_s, k_v, c_v = SOLID.values()
    readings = 5 / k_s + 5 / k_v * (1 - np.exp(-times * k_v / c_v)) + 3e-3 * (given is OFFSET)
    readings += sd * np.random.default_rng(0).standard_normal(len(times))
    held: dict[str, Any] = {"reads": "strain", "hold": 5.0, "model": "zener_kelvin", "start": 0.0}
    found = told(times, readings, **held, **given).to_frame()
    if given is OFFSET:
        assert np.isnan(found.loc["k_s", ["low", "high"]].astype(float)).all()
    for name, ends in zip(list(SOLID)[-len(limits) :], limits, strict=True):
        assert found.loc[name, ["low", "high"]].tolist() == pytest.approx(ends, rel=3e-5)


def test_a_fit_is_news_if_it_is_lower_by_a_thousandth() -> None:
    """Relative to 1 + the increase of chi-squared, here 10.98 and 10.995."""
    for lower, expected in ((9.98, True), (9.995, False)):
        increases, x = np.array([3.0, 10.0]), np.zeros((2, 1))
        news = keep_lower(increases, x, np.array([1]), np.array([lower]), np.ones((1, 1)))
        assert (news.tolist(), increases[1], x[1, 0]) == ([False, expected], lower, 1.0)
