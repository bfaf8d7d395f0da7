"""Populations of cells, against other programs' formulas, limiting cases and simulations."""

from collections.abc import Callable
from itertools import pairwise, product

import numpy as np
import pytest
from scipy import integrate, special, stats
from statsmodels.stats.meta_analysis import combine_effects
from statsmodels.stats.nonparametric import rank_compare_2indep

from biogrip.arrays import Array
from biogrip.groups.cell_likelihood import CellLikelihood, make_cell_likelihood
from biogrip.groups.comparison import adjusted, difference
from biogrip.groups.median_ratio import shift
from biogrip.groups.population import Estimates, Population, estimate_population
from biogrip.groups.power import cells_needed, detectable_ratio, power
from tests.helpers.cells import normal_cell, normal_population

RNG = np.random.default_rng(20)


def dish(y: Array, s: Array | float, confidence: float = 0.95) -> Population:
    return normal_population(y, np.broadcast_to(np.asarray(s, float), y.shape), confidence)


def drawn(count: int, spread: float, error: Array | float, centre: float = 0.0) -> Array:
    cells = centre + spread * RNG.standard_normal(count)
    values: Array = cells + error * RNG.standard_normal(count)
    return values


def test_cells_known_exactly_give_students_t_chi_squared_and_welchs_test() -> None:
    one, other = drawn(8, 0.3, 0.0), drawn(5, 0.6, 0.0, 1.0)
    # Small enough that nothing of it shows, and far below what any trace determines.
    first, second = dish(one, 1e-7), dish(other, 1e-7)
    assert first.centre.centre == pytest.approx(np.mean(one), abs=1e-5)
    interval = stats.t.interval(0.95, 7, np.mean(one), stats.sem(one))
    # Quadrature errs by 1e-4 of a standard deviation.
    assert (first.centre.low, first.centre.high) == pytest.approx(interval, abs=1e-4)
    deviation = float(np.std(one, ddof=1))
    assert first.spread.centre == pytest.approx(deviation, rel=1e-3)
    # The shortest interval is the one of equal densities.
    scale = deviation * np.sqrt(7)
    low, high = (scale / np.sqrt(stats.chi2.ppf(tail, 7)) for tail in (0.975, 0.025))
    assert first.spread.high - first.spread.low < high - low
    squares = [(scale / end) ** 2 for end in (first.spread.high, first.spread.low)]
    assert np.diff(stats.chi2.cdf(squares, 7)) == pytest.approx(0.95, abs=2e-3)
    of_high, of_low = (stats.chi2.pdf(square, 7) * square**1.5 for square in squares)
    assert of_high == pytest.approx(of_low, rel=0.05)
    assert [own.centre for own in first.cells] == pytest.approx(one, abs=1e-6)
    welch = stats.ttest_ind(one, other, equal_var=False)
    compared = difference(first, second)
    assert compared.p_value == pytest.approx(welch.pvalue, rel=2e-3)
    assert compared.freedom == pytest.approx(welch.df, rel=1e-3)
    limits = welch.confidence_interval(0.95)
    assert np.log([compared.low, compared.high]) == pytest.approx([*limits], abs=2e-3)


def test_many_cells_are_those_of_a_random_effects_meta_analysis() -> None:
    """Paule and Mandel's estimate, and the interval of Hartung and Knapp, from statsmodels."""
    s = RNG.uniform(0.1, 0.4, 80)
    y = drawn(80, 0.3, s, 2.0)
    found, other = dish(y, s), combine_effects(y, s**2, method_re="pm")
    deviation = np.sqrt(other.var_hksj_re)
    assert found.centre.centre == pytest.approx(other.mean_effect_re, abs=0.1 * deviation)
    assert found.deviation == pytest.approx(deviation, rel=0.05)
    # Each has a standard deviation of 11 %; they differ in weights.
    assert found.spread.centre == pytest.approx(np.sqrt(other.tau2), rel=0.08)


