"""Medians and ratios of groups of cells, from the table that ``biogrip identify --csv`` writes.

The logarithm of a quantity varies from cell to cell with the variance tau^2, and is known of cell i
with the standard error s_i, from its limits. The mean of a group weighs each cell by
1/(s_i^2 + tau^2), with tau^2 after DerSimonian and Laird (Controlled Clinical Trials 7 (1986),
177-188). Its limits are those of Student's t after Hartung and Knapp, never closer than the weights
say (Roever, Knapp and Friede, BMC Medical Research Methodology 15 (2015), 99). Two groups are
compared by Welch's t, several with the first after Holm (Scandinavian Journal of Statistics 6
(1979), 65-70).
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import exp, inf, log, nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri, stdtr, stdtrit

from biogrip import __version__
from biogrip.arrays import Array
from biogrip.command.outputs import FAILED, LINEAR, WRITTEN_BY, check_output
from biogrip.digits import counted, rounded_numbers, with_limits, with_unit
from biogrip.errors import BiogripError, nearest
from biogrip.files import refuse_inputs
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED
from biogrip.judging.verdicts import (
    BOUNDED_ABOVE,
    BOUNDED_BELOW,
    DETERMINED,
    FIT_REJECTED,
    NOT_DETERMINED,
)
from biogrip.records.rows import read_rows, write_rows
from biogrip.terminal import aligned, visible, visible_lines
from biogrip.traces.columns import trace_file_problem

FEWEST_CELLS = 3
"""Fewest cells of which a median is estimated."""

COLUMNS = "cells", "determined", "median", "low", "high", "ratio", "ratio_low", "ratio_high", "p"
"""What is said of a quantity in a group."""

Compared = dict[tuple[str, str], dict[str, Any]]

_OF_QUANTITY = re.compile(r"(.*) (verdict|low|value|high)(?: \((.*)\))?")
# By verdict the numbers that tell it, ascending.
_NUMBERS: dict[str, tuple[str, ...]] = {
    DETERMINED: ("low", "value", "high"),
    BOUNDED_BELOW: ("low",),
    BOUNDED_ABOVE: ("high",),
    **{NOT_DETERMINED: (), FIT_REJECTED: (), "": ()},
}
_CONFIDENCES = 0.5, 0.99
# Five digits know a logarithm no better; limits of traces without noise may be equal.
_LEAST_WIDTH = 1e-4
_ONE_SIDED = {BOUNDED_ABOVE: ("at most", "lower"), BOUNDED_BELOW: ("at least", "higher")}


@dataclass
class Cell:
    """A cell, and what its traces tell of each quantity."""

    name: str
    group: str
    doubtful: bool = False
    traces: list[Mapping[str, str]] = field(default_factory=list)
    known: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Logarithm of each quantity that is determined, and its standard error."""
    others: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Verdict of each other quantity, and its only limit as text, or ""."""

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
        return exp(self.mean), exp(self.mean - reach), exp(self.mean + reach)

    @property
    def p_value(self) -> float:
        """Two-sided p value of a mean of 0."""
        return 2 * float(stdtr(self.freedom, -abs(self.mean) / self.error))


def estimate(values: Array, errors: Array) -> Estimate:
    """Estimate the mean of a population from values (n,) with standard errors (n,)."""
    weights, freedom = errors**-2.0, len(values) - 1
    squares = weights @ (values - np.average(values, weights=weights)) ** 2
    beyond = (squares - freedom) / (weights.sum() - weights @ weights / weights.sum())
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


def compare(cells: Sequence[Cell], groups: Sequence[str], confidence: float) -> Compared:
    """Return `COLUMNS` by quantity and group; ratio and p value are against the first group.

    A median takes `FEWEST_CELLS` that determine the quantity, and no fewer than do not. Of cells
    whose fit is rejected it takes what is told without a model.
    """
    found: Compared = {}
    for quantity in dict.fromkeys(name for cell in cells for name in cell.known | cell.others):
        estimates: dict[str, Estimate] = {}
        for group in groups:
            these = [it for it in cells if it.group == group and not it.rejects(quantity)]
            all_known = [cell.known.get(quantity) for cell in these]
            known = [own for own in all_known if own]
            found[quantity, group] = {"cells": len(all_known), "determined": len(known)}
            if len(known) >= max(FEWEST_CELLS, len(all_known) / 2):
                estimates[group] = estimate(*np.array(known).T)
                median = estimates[group].limits(confidence)
                found[quantity, group] |= zip(COLUMNS[2:5], median, strict=True)
        if groups[0] in estimates:
            first = estimates.pop(groups[0])
            ratios = {group: own.over(first) for group, own in estimates.items()}
            p_values = adjusted([own.p_value for own in ratios.values()])
            for (group, own), p in zip(ratios.items(), p_values, strict=True):
                ratio = *own.limits(confidence), p
                found[quantity, group] |= zip(COLUMNS[5:], ratio, strict=True)
    return found


def groups(found: Path, by: str, table: Path | None) -> None:
    """Compare groups of cells, print the comparison, and write it as CSV if asked.

    Found is the CSV file of ``biogrip identify --csv``, a column of it makes the groups, and traces
    of a cell, as a column `cell` says, are averaged. Another file, or a column that is not there,
    is a `BiogripError`.
    """
    if problem := trace_file_problem(found):
        raise BiogripError(f"FOUND: {problem}")
    header, *rows = read_rows(found)
    units = _units(header)
    columns = [column for item in units.items() for column in _columns(*item).values()]
    for name in ("trace", "fit", "confidence", by, *columns):
        if header.count(name) != 1:
            many, near = ("two", "") if name in header else ("no", nearest(name, header))
            raise BiogripError(
                f"{visible(found)}: found {many} column '{name}'; allowed is a table that `biogrip "
                f"identify --csv` wrote, and of --by a column of it.{near}"
            )
    traces = [dict(zip(header, map(visible, row), strict=True)) for row in rows]
    for number, own in enumerate(traces, start=2):
        for column, allowed in _complaints(own, by, units):
            where = f"{visible(found)}, row {number} ({own['trace']}), {column}"
            raise BiogripError(f"{where}: found '{own[column]}'; allowed is {allowed}.")
    if table is not None:
        refuse_inputs([table], [found])
        check_output(table)
    used = [own for own in traces if own[by] and _is_used(own)]
    levels = sorted({float(own["confidence"]) for own in used})
    if len(levels) != 1:
        of = " and ".join(map(str, levels)) or "no trace of a group"
        raise BiogripError(
            f"{visible(found)}: found limits of {of}; allowed are those of one confidence, of "
            "traces that were identified."
        )
    (confidence,) = levels
    names = list(dict.fromkeys(own[by] for own in traces if own[by]))
    cells = _cells(used, by, units, confidence)
    compared = compare(cells, names, confidence)
    lines = [
        f"{visible(found)}: {counted(len(cells), 'cell')}, {100 * confidence:g} % limits",
        _printed(compared, names[0], units),
        *_left_out(traces, by, cells),
        *_not_known(cells, compared),
    ]
    if doubtful := [cell.name for cell in cells if cell.doubtful]:
        again = compare([cell for cell in cells if not cell.doubtful], names, confidence)
        lines += [f"Without the doubtful {', '.join(doubtful)}:", _printed(again, names[0], units)]
    print(visible_lines("\n".join(lines)))
    if table is not None:
        own = ([*key, units[key[0]], *map(row.get, COLUMNS)] for key, row in compared.items())
        names = ["quantity", "group", "unit", *COLUMNS, WRITTEN_BY]
        write_rows(table, names, ([*rounded_numbers(row), __version__] for row in own))
        print(f"Written to {visible(table)}.")


def _units(header: Sequence[str]) -> dict[str, str]:
    """Return quantities with their units; other columns, as a lone ``p value``, are the user's."""
    found: dict[str, dict[str, str]] = {}
    for name, what, unit in (it.groups("") for it in map(_OF_QUANTITY.fullmatch, header) if it):
        found.setdefault(name, {})[what] = unit
    return {name: max(of.values()) for name, of in found.items() if "verdict" in of or len(of) == 3}


