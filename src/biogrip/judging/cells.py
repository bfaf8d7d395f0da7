"""Geometric means and ratios of groups of cells, from what traces tell.

The logarithm of a quantity varies from cell to cell with the variance tau^2, and is known of cell i
with the standard error s_i, from its limits. Cells weigh 1/(s_i^2 + tau^2), with tau^2 after
DerSimonian and Laird (Controlled Clinical Trials 7 (1986), 177-188), of cells within units.

1. Where dishes, animals or days were repeated, these are the units, and count alike (Lord et al.,
   Journal of Cell Biology 219 (2020), e202001064). Without units each cell is one.
2. A group is the mean of its units, with limits of Student's t. Cells that are only bounded are
   counted by `biogrip.judging.censored`.
3. Units of the same name in two groups are pairs, as days on which both were measured: a paired t
   test. Other units are compared by Welch's t test. Where there is both, the larger number of
   units decides, and the others are left out (Guo and Yuan, Statistical Methods in Medical Research
   26 (2017), 1323-1340, compare this with models of both).
4. p takes `FEWEST_PAIRS`, or `FEWEST_UNITS` in each group, and one more beside over twice as many:
   of equal groups of two and ten units 7 % have Welch's p below 0.01, of three and ten 3 %.
5. Several groups are compared with the first after Holm (Scandinavian Journal of Statistics 6
   (1979), 65-70).

How a cell came to be only bounded is not known, and the mean depends on it. A bound is read twice:
as it is, and as the end of what is determined in the group. The larger p is given, with its ratio.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, inf, sqrt
from typing import Any

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from biogrip.arrays import Array
from biogrip.judging.censored import ABOVE, BELOW, KNOWN, censored_mean, pseudo_values
from biogrip.judging.doubts import OK
from biogrip.judging.profiles import BOUNDED_ABOVE, BOUNDED_BELOW, DETERMINED, FIT_REJECTED

FEWEST_CELLS, FEWEST_UNITS, FEWEST_PAIRS = 3, 3, 2
"""Fewest cells of which a mean is estimated, and fewest units, or pairs of them, for p."""

COLUMNS = (
    *("cells", "determined", "bounded", "units", "pairs", "scatter_of_cells", "scatter_of_units"),
    *("median", "low", "high", "ratio", "ratio_low", "ratio_high", "p", "no_p"),
)
"""What is said of a quantity in a group. Scatters are standard deviations of logarithms; ``median``
is the geometric mean, which is the median where logarithms are symmetric; ``no_p`` says why."""

CELL = "cell"
"""Column of a table of traces that names the cell of a trace."""

Compared = dict[tuple[str, str], dict[str, Any]]

SIDES = {BOUNDED_ABOVE: BELOW, BOUNDED_BELOW: ABOVE}
"""Where cells of a verdict lie from their bounds."""

# Five digits know a logarithm no better; limits of traces without noise may be equal.
_LEAST_WIDTH = 1e-4
_LARGEST_LOG = 700.0
# Least share of a group's cells that tell anything, and of these that determine the quantity. Less
# of the latter gives p in fewer tables, and in these below 0.05 more often.
_LEAST_TOLD, _LEAST_KNOWN = 1 / 2, 1 / 3


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

    def place(self, quantity: str) -> tuple[float, float, int] | None:
        """Return the logarithm, its error and its side, or None if nothing is told of it."""
        if quantity in self.known:
            return *self.known[quantity], KNOWN
        verdict, bound = self.others.get(quantity, ("", None))
        return (float(np.log(bound)), 0.0, SIDES[verdict]) if verdict in SIDES and bound else None


@dataclass(frozen=True)
class Estimate:
    """A mean of logarithms with its standard error, from some degrees of freedom."""

    mean: float
    error: float
    freedom: float

    @classmethod
    def of(cls, values: Sequence[float]) -> "Estimate":
        """Return the mean of independent normal values, of at least two."""
        error = max(float(np.std(values, ddof=1)), _LEAST_WIDTH) / sqrt(len(values))
        return cls(float(np.mean(values)), error, len(values) - 1)

    def over(self, other: "Estimate") -> "Estimate":
        """Return the difference from another, with Satterthwaite's degrees of freedom."""
        error = hypot(self.error, other.error)
        shares = (
            (self.error / error) ** 4 / self.freedom,
            (other.error / error) ** 4 / other.freedom,
        )
        return Estimate(self.mean - other.mean, error, 1 / sum(shares))

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


def adjusted(p_values: Sequence[float]) -> list[float]:
    """Return p values adjusted for their number by Holm's method."""
    raised, largest = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(np.argsort(p_values)):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[index]))
        raised[index] = largest
    return raised


def cell_weights(values: Array, errors: Array, sides: Array, units: Array) -> Array:
    """Return weights of cells (n,), which sum to 1 in every unit (n,).

    A cell that is only bounded weighs as if it had the mean error of those that are determined.
    """
    known, (_, places) = sides == KNOWN, np.unique(units, return_inverse=True)
    precisions, of = errors[known] ** -2.0, places[known]
    sums = np.bincount(of, precisions)
    means = np.bincount(of, precisions * values[known]) / np.where(sums, sums, 1.0)
    squares = precisions @ (values[known] - means[of]) ** 2
    room = sums.sum() - (precisions**2 / sums[of]).sum()
    beyond = (squares - known.sum() + np.count_nonzero(sums)) / max(room, np.finfo(float).tiny)
    errors = np.where(known, errors, errors[known].mean())
    weights = 1 / (errors**2 + max(beyond, 0.0))
    return weights / np.bincount(places, weights)[places]


