"""The command ``biogrip groups``: compare cells by the table of ``biogrip identify --csv``.

`biogrip.judging.cells` has the statistics.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from math import inf, nan
from pathlib import Path
from textwrap import fill
from typing import NoReturn

from biogrip import __version__
from biogrip.command.outputs import COLUMNS as OF_TRACES
from biogrip.command.outputs import FAILED, LINEAR, METHODS, REASONS, WRITTEN_BY, check_outputs
from biogrip.command.words import in_sentences, outcome_in_words, paragraph, together
from biogrip.digits import counted, plain, rounded_numbers, with_limits, with_unit
from biogrip.errors import BiogripError, nearest
from biogrip.files import atomic_write
from biogrip.judging.cells import (
    COLUMNS,
    Cell,
    Compared,
    Told,
    at_bounds,
    compare,
    gather,
    shared_columns,
)
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED
from biogrip.judging.verdicts import (
    BOUNDED_ABOVE,
    BOUNDED_BELOW,
    DETERMINED,
    FIT_REJECTED,
    NOT_DETERMINED,
)
from biogrip.records import read_rows, write_rows
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
_ONE_SIDED = {BOUNDED_ABOVE: ("at most", "lower"), BOUNDED_BELOW: ("at least", "higher")}
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
    if problem := trace_file_problem(found):
        raise BiogripError(f"FOUND: {problem}")
    if unit == by:
        raise BiogripError("--unit: found the column of --by; allowed is another, as of dishes.")
    header, *rows = read_rows(found)
    units = _units(header)
    columns = [column for item in units.items() for column in _columns(*item).values()]
    made_by = [by] if unit is None else [by, unit]
    for name in ("trace", "fit", "confidence", *made_by, *columns):
        if header.count(name) != 1:
            many, near = ("two", "") if name in header else ("no", nearest(name, header))
            raise BiogripError(
                f"{visible(found)}: found {many} column '{name}'; allowed is a table that `biogrip "
                f"identify --csv` wrote, and of --by and --unit columns of it.{near}"
            )
    traces = [dict(zip(header, map(visible, row), strict=True)) for row in rows]
    # Names of two of the columns end with the unit of what is read.
    mine = {*OF_TRACES, *columns}
    copied = {it for it in header if it not in mine and not it.startswith(("noise", "misfit"))}
    used, told = [], []
    for number, own in enumerate(traces, start=2):
        where = f"{visible(found)}, row {number} ({own['trace']})"
        if own["fit"] not in _FITS:
            _refuse(own, "fit", ", ".join(_FITS), where)
        if all(own[name] for name in made_by) and _is_used(own):
            used.append(own)
            told.append(_told(own, copied | {*made_by}, units, where))
    check_outputs([("--csv", table), ("--plot", plot)], [found])
    if plot is not None and plot.suffix not in (".png", ".pdf"):
        text = f"found {visible(plot)}; allowed is a name that ends with .png or .pdf."
        raise BiogripError(f"--plot: {text}")
    levels = sorted({float(own["confidence"]) for own in used})
    if len(levels) != 1:
        of = " and ".join(map(str, levels)) or "no trace of a group"
        raise BiogripError(
            f"{visible(found)}: found limits of {of}; allowed are those of one confidence, of "
            "traces that were identified."
        )
    (confidence,) = levels
    cells = gather(told, by, unit, confidence)
    names = list(dict.fromkeys(own[by] for own in traces if all(own[it] for it in made_by)))
    compared = compare(cells, names, confidence, units=unit is not None)
    counts = [counted(len(used), "trace"), counted(len(cells), "cell")]
    counts += [f"{len({(it.group, it.unit) for it in cells})} units ({unit})"] if unit else []
    lines = [
        f"{visible(found)}: {', '.join(counts)}, {100 * confidence:g} % limits",
        _printed(compared, names, units, unit),
        *_left_out(traces, made_by, cells, told),
        *_not_known(cells, compared, confidence, unit),
        *_not_paired(cells, unit),
        *([] if unit else _shared(told, by, names, confidence, compared)),
    ]
    if doubtful := [cell.name for cell in cells if cell.doubtful]:
        sound = [cell for cell in cells if not cell.doubtful]
        again = compare(sound, names, confidence, units=unit is not None)
        lines += [f"Without the doubtful {_few(doubtful)}:", _printed(again, names, units, unit)]
    made = (in_sentences(own[METHODS]) for own in used if own.get(METHODS))
    outcome = ((it["trace"], it["fit"], it.get(REASONS) or it.get(FAILED, "")) for it in traces)
    text, latex = paragraph(
        [*together(made), *outcome_in_words(outcome), *_tests(cells, names, by, unit)],
        max(own.get(WRITTEN_BY, "") for own in used) or __version__,
    )
    lines += ["", "For a paper:", fill(text, _WIDTH), "", "As LaTeX:", fill(latex, _WIDTH)]
    print(visible_lines("\n".join(lines)))
    if table is not None:
        lines_of = ([*key, units[key[0]], *map(row.get, COLUMNS)] for key, row in compared.items())
        columns = ["quantity", "group", "unit", *COLUMNS, WRITTEN_BY]
        write_rows(table, columns, ([*rounded_numbers(row), __version__] for row in lines_of))
    if plot is not None:
        _draw(cells, compared, units, plot)
    if said := [visible(path) for path in (table, plot) if path]:
        print(f"Written to {', '.join(said)}.")


def _draw(cells: Sequence[Cell], compared: Compared, units: Mapping[str, str], plot: Path) -> None:
    # Imported here: loading Matplotlib takes long.
    from biogrip.figures.cells import ONE_COLUMN_IN, draw_cells
    from biogrip.figures.style import styled

    with styled(), atomic_write(plot) as scratch:
        drawn = draw_cells(cells, compared, units, ONE_COLUMN_IN)
        kind = plot.suffix.removeprefix(".")
        mark = {"Creator" if kind == "pdf" else "Software": f"{WRITTEN_BY} {__version__}"}
        drawn.savefig(scratch, format=kind, dpi=300, metadata=mark | _UNDATED[kind])


def _told(own: Mapping[str, str], copied: set[str], units: Mapping[str, str], where: str) -> Told:
    """Return what a row tells; refuse what `identify` does not write there."""
    lowest, highest = _CONFIDENCES
    if not lowest <= _number(own["confidence"]) <= highest:
        _refuse(own, "confidence", f"a number from {lowest} to {highest}", where)
    quantities = {}
    for name, unit in units.items():
        columns = _columns(name, unit)
        if (verdict := own[columns["verdict"]]) not in _NUMBERS:
            _refuse(own, columns["verdict"], ", ".join(_NUMBERS).rstrip(", "), where)
        least, above, numbers = 0.0, "above 0", dict[str, float]()
        for what in _NUMBERS[verdict]:
            number = _number(own[columns[what]])
            if not (least <= number < inf and number > 0):
                _refuse(own, columns[what], f"a number {above}", where)
            least, above = number, f"of at least {number:g}, its {what}"
            numbers[what] = number
        value, low, high = map(numbers.get, ("value", "low", "high"))
        quantities[name] = verdict, value, low, high
    words = {name: own[name] for name in own if name in copied}
    return Told(own["trace"], own["fit"], words, quantities)


def _refuse(own: Mapping[str, str], column: str, allowed: str, where: str) -> NoReturn:
    raise BiogripError(f"{where}, {column}: found '{own[column]}'; allowed is {allowed}.")


def _units(header: Sequence[str]) -> dict[str, str]:
    """Return quantities with their units; other columns, as a lone ``p value``, are the user's."""
    found: dict[str, dict[str, str]] = {}
    for name, what, unit in (it.groups("") for it in map(_OF_QUANTITY.fullmatch, header) if it):
        found.setdefault(name, {})[what] = unit
    return {name: max(of.values()) for name, of in found.items() if "verdict" in of or len(of) == 3}


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


