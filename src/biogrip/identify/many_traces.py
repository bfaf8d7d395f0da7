"""Identification of several recorded traces in batches, each trace as if it were alone."""

import os
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from biogrip import __version__
from biogrip.digits import rounded_numbers, with_unit
from biogrip.errors import BiogripError
from biogrip.identify.one_trace import (
    Identified,
    IdentifyOptions,
    case_of,
    identify_alike,
    identify_trace,
    read,
)
from biogrip.identify.outputs import WRITTEN_BY, name_in_units
from biogrip.identify.trace_case import TraceCase
from biogrip.physics.instruments import INSTRUMENTS, ROTATION
from biogrip.processes import worker_processes
from biogrip.records.rows import read_rows, write_rows
from biogrip.terminal import Progress, visible, visible_lines

# Most traces of a batch, and most readings of traces that are fitted together.
_MOST_IN_BATCH, _MOST_READINGS = 25, 200_000
_OF_QUANTITY = ("verdict", "value", "low", "high")
FAILED = "failed"
"""Status of a trace that could not be read, or whose fit failed; and the column that says why."""

T = TypeVar("T")


@dataclass(frozen=True)
class Outcome:
    """Results of several traces.

    Parameters
    ----------
    found
        Result of each usable trace, as data of `identify_trace`.
    refused
        Message of each other trace, which could not be read or whose fit failed, by file.
    on_page
        What a page shows of each usable trace, if there is to be one.
    """

    found: list[dict[str, Any]]
    refused: dict[str, str]
    on_page: list[dict[str, Any]] = field(default_factory=list)


