"""Populations of cells, against other programs' formulas, limiting cases and simulations."""

from itertools import pairwise, product

import numpy as np
import pytest
from scipy import integrate, special, stats
from statsmodels.stats.nonparametric import rank_compare_2indep

from biogrip.arrays import Array
from biogrip.groups.comparison import adjusted, difference
from biogrip.groups.median_ratio import shift
from biogrip.groups.population import Estimates, Population, estimate_population
from biogrip.groups.power import cells_needed, detectable_ratio, power

RNG = np.random.default_rng(20)


def dish(y: Array, s: Array | float, confidence: float = 0.95) -> Population:
    names = tuple(f"cell {i}" for i in range(len(y)))
    return estimate_population(Estimates(names, y, np.broadcast_to(s, y.shape)), confidence)


def drawn(count: int, spread: float, error: Array | float, centre: float = 0.0) -> Array:
    cells = centre + spread * RNG.standard_normal(count)
    values: Array = cells + error * RNG.standard_normal(count)
    return values


def generalized_q(y: Array, s: Array, spread: float) -> float:
    weight = 1 / (spread**2 + s**2)
    centre = np.average(y, weights=weight)
    return float(np.sum(weight * (y - centre) ** 2))


def test_estimate_and_limits_of_the_spread_are_where_q_says() -> None:
    for _ in range(20):
        s = RNG.uniform(0.02, 0.3, 9)
        y = drawn(9, 0.4, s)
        found = dish(y, s)
        # Paule and Mandel's criterion in statsmodels is met to 1e-5.
        assert generalized_q(y, s, found.spread) == pytest.approx(8, abs=1e-4)
        for limit, tail in ((found.spread_low, 0.975), (found.spread_high, 0.025)):
            if limit > 0:
                q = generalized_q(y, s, limit)
                assert q == pytest.approx(stats.chi2.ppf(tail, 8), rel=1e-8)
            else:
                assert generalized_q(y, s, 0.0) <= stats.chi2.ppf(tail, 8)
        assert found.spread_low <= found.spread <= found.spread_high


def test_median_and_interval_are_least_squares_with_those_weights() -> None:
    """Hartung and Knapp's variance is that of weighted least squares with its scale estimated."""
    from statsmodels.regression.linear_model import WLS

    s = RNG.uniform(0.02, 0.3, 7)
    y = drawn(7, 0.2, s, 3.0)
    found = dish(y, s, 0.9)
    fit = WLS(y, np.ones(7), weights=1 / (found.spread**2 + s**2)).fit()
    assert found.centre == pytest.approx(fit.params[0], rel=1e-12)
    assert found.deviation == pytest.approx(fit.bse[0], rel=1e-10)
    low, high = fit.conf_int(0.1)[0]
    assert (found.low, found.high) == pytest.approx((np.exp(low), np.exp(high)), rel=1e-10)


def test_cells_known_exactly_give_the_t_interval_and_welchs_test() -> None:
    one, other = drawn(8, 0.3, 0.0), drawn(5, 0.6, 0.0, 1.0)
    # Small enough that nothing of it shows, and far below what any trace determines.
    first, second = dish(one, 1e-9), dish(other, 1e-9)
    assert first.centre == pytest.approx(np.mean(one), rel=1e-9)
    assert first.spread == pytest.approx(np.std(one, ddof=1), rel=1e-5)
    quantiles = stats.chi2.ppf([0.975, 0.025], 7)
    limits = np.std(one, ddof=1) * np.sqrt(7 / quantiles)
    assert (first.spread_low, first.spread_high) == pytest.approx(limits, rel=1e-8)
    assert first.shrunk == pytest.approx(one, rel=1e-9)
    welch = stats.ttest_ind(one, other, equal_var=False)
    compared = difference(first, second)
    assert compared.p_value == pytest.approx(welch.pvalue, rel=1e-6)
    assert compared.freedom == pytest.approx(welch.df, rel=1e-8)
    interval = welch.confidence_interval(0.95)
    assert np.log([compared.low, compared.high]) == pytest.approx([*interval], rel=1e-8)
    assert compared.ratio == pytest.approx(np.exp(np.mean(one) - np.mean(other)), rel=1e-9)


def test_cells_that_scatter_less_than_their_errors_are_taken_as_alike() -> None:
    y, s = 0.01 * drawn(6, 1.0, 0.0), np.full(6, 0.5)
    found = dish(y, s)
    assert found.spread == found.spread_low == 0
    # All errors the same: the mean, and its plain t interval.
    assert found.deviation == pytest.approx(stats.sem(y), rel=1e-10)
    assert found.shrunk == pytest.approx(np.full(6, np.mean(y)), rel=1e-10)
    assert found.shrunk_deviations == pytest.approx(np.full(6, found.deviation), rel=1e-10)


