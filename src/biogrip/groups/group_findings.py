"""Populations of cells in several groups, and differences between the groups."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from biogrip.groups.comparison import Difference, adjusted, difference
from biogrip.groups.joint_fit import JointFit
from biogrip.groups.median_ratio import Shift, shift
from biogrip.groups.population import FEWEST_CELLS, Estimates, Population, estimate_population
from biogrip.groups.power import detectable_ratio
from biogrip.identifiability.likelihood import Likelihood
from biogrip.identifiability.quantities import Quantity
from biogrip.identifiability.verdicts import DETERMINED, Finding

USUAL_POWER = 0.8
"""Power at which the smallest detectable ratio is given (Cohen 1988)."""


@dataclass(frozen=True)
class JudgedCell:
    """A cell of a group, with the joint fit of its traces."""

    name: str
    group: str
    fit: JointFit


@dataclass(frozen=True)
class GroupFinding:
    """Cells and population of one quantity in one group."""

    group: str
    quantity: str
    """Label of the quantity."""
    unit: str
    estimates: Estimates
    """Estimates of cells that determine the quantity."""
    others: tuple[str, ...]
    """Names of the other cells."""
    population: Population | None
    """Population of the estimates; None if there are too few cells."""


@dataclass(frozen=True)
class GroupDifference:
    """Difference of one quantity between a group and the first group."""

    quantity: str
    """Label of the quantity."""
    group: str
    against: str
    """The reference group."""
    difference: Difference
    """Ratio of the medians of the populations."""
    adjusted_p: float
    """p value adjusted for the number of groups that the quantity is compared in."""
    ranks: Shift
    """Estimate of the difference of logarithms by ranks."""
    detectable_ratio: float
    """Smallest ratio that as many cells with this scatter detect with `USUAL_POWER`."""


def findings_of_groups(
    cells: Sequence[JudgedCell], groups: Sequence[str], confidence: float
) -> list[GroupFinding]:
    """Estimate the population of every quantity in every group.

    Parameters
    ----------
    cells
        Judged cells with the same sample model, at least one.
    groups
        Names of groups in the order of the result; a group may be empty.
    confidence
        Confidence level of the intervals, e.g. 0.95.
    """
    quantities = [finding.quantity for finding in cells[0].fit.diagnosis.findings]
    return [
        _finding(group, quantity, index, [c for c in cells if c.group == group], confidence)
        for group in groups
        for index, quantity in enumerate(quantities)
    ]


def differences_of_groups(findings: Sequence[GroupFinding]) -> list[GroupDifference]:
    """Compare every group with the first, in quantities that enough cells of both determine."""
    compared: list[GroupDifference] = []
    for quantity in dict.fromkeys(finding.quantity for finding in findings):
        own = [finding for finding in findings if finding.quantity == quantity]
        first = own[0]
        pairs = [
            (finding, finding.population, first.population)
            for finding in own[1:]
            if finding.population is not None and first.population is not None
        ]
        if not pairs:
            continue
        apart = [difference(one, other) for _, one, other in pairs]
        p_values = adjusted([each.p_value for each in apart])
        for (finding, one, other), each, p_value in zip(pairs, apart, p_values, strict=True):
            compared.append(
                GroupDifference(
                    quantity,
                    finding.group,
                    first.group,
                    each,
                    p_value,
                    shift(one.estimates.log_values, other.estimates.log_values, each.confidence),
                    _detectable_ratio(one, other),
                )
            )
    return compared


def log_deviation(finding: Finding, likelihood: Likelihood) -> float:
    """Return the standard deviation of a quantity's logarithm from its interval's width."""
    low, high = finding.profile.low, finding.profile.high
    assert low is not None
    assert high is not None
    return (high - low) / (2 * sqrt(likelihood.threshold))


def _finding(
    group: str, quantity: Quantity, index: int, cells: Sequence[JudgedCell], confidence: float
) -> GroupFinding:
    diagnoses = [(cell.name, cell.fit.diagnosis) for cell in cells]
    known = [
        (
            name,
            each.findings[index].profile.best,
            log_deviation(each.findings[index], each.likelihood),
        )
        for name, each in diagnoses
        if each.findings[index].verdict == DETERMINED
    ]
    names = tuple(name for name, _, _ in known)
    estimates = Estimates(
        names,
        np.array([value for _, value, _ in known]),
        np.array([error for _, _, error in known]),
    )
    return GroupFinding(
        group,
        quantity.label,
        quantity.unit,
        estimates,
        tuple(name for name, _ in diagnoses if name not in names),
        estimate_population(estimates, confidence) if len(names) >= FEWEST_CELLS else None,
    )


def _detectable_ratio(one: Population, other: Population) -> float:
    fewer = 1 + min(one.freedom, other.freedom)
    # `deviation` includes spread and errors; badly known cells have less weight in it.
    variances = [(1 + each.freedom) * each.deviation**2 for each in (one, other)]
    return detectable_ratio(fewer, USUAL_POWER, sqrt(sum(variances) / 2), 0.0, one.confidence)