def identify_traces(
    options: Sequence[IdentifyOptions], outputs: Sequence[Path], *, page: bool
) -> Outcome:
    """Identify traces in batches, and collect the errors of those that fail.

    The result of a trace is the same, to the last bit, in any batch and alone.

    Parameters
    ----------
    options
        Options of each trace.
    outputs
        JSON file to write for each.
    page
        True to draw what a page shows of each.
    """
    if len(options) <= 1:
        return identify_batch(options, outputs, page=page)
    processors = len(os.sched_getaffinity(0))
    size = min(_MOST_IN_BATCH, -(-len(options) // processors))
    batches = [slice(start, start + size) for start in range(0, len(options), size)]
    found = []
    with worker_processes(min(processors, len(batches))) as processes:
        jobs = [
            processes.submit(identify_batch, options[own], outputs[own], page=page)
            for own in batches
        ]
        for own, job in zip(batches, jobs, strict=True):
            found.append(job.result())
            for number, each in enumerate(options[own], start=own.start + 1):
                print(f"{number} of {len(options)}: {visible(each.trace)}", file=sys.stderr)
    return _joined(found)


def _joined(outcomes: Iterable[Outcome]) -> Outcome:
    every = Outcome([], {})
    for outcome in outcomes:
        every.found.extend(outcome.found)
        every.refused.update(outcome.refused)
        every.on_page.extend(outcome.on_page)
    return every


def identify_batch(
    options: Sequence[IdentifyOptions], outputs: Sequence[Path] | None, *, page: bool
) -> Outcome:
    """Identify the traces of one batch; arguments and result as of `identify_traces`.

    Without `outputs`, no file is written.
    """
    results: dict[int, Identified | BiogripError] = {}
    if len(options) == 1 and outputs is not None:
        results[0] = _tried(options[0].trace, lambda: identify_trace(options[0], outputs[0]))
    else:
        results = _results(options, outputs)
    outcome = Outcome([], {})
    for index, own in enumerate(options):
        result = results[index]
        if isinstance(result, BiogripError):
            outcome.refused[str(own.trace)] = str(result)
        else:
            outcome.found.append(result.data)
            if page:
                # Imported here: loading pandas takes long.
                from biogrip.identify.on_page import for_page

                outcome.on_page.append(for_page(result))
    return outcome


def _results(
    options: Sequence[IdentifyOptions], outputs: Sequence[Path] | None
) -> dict[int, Identified | BiogripError]:
    """Return results or errors of traces by their index, those alike fitted together."""
    results: dict[int, Identified | BiogripError] = {}
    traces: dict[int, TraceCase] = {}
    progress = Progress("", 0, quiet=True)
    for index, own in enumerate(options):
        read_or_not = _tried(own.trace, partial(_read, own, progress))
        if isinstance(read_or_not, BiogripError):
            results[index] = read_or_not
        else:
            traces[index] = read_or_not

    def identify(group: Sequence[int]) -> None:
        found = _tried(
            options[group[0]].trace,
            lambda: identify_alike(
                [options[index] for index in group],
                [traces[index] for index in group],
                None if outputs is None else [outputs[index] for index in group],
                progress,
            ),
        )
        if not isinstance(found, BiogripError):
            results.update(zip(group, found, strict=True))
        elif len(group) == 1:
            results[group[0]] = found
        else:
            # The error is of one of them.
            for index in group:
                identify([index])

    for group in _alike(traces):
        identify(group)
    return results


def _read(options: IdentifyOptions, progress: Progress) -> TraceCase:
    return read(options, case_of(options), progress)


def _tried(trace: Path, work: Callable[[], T]) -> T | BiogripError:
    """Return what work on a trace gives, or the error by which it fails, whatever that is."""
    try:
        return work()
    except BiogripError as error:
        return error
    except BrokenPipeError:
        # Whoever reads the progress has gone.
        raise
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return BiogripError(
            f"{visible(trace)}: the fit failed, which is a fault of biogrip and not of the trace: "
            f"{type(error).__name__}: {error} ({Path(where.filename).name}, line {where.lineno}). "
            "Please report it, with the trace if it may be shared."
        )


def _alike(traces: Mapping[int, TraceCase]) -> list[list[int]]:
    """Group the indices of traces that can be fitted together, none with too many readings."""
    groups: list[list[int]] = []
    for index, trace in traces.items():
        for group in groups:
            readings = sum(len(traces[other].readings[0]) for other in (*group, index))
            if readings <= _MOST_READINGS and trace.is_like(traces[group[0]]):
                group.append(index)
                break
        else:
            groups.append([index])
    return groups


COLUMNS = (
    *("trace", "fit", "confidence", "model", "preferred_model", "samples"),
    *("noise_rad", "misfit_rad", "fixed", FAILED, WRITTEN_BY),
)
"""Columns of the table of traces, but for those of quantities."""


def write_table(
    outcome: Outcome, table: Path, copied: Mapping[str, Mapping[str, str]] | None = None
) -> None:
    """Write one row per trace as CSV: numbers, their units in the header, and why it failed if so.

    Parameters
    ----------
    outcome
        Results of the traces.
    table
        The file.
    copied
        Cells to copy of each trace, by file and column, in the order of rows. By default nothing
        is copied, and traces that failed come last.
    """
    # The same is read in all traces.
    names = {each["reads"]["quantity"] for each in outcome.found} or {ROTATION.name}
    read = INSTRUMENTS[names.pop()].read
    rows: dict[str, dict[str, Any]] = {
        each["trace"]: {
            **{name: each[name] for name in COLUMNS if name in each},
            "preferred_model": _preferred(each),
            "fixed": "; ".join(each.get("fixed", ())),
            **_of_quantities(each),
        }
        for each in map(rounded_numbers, outcome.found)
    }
    rows |= {
        trace: {
            "trace": trace,
            "fit": FAILED,
            FAILED: visible_lines(why).replace("\n", " "),
            WRITTEN_BY: __version__,
        }
        for trace, why in outcome.refused.items()
    }
    copied = copied or {trace: {} for trace in rows}
    words = dict.fromkeys(name for own in copied.values() for name in own)
    quantities = dict.fromkeys(name for row in rows.values() for name in row if name not in COLUMNS)
    first, *columns = COLUMNS
    header = [first, *words, *columns[:-2], *quantities, *columns[-2:]]
    write_rows(
        table,
        [name if name in words else name_in_units(name, read) for name in header],
        [
            [{**rows[trace], **own}.get(name, "") for name in header]
            for trace, own in copied.items()
        ],
    )


def join_tables(parts: Sequence[Path], table: Path) -> None:
    """Write the rows of several tables of traces as one, as if `write_table` had written all."""
    frames = [read_rows(part) for part in parts]
    last = COLUMNS[-2:]
    names = dict.fromkeys(name for header, *_ in frames for name in header if name not in last)
    header = [*names, *last]
    rows = [dict(zip(columns, row, strict=True)) for columns, *own in frames for row in own]
    write_rows(table, header, [[row.get(name, "") for name in header] for row in rows])


def _preferred(found: Mapping[str, Any]) -> str:
    """Return the model of the lowest BIC; "" if none were compared."""
    return next((row["model"] for row in found["models"] if row["delta_bic"] == 0), "")


def _of_quantities(found: Mapping[str, Any]) -> dict[str, Any]:
    """Return verdict, value and limits of each quantity by column, "" for limits that are none."""
    return {
        with_unit(f"{own['quantity']} {what}", own["unit"] if what != "verdict" else ""): (
            "" if own[what] is None else own[what]
        )
        for own in found["quantities"]
        for what in _OF_QUANTITY
    }