def _printed(
    compared: Compared, names: Sequence[str], units: Mapping[str, str], unit: str | None
) -> str:
    """Return a comparison as a table, but for quantities that no cell determines."""
    rows = []
    for (name, group), row in compared.items():
        if not any(compared[name, each]["determined"] for each in names):
            continue
        mean, ratio, p = "too few", "", ""
        if "low" in row:
            mean = with_limits(row["median"], row["low"], row["high"])
        elif "median" in row:
            mean = plain(row["median"])
        if "p" in row:
            ratio = with_limits(row["ratio"], row["ratio_low"], row["ratio_high"])
            p = f"{row['p']:.2g}"
        elif unit and group != names[0] and "median" in row:
            ratio = "cannot be told"
        determined = [f"{row['determined']} of {row['cells']}"]
        if unit:
            scatters = [row.get("scatter_of_cells"), row.get("scatter_of_units")]
            shown = ("?" if it is None else f"{plain(100 * it, 2)} %" for it in scatters)
            determined += [str(row["units"]), ", ".join(shown)]
        rows.append((with_unit(name, units[name]), group, *determined, mean, ratio, p))
    of_units = [unit, f"scatter of cells, {unit}"] if unit else []
    ratio_to = f"ratio to {names[0]}"
    of_group = "geometric mean", ratio_to, "p"
    return aligned(rows, ("quantity", "group", "determined in", *of_units, *of_group))


