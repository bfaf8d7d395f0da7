"""The command ``biogrip groups``: compare cells by the table of ``biogrip identify --csv``.

`biogrip.judging.cells` has the statistics.
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path
from textwrap import fill
from typing import Any, NoReturn

from biogrip import __version__
from biogrip.command.outputs import COLUMNS as OF_TRACES
from biogrip.command.outputs import FAILED, LINEAR, METHODS, WRITTEN_BY, check_outputs
from biogrip.command.words import in_sentences, outcome_in_words, paragraph, together
from biogrip.digits import counted, plain, rounded_numbers, with_limits, with_unit
from biogrip.errors import BiogripError, nearest
from biogrip.files import atomic_write, read_rows, write_rows
from biogrip.judging.cells import COLUMNS, Cell, Compared, Told, compare, gather, shared_columns
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED
from biogrip.judging.profiles import (
    BOUNDED_ABOVE,
    BOUNDED_BELOW,
    DETERMINED,
    FIT_REJECTED,
    NOT_DETERMINED,
)
from biogrip.terminal import aligned, visible, visible_lines
from biogrip.traces.columns import trace_file_problem

_OF_QUANTITY = re.compile(r"(.*) (verdict|low|value|high)(?: \((.*)\))?")
# By verdict the numbers that tell it, ascending.
_NUMBERS: dict[str, tuple[str, ...]] = {
    DETERMINED: ("low", "value", "high"),
    BOUNDED_BELOW: ("low",),
    BOUNDED_ABOVE: ("high",),
    **{NOT_DETERMINED: (), FIT_REJECTED: (), "": ()},
}
_FITS = OK, DOUBTFUL, REJECTED, FAILED
_CONFIDENCES = 0.5, 0.99
_ONE_SIDED = {BOUNDED_ABOVE: "at most", BOUNDED_BELOW: "at least"}
_UNDATED: dict[str, dict[str, None]] = {"png": {}, "pdf": {"CreationDate": None}}
# Most names that a line has.
_FEW = 5
_WIDTH = 100


def groups(
    found: Path,
    by: str,
    table: Path | None = None,
    unit: str | None = None,
    plot: Path | None = None,
) -> None:
    """Compare groups of cells, print the comparison, write it as CSV and draw it if asked.

    Found is the CSV file of ``biogrip identify --csv``; a column of it makes the groups, another
    may say what was repeated. Traces of a cell, as a column `cell` says, are averaged. Another
    file, or a column that is not there, is a `BiogripError`.
    """
    _check_names(found, by, unit, table, plot)
    grouped = _read(found, by, unit)
    cells = grouped.gathered(unit)
    compared = grouped.compared(cells)
    lines = [
        _counts(grouped, cells, found),
        _printed(compared, grouped),
        *_left_out(grouped, cells),
        *_not_determined(cells, compared),
        *_pairs(cells, compared, grouped),
        *_without_p(compared),
        *([] if unit else _shared(grouped)),
        *_without_doubtful(grouped, cells),
        "",
        "For a paper:",
        fill(_for_a_paper(grouped, cells, compared), _WIDTH),
    ]
    print(visible_lines("\n".join(lines)))
    if table is not None:
        _write_table(table, compared, grouped.units)
    if plot is not None:
        _draw(cells, compared, grouped, plot)
    if written := [visible(path) for path in (table, plot) if path]:
        print(f"Written to {', '.join(written)}.")


@dataclass(frozen=True)
class _Grouped:
    """What a table of traces tells of groups."""

    by: str
    """Column that makes the groups."""
    unit: str | None
    """Column of what was repeated, if there is one."""
    units: Mapping[str, str]
    """Units of numbers, by quantity."""
    traces: Sequence[Mapping[str, str]]
    """All rows, by column."""
    used: Sequence[Mapping[str, str]]
    """Rows of a group that tell anything."""
    told: Sequence[Told]
    """What these tell."""
    confidence: float
    """Confidence of all limits."""

    @property
    def made_by(self) -> list[str]:
        """Columns that make groups, and units in them."""
        return [self.by, *([self.unit] if self.unit else [])]

    @property
    def names(self) -> list[str]:
        """Groups, in the order of the table."""
        rows = (row for row in self.traces if all(row[name] for name in self.made_by))
        return list(dict.fromkeys(row[self.by] for row in rows))

    def gathered(self, unit: str | None) -> list[Cell]:
        """Return the cells of the traces, with what was repeated by a column."""
        return gather(self.told, self.by, unit, self.confidence)

    def compared(self, cells: Sequence[Cell]) -> Compared:
        """Return the comparison of cells, by units if they have any."""
        return compare(cells, self.names, self.confidence, units=any(it.unit for it in cells))


def _check_names(
    found: Path, by: str, unit: str | None, table: Path | None, plot: Path | None
) -> None:
    if problem := trace_file_problem(found):
        raise BiogripError(f"FOUND: {problem}")
    if unit == by:
        raise BiogripError("--unit: found the column of --by; allowed is another, as of dishes.")
    check_outputs([("--csv", table), ("--plot", plot)], [found])
    if plot is not None and plot.suffix not in (".png", ".pdf"):
        text = f"found {visible(plot)}; allowed is a name that ends with .png or .pdf."
        raise BiogripError(f"--plot: {text}")


def _read(found: Path, by: str, unit: str | None) -> _Grouped:
    """Read the table that `identify` wrote; refuse what it does not write."""
    header, *rows = read_rows(found)
    units = _units(header)
    columns = [column for item in units.items() for column in _columns(*item).values()]
    made_by = [by, *([unit] if unit else [])]
    _check_header(found, header, ("trace", "fit", "confidence", *made_by, *columns))
    traces = [dict(zip(header, map(visible, row), strict=True)) for row in rows]
    # Names of two of the columns end with the unit of what is read.
    ours = {*OF_TRACES, *columns}
    copied = {it for it in header if it not in ours and not it.startswith(("noise", "misfit"))}
    used, told = [], []
    for number, trace in enumerate(traces, start=2):
        where = f"{visible(found)}, row {number} ({trace['trace']})"
        if trace["fit"] not in _FITS:
            _refuse(trace, "fit", ", ".join(_FITS), where)
        if all(trace[name] for name in made_by) and _is_used(trace):
            used.append(trace)
            told.append(_told(trace, copied | {*made_by}, units, where))
    confidence = _confidence(found, {float(trace["confidence"]) for trace in used})
    return _Grouped(by, unit, units, traces, used, told, confidence)


def _check_header(found: Path, header: Sequence[str], wanted: Iterable[str]) -> None:
    for name in wanted:
        if header.count(name) != 1:
            many, near = ("two", "") if name in header else ("no", nearest(name, header))
            raise BiogripError(
                f"{visible(found)}: found {many} column '{name}'; allowed is a table that `biogrip "
                f"identify --csv` wrote, and of --by and --unit columns of it.{near}"
            )


def _confidence(found: Path, levels: set[float]) -> float:
    if len(levels) != 1:
        several = " and ".join(map(str, sorted(levels))) or "no trace of a group"
        raise BiogripError(
            f"{visible(found)}: found limits of {several}; allowed are those of one confidence, of "
            "traces that were identified."
        )
    return levels.pop()


def _write_table(table: Path, compared: Compared, units: Mapping[str, str]) -> None:
    rows = ([*key, units[key[0]], *map(row.get, COLUMNS)] for key, row in compared.items())
    columns = ["quantity", "group", "unit", *COLUMNS, WRITTEN_BY]
    write_rows(table, columns, ([*rounded_numbers(row), __version__] for row in rows))


def _draw(cells: Sequence[Cell], compared: Compared, grouped: _Grouped, plot: Path) -> None:
    # Imported here: loading Matplotlib takes long.
    from biogrip.figures.cells import ONE_COLUMN_IN, draw_cells
    from biogrip.figures.style import styled

    with styled(), atomic_write(plot) as scratch:
        drawn = draw_cells(cells, compared, grouped.units, ONE_COLUMN_IN, grouped.unit)
        kind = plot.suffix.removeprefix(".")
        mark = {"Creator" if kind == "pdf" else "Software": f"{WRITTEN_BY} {__version__}"}
        drawn.savefig(scratch, format=kind, dpi=300, metadata=mark | _UNDATED[kind])


def _told(trace: Mapping[str, str], copied: set[str], units: Mapping[str, str], where: str) -> Told:
    """Return what a row tells; refuse what `identify` does not write there."""
    lowest, highest = _CONFIDENCES
    if not lowest <= _number(trace["confidence"]) <= highest:
        _refuse(trace, "confidence", f"a number from {lowest} to {highest}", where)
    quantities = {}
    for name, unit in units.items():
        columns = _columns(name, unit)
        if (verdict := trace[columns["verdict"]]) not in _NUMBERS:
            _refuse(trace, columns["verdict"], ", ".join(_NUMBERS).rstrip(", "), where)
        least, above, numbers = 0.0, "above 0", dict[str, float]()
        for what in _NUMBERS[verdict]:
            number = _number(trace[columns[what]])
            if not (least <= number < inf and number > 0):
                _refuse(trace, columns[what], f"a number {above}", where)
            least, above = number, f"of at least {number:g}, its {what}"
            numbers[what] = number
        value, low, high = map(numbers.get, ("value", "low", "high"))
        quantities[name] = verdict, value, low, high
    words = {name: trace[name] for name in trace if name in copied}
    return Told(trace["trace"], trace["fit"], words, quantities)


def _refuse(trace: Mapping[str, str], column: str, allowed: str, where: str) -> NoReturn:
    raise BiogripError(f"{where}, {column}: found '{trace[column]}'; allowed is {allowed}.")


def _units(header: Sequence[str]) -> dict[str, str]:
    """Return quantities with their units; other columns, as a lone ``p value``, are the user's."""
    parts = defaultdict[str, dict[str, str]](dict)
    for column in filter(None, map(_OF_QUANTITY.fullmatch, header)):
        name, what, unit = column.groups("")
        parts[name][what] = unit
    return {name: max(of.values()) for name, of in parts.items() if "verdict" in of or len(of) == 3}


