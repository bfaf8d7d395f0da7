"""Geometric means and ratios of groups of cells, from what traces tell.

The logarithm of a quantity varies from cell to cell with the variance tau^2, and is known of cell i
with the standard error s_i, from its limits. A mean of cells weighs each by 1/(s_i^2 + tau^2), with
tau^2 after DerSimonian and Laird (Controlled Clinical Trials 7 (1986), 177-188).

Where dishes, animals or days were repeated, these are the units: a group is the mean of the means
of its units, with the limits of Student's t (Lord et al., Journal of Cell Biology 219 (2020),
e202001064). Without units cells are taken for independent, with limits after Hartung and Knapp,
never closer than the weights say (Roever et al., BMC Medical Research Methodology 15 (2015), 99).
Two groups are compared by Welch's t, several with the first after Holm (Scandinavian Journal of
Statistics 6 (1979), 65-70).
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import log, sqrt
from typing import Any

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from biogrip.arrays import Array
from biogrip.judging.doubts import OK
from biogrip.judging.verdicts import BOUNDED_BELOW, DETERMINED, FIT_REJECTED

FEWEST_CELLS, FEWEST_UNITS = 3, 2
"""Fewest cells of which a mean is estimated, and fewest units of which its limits are."""

COLUMNS = (
    *("cells", "determined", "units", "scatter_of_cells", "scatter_of_units"),
    *("median", "low", "high", "ratio", "ratio_low", "ratio_high", "p"),
)
"""What is said of a quantity in a group. Scatters are standard deviations of logarithms; ``median``
is the geometric mean, which is the median where logarithms are symmetric."""

CELL = "cell"
"""Column of a table of traces that names the cell of a trace."""

Compared = dict[tuple[str, str], dict[str, Any]]

# Five digits know a logarithm no better; limits of traces without noise may be equal.
_LEAST_WIDTH = 1e-4
_LARGEST_LOG = 700.0


@dataclass(frozen=True)
class Told:
    """What a trace tells of quantities."""

    trace: str
    fit: str
    words: Mapping[str, str]
    """Cells of its row in a table of traces, by column."""
    quantities: Mapping[str, tuple[str, float | None, float | None, float | None]]
    """Verdict, value, and limits by quantity."""

    def cell(self) -> str:
        """Return the name of its cell."""
        return self.words.get(CELL) or self.trace


@dataclass
class Cell:
    """A cell, and what its traces tell of each quantity."""

    name: str
    group: str
    unit: str = ""
    doubtful: bool = False
    traces: list[Told] = field(default_factory=list)
    known: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Logarithm of each quantity that is determined, and its standard error."""
    others: dict[str, tuple[str, float | None]] = field(default_factory=dict)
    """Verdict of each other quantity, and its only limit, if any."""

    def rejects(self, quantity: str) -> bool:
        """Return True if a quantity is of a model that the traces reject."""
        return self.others.get(quantity, ("",))[0] == FIT_REJECTED


@dataclass(frozen=True)
class Estimate:
    """A mean of logarithms with its standard error, from some degrees of freedom."""

    mean: float
    error: float
    freedom: float

    def over(self, other: "Estimate") -> "Estimate":
        """Return the difference from another, with Satterthwaite's degrees of freedom."""
        own, others = self.error**2, other.error**2
        freedom = (own + others) ** 2 / (own**2 / self.freedom + others**2 / other.freedom)
        return Estimate(self.mean - other.mean, sqrt(own + others), freedom)

    def limits(self, confidence: float) -> tuple[float, float, float]:
        """Return the value, no longer a logarithm, and its limits."""
        reach = float(stdtrit(self.freedom, (1 + confidence) / 2)) * self.error
        value, low, high = map(no_longer_log, (self.mean, self.mean - reach, self.mean + reach))
        return value, low, high

    @property
    def p_value(self) -> float:
        """Two-sided p value of a mean of 0."""
        return 2 * float(stdtr(self.freedom, -abs(self.mean) / self.error))


def no_longer_log(value: float) -> float:
    """Return the number of a logarithm, within the range of floats."""
    return float(np.exp(np.clip(value, -_LARGEST_LOG, _LARGEST_LOG)))


def estimate(values: Array, errors: Array) -> Estimate:
    """Estimate the mean of a population from values (n,) with standard errors (n,)."""
    weights, freedom = errors**-2.0, len(values) - 1
    squares = weights @ (values - np.average(values, weights=weights)) ** 2
    room = weights.sum() - weights @ weights / weights.sum()
    beyond = (squares - freedom) / max(room, np.finfo(float).tiny)
    weights = 1 / (errors**2 + max(beyond, 0.0))
    mean = np.average(values, weights=weights)
    variance = max(weights @ (values - mean) ** 2 / freedom, 1.0) / weights.sum()
    return Estimate(float(mean), float(variance) ** 0.5, freedom)


def adjusted(p_values: Sequence[float]) -> list[float]:
    """Return p values adjusted for their number by Holm's method."""
    found, largest = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(np.argsort(p_values)):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[index]))
        found[index] = largest
    return found


def unit_means(cells: Sequence[Cell], quantity: str) -> dict[str, float]:
    """Return means of logarithms of units, of which no more cells are unknown than known."""
    of: dict[str, list[tuple[float, float] | None]] = defaultdict(list)
    for cell in cells:
        of[cell.unit].append(cell.known.get(quantity))
    found = {}
    for unit, every in of.items():
        known = np.array([own for own in every if own])
        if 2 * len(known) >= len(every):
            found[unit] = float(estimate(*known.T).mean if len(known) > 1 else known[0, 0])
    return found