def _left_out(
    traces: Sequence[Mapping[str, str]],
    made_by: Sequence[str],
    cells: Sequence[Cell],
    told: Sequence[Told],
) -> Iterator[str]:
    """Say which traces are left out, and which are averaged."""
    for status, why in ((REJECTED, "the fit is rejected"), (FAILED, "not identified")):
        if names := [it["trace"] for it in traces if it["fit"] == status and not _is_used(it)]:
            yield f"Left out, {why}: {', '.join(names)}."
    if names := [own["trace"] for own in traces if own["fit"] == REJECTED and _is_used(own)]:
        yield f"Used only whatever the model, as their fits are rejected: {', '.join(names)}."
    for column in made_by:
        if names := [own["trace"] for own in traces if not own[column]]:
            yield f"Left out, nothing under {column}: {', '.join(names)}."
    if several := [cell for cell in cells if len(cell.traces) > 1]:
        names = [f"{cell.name} ({len(cell.traces)})" for cell in several]
        yield f"Averages of several traces: {_few(names)}."
        for column, nests in shared_columns(told, made_by[0]):
            words = ({own.words[column] for own in cell.traces} for cell in several)
            if column not in made_by and not nests and max(map(len, words)) > 1:
                yield (
                    f"These differ in {column}: if cells are numbered anew in each, "
                    f"--unit {column} takes them for different ones."
                )


def _not_known(
    cells: Sequence[Cell], compared: Compared, confidence: float, unit: str | None
) -> Iterator[str]:
    """Say which cells are in no mean, as they do not determine the quantity."""
    for name in dict.fromkeys(name for name, _ in compared):
        if any(row["determined"] for (own, _), row in compared.items() if own == name):
            groups = [group for own, group in compared if own == name]
            for group in groups:
                these = [cell for cell in cells if cell.group == group]
                yield from _of_group(name, group, these, confidence, unit)
        else:
            every = [it for it in cells if it.others.get(name, ("",))[0] not in ("", FIT_REJECTED)]
            said = "; ".join(_bounds(name, every, 0)) or "nothing is told by any"
            if every:
                yield f"{name} is determined in none of {counted(len(every), 'cell')}: {said}."