def _columns(name: str, unit: str) -> dict[str, str]:
    """Return the columns of a quantity by what they have."""
    numbers = {what: with_unit(f"{name} {what}", unit) for what in _NUMBERS[DETERMINED]}
    return {"verdict": f"{name} verdict"} | numbers


def _complaints(
    own: Mapping[str, str], by: str, units: Mapping[str, str]
) -> Iterator[tuple[str, str]]:
    """Yield columns of a row with what `identify` does not write there, and what is allowed.

    Of a trace that is left out only its fit counts.
    """
    fits = OK, DOUBTFUL, REJECTED, FAILED
    if own["fit"] not in fits:
        yield "fit", ", ".join(fits)
    if not (_is_used(own) and own[by]):
        return
    low, high = _CONFIDENCES
    if not low <= _number(own["confidence"]) <= high:
        yield "confidence", f"a number from {low} to {high}"
    for columns in map(_columns, units, units.values()):
        verdict = columns["verdict"]
        if own[verdict] not in _NUMBERS:
            yield verdict, ", ".join(_NUMBERS).rstrip(", ")
            return
        least, above = 0.0, "above 0"
        for what in _NUMBERS[own[verdict]]:
            number = _number(own[columns[what]])
            if not (least <= number < inf and number > 0):
                yield columns[what], f"a number {above}"
                return
            least, above = number, f"of at least {number:g}, its {what}"