def bounds_read(values: Array, sides: Array, *, at_end: bool) -> Array:
    """Return values (n,) of which bounds are those that a likelihood takes for independent.

    A bound beyond all that is determined tells of the cell itself, not of what could be determined
    of others: the end of these is put for it, or, at the end, for every bound.
    """
    known = values[sides == KNOWN]
    low, high = (known.min(), known.max()) if len(known) else (inf, -inf)
    below, above = (low, high) if at_end else (np.maximum(values, low), np.minimum(values, high))
    return np.select([sides == BELOW, sides == ABOVE], [below, above], values)


def compare(
    cells: Sequence[Cell], groups: Sequence[str], confidence: float, *, units: bool = False
) -> Compared:
    """Return `COLUMNS` by quantity and group; ratio and p value are against the first group.

    Of cells whose fit is rejected it takes what is told without a model. A mean takes that half of
    the cells tell anything, and a third of these determine it; without units, `FEWEST_CELLS`.
    ``of_units`` has the logarithms of units.
    """
    compared: Compared = {}
    for quantity in dict.fromkeys(name for cell in cells for name in cell.known | cell.others):
        usable = [cell for cell in cells if not cell.rejects(quantity)]
        readings: list[Compared] = []
        for at_end in (False, True):
            rows = {
                (quantity, it): _row([c for c in usable if c.group == it], quantity, units, at_end)
                for it in groups
            }
            _add_ratios([*rows.values()], confidence)
            readings.append(rows)
            if not any(row["bounded"] for row in rows.values()):
                break
        chosen = max(readings, key=_least_p)
        compared |= chosen
    return compared


def _least_p(rows: Compared) -> float:
    return min((row["p"] for row in rows.values() if "p" in row), default=inf)


def _row(cells: Sequence[Cell], quantity: str, units: bool, at_end: bool) -> dict[str, Any]:
    """Return counts, scatters and, in ``of_units``, logarithms of the units of a group."""
    told = [(cell.unit, *place) for cell in cells if (place := cell.place(quantity))]
    determined = sum(side == KNOWN for *_, side in told)
    row: dict[str, Any] = {"cells": len(cells), "determined": determined}
    row |= {"bounded": len(told) - determined, "of_units": {}}
    row |= {"units": len({unit for unit, *_ in told})} if units else {}
    fewest = max(1 if units else FEWEST_CELLS, _LEAST_KNOWN * len(told))
    if determined < fewest or len(told) < _LEAST_TOLD * len(cells):
        return row
    names = np.array([unit for unit, *_ in told])
    values, errors, sides = np.array([place for _, *place in told]).T
    weights = cell_weights(values, errors, sides, names)
    values = bounds_read(values, sides, at_end=at_end)
    if np.isfinite(mean := censored_mean(values, sides, weights)):
        row["median"] = no_longer_log(mean)
    if units:
        row["scatter_of_cells"] = _scatter_within(values[sides == KNOWN], names[sides == KNOWN])
    of_units = pseudo_values(values, sides, weights, names if units else np.arange(len(told)))
    if units and len(of_units) > 1:
        row["scatter_of_units"] = float(np.std([*of_units.values()], ddof=1))
    return row | {"of_units": of_units}


def _scatter_within(values: Array, units: Array) -> float | None:
    """Return the standard deviation of values (n,) within units (n,), if any has two."""
    names, places, counts = np.unique(units, return_inverse=True, return_counts=True)
    rest = values - (np.bincount(places, values) / counts)[places]
    freedom = len(values) - len(names)
    return sqrt(float(rest @ rest) / freedom) if freedom else None


def _add_ratios(rows: Sequence[dict[str, Any]], confidence: float) -> None:
    """Add limits, and ratio and p value against the first group, or why there is none."""
    tested = list[tuple[dict[str, Any], Estimate]]()
    for row in rows:
        if len(row["of_units"]) > 1:
            mean = Estimate.of([*row["of_units"].values()]).limits(confidence)
            row |= zip(("median", "low", "high"), mean, strict=True)
        if row is not rows[0] and (difference := _difference(rows[0], row)):
            tested.append((row, difference))
    p_values = adjusted([difference.p_value for _, difference in tested])
    for (row, difference), p in zip(tested, p_values, strict=True):
        row |= zip(COLUMNS[-5:-1], (*difference.limits(confidence), p), strict=True)


def _difference(first: Mapping[str, Any], row: dict[str, Any]) -> Estimate | None:
    """Return the difference of logarithms of units, of pairs where these are most; or say why not.

    Without units no cell is a pair of another.
    """
    if "median" not in row or "median" not in first:
        row["no_p"] = "too few cells are determined"
        return None
    row["ratio"] = row["median"] / first["median"]
    before, after = first["of_units"], row["of_units"]
    both = [unit for unit in after if unit in before] if "units" in row else []
    alone = [[of[unit] for unit in of if unit not in both] for of in (before, after)]
    row["pairs"] = len(both) if len(both) >= min(map(len, alone)) else 0
    if row["pairs"] >= FEWEST_PAIRS:
        return Estimate.of([after[unit] - before[unit] for unit in both])
    fewest, most = sorted(map(len, alone))
    if not row["pairs"] and fewest >= FEWEST_UNITS + (most > 2 * FEWEST_UNITS):
        return Estimate.of(alone[1]).over(Estimate.of(alone[0]))
    row["no_p"] = (
        f"p takes {FEWEST_UNITS} units in each group, {FEWEST_UNITS + 1} beside more than "
        f"{2 * FEWEST_UNITS}, or {FEWEST_PAIRS} that are in both"
    )
    if not (before and after):
        row["no_p"] = "a mean hangs on one unit, as elsewhere cells are only bounded"
    return None


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