def _bounds(name: str, cells: Sequence[Cell], most: int) -> Iterator[str]:
    """Say how many cells bound a quantity, and by what; of few by name."""
    for verdict, (words, _) in _ONE_SIDED.items():
        some = [cell for cell in cells if cell.others.get(name, ("",))[0] == verdict]
        ends = sorted(end for cell in some if (end := cell.others[name][1]))
        if some and len(some) <= most:
            named = (f"{cell.name} ({words} {plain(cell.others[name][1] or 0)})" for cell in some)
            yield f"in {', '.join(named)}"
        elif some:
            reach = " to ".join(dict.fromkeys(plain(end) for end in (ends[0], ends[-1])))
            yield f"{verdict} in {len(some)} ({words} {reach})"


def _of_group(
    name: str, group: str, cells: Sequence[Cell], confidence: float, unit: str | None
) -> Iterator[str]:
    """Say what cells of a group leave open, and what mean bounds would give as values."""
    for verdict, (_, moved) in _ONE_SIDED.items():
        own = [cell for cell in cells if cell.others.get(name, ("",))[0] == verdict]
        for said in _bounds(name, own, _FEW):
            placed = at_bounds(cells, name, verdict)
            row = compare(placed, [group], confidence, units=unit is not None)[name, group]
            what = f"{name} of {group}: only bounded {said.removeprefix(verdict).strip()}, so in no"
            moves = f"that of all cells is {moved}"
            if "median" in row:
                moves = f"with them at these bounds it is {plain(row['median'])}, {moves}"
            yield f"{what} mean; {moves}."
    told = {*_ONE_SIDED, FIT_REJECTED}
    if some := [it.name for it in cells if name in it.others and it.others[name][0] not in told]:
        yield f"{name} of {group}: nothing is told by {_few(some)}."


def _not_paired(cells: Sequence[Cell], unit: str | None) -> Iterator[str]:
    """Say which units stand in several groups."""
    groups = Counter(name for name, _ in {(cell.unit, cell.group) for cell in cells})
    if unit and (both := sorted(name for name, count in groups.items() if count > 1)):
        several = ", ".join(both) if len(both) <= _FEW else f"{len(both)} of {unit}"
        yield f"In several groups: {several}. Each counts there as another one; nothing is paired."


def _shared(
    told: Sequence[Told], by: str, names: Sequence[str], confidence: float, compared: Compared
) -> Iterator[str]:
    """Say what columns that cells share would change as units."""
    for column, _ in shared_columns(told, by):
        cells = gather(told, by, column, confidence)
        again = compare(cells, names, confidence, units=True)
        ps = [
            f"{row['p']:.2g} for {name}{f' of {group}' if names[2:] else ''} (here {here})"
            for (name, group), row in again.items()
            if "p" in row
            and (here := f"{own['p']:.2g}" if "p" in (own := compared[name, group]) else "none")
        ]
        units = len({(cell.group, cell.unit) for cell in cells})
        then = f"p is {', '.join(ps)}" if ps else "whether groups differ cannot be told"
        yield (
            f"Column {column} puts {len(cells)} cells into {units} units. If these are what was "
            f"repeated, cells are not independent: with --unit {column} {then}."
        )


def _tests(cells: Sequence[Cell], names: Sequence[str], by: str, unit: str | None) -> Iterator[str]:
    """Yield sentences for a paper on what was compared, and how."""
    counts = []
    for group in names:
        own = [cell for cell in cells if cell.group == group]
        of = f" in {counted(len({cell.unit for cell in own}), 'unit')}" if unit else ""
        counts.append(f"{group} {counted(len(own), 'cell')}{of}")
    yield f"Groups are those of {by}: {'; '.join(counts)}."
    if unit:
        yield (
            f"The unit is the {unit}: geometric means are those of the units' geometric means, "
            "with limits of Student's t, and ratios are compared by Welch's t test (Lord et al., "
            "Journal of Cell Biology 219 (2020), e202001064)."
        )
    else:
        yield (
            "Cells are taken for independent: geometric means have random effects "
            "(DerSimonian and Laird 1986) and limits after Hartung and Knapp, and ratios are "
            "compared by Welch's t test."
        )
    if names[2:]:
        yield f"Groups are compared with {names[0]}, and p values are adjusted after Holm (1979)."


def _few(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= _FEW else f"{len(names)} cells"