def stiffness(read: float, error: float) -> CellLikelihood:
    """A cell whose rotation exp(-y) was read: from the reading 0 on it is bounded below only."""
    y = np.linspace(-6.0, 9.0, 200)
    increases = ((np.exp(-y) - read) / error) ** 2
    return make_cell_likelihood(y, increases - increases.min())


def exact(read: float, error: float) -> Callable[[float], float]:
    largest = min(read, 0.0)
    return lambda y: float(np.exp(-0.5 * (((np.exp(-y) - read) ** 2 - largest**2) / error**2)))


@pytest.mark.parametrize("read", [1.0, 0.3, 0.0, -0.3])
@pytest.mark.parametrize("spread", [1e-5, 0.02, 0.3, 3.0])
def test_a_likelihood_is_integrated_over_any_population(read: float, spread: float) -> None:
    cell, at = stiffness(read, 0.2), exact(read, 0.2)
    centres = np.array([-0.4, 0.1, 1.0, 4.0])
    found = cell.masses(centres, np.full(4, spread)).sum(axis=0)
    for own, centre in zip(found, centres.tolist(), strict=True):
        # Beyond the end the likelihood hardly changes.
        expected, _ = integrate.quad(
            lambda z, c=centre: at(c + spread * z) * stats.norm.pdf(z), -9, 9, limit=500
        )
        # Straight lines between knots, and nodes of profiles.
        assert own == pytest.approx(expected, rel=0.04, abs=2e-3)


def test_students_likelihood_has_the_limits_of_the_f_threshold() -> None:
    z = np.linspace(-60, 60, 2401)
    cell = make_cell_likelihood(z, z * z, 5.0)
    masses = np.diff(cell.knots) * (cell.values[1:] + cell.values[:-1]) / 2
    below = np.interp(-np.sqrt(stats.f.ppf(0.95, 1, 5)), cell.knots[1:], np.cumsum(masses))
    assert below / masses.sum() == pytest.approx(0.025, abs=2e-4)


def test_posterior_of_bounded_and_skewed_cells_is_that_of_plain_sums() -> None:
    """Limits of centre, spread and cells from sums over points in all dimensions."""
    reads, error = np.array([1.1, 0.9, 0.8, 0.7, 0.25, -0.1]), 0.12
    cells = [stiffness(read, error) for read in reads]
    known = Estimates(tuple("abcd"), -np.log(reads[:4]), error / reads[:4])
    found = estimate_population(known, cells, 0.9, freedom=5)
    scale = np.median(known.deviations)
    centres, taus = np.linspace(-4, 9, 326), scale * np.sinh(np.linspace(0.04, 4.76, 60))
    points = np.linspace(-5.0, 20.0, 1001)
    # Between points the likelihood is that of the middle, however narrow a population is.
    edges = np.append(points, points[-1] + 0.025) - 0.0125
    log_likelihood = np.zeros((len(taus), len(centres)))
    profiles = np.array([[exact(read, error)(at) for at in points] for read in reads])
    shares = [
        np.diff(special.ndtr((edges[:, None] - centres) / tau), axis=0) + 1e-99 for tau in taus
    ]
    for row, share in enumerate(shares):
        log_likelihood[row] = np.log(profiles @ share).sum(axis=0)
    posterior = np.exp(log_likelihood - log_likelihood.max())
    of_centre = np.cumsum(posterior.sum(axis=0)) / posterior.sum()
    low, middle, high = np.interp([0.05, 0.5, 0.95], of_centre, centres + 0.02)
    assert found.centre.centre == pytest.approx(middle, abs=0.01)
    assert (found.centre.low, found.centre.high) == pytest.approx((low, high), abs=0.03)
    # The prior is uniform in these nodes: their posterior is the restricted likelihood.
    assert found.spread.centre == pytest.approx(taus[np.argmax(posterior.sum(axis=1))], rel=0.05)
    for number in (0, 5):
        own = sum(
            (profiles[number][:, None] * share / (profiles[number] @ share)) @ weights
            for share, weights in zip(shares, posterior, strict=True)
        )
        ends = np.interp([0.05, 0.5, 0.95], np.cumsum(own) / np.sum(own), edges[1:])
        cell = found.cells[number]
        assert (cell.low, cell.centre, cell.high) == pytest.approx([*ends], abs=0.03)