def test_cells_are_shrunk_by_how_well_they_are_known() -> None:
    y, s = np.array([0.0, 0.5, 1.0, 1.0]), np.array([0.1, 0.1, 0.1, 1.0])
    found = dish(y, s)
    moved = (y - found.shrunk) / (y - found.centre)
    assert moved == pytest.approx(s**2 / (s**2 + found.spread**2), rel=1e-9)


def test_shrunk_cells_are_the_normal_equations_of_all_cells_and_the_median() -> None:
    """Cells within the spread of the median, estimates within their errors of the cells."""
    y, s = np.array([0.0, 0.5, 1.0, 2.0]), np.array([0.3, 0.4, 0.3, 0.5])
    found = dish(y, s)
    precision = np.diag([*1 / s**2, 0.0])
    for cell in range(4):
        apart = np.eye(5)[cell] - np.eye(5)[4]
        precision += np.outer(apart, apart) / found.spread**2
    covariance = np.linalg.inv(precision)
    assert found.shrunk == pytest.approx((covariance @ [*y / s**2, 0.0])[:4], rel=1e-9)
    # With the estimated spread Q is 3, as statsmodels meets it: to 1e-5.
    expected = np.sqrt(np.diag(covariance)[:4])
    assert found.shrunk_deviations == pytest.approx(expected, rel=1e-4)


def test_neither_order_nor_unit_matters() -> None:
    s = RNG.uniform(0.05, 0.3, 8)
    y = drawn(8, 0.3, s)
    order = RNG.permutation(8)
    found, again, larger = dish(y, s), dish(y[order], s[order]), dish(y + np.log(1e3), s)
    assert again.centre == pytest.approx(found.centre, abs=1e-13)
    assert again.shrunk == pytest.approx(found.shrunk[order], abs=1e-12)
    assert again.spread_high == pytest.approx(found.spread_high, rel=1e-9)
    assert larger.median == pytest.approx(1e3 * found.median, rel=1e-12)
    assert larger.spread == pytest.approx(found.spread, rel=1e-9)
    there, back = difference(found, larger), difference(larger, found)
    assert there.log_ratio == pytest.approx(-back.log_ratio, rel=1e-12)
    assert there.p_value == pytest.approx(back.p_value, rel=1e-12)