def compare(
    cells: Sequence[Cell], groups: Sequence[str], confidence: float, *, units: bool = False
) -> Compared:
    """Return `COLUMNS` by quantity and group; ratio and p value are against the first group.

    Of cells whose fit is rejected it takes what is told without a model. A mean takes
    `FEWEST_CELLS` that determine the quantity, and no fewer than do not; of units, half of them,
    and limits take `FEWEST_UNITS`.
    """
    found: Compared = {}
    for quantity in dict.fromkeys(name for cell in cells for name in cell.known | cell.others):
        estimates: dict[str, Estimate] = {}
        for group in groups:
            these = [it for it in cells if it.group == group and not it.rejects(quantity)]
            known = [it.known[quantity] for it in these if quantity in it.known]
            row: dict[str, Any] = {"cells": len(these), "determined": len(known)}
            found[quantity, group] = row
            if units:
                means = unit_means(these, quantity)
                row |= {"units": len(means), **_scatters(these, quantity, means)}
                if 2 * len(means) >= max(len({it.unit for it in these}), 1):
                    mean, count = float(np.mean([*means.values()])), len(means)
                    row["median"] = no_longer_log(mean)
                    if count >= FEWEST_UNITS:
                        error = max(row["scatter_of_units"], _LEAST_WIDTH)
                        estimates[group] = Estimate(mean, error / sqrt(count), count - 1)
            elif len(known) >= max(FEWEST_CELLS, len(these) / 2):
                estimates[group] = estimate(*np.array(known).T)
            if group in estimates:
                median = estimates[group].limits(confidence)
                row |= zip(("median", "low", "high"), median, strict=True)
        if groups[0] in estimates:
            first = estimates.pop(groups[0])
            ratios = {group: own.over(first) for group, own in estimates.items()}
            p_values = adjusted([own.p_value for own in ratios.values()])
            for (group, own), p in zip(ratios.items(), p_values, strict=True):
                ratio = *own.limits(confidence), p
                found[quantity, group] |= zip(COLUMNS[-4:], ratio, strict=True)
    return found


def _scatters(cells: Sequence[Cell], quantity: str, means: Mapping[str, float]) -> dict[str, float]:
    """Return standard deviations of logarithms of cells within units, and of means of units."""
    known = [(it.known[quantity][0], it.unit) for it in cells if quantity in it.known]
    own = [value - means[unit] for value, unit in known if unit in means]
    found = {}
    if len(own) > len(means):
        found["scatter_of_cells"] = sqrt(sum(each**2 for each in own) / (len(own) - len(means)))
    if len(means) >= FEWEST_UNITS:
        found["scatter_of_units"] = float(np.std([*means.values()], ddof=1))
    return found


def gather(traces: Sequence[Told], by: str, unit: str | None, confidence: float) -> list[Cell]:
    """Return cells; what their traces tell is averaged by the inverse squares of errors.

    Cells of one name are different ones in different groups, and in different units; by default
    those of any column that nests in the groups.
    """
    nested = [name for name, nests in shared_columns(traces, by) if nests]
    apart = [by, *([unit] if unit else nested)]
    cells: dict[tuple[str, ...], Cell] = {}
    for own in traces:
        key = own.cell(), *(own.words[name] for name in apart)
        new = Cell(key[0], key[1], own.words[unit] if unit else "")
        cells.setdefault(key, new).traces.append(own)
    width = 2 * float(ndtri((1 + confidence) / 2))
    for cell in cells.values():
        cell.doubtful = any(own.fit != OK for own in cell.traces)
        for name in dict.fromkeys(name for own in cell.traces for name in own.quantities):
            told = [own.quantities[name] for own in cell.traces if name in own.quantities]
            some = [np.log(it[1:]) for it in told if it[0] == DETERMINED]  # type: ignore[arg-type]
            if some:
                values, lows, highs = np.transpose(some)
                weights = (width / np.maximum(highs - lows, _LEAST_WIDTH)) ** 2
                mean = float(np.average(values, weights=weights))
                cell.known[name] = mean, float(weights.sum()) ** -0.5
                continue
            verdict, _, low, high = told[0]
            if verdict:
                cell.others[name] = verdict, low if verdict == BOUNDED_BELOW else high
    return [*cells.values()]


def shared_columns(traces: Sequence[Told], by: str) -> Iterator[tuple[str, bool]]:
    """Yield columns whose words cells of a group share, as those of dishes.

    With it comes True if the column nests in the groups: if no word stands in two of them.
    """
    groups = {own.words[by] for own in traces}
    for name in traces[0].words if traces else ():
        words = [own.words[name] for own in traces]
        units = {(own.words[by], own.words[name]) for own in traces}
        cells = {(own.words[by], own.words[name], own.cell()) for own in traces}
        nests = len(set(words)) == len(units) > 1
        shared = name not in (by, CELL) and all(words) and 3 * len(units) <= 2 * len(cells)
        if shared and (nests or len(units) > len(groups)):
            yield name, nests


def at_bounds(cells: Sequence[Cell], quantity: str, verdict: str) -> list[Cell]:
    """Return cells of which those with a verdict, bounded, have the bound for a value."""
    found = []
    for cell in cells:
        own, bound = cell.others.get(quantity, ("", None))
        if own == verdict and bound:
            known = cell.known | {quantity: (log(bound), _LEAST_WIDTH)}
            cell = replace(cell, known=known)
        found.append(cell)
    return found