def _number(text: str) -> float:
    """Return the number in a cell, nan if there is none."""
    try:
        return float(text)
    except ValueError:
        return nan


def _is_used(trace: Mapping[str, str]) -> bool:
    """Return True if a trace tells anything; of a rejected fit, without its model."""
    return trace["fit"] != FAILED and (trace["fit"] != REJECTED or trace.get(LINEAR) == "yes")


def _cells(
    traces: Sequence[Mapping[str, str]], by: str, units: Mapping[str, str], confidence: float
) -> list[Cell]:
    """Return cells; what their traces tell is averaged by the inverse squares of errors."""
    cells: dict[tuple[str, str], Cell] = {}
    for own in traces:
        name = own.get("cell") or own["trace"]
        cells.setdefault((name, own[by]), Cell(name, own[by])).traces.append(own)
    width = 2 * float(ndtri((1 + confidence) / 2))
    for cell in cells.values():
        cell.doubtful = any(own["fit"] != OK for own in cell.traces)
        for name, unit in units.items():
            verdict, low, value, high = _columns(name, unit).values()
            some = [own for own in cell.traces if own[verdict] == DETERMINED]
            if some:
                logs = [log(float(own[value])) for own in some]
                widths = [log(float(own[high])) - log(float(own[low])) for own in some]
                weights = [(width / max(it, _LEAST_WIDTH)) ** 2 for it in widths]
                cell.known[name] = float(np.average(logs, weights=weights)), sum(weights) ** -0.5
            elif said := cell.traces[0][verdict]:
                cell.others[name] = said, cell.traces[0][low] or cell.traces[0][high]
    return [*cells.values()]


def _printed(compared: Compared, first: str, units: Mapping[str, str]) -> str:
    """Return a comparison as a table."""
    rows = []
    for (name, group), row in compared.items():
        median, ratio, p = "too few", "", ""
        if "median" in row:
            median = with_limits(row["median"], row["low"], row["high"])
        if "p" in row:
            ratio = with_limits(row["ratio"], row["ratio_low"], row["ratio_high"])
            p = f"{row['p']:.2g}"
        determined = f"{row['determined']} of {row['cells']}"
        rows.append((with_unit(name, units[name]), group, determined, median, ratio, p))
    header = ("quantity", "group", "determined in", "median", f"ratio to {first}", "p")
    return aligned(rows, header)


def _left_out(traces: Sequence[Mapping[str, str]], by: str, cells: Sequence[Cell]) -> Iterator[str]:
    """Say which traces are left out, and which are averaged."""
    for status, why in ((REJECTED, "the fit is rejected"), (FAILED, "not identified")):
        if names := [it["trace"] for it in traces if it["fit"] == status and not _is_used(it)]:
            yield f"Left out, {why}: {', '.join(names)}."
    if names := [own["trace"] for own in traces if own["fit"] == REJECTED and _is_used(own)]:
        yield f"Of the model left out, whose fit is rejected: {', '.join(names)}."
    if names := [own["trace"] for own in traces if not own[by]]:
        yield f"Left out, nothing under {by}: {', '.join(names)}."
    if names := [f"{it.name} ({len(it.traces)})" for it in cells if len(it.traces) > 1]:
        yield f"Averages of several traces: {', '.join(names)}."


def _not_known(cells: Sequence[Cell], compared: Compared) -> Iterator[str]:
    """Say which cells are in no median, as they do not determine the quantity."""
    for name, group in compared:
        own = [cell for cell in cells if cell.group == group and name in cell.others]
        others = [(cell.name, *cell.others[name]) for cell in own]
        for verdict, (words, moved) in _ONE_SIDED.items():
            if some := [f"{cell} ({words} {end})" for cell, it, end in others if it == verdict]:
                what = f"{name} of {group}: only bounded in {', '.join(some)}, which the median"
                yield f"{what} leaves out: that of all cells is {moved}."
        told = {*_ONE_SIDED, FIT_REJECTED}
        if some := [cell for cell, verdict, _ in others if verdict not in told]:
            yield f"{name} of {group}: nothing is told by {', '.join(some)}."