def test_a_bound_moves_the_median_and_a_flat_profile_nothing() -> None:
    y, s = drawn(6, 0.2, 0.0), np.full(6, 0.05)
    known = [normal_cell(*own) for own in zip(y.tolist(), s.tolist(), strict=True)]
    estimates = Estimates(tuple("abcdef"), y, s)
    values = np.linspace(-9.0, 9.0, 40)
    flat = make_cell_likelihood(values, np.zeros(40))
    above = make_cell_likelihood(values, 40.0 / (1 + np.exp(20 * (values - 0.5))))
    plain, same, higher = (
        estimate_population(estimates, [*known, *others], 0.95, freedom=5)
        for others in ([], [flat, flat], [above, above])
    )
    assert same.centre.centre == pytest.approx(plain.centre.centre, abs=1e-9)
    assert same.spread.high == pytest.approx(plain.spread.high, rel=1e-9)
    assert higher.centre.centre > plain.centre.centre + plain.deviation
    # What is not known of a cell is known of its population.
    assert same.cells[-1].centre == pytest.approx(plain.centre.centre, abs=0.01)
    assert same.cells[-1].low < plain.centre.low


def test_most_cells_far_beyond_a_bound_are_followed() -> None:
    """Nodes start about cells that are determined, and move to where all cells are."""
    y, s = np.array([0.0, 0.1, -0.1]), np.full(3, 0.05)
    known = [normal_cell(*own) for own in zip(y.tolist(), s.tolist(), strict=True)]
    values = np.linspace(-9.0, 9.0, 181)
    above = make_cell_likelihood(values, 400 / (1 + np.exp(20 * (values - 3.0))))
    found = estimate_population(
        Estimates(tuple("abc"), y, s), [*known, *(above for _ in range(20))], 0.95, freedom=22
    )
    assert found.centre.centre > 2.5
    assert found.spread.low > 1


def test_cells_that_scatter_less_than_their_errors_are_taken_as_alike() -> None:
    y, s = 0.01 * drawn(6, 1.0, 0.0), np.full(6, 0.5)
    found = dish(y, s)
    assert found.spread.centre == found.spread.low == 0
    assert found.centre.centre == pytest.approx(np.mean(y), abs=1e-4)
    # All are drawn nearly to the median.
    assert [own.centre for own in found.cells] == pytest.approx([np.mean(y)] * 6, abs=0.01)


def test_neither_order_nor_unit_matters() -> None:
    s = RNG.uniform(0.05, 0.3, 8)
    y = drawn(8, 0.3, s)
    order = RNG.permutation(8)
    found, again, larger = dish(y, s), dish(y[order], s[order]), dish(y + np.log(1e3), s)
    assert again.centre.centre == pytest.approx(found.centre.centre, abs=1e-9)
    low = [own.low for own in found.cells]
    assert [own.low for own in again.cells] == pytest.approx(np.array(low)[order], abs=1e-9)
    assert again.spread.high == pytest.approx(found.spread.high, rel=1e-9)
    assert larger.centre.low == pytest.approx(np.log(1e3) + found.centre.low, abs=1e-8)
    assert larger.spread.centre == pytest.approx(found.spread.centre, rel=1e-8)
    there, back = difference(found, larger), difference(larger, found)
    assert there.log_ratio == pytest.approx(-back.log_ratio, rel=1e-9)
    assert there.p_value == pytest.approx(back.p_value, rel=1e-6)


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