def _columns(name: str, unit: str) -> dict[str, str]:
    numbers = {what: with_unit(f"{name} {what}", unit) for what in _NUMBERS[DETERMINED]}
    return {"verdict": f"{name} verdict"} | numbers


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return nan


def _is_used(trace: Mapping[str, str]) -> bool:
    """Return True if a trace tells anything; of a rejected fit, without its model."""
    return trace["fit"] != FAILED and (trace["fit"] != REJECTED or trace.get(LINEAR) == "yes")


def _counts(grouped: _Grouped, cells: Sequence[Cell], found: Path) -> str:
    counts = [counted(len(grouped.used), "trace"), counted(len(cells), "cell")]
    units = len({(cell.group, cell.unit) for cell in cells})
    counts += [f"{units} units ({grouped.unit})"] if grouped.unit else []
    return f"{visible(found)}: {', '.join(counts)}, {100 * grouped.confidence:g} % limits"


def _printed(compared: Compared, grouped: _Grouped) -> str:
    """Return a comparison as a table, but for quantities that no cell determines."""
    named = {name for (name, _), row in compared.items() if row["determined"]}
    rows = [
        (with_unit(name, grouped.units[name]), group, *_shown(row))
        for (name, group), row in compared.items()
        if name in named
    ]
    scatter = "SD of logarithms: cells, units"
    of_units = [f"units ({grouped.unit})", scatter] if grouped.unit else []
    of_group = "geometric mean", f"ratio to {grouped.names[0]}", "p"
    return aligned(rows, ("quantity", "group", "cells determined", *of_units, *of_group))