def test_p_values_of_several_groups_are_adjusted_step_by_step() -> None:
    # Holm 1979: the smallest of three counts thrice, the next twice, and none less than before.
    assert adjusted([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert adjusted([0.2]) == pytest.approx([0.2])


@pytest.mark.parametrize(("cells", "spread"), [((7, 6), 1.0), ((6, 12), 0.2), ((9, 9), 5.0)])
def test_a_shift_is_where_the_rank_test_turns(cells: tuple[int, int], spread: float) -> None:
    """Brunner and Munzel's test as statsmodels has it, for spreads that differ, too."""
    one, other = drawn(cells[0], spread, 0.0, 1.0), drawn(cells[1], 1.0, 0.0)
    found = shift(one, other, 0.95)
    assert found.estimate == np.median(np.subtract.outer(one, other))
    assert found.low is not None
    assert found.high is not None
    for limit, inwards in ((found.low, 1), (found.high, -1)):
        with np.errstate(divide="ignore", invalid="ignore"):
            p_inside, p_outside = (
                rank_compare_2indep(one - limit - side * 1e-9, other).pvalue
                for side in (inwards, -inwards)
            )
        assert p_inside >= 0.05
        # Not a number where all of one are on one side of all of the other.
        assert not p_outside >= 0.05


def test_few_cells_have_no_interval_by_ranks() -> None:
    """Of n cells beside others that hardly scatter, all are on one side in 2 of 2^n cases."""
    one, other = drawn(20, 1.0, 0.0), drawn(20, 1.0, 0.0)
    for confidence, fewest in ((0.9, 5), (0.95, 6), (0.99, 8)):
        few = shift(one[: fewest - 1], other, confidence)
        assert (few.low, few.high) == (None, None)
        assert shift(other, one[:fewest], confidence).low is not None


def test_power_is_the_noncentral_t() -> None:
    size = np.log(1.4) / np.hypot(0.3, 0.1)
    for cells in (2, 5, 20):
        freedom, middle = 2 * (cells - 1), size * np.sqrt(cells / 2)
        limit = stats.t.ppf(0.975, freedom)
        expected = stats.nct.sf(limit, freedom, middle) + stats.nct.cdf(-limit, freedom, middle)
        assert power(1.4, cells, 0.3, 0.1) == pytest.approx(expected, rel=1e-6)
        assert power(1 / 1.4, cells, 0.3, 0.1) == pytest.approx(expected, rel=1e-6)
    enough = cells_needed(1.4, 0.8, 0.3, 0.1)
    assert power(1.4, enough - 1, 0.3, 0.1) < 0.8 <= power(1.4, enough, 0.3, 0.1)
    assert cells_needed(100.0, 0.8, 0.1, 0.0) == 3
    seen = detectable_ratio(12, 0.8, 0.3, 0.1)
    assert power(seen, 12, 0.3, 0.1) == pytest.approx(0.8, abs=1e-6)


def test_power_is_a_mean_of_normal_probabilities() -> None:
    """Over chi-squared, from a difference that hardly shows to one that cannot be missed."""
    for cells, ratio, confidence in product((2, 3, 8, 40), (1.01, 1.4, 3), (0.5, 0.99)):
        freedom, middle = 2 * (cells - 1), np.log(ratio) / 0.1 * np.sqrt(cells / 2)
        limit = stats.t.ppf((1 + confidence) / 2, freedom)

        def missed(
            v: float, freedom: int = freedom, middle: float = middle, limit: float = limit
        ) -> float:
            reach = limit * np.sqrt(v / freedom)
            inside = special.ndtr(reach - middle) - special.ndtr(-reach - middle)
            return inside * stats.chi2.pdf(v, freedom)

        widths = freedom + np.sqrt(2 * freedom) * np.array([-3, -1, 0, 1, 3, 6, 12])
        between = [0, *widths[widths > 0], 20 * freedom + 100]
        lost = sum(integrate.quad(missed, *ends, epsabs=1e-13)[0] for ends in pairwise(between))
        assert power(ratio, cells, 0.1, 0.0, confidence) == pytest.approx(1 - lost, abs=1e-9)


@pytest.mark.parametrize("spread", [0.01, 0.1, 0.3, 1.0])
@pytest.mark.parametrize("ratio", [1.02, 1.2, 3.0, 1e6])
def test_enough_cells_are_found_for_every_difference(ratio: float, spread: float) -> None:
    enough = cells_needed(ratio, 0.8, spread, 0.0)
    assert power(ratio, enough, spread, 0.0) >= 0.8
    assert enough == 3 or power(ratio, enough - 1, spread, 0.0) < 0.8
    # More cells never show less, nor anything but a probability.
    powers = [power(ratio, enough * 2**k, spread, 0.0) for k in range(8)]
    assert np.all(np.diff(powers) > -1e-12)
    assert powers[-1] <= 1 + 1e-12


@pytest.mark.parametrize("wanted", [0.1, 0.8, 0.99])
@pytest.mark.parametrize("cells", [2, 3, 20, 1000])
def test_the_ratio_seen_has_the_power_wanted(cells: int, wanted: float) -> None:
    seen = detectable_ratio(cells, wanted, 0.3, 0.1)
    assert power(seen, cells, 0.3, 0.1) == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize(
    ("spread", "error", "cells"),
    [(0.3, 0.01, 8), (0.3, 0.2, 8), (0.0, 0.2, 8), (0.1, 0.3, 5)],
)
def test_differences_and_spreads_hold_the_truth(spread: float, error: float, cells: int) -> None:
    """Of 1000 pairs, with errors that differ from cell to cell by a factor of two.

    Three standard deviations of a count are 2.1 % of 95, and 4.7 % of any. Without a spread its
    lower limit is zero for all but 2.5 %, and it is held more often. What a cell's own error is
    of its difference from the others is estimated as well, which shrunk cells take no account of:
    where both are of one size, their intervals hold the truth in some 92 %.
    """
    rng = np.random.default_rng([int(100 * spread), int(100 * error), cells])
    ratio, pairs = np.log(1.5), 1000
    held, seen, spreads, shrunk = 0, 0, 0, 0
    for _ in range(pairs):
        found, truths = [], []
        for centre in (ratio, 0.0):
            s = error * rng.uniform(0.7, 1.4, cells)
            truths.append(centre + spread * rng.standard_normal(cells))
            found.append(dish(truths[-1] + s * rng.standard_normal(cells), s))
        compared = difference(*found)
        held += compared.low <= 1.5 <= compared.high
        seen += compared.p_value < 0.05
        spreads += found[0].spread_low <= spread <= found[0].spread_high
        away = np.abs(found[0].shrunk - truths[0])
        shrunk += int(np.sum(away <= found[0].reach * found[0].shrunk_deviations))
    expected = power(1.5, cells, spread, error * np.sqrt(np.mean(np.square([0.7, 1.0, 1.4]))))
    assert 0.929 <= held / pairs <= 0.971
    assert spreads / pairs >= 0.929
    assert shrunk / (pairs * cells) >= 0.9
    assert seen / pairs == pytest.approx(expected, abs=0.06)
