"""From verdicts on cells to groups: which cells count, which groups are compared, and how."""

from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest
from scipy import stats

from biogrip.groups.group_findings import (
    GroupFinding,
    JudgedCell,
    differences_of_groups,
    findings_of_groups,
    judged_cell,
)
from biogrip.groups.power import power
from biogrip.identifiability.diagnosis import Diagnosis
from biogrip.identifiability.likelihood import Likelihood
from biogrip.identifiability.profiles import Profile
from biogrip.identifiability.quantities import Quantity
from biogrip.identifiability.verdicts import Finding

THRESHOLD = 4.0
K, C = Quantity("k", "$k$", "N/m", (0,)), Quantity("c", "$c$", "N s/m", (1,))


def judged(group: str, number: int, k: float | None, c: float | None) -> JudgedCell:
    """A cell whose logarithms are known to 0.01, or bounded above only."""
    findings = [Finding(each, profile(value), 0.01) for each, value in ((K, k), (C, c))]
    likelihood = cast(Likelihood, Mock(threshold=THRESHOLD, freedom=np.inf))
    told = Diagnosis(likelihood, findings, [], cast(Any, None), [])
    return judged_cell(f"{group}{number}", group, told)


def profile(value: float | None) -> Profile:
    best = 0.0 if value is None else value
    values = best + 0.01 * np.linspace(-9, 9, 37)
    increases = ((values - best) / 0.01) ** 2
    if value is None:
        increases[values < best] = 0.0
    low = None if value is None else best - 0.02
    return Profile(values, increases, best, low, best + 0.02, np.zeros(2))


RNG = np.random.default_rng(7)
VALUES = {
    group: middle + 0.3 * RNG.standard_normal(count)
    for group, middle, count in (("a", 1.0, 6), ("b", 1.5, 5), ("d", 2.5, 4))
}
CELLS = [
    # c of the second group is determined in two cells only.
    judged(group, number, value, None if group == "b" and number > 1 else value)
    for group, values in VALUES.items()
    for number, value in enumerate(values)
]


@pytest.fixture(scope="module")
def findings() -> list[GroupFinding]:
    return findings_of_groups(CELLS, [*VALUES], 0.95)


def test_only_cells_that_determine_a_quantity_count(findings: list[GroupFinding]) -> None:
    by_name = {(each.group, each.quantity): each for each in findings}
    assert list(by_name) == [(group, quantity) for group in "abd" for quantity in "kc"]
    few = by_name["b", "c"]
    assert few.estimates.cells == ("b0", "b1")
    assert few.others == ("b2", "b3", "b4")
    assert few.bounded == few.others
    assert few.population is None
    assert few.shrunk == ()
    all_of_them = by_name["b", "k"]
    assert all_of_them.others == ()
    assert all_of_them.estimates.log_values == pytest.approx(VALUES["b"])
    # Half an interval is two deviations at a threshold of four.
    assert all_of_them.estimates.deviations == pytest.approx(0.01)
    assert all_of_them.population is not None


def test_groups_are_compared_with_the_first(findings: list[GroupFinding]) -> None:
    found = differences_of_groups(findings)
    assert [(each.quantity, each.group, each.against) for each in found] == [
        *(("k", "b", "a"), ("k", "d", "a"), ("c", "d", "a"))
    ]
    # Errors are small beside the spread: Welch's test.
    for each in found:
        expected = stats.ttest_ind(VALUES[each.group], VALUES["a"], equal_var=False)
        assert each.difference.log_ratio == pytest.approx(
            np.mean(VALUES[each.group]) - np.mean(VALUES["a"]), abs=1e-3
        )
        assert each.difference.p_value == pytest.approx(expected.pvalue, rel=0.02)
    first, second, alone = found
    larger = max(first.difference.p_value, second.difference.p_value)
    smaller = min(first.difference.p_value, second.difference.p_value)
    assert sorted((first.adjusted_p, second.adjusted_p)) == pytest.approx(
        [2 * smaller, max(2 * smaller, larger)]
    )
    assert alone.adjusted_p == alone.difference.p_value


def test_the_ratio_that_is_seen_has_the_usual_power(findings: list[GroupFinding]) -> None:
    found = differences_of_groups(findings)[1]
    spreads = [
        each.population.spread.centre for each in (findings[0], findings[4]) if each.population
    ]
    spread = float(np.sqrt(np.mean(np.square(spreads))))
    assert power(found.detectable_ratio, 4, spread, 0.01) == pytest.approx(0.8, abs=0.01)


def test_the_order_of_cells_does_not_matter(findings: list[GroupFinding]) -> None:
    turned = CELLS[::-1]
    for ours, theirs in zip(
        differences_of_groups(findings),
        differences_of_groups(findings_of_groups(turned, [*VALUES], 0.95)),
        strict=True,
    ):
        assert ours.difference.ratio == pytest.approx(theirs.difference.ratio, rel=1e-8)
        assert ours.difference.high == pytest.approx(theirs.difference.high, rel=1e-8)
        assert ours.ranks == theirs.ranks


def test_cells_that_are_bounded_count() -> None:
    """They lower the median, by no more than the bound allows, and shrink below it."""
    bounded = [judged("a", number, None, None) for number in (6, 7)]
    (plain, _), (found, _) = (
        findings_of_groups(cells, ["a"], 0.95) for cells in (CELLS[:6], [*CELLS[:6], *bounded])
    )
    assert found.others == found.bounded == ("a6", "a7")
    assert plain.population is not None
    assert found.population is not None
    assert found.population.centre.centre < plain.population.centre.centre - 0.05
    assert [name for name, _ in found.shrunk] == [f"a{number}" for number in range(8)]
    assert found.shrunk[-1][1].high < 0.03


def test_a_first_group_without_cells_is_compared_with_nothing() -> None:
    found = findings_of_groups(CELLS, ["none", *VALUES], 0.95)
    assert found[0].population is None
    assert found[0].estimates.cells == found[0].others == ()
    assert differences_of_groups(found) == []