def _shown(row: Mapping[str, Any]) -> Iterator[str]:
    """Yield cells of a row of the printed table."""
    yield f"{row['determined']} of {row['cells']}" + f", {row['bounded']} bounded" * (
        row["bounded"] > 0
    )
    if "units" in row:
        scatters = (row.get(f"scatter_of_{what}") for what in ("cells", "units"))
        yield str(row["units"])
        yield ", ".join("?" if it is None else f"{plain(100 * it, 2)} %" for it in scatters)
    for what, low, high in (("median", "low", "high"), ("ratio", "ratio_low", "ratio_high")):
        none = "too few" if what == "median" else ""
        value = plain(row[what]) if what in row else none
        yield with_limits(row[what], row[low], row[high]) if low in row else value
    yield f"{row['p']:#.2g}" if "p" in row else "none" * ("no_p" in row)


def _left_out(grouped: _Grouped, cells: Sequence[Cell]) -> Iterator[str]:
    """Say which traces are left out, and which are averaged."""
    traces, made_by = grouped.traces, grouped.made_by
    for status, why in ((REJECTED, "the fit is rejected"), (FAILED, "not identified")):
        if names := [it["trace"] for it in traces if it["fit"] == status and not _is_used(it)]:
            yield f"Left out, {why}: {', '.join(names)}."
    if names := [it["trace"] for it in traces if it["fit"] == REJECTED and _is_used(it)]:
        yield f"Used only whatever the model, as their fits are rejected: {', '.join(names)}."
    for column in made_by:
        if names := [it["trace"] for it in traces if not it[column]]:
            yield f"Left out, nothing under {column}: {', '.join(names)}."
    if several := [cell for cell in cells if len(cell.traces) > 1]:
        names = [f"{cell.name} ({len(cell.traces)})" for cell in several]
        yield f"Averages of several traces: {_few(names)}."


def _not_determined(cells: Sequence[Cell], compared: Compared) -> Iterator[str]:
    """Say which cells do not determine a quantity; of one that none does, only that."""
    determined = {name for (name, _), row in compared.items() if row["determined"]}
    for name, group in compared:
        told = [it for it in cells if it.group == group and name in it.others]
        told = [it for it in told if not it.rejects(name)]
        if bounds := "; ".join(_bounds(name, told)):
            counts = ", which count as bounds" if name in determined else ""
            yield f"{name} of {group}: {bounds}{counts}."
        if names := [it.name for it in told if it.others[name][0] not in _ONE_SIDED]:
            yield f"{name} of {group}: nothing is told by {_few(names)}."


