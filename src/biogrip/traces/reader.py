"""Reader of recorded traces in the user's own files, with gaps, units and line numbers."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.digits import counted, plain
from biogrip.errors import BiogripError, nearest
from biogrip.physics.instruments import INSTRUMENTS, PHASE, VISCOSITY
from biogrip.physics.protocol import joined
from biogrip.terminal import visible
from biogrip.traces.columns import AXES, listed, place, plain_name, shortened, unit_of
from biogrip.traces.measurement_block import UNREAD, MeasurementBlock
from biogrip.traces.tables import (
    BLANKS,
    DAY_S,
    Sheet,
    Table,
    decimal_mark,
    find_tables,
    is_clock,
    is_number,
    number_reader,
    numbers_of,
    read_sheet,
    seconds_or_inf,
)

FEWEST_SAMPLES = 5
_PLURALS = {"time": "times", "frequency": "frequencies"}
# Relative to the last time: smaller steps are damaged numbers, not a clock's.
_SHORTEST_STEP = 1e-18
_IN_WORDS = {",": "commas", ";": "semicolons", "\t": "tabs", BLANKS: "blanks"}
_DECIMAL = {".": "point", ",": "comma"}
# What `Recording.remarks` says of parts of its form.
_REMARKS = {
    "averaged": "Averaged at repeated {axis}: {}.",
    "repeats": "Rows that were averaged {}: they are no repeats.",
    "outside": "Left out by from_s and until_s: {}.",
    "others": "Left out, for rows asks for others: {}.",
    "unclear": "The {decimal} of {} is read as a decimal mark; where it is between thousands, "
    "numbers are 1000 times as large.",
    "below": "Left out below the last row, where it may be cut: {}.",
    "lacks": "The last row has {}, as where a file was cut.",
}
# More seconds than there are in hours, minutes and seconds without a date.
_DATED_S = 1e10


def form_in_words(path: Path, form: Mapping[str, Any]) -> str:
    """Return a `Recording.form` as a small table."""
    columns = form["columns"].items()
    named = {key: f"{of['column']}, in {of['unit']}" for key, of in columns}
    found = {key: value for key, value in form.items() if key != "columns"} | named
    width = max(13, 2 + max(map(len, found)))
    rows = (f"\n  {key:<{width}}{visible(value)}" for key, value in found.items())
    return f"{visible(path)} is read as{''.join(rows)}"


@dataclass(frozen=True)
class Recording:
    """A recorded trace, in SI units."""

    time_s: Array
    """Strictly increasing times, (n_samples,), from the start of the protocol if `onset_s` is
    known."""
    readings: Array
    """What the instrument read, (n_samples,)."""
    lines: IntArray
    """Line number of each reading in the file, from 1, or index in its array, (n_samples,)."""
    path: Path | None = None
    """The file; None for arrays."""
    read: MeasurementBlock = UNREAD
    """What was read of it."""
    units: tuple[str, str] = ("s", "1")
    """Units of the times and of the readings in the file."""
    sd: Array | None = None
    """Standard deviations of the readings, (n_samples,), where they are known."""
    correlation: Array | None = None
    """Correlation of the noise of both moduli of a sweep, (n_frequencies,), ascending."""
    sd_known: bool = True
    """False if only their ratios are, as of a sweep of which nothing says the noise."""
    onset_s: float | None = None
    """Time of the clock at which the protocol starts, if that was given or fitted."""
    gaps: int = 0
    """Number of rows left out for want of a number."""
    at_steps: tuple[tuple[float, float], ...] = ()
    """Readings that were left out where a sample may jump, with their times by the clock."""
    load_noise: float = 0.0
    """Standard deviation of what was smoothed out of `load`, as a share of its largest value."""
    form: Mapping[str, Any] = field(default_factory=dict)
    """What was recognised in the file, for people to check before they believe a fit; `read_as` of
    the JSON file."""
    remarks_before: tuple[str, ...] = ()
    """Sentences that come before: of an earlier reading, where `form` is lost, on what was held, or
    on a reading that is hardly plausible."""
    load: Array | None = None
    """Times and loads, or deformations, in SI units, (n, 2), where they are read: of all rows, used
    or not."""
    later_blocks: tuple[int, ...] = ()
    """First line of each block that was joined to the first."""

    def part(self, kept: BoolArray) -> "Recording":
        """Return some of the readings, (n_samples,) true for those."""
        return replace(
            self,
            time_s=self.time_s[kept],
            readings=self.readings[kept],
            lines=self.lines[kept],
            sd=None if self.sd is None else self.sd[kept],
        )

    def place(self, sample: int, column: str) -> str:
        """Return file, line and column of a reading, or array and index, for messages."""
        return place(self.path, int(self.lines[sample]), column)

    def extent(self, column: str) -> str:
        """Return the same for all readings."""
        first, last = self.lines[[0, -1]]
        if self.path is None:
            return f"{column}[{first}] to [{last}]"
        return f"{place(self.path)}, lines {first} to {last}, column '{column}'"

    def remarks(self) -> list[str]:
        """Return sentences on what was left out, and on what is hardly plausible."""
        said = [*self.remarks_before]
        if self.gaps:
            rows = f"{counted(self.gaps, 'row')} of {len(self.time_s) + self.gaps}"
            said.append(f"Left out for want of a number: {rows}.")
        form = self.form
        for key, text in _REMARKS.items():
            if form.get(key):
                found = form[key] if isinstance(form[key], str) else counted(form[key], "reading")
                said.append(text.format(found, axis=_PLURALS[self.read.axis], **form))
        if self.load_noise:
            said.append(
                f"Smoothed out of {self.read.load}, since the readings do not follow it: what "
                f"scatters from row to row by {plain(100 * self.load_noise, 2)} % of the largest."
            )
        if "clock" in form:
            begins = ", when the protocol is taken to start" * form["clock"].startswith("dates")
            said.append(f"Times are {form['clock']}{begins * (self.onset_s is None)}.")
        if self.at_steps:
            times = ", ".join(f"{time_s:.6g} s" for time_s, _ in self.at_steps)
            said.append(
                "Left out where a sample may jump, at a step or where the rate of a deformation "
                "jumps, since nothing tells on which side they were taken: "
                f"{counted(len(self.at_steps), 'reading')}, at {times}."
            )
        return said


def is_usual(recording: Recording) -> bool:
    """Return True of arrays, and of a file with a table as biogrip itself would write."""
    form, named = recording.form, recording.read.named
    usual = {"encoding": "UTF-8", "separator": "commas", "decimal": "point"}
    odd = {"units_line", "block", "preamble", "averaged", "outside", "others", "unclear", "clock"}
    names = ["time_s", recording.read.instrument.read.column]
    return recording.path is None or (
        usual.items() <= form.items()
        and not odd & form.keys()
        and "load" not in named
        and [*named.values()][:2] == names
    )


def read_recording(path: Path, columns: MeasurementBlock) -> Recording:
    """Read the columns of a recorded trace from a file.

    The header is the line that has the columns, or has a row of units below it; of several such
    tables, ``block`` says which, or which are one test. With semicolons or tabs between cells
    numbers may have a decimal comma; one table has one decimal mark, and none between thousands.
    Times may be hours:minutes:seconds, after a date or not. Other columns may hold anything.

    An empty cell, ``nan``, ``NA``, ``N/A``, ``#N/A``, ``#NV`` (in any case) or ``-`` is a gap. Its
    row is left out and counted; nothing is interpolated. A `BiogripError` has file, line and column
    of what cannot be used, and what is allowed.
    """
    sheet, quantity = read_sheet(path, columns), columns.instrument.read
    if columns.reading_column == quantity.name and quantity.name not in sheet.cells:
        # As by --reading modulus, of a column modulus_Pa.
        usual: dict[str, Any] = {quantity.name: quantity.column}
        columns = replace(columns, **usual)
    tables, places = find_tables(path, sheet, columns)
    parts = [_read_block(path, sheet, tables[place], columns) for place in places]
    values, lines, units, form, remarks = _joined_blocks(columns, parts)
    load, chosen = None, np.concatenate([part.chosen for part in parts])
    differ = _check_conditions(
        path, columns, values[chosen], lines[chosen], sheet, tables[places[0]]
    )
    if columns.load is not None:
        history, values = values[:, [0, -1]], values[:, :-1]
        numbers = ~np.any(np.isnan(history), axis=1)
        if np.any(np.diff(history[numbers, 0]) < 0):
            # Rows of other samples, one below the other, have loads of their own.
            numbers &= chosen
        load = _load(path, columns, history[numbers], lines[numbers], units)
        # Nothing tells what came before its first row with a number, nor after the last.
        begins, ends = history[numbers][[0, -1], 0]
        values[(values[:, 0] < begins) | (values[:, 0] > ends), 1:] = np.nan
    table, several = tables[places[0]], len(tables) > 1
    names = (table.names[index] for index in parts[0].indices)
    names_and_units = ({"column": n, "unit": unit} for n, unit in zip(names, units, strict=True))
    recording = _checked(path, columns, units, values[chosen], lines[chosen])
    form = {
        "encoding": sheet.encoding,
        "separator": _IN_WORDS[sheet.separator],
        **form,
        "header_line": int(sheet.numbers[table.at]) or None,
        "units_line": None if table.units_at is None else int(sheet.numbers[table.units_at]),
        "block": columns.block or places[0] + 1 if several else None,
        "blocks": len(tables) if several else None,
        "preamble": table.title or None,
        "columns": dict(zip(columns.named, names_and_units, strict=True)),
        "rows": len(values),
        **recording.form,
        "others": int(np.count_nonzero(~chosen)) or None,
        "repeats": differ or None,
        **(_signs_of_a_cut(sheet, tables[-1]) if max(places) + 1 == len(tables) else {}),
    }
    form = {key: value for key, value in form.items() if value is not None}
    if load is None and not columns.instrument.has_jaws and len(parts) == 1:
        remarks += tuple(_about_rise(sheet, table, parts[0], columns))
    before = places[0] and tables[places[0] - 1].common(columns) == len(columns.named)
    if columns.has_tip and load is None and (before or not chosen[0]):
        said = f"Block {places[0]}" if before else "What is in rows before these"
        remarks += (f"{said} tells the zero and the approach: read it, too, with --load DEPTH.",)
    later = tuple(int(line) for part in parts[1:] for line in part.lines[:1])
    return replace(recording, form=form, load=load, remarks_before=remarks, later_blocks=later)


@dataclass(frozen=True)
class _TablePart:
    """What was read of a table."""

    indices: list[int]
    """Where the columns are."""
    units: list[str]
    """Their units."""
    values: Array
    """Their numbers in these units, (n_rows, n_columns), NaN for gaps."""
    lines: IntArray
    """Line numbers, (n_rows,)."""
    chosen: BoolArray
    """True for rows to use, (n_rows,)."""
    form: dict[str, Any]
    """What marks the numbers have."""


def _about_rise(
    sheet: Sheet, table: Table, part: _TablePart, columns: MeasurementBlock
) -> Iterator[str]:
    """Yield a sentence if a column that is not read has a load that rises before it is held."""
    controlled, read = columns.instrument.controlled.name, columns.instrument.read.name
    for index, name in enumerate(table.names):
        if name in columns.named.values() or not plain_name(name).lower().startswith(controlled):
            continue
        loads = numbers_of(sheet, table, index)[part.chosen]
        level = np.median(loads[len(loads) // 2 :])
        away = np.abs(loads - level) > levels.SAME_SHARE * abs(level)
        rising = np.flatnonzero(away & (np.abs(loads) > levels.SAME_SHARE * abs(level)))
        after = int(rising[-1]) + 1 if len(rising) > 1 else len(loads)
        if after > len(loads) // 2 or np.any(np.diff(np.abs(loads[: after + 1])) < 0):
            continue
        until = f"{part.values[part.chosen, 0][after]:g} {part.units[0]}"
        instead = {"modulus": "stress", "compliance": "strain"}.get(read, read)
        yield f"{name} rises until {until}: read {instead} with --load {quote(name)}."


def _read_block(path: Path, sheet: Sheet, table: Table, columns: MeasurementBlock) -> _TablePart:
    header_line = int(sheet.numbers[table.at]) or None
    rows = slice(table.first, table.end)
    times = [cell for i in table.indices(columns.axis_column)[:1] for cell in sheet.cells[rows, i]]
    if table.end <= table.first and table.common(columns) == len(columns.named):
        raise BiogripError(
            f"{place(path, header_line)}: found names of columns without rows of numbers below "
            "them, allowed is a table with rows."
        )
    clock = is_clock(times)
    indices, units = _columns_of(path, header_line, table, columns, clock=clock)
    values, form = _numbers(path, sheet, table, indices, clock=clock)
    chosen = _chosen(path, sheet, table, columns)
    return _TablePart(indices, units, values, sheet.numbers[rows], chosen, form)


def _joined_blocks(
    columns: MeasurementBlock, parts: Sequence[_TablePart]
) -> tuple[Array, IntArray, list[str], dict[str, Any], tuple[str, ...]]:
    """Join blocks of one test: values in the first one's units, lines, units, form, remarks.

    Times that begin anew go on from the last one before; from zero, after its last interval.
    """
    first, remarks = parts[0], list[str]()
    rows = [first.values]
    for number, part in zip(columns.blocks[1:], parts[1:], strict=False):
        sizes = [
            columns.units_of(key)[unit] / columns.units_of(key)[to]
            for key, unit, to in zip(columns.named, part.units, first.units, strict=True)
        ]
        values = part.values * sizes
        (before, last), begins = _last_two(rows[-1][:, 0]), np.nanmin(values[:, 0], initial=np.inf)
        if columns.axis == "time" and begins <= last:
            later = last if begins > 0 else last + (last - before)
            values[:, 0] += later
            remarks.append(
                f"Times of block {number} begin anew at {begins:g} {first.units[0]}: they are "
                f"counted on from {later:g} {first.units[0]}, where the block before it ends."
            )
        rows.append(values)
    joined_rows, form = np.concatenate(rows), first.form
    if str(form.get("clock")).startswith("dates"):
        joined_rows[:, 0] -= np.nanmin(joined_rows[:, 0])
    lines = np.concatenate([part.lines for part in parts])
    return joined_rows, lines, first.units, form, tuple(remarks)


def _last_two(times: Array) -> Array:
    """Return the last two of some times that are numbers, (n_rows,)."""
    numbers = times[~np.isnan(times)]
    return np.append([0.0, 0.0], numbers)[-2:]


def recording_of_arrays(columns: MeasurementBlock, *arrays: Array) -> Recording:
    """Return a recording of times, readings and perhaps standard deviations, (n_samples,) each.

    Messages and units go by the names in `columns`; a row with a NaN is a gap. A `BiogripError`
    is as of `read_recording`, or says that `columns` asks for what only a file has.
    """
    for key in ("block", "rows", "load"):
        if getattr(columns, key) is not None:
            raise BiogripError(f"measurement.{key}: is only for a file, not for arrays.")
    units: list[str] = []
    for key in columns.named:
        units.append(_unit(None, key, "", columns, units))
    values = np.column_stack(arrays)
    for row, column in np.argwhere(np.isinf(values))[:1]:
        name = [*columns.named.values()][column]
        raise BiogripError(f"{place(None, row, name)}: found inf, allowed are finite numbers.")
    return _checked(None, columns, units, values, np.arange(len(values)))


def _checked(
    path: Path | None, columns: MeasurementBlock, units: list[str], values: Array, lines: IntArray
) -> Recording:
    """Return the readings that are numbers, in SI units; refuse those that no trace can have.

    Values are times, readings and perhaps standard deviations, (n_rows, 2) or (n_rows, 3); of a
    sweep frequencies, and as many columns as are named.
    """
    gaps = np.any(np.isnan(values), axis=1)
    values, lines, without_number = values[~gaps], lines[~gaps], int(np.count_nonzero(gaps))
    for index, (key, column) in enumerate(columns.named.items()):
        for row in np.flatnonzero(values[:, index] <= 0)[:1] if key in ("sd", "loss_sd") else ():
            raise BiogripError(
                f"{place(path, lines[row], column)}: found {values[row, index]:.15g}, allowed is a "
                "standard deviation above 0."
            )
    sweeps = columns.instrument.sweeps
    if sweeps:
        ascending = np.argsort(values[:, 0], kind="stable")
        values, lines = values[ascending], lines[ascending]
    in_si = AXES[columns.axis][units[0]]
    clock = values[:, 0] * (1.0 if sweeps else in_si)
    used = clock >= (-np.inf if columns.from_s is None else columns.from_s)
    used &= clock <= (np.inf if columns.until_s is None else columns.until_s)
    values, lines, averaged = values[used], lines[used], 0
    _check_count(path, columns, len(values), without_number)
    if columns.average_repeated:
        values, lines, averaged = _averaged(values, lines, 3 if columns.partner else 2)
    _check_order(path, columns, values[:, 0], lines)
    time_s = values[:, 0] * in_si
    quantity, scale = columns.instrument.read, columns.scale or 1.0
    end = "rad_per_s" if sweeps else "s"
    form = {
        "gaps": without_number,
        "averaged": averaged or None,
        "outside": int(np.count_nonzero(~used)) or None,
        f"first_{end}": float(time_s[0]),
        f"last_{end}": float(time_s[-1]),
    }
    readings, sd = quantity.in_si(values[:, 1], units[1], scale), None
    unit = quantity.units[units[1]] * scale
    if columns.sd is not None:
        sd = values[:, 2] * abs(unit) * quantity.slope(values[:, 1] * unit)
    for row in np.flatnonzero(values[:, 0] <= 0)[:1] if sweeps else ():
        found = f"found a frequency of {values[row, 0]:.3g}; allowed is one above 0"
        raise BiogripError(f"{place(path, lines[row])}: {found}.")
    if columns.partner:
        moduli = _both_moduli(columns, units, values)
        sd = None if sd is None else joined(time_s, *(abs(unit) * values[:, 3:].T))[1]
        time_s, readings = joined(time_s, *moduli)
        lines = np.append(lines[::-1], lines)
    elif sweeps:
        time_s, readings, lines = -time_s[::-1], readings[::-1], lines[::-1]
        sd = None if sd is None else sd[::-1]
    form = {key: value for key, value in form.items() if value is not None}
    of_file = path, columns, (units[0], units[1])
    return Recording(time_s, readings, lines, *of_file, sd=sd, gaps=without_number, form=form)


def _no_column(
    path: Path, line: int | None, column: str, names: list[str], read: Collection[str] = ()
) -> str:
    """Return that there is no such column, and which is nearest of those that are not read."""
    near = nearest(column, [name for name in names if name not in read])
    there = f"The file has: {listed(names)}.{near}"
    return f"{place(path, line)}: there is no column '{visible(column)}'. {there}"


def _both_moduli(columns: MeasurementBlock, units: list[str], values: Array) -> tuple[Array, Array]:
    """Return storage and loss moduli of a sweep, (n_rows,) in SI units."""
    partner, read, scale = columns.partner, columns.instrument.read, columns.scale or 1.0
    assert partner is not None
    first = values[:, 1] * (read.units[units[1]] * scale)
    if read is VISCOSITY:
        first = first * values[:, 0] * AXES[columns.axis][units[0]]
    second = values[:, 2] * partner.units[units[2]]
    is_whole = read is VISCOSITY or read.name == "complex_modulus"
    if partner.unit == read.unit:
        loss = second * scale
        square = first**2 - loss**2
        storage = np.sign(square) * np.sqrt(np.abs(square)) if is_whole else first
    else:
        phase = second if partner == PHASE else np.arctan(second)
        storage = first * np.cos(phase) if is_whole else first
        loss = storage * np.tan(phase)
    return storage, loss


def _columns_of(
    path: Path, line: int | None, table: Table, columns: MeasurementBlock, *, clock: bool
) -> tuple[list[int], list[str]]:
    """Return where the columns to read are in a table, and their units; or list what is wrong."""
    indices, units, problems = list[int](), list[str](), list[str]()
    for key, column in columns.named.items():
        same = table.indices(column)
        if not same:
            said = _no_column(path, line, column, table.names, columns.named.values())
            problems.append(f"{said} Say which is which by {_ways(table.names, columns)}.")
            continue
        if len(same) > 1:
            where = place(path, line, column)
            problems.append(f"{where}: found {len(same)} columns of this name, allowed is one.")
        indices.append(same[0])
        below = table.units[same[0]] if table.units else ""
        try:
            timed = clock and key == columns.axis
            units.append("s" if timed else _unit(path, key, below, columns, units))
        except BiogripError as error:
            problems.append(str(error))
    if not problems and len({*indices}) < len(indices):
        of = " and ".join(columns.named)
        problems.append(f"{place(path, line)}: found {of} in one column, allowed are several.")
    if problems:
        raise BiogripError("\n".join(problems))
    return indices, units


def _ways(names: Sequence[str], columns: MeasurementBlock) -> str:
    """Return what says the columns of a file, with an example where a name tells its quantity."""
    ways = columns.said_by(*columns.named)
    if all(map(is_number, filter(None, names))):
        return f"{ways}, where no line has names by numbers, 1 to {len(names)}"
    alike = (
        (read, name) for read in INSTRUMENTS for name in names if name.lower().startswith(read)
    )
    examples = (f", as --reading {quote(f'{read}={name}')}" for read, name in alike)
    return ways + next(examples, "")


def _unit(
    path: Path | None, key: str, below: str, columns: MeasurementBlock, units: list[str]
) -> str:
    """Return the unit of a column; standard deviations have that of the readings before them."""
    unit_key, allowed = columns.unit_key(key), columns.units_of(key)
    given = getattr(columns, unit_key)
    if unit_key == "partner_unit" and allowed == columns.instrument.read.units:
        given = given or columns.reading_unit
    if key in ("sd", "loss_sd") and len(units) > 1:
        given = units[1]
    scaled = (columns.load_scale if key == "load" else columns.scale) is not None
    said_by = columns.said_by(unit_key)
    return unit_of(path, columns.named[key], given, allowed, said_by, below, scaled=scaled)


def _numbers(
    path: Path, sheet: Sheet, table: Table, indices: list[int], *, clock: bool
) -> tuple[Array, dict[str, Any]]:
    """Return the numbers of columns, (n_rows, n_columns), NaN for gaps, and what marks they have.

    If the first column has a clock's times, they are in s.
    """
    rows, width = slice(table.first, table.end), len(table.names)
    cells, lines, widths = sheet.cells[rows], sheet.numbers[rows], sheet.widths[rows]
    # Empty cells at the end are common.
    wrong = (widths <= max(indices)) | np.any(cells[:, width:] != "", axis=1)
    for row in np.flatnonzero(wrong)[:1]:
        raise BiogripError(
            f"{place(path, lines[row])}: found {counted(widths[row], 'cell')} in the row, allowed "
            f"are the header's {width}. A decimal comma needs semicolons or tabs as separators."
        )
    decimal, unclear = decimal_mark(cells[:, indices[clock:]].ravel().tolist(), sheet.separator)
    values = np.empty((len(cells), len(indices)))
    for column, index in enumerate(indices):
        number = seconds_or_inf if clock and column == 0 else number_reader(decimal)
        values[:, column] = np.fromiter(map(number, cells[:, index].tolist()), float, len(cells))
        for row in np.flatnonzero(np.isinf(values[:, column]))[:1]:
            raise BiogripError(
                f"{place(path, lines[row], table.names[index])}: found "
                f"'{shortened(cells[row, index])}', allowed is a finite number, or nan, NA, N/A, - "
                f"or nothing where there is none; numbers have a decimal {_DECIMAL[decimal]}, "
                "times may be hh:mm:ss, after a date as 2026-11-25 or not."
            )
    form = {"decimal": _DECIMAL[decimal], "unclear": unclear or None}
    if clock:
        form["clock"] = "hours:minutes:seconds, perhaps without hours"
        if np.nanmin(values[:, 0]) > _DATED_S:
            form["clock"] = "dates, from the first"
        else:
            # Without dates it falls by a day at midnight.
            there = np.flatnonzero(~np.isnan(values[:, 0]))
            falls = np.diff(values[there, 0], prepend=values[there[:1], 0]) < -DAY_S / 2
            values[there, 0] += DAY_S * np.cumsum(falls)
    return values, form


def _signs_of_a_cut(sheet: Sheet, table: Table) -> dict[str, str | None]:
    """Return what is below the last table of a file, and what its last row lacks."""
    words = " ".join(sheet.cells[table.end :, 0])
    lacks, last = None, table.end - 1
    if sheet.numbers[last] == sheet.without_end:
        lacks = "no line end"
    if last > table.first and sheet.widths[last] < sheet.widths[last - 1]:
        lacks = "fewer cells than the row before"
    below = f"'{visible(shortened(words))}'" if words else None
    return {"below": below, "lacks": lacks}


def _chosen(path: Path, sheet: Sheet, table: Table, columns: MeasurementBlock) -> BoolArray:
    """Return which rows have the values of other columns that are asked for, (n_rows,)."""
    chosen = np.ones(table.end - table.first, bool)
    if not columns.rows:
        return chosen
    # Imported here, as below: most traces are of one condition.
    from biogrip.traces.conditions import alike

    line = int(sheet.numbers[table.at]) or None
    for column, wanted in columns.rows.items():
        if not (same := table.indices(column)):
            raise BiogripError(_no_column(path, line, column, table.names))
        cells = [str(cell) for cell in sheet.cells[table.first : table.end, same[0]]]
        values = [*dict.fromkeys(cells)]
        if not (fits := alike(cells, wanted)):
            text = f"found no row with '{wanted}', allowed are {listed(values, 10)}."
            raise BiogripError(f"{place(path, line, column)}: {text}{nearest(wanted, values)}")
        chosen &= [cell in fits for cell in cells]
    return chosen


def _check_conditions(
    path: Path,
    columns: MeasurementBlock,
    values: Array,
    lines: IntArray,
    sheet: Sheet,
    table: Table,
) -> str:
    """Refuse rows of several conditions; the message names the column that tells them apart.

    Return how rows differ that are averaged, if by more than noise.
    """
    numbers = ~np.any(np.isnan(values), axis=1)
    places, lines = values[numbers, 0], lines[numbers]
    falls = columns.axis == "time" and bool(np.any(np.diff(places) < 0))
    if not falls and len(np.unique(places)) == len(places):
        return ""
    from biogrip.traces.conditions import how_they_differ, tells_apart

    sweeps = columns.axis == "frequency"
    scale = np.log(places) if sweeps and np.all(places > 0) else places
    differ = how_they_differ(scale, values[numbers, 1:], sweeps=sweeps)
    if not (falls or differ):
        return ""
    read = {index for name in columns.named.values() for index in table.indices(name)}
    rows = sheet.cells[np.searchsorted(sheet.numbers, lines)]
    others = {n: rows[:, i].tolist() for i, n in enumerate(table.names) if n and i not in read}
    condition = tells_apart(places, others)
    if condition:
        there = (f"'{name}' ({listed(values, 5)})" for name, values in condition.items())
        said = f"in rows that {' and '.join(there)} tells apart"
        ways = (f"--rows {quote(f'{name}={values[0]}')}" for name, values in condition.items())
        way = f"as by {' '.join(ways)}"
    elif sweeps and not columns.average_repeated:
        said = f"with moduli that {differ}, as of several conditions"
        way = "in a file of their own or with a column that tells them apart"
    else:
        return differ
    raise BiogripError(
        f"{place(path)}: found {_PLURALS[columns.axis]} again and again, {said}; allowed are rows "
        f"of one condition, {way}."
    )


def _load(
    path: Path, columns: MeasurementBlock, history: Array, lines: IntArray, units: list[str]
) -> Array:
    _check_count(path, columns, len(history), 0)
    if columns.average_repeated:
        history, lines, _ = _averaged(history, lines)
    _check_order(path, columns, history[:, 0], lines)
    time_s = history[:, 0] * AXES[columns.axis][units[0]]
    scale = columns.load_scale or 1.0
    sizes = columns.instrument.controlled.in_si(history[:, 1], units[-1], scale)
    if columns.has_tip and not np.any(sizes > 0):
        raise BiogripError(
            f"{place(path, lines[0], columns.load)}: found nothing above zero, allowed is a "
            f"depth or a force of a tip in contact: {columns.deepened}."
        )
    # Before its contact a tip does not press; where it touches may be fitted.
    pressed = columns.has_tip and columns.tip_power is None
    return np.column_stack((time_s, np.maximum(sizes, 0.0) if pressed else sizes))


def _averaged(values: Array, lines: IntArray, first_sd: int = 2) -> tuple[Array, IntArray, int]:
    """Average rows of equal times; return the means, their first lines, and how many rows it were.

    From a column on they have standard deviations; that of a mean is the
    root of the sum of squares over the number.
    """
    starts = np.flatnonzero(np.append(True, np.diff(values[:, 0]) != 0))
    counts = np.diff(np.append(starts, len(values)))
    means = np.add.reduceat(values, starts) / counts[:, None]
    means[:, 0] = values[starts, 0]
    means[:, first_sd:] = np.hypot.reduceat(values[:, first_sd:], starts) / counts[:, None]
    return means, lines[starts], int(np.sum(counts[counts > 1]))


def _check_count(
    path: Path | None, columns: MeasurementBlock, found: int, without_number: int
) -> None:
    # Each row of a sweep has two readings.
    fewest = FEWEST_SAMPLES // (2 if columns.partner else 1)
    if found < fewest:
        gaps = f" ({counted(without_number, 'row')} with NaN)" if without_number else ""
        *names, last = columns.named.values()
        which = f"{'both ' if len(names) == 1 else ''}{', '.join(names)} and {last}"
        raise BiogripError(
            f"{place(path)}: found {counted(found, 'row')} with a number in {which}{gaps}, "
            f"allowed are at least {fewest}."
        )


def _check_order(
    path: Path | None, columns: MeasurementBlock, time: Array, lines: IntArray
) -> None:
    least = _SHORTEST_STEP * float(np.max(np.abs(time)))
    for row in np.flatnonzero(np.diff(time) <= least)[:1]:
        before, now = time[row : row + 2]
        axes, hint = _PLURALS[columns.axis], ""
        if now == before:
            way = columns.said_by("average_repeated")
            hint = f" The readings of equal {axes} are averaged by {way}."
        raise BiogripError(
            f"{place(path, lines[row + 1], columns.axis_column)}: found {now:.15g} after "
            f"{before:.15g}, allowed are {axes} that increase.{hint}"
        )
