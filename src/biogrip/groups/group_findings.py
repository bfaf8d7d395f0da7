"""Populations of cells in several groups, and differences between the groups."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from biogrip.groups.cell_likelihood import make_cell_likelihood
from biogrip.groups.comparison import Difference, adjusted, difference
from biogrip.groups.median_ratio import Shift, shift
from biogrip.groups.population import (
    FEWEST_CELLS,
    Estimates,
    Interval,
    Population,
    estimate_population,
)
from biogrip.groups.power import detectable_ratio
from biogrip.identifiability.diagnosis import Diagnosis
from biogrip.identifiability.profiles import Profile

USUAL_POWER = 0.8
"""Power at which the smallest detectable ratio is given (Cohen 1988)."""


@dataclass(frozen=True)
class CellProfile:
    """Profile of one quantity in one cell."""

    name: str
    profile: Profile
    threshold: float
    """Increase of chi^2 at its limits."""
    freedom: float
    """Degrees of freedom of the noise, see `Likelihood`."""

    @property
    def is_bounded(self) -> bool:
        """True if it has a limit on one side at least."""
        return self.profile.low is not None or self.profile.high is not None

    @property
    def is_determined(self) -> bool:
        """True if it has limits on both."""
        return self.profile.low is not None and self.profile.high is not None

    @property
    def log_deviation(self) -> float:
        """Standard deviation of the logarithm from the width of its interval, if it has one."""
        low, high = self.profile.low, self.profile.high
        assert low is not None
        assert high is not None
        return (high - low) / (2 * sqrt(self.threshold))


@dataclass(frozen=True)
class QuantityProfile:
    """Profile of a quantity with its label and unit."""

    quantity: str
    unit: str
    of_cell: CellProfile


@dataclass(frozen=True)
class JudgedCell:
    """A cell of a group, with the profile of each quantity."""

    name: str
    group: str
    profiles: tuple[QuantityProfile, ...]


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
    bounded: tuple[str, ...]
    """Names of those among them whose traces bound it on one side."""
    population: Population | None
    """Population of all cells, by their profiles; None if too few determine the quantity."""
    shrunk: tuple[tuple[str, Interval], ...]
    """Logarithm in each cell that determines or bounds the quantity, as its own traces and the
    population tell together; empty without a population."""


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


def judged_cell(name: str, group: str, diagnosis: Diagnosis) -> JudgedCell:
    """Return a cell with the profiles of its diagnosis."""
    likelihood = diagnosis.likelihood
    return JudgedCell(
        name,
        group,
        tuple(
            QuantityProfile(
                finding.quantity.label,
                finding.quantity.unit,
                CellProfile(name, finding.profile, likelihood.threshold, likelihood.freedom),
            )
            for finding in diagnosis.findings
        ),
    )


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
    return [
        _finding(group, index, cells, confidence)
        for group in groups
        for index in range(len(cells[0].profiles))
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
            known = finding.estimates.log_values, first.estimates.log_values
            ranks = shift(*known, each.confidence)
            compared.append(
                GroupDifference(
                    quantity,
                    finding.group,
                    first.group,
                    each,
                    p_value,
                    ranks,
                    _detectable_ratio(one, other),
                )
            )
    return compared


def estimates_of(cells: Sequence[CellProfile]) -> Estimates:
    """Return values and errors of the cells that determine a quantity, from limits and optimum."""
    known = [cell for cell in cells if cell.is_determined]
    return Estimates(
        tuple(cell.name for cell in known),
        np.array([cell.profile.best for cell in known]),
        np.array([cell.log_deviation for cell in known]),
    )


def population_of(cells: Sequence[CellProfile], confidence: float) -> Population | None:
    """Estimate the population of cells; None if fewer than `FEWEST_CELLS` determine a quantity."""
    estimates = estimates_of(cells)
    if len(estimates.cells) < FEWEST_CELLS:
        return None
    return estimate_population(
        estimates,
        [
            make_cell_likelihood(cell.profile.log_values, cell.profile.increases, cell.freedom)
            for cell in cells
        ],
        confidence,
        freedom=sum(cell.is_bounded for cell in cells) - 1,
    )


def _finding(
    group: str, index: int, cells: Sequence[JudgedCell], confidence: float
) -> GroupFinding:
    quantity = cells[0].profiles[index]
    own = [cell.profiles[index].of_cell for cell in cells if cell.group == group]
    estimates, population = estimates_of(own), population_of(own, confidence)
    others = [cell for cell in own if not cell.is_determined]
    shrunk = zip(own, population.cells, strict=True) if population else ()
    return GroupFinding(
        group,
        quantity.quantity,
        quantity.unit,
        estimates,
        tuple(cell.name for cell in others),
        tuple(cell.name for cell in others if cell.is_bounded),
        population,
        tuple((cell.name, interval) for cell, interval in shrunk if cell.is_bounded),
    )


def _detectable_ratio(one: Population, other: Population) -> float:
    fewer = 1 + min(one.freedom, other.freedom)
    # `deviation` includes spread and errors; badly known cells have less weight in it.
    variances = [(1 + each.freedom) * each.deviation**2 for each in (one, other)]
    return detectable_ratio(fewer, USUAL_POWER, sqrt(sum(variances) / 2), 0.0, one.confidence)