def _bounds(name: str, cells: Sequence[Cell]) -> Iterator[str]:
    """Say how many cells bound a quantity, and by what."""
    for verdict, words in _ONE_SIDED.items():
        if ends := sorted(it.others[name][1] or 0 for it in cells if it.others[name][0] == verdict):
            reach = " to ".join(dict.fromkeys(plain(end) for end in (ends[0], ends[-1])))
            yield f"{verdict} in {len(ends)} ({words} {reach})"


def _pairs(cells: Sequence[Cell], compared: Compared, grouped: _Grouped) -> Iterator[str]:
    """Say which units are in a group and in the first, and what follows."""
    first, *others = grouped.names
    of = {name: {it.unit for it in cells if it.group == name and it.unit} for name in grouped.names}
    for group in others:
        paired = any(row.get("pairs") for (_, name), row in compared.items() if name == group)
        if both := sorted(of[first] & of[group]):
            left = sorted(of[first] ^ of[group]) if paired else both
            follows = "are pairs, of which ratio and p are (paired t test)"
            follows = follows if paired else "are fewer than those of one group alone"
            yield (
                f"{grouped.unit} in {first} and {group}: {_few(both)}. These {follows}"
                + f"; left out of ratio and p: {_few(left)}" * bool(left)
                + ". If a name means another one in each group, name them apart."
            )


def _without_p(compared: Compared) -> Iterator[str]:
    """Say why there is no p."""
    reasons = defaultdict[tuple[str, str], list[str]](list)
    for (name, group), row in compared.items():
        if "no_p" in row:
            reasons[group, row["no_p"]].append(name)
    for (group, why), names in reasons.items():
        yield f"No p for {', '.join(names)} of {group}: {why}."


def _shared(grouped: _Grouped) -> Iterator[str]:
    """Say which columns may be those of units."""
    for column, _ in shared_columns(grouped.told, grouped.by):
        cells = grouped.gathered(column)
        units = len({(cell.group, cell.unit) for cell in cells})
        yield (
            f"Column {column} puts {len(cells)} cells into {units} units. If these are what was "
            f"repeated, cells are not independent, and p is that of --unit {column}."
        )


def _without_doubtful(grouped: _Grouped, cells: Sequence[Cell]) -> Iterator[str]:
    if doubtful := [cell.name for cell in cells if cell.doubtful]:
        yield f"Without the doubtful {_few(doubtful)}:"
        yield _printed(grouped.compared([cell for cell in cells if not cell.doubtful]), grouped)


def _for_a_paper(grouped: _Grouped, cells: Sequence[Cell], compared: Compared) -> str:
    """Return a paragraph on how traces were identified, and groups compared."""
    made = (in_sentences(trace[METHODS]) for trace in grouped.used if trace.get(METHODS))
    outcome = ((trace["trace"], trace["fit"]) for trace in grouped.traces)
    version = max(trace.get(WRITTEN_BY, "") for trace in grouped.used) or __version__
    tests = _tests(grouped, cells, [*compared.values()])
    return paragraph([*together(made), *outcome_in_words(outcome), *tests], version)


def _tests(
    grouped: _Grouped, cells: Sequence[Cell], rows: Sequence[Mapping[str, Any]]
) -> Iterator[str]:
    """Yield sentences on what was compared, and how."""
    counts = []
    for group in grouped.names:
        units = [cell.unit for cell in cells if cell.group == group]
        of = f" in {counted(len({*units}), 'unit')}" if grouped.unit else ""
        counts.append(f"{group} {counted(len(units), 'cell')}{of}")
    yield f"Groups are those of {grouped.by}: {'; '.join(counts)}."
    unit = "Cells are taken for independent, and weigh in geometric means"
    if grouped.unit:
        unit = f"The unit is the {grouped.unit}, cells weigh in its geometric mean"
    yield f"{unit} by their scatter and errors (DerSimonian and Laird 1986); limits are Student's."
    if any(row["bounded"] for row in rows):
        yield (
            "Cells that are only bounded count by Tobin's likelihood (1958), with errors by the "
            "jackknife, and the larger p of two readings of bounds is given."
        )
    tests = {bool(row["pairs"]) for row in rows if "p" in row}
    named = "Welch's t test", f"the paired t test of each {grouped.unit} that is in both groups"
    if tests:
        by = " or ".join(named[it] for it in sorted(tests))
        yield f"Logarithms of means are compared by {by}; p is not adjusted for several quantities."
    if grouped.names[2:]:
        yield f"Groups are compared with {grouped.names[0]}, p values adjusted after Holm (1979)."


def _few(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= _FEW else f"{len(names)} of them"
