"""Files that biogrip writes of traces: their keys and columns, and which may be replaced."""

import json
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

from biogrip import __version__
from biogrip.command.words import set_up_in_words
from biogrip.digits import rounded_numbers, with_unit
from biogrip.errors import BiogripError
from biogrip.files import AGAIN, read_object, scratch_path, whole, write_object, write_text
from biogrip.judging.without_model import EXPONENT, LEVEL
from biogrip.physics.instruments import INSTRUMENTS, ROTATION, Channel
from biogrip.terminal import visible, visible_lines

WRITTEN_BY = "written_by_biogrip"
"""Mark at the beginning of every file that biogrip writes; files without it are not replaced."""

FAILED = "failed"
"""Status of a trace that could not be read, or whose fit failed; and the column that says why."""

LINEAR = "linear"
"""Column that is ``yes`` if a linear sample leaves noise of the trace, else ``no``."""

REASONS, METHODS = "reasons", "methods"
"""Columns of why a fit is doubtful or rejected, and of how it was made, in sentences."""

COLUMNS = (
    *("trace", "fit", "confidence", "model", "preferred_model", "samples"),
    *("noise_rad", "misfit_rad", "fixed", LINEAR, REASONS, METHODS, FAILED, WRITTEN_BY),
)
"""Columns of the table of traces, but for those of quantities."""

_LAST = COLUMNS[-4:]
_OF_QUANTITY = ("verdict", "value", "low", "high")
_RADIANS = re.compile("_rad(?=$|_per_s$)")
# A header that may be long has its mark at the end.
_HEAD_BYTES = 100_000
# The trace of which a file is the result.
_OF_TRACE = re.compile(rb'^ "trace": ("(?:[^"\\\\]|\\\\.)*"),$', re.M)


@dataclass(frozen=True)
class Outcome:
    """Results of several traces."""

    found: list[dict[str, Any]]
    """Result of each usable trace, see `data_of`."""
    refused: dict[str, str]
    """Message of each other trace, which could not be read or whose fit failed, by file."""
    pictures: dict[str, list[str]] = field(default_factory=dict)
    """Drawings of usable traces as data URLs, by file, if there is to be a page."""
    copied: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    """Cells to copy from a table of traces by file, of all in the order of its rows, and column."""


def check_outputs(outputs: Iterable[tuple[str, Path | None]], inputs: Iterable[Path]) -> None:
    """Refuse, by a `BiogripError`, files that are read, or written twice, or not to be replaced.

    `outputs` are those that are asked for, each behind its trace or its option.
    """
    # Path.exists raises for invalid paths; os.path.exists returns False.
    read = {os.path.realpath(path) for path in inputs if os.path.exists(path)}
    first: dict[str, str] = {}
    for written_for, output in outputs:
        if output is None:
            continue
        place = os.path.join(os.path.realpath(output.parent), output.name)
        if place in first:
            text = f"'{visible(first[place])}' and for '{visible(written_for)}'; allowed is a file"
            raise BiogripError(f"{visible(output)}: would be written for {text} for each.")
        first[place] = written_for
        if os.path.realpath(output) in read:
            raise BiogripError(f"{visible(output)}: is read; allowed is another file to write.")
        _check_output(output, written_for)


def _check_output(output: Path, written_for: str) -> None:
    folder = output.parent
    if os.path.isdir(output) or not os.path.isdir(folder) or not os.access(folder, os.W_OK):
        text = "cannot be written; allowed is a file in a folder that you may write to."
        raise BiogripError(f"{visible(output)}: {text}")
    try:
        # A name that is too long for the system is found here.
        for place in (output, scratch_path(output)):
            place.exists()
    except OSError as error:
        raise BiogripError(f"{visible(output)}: cannot be written: {error.strerror}.") from error
    if output.exists() and not output.is_symlink() and not output.is_file():
        raise BiogripError(f"{visible(output)}: is no regular file; allowed is one.")
    if not os.path.lexists(output):
        return
    head = b""
    if not output.is_symlink():
        with output.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    of_trace = _OF_TRACE.search(head)
    trace = json.loads(of_trace[1]) if of_trace else written_for
    if WRITTEN_BY.encode() not in head:
        problem = "is there, and biogrip did not write it"
    elif not _are_of_one_trace(trace, written_for):
        problem = f"is the result of '{visible(trace)}', and would be replaced for "
        problem += f"'{visible(written_for)}'"
    else:
        return
    text = f"{problem}; allowed is another name, or to delete it first."
    raise BiogripError(f"{visible(output)}: {text}")


def _are_of_one_trace(one: str, other: str) -> bool:
    """Return True if two names are of one trace; the folder may be said from another one."""
    if os.path.exists(one) and os.path.exists(other):
        return os.path.samefile(one, other)
    return os.path.basename(one) == os.path.basename(other)


# Keys of a result that are in the unit of what is read.
_OF_READINGS = ("misfit_rad", "noise_rad", "scatter_rad", "offset_rad", "drift_rad_per_s")


def as_written(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the result of a trace, `data_of`, as it comes back from its JSON file."""
    # Assumptions, which must be repeatable, are not rounded.
    kept = {"assumed": data["assumed"]}
    if "traces" in data:
        kept["traces"] = [as_written(trace) for trace in data["traces"]]
    return json.loads(json.dumps(rounded_numbers(data) | kept))


def write_result(path: Path, data: Mapping[str, Any], made_from: str) -> None:
    """Write the result of a trace, `data_of`, as JSON, with a digest of what it was made from."""
    write_object(path, _renamed(as_written(data), written=True), made_from)


def read_result(path: Path, made_from: str) -> dict[str, Any]:
    """Read the result of a trace, `as_written`.

    If it was made from anything else, or is not as it was written, it is a `BiogripError`.
    """
    return _renamed(read_object(path, "the result of a trace", made_from), written=False)


def _renamed(data: dict[str, Any], *, written: bool) -> dict[str, Any]:
    """Return a result whose keys name the unit of what is read, if written, or radians."""
    read = INSTRUMENTS[data["reads"]["quantity"]].read
    pairs = ((name, _in_units(name, read)) for name in _OF_READINGS)
    names = dict(pair if written else pair[::-1] for pair in pairs)

    def renamed(own: dict[str, Any]) -> dict[str, Any]:
        return {names.get(key, key): each for key, each in own.items()}

    kept = {"assumed": data["assumed"]}
    if "traces" in data:
        kept["traces"] = [_renamed(trace, written=written) for trace in data["traces"]]
    return {**json.loads(json.dumps(data), object_hook=renamed), **kept}


def _in_units(name: str, read: Channel) -> str:
    return _RADIANS.sub(read.suffix, name)


def table_of(outcome: Outcome) -> tuple[list[str], list[list[Any]]]:
    """Return header and rows, one a trace: numbers with units, and why it failed if so.

    Of what any linear sample would show, it has what was asked for, or else levels and exponents.
    Rows are in the order of what is copied.
    """
    # The same is read in all traces, but in those of one sample.
    names = [each["reads"]["quantity"] for each in outcome.found if "traces" not in each]
    read = INSTRUMENTS[names[0] if names else ROTATION.name].read
    rows: dict[str, dict[str, Any]] = {}
    for each in map(rounded_numbers, outcome.found):
        row = {name: each[name] for name in COLUMNS if name in each}
        row |= {
            "preferred_model": each["preferred_model"] or "",
            "fixed": "; ".join(each.get("fixed", ())),
            REASONS: " ".join(each["reasons"]),
            METHODS: " ".join(set_up_in_words(each)),
            LINEAR: "yes" if each["without_model"]["is_linear"] else "no",
        }
        if "traces" in each:
            told = {"traces": len(each["traces"]), "one sample p": each["agreement"]["p"]}
            row |= {**told, "noise_rad": "", "misfit_rad": ""}
        without = each["without_model"]["quantities"]
        if not each["assumed"]["identifiability"]["at_s"]:
            without = [own for own in without if own["kind"] in (LEVEL, EXPONENT)]
        for own in (*each["quantities"], *without):
            for what in _OF_QUANTITY:
                unit = own["unit"] if what != "verdict" else ""
                name = with_unit(f"{own['quantity']} {what}", unit)
                row[name] = "" if own[what] is None else own[what]
        rows[each["trace"]] = row
    for trace, why in outcome.refused.items():
        why = visible_lines(why).replace("\n", " ")
        rows[trace] = {"trace": trace, "fit": FAILED, FAILED: why, WRITTEN_BY: __version__}
    words = dict.fromkeys(name for own in outcome.copied.values() for name in own)
    quantities = dict.fromkeys(name for row in rows.values() for name in row if name not in COLUMNS)
    first, *columns = COLUMNS
    header = [first, *words, *columns[: -len(_LAST)], *quantities, *_LAST]
    return [name if name in words else _in_units(name, read) for name in header], [
        [{**rows[trace], **own}.get(name, "") for name in header]
        for trace, own in outcome.copied.items()
    ]


def join_tables(parts: list[Path], table: Path, rows: int) -> None:
    """Write the rows of several tables of traces as one, as if all had been written at once."""
    # Imported here: loading pandas takes long.
    import pandas as pd

    frames, last = [], list(_LAST)
    for part in parts:
        rows_of = StringIO(whole(part), newline="")
        frames.append(frame := pd.read_csv(rows_of, dtype=str, keep_default_na=False))
        first, end = map(int, part.stem.split("-"))
        wanted = min(end + 1, rows) - first
        if len(frame) != wanted or not {"samples", *last} <= {*frame}:
            text = f"found {len(frame)} traces, wanted {wanted} with {', '.join(last)}"
            raise BiogripError(f"{part}: {text}. {AGAIN}")
    # Of a batch that no trace was read in alone, two columns are in no unit of the others.
    at = [*frames[0].columns].index("samples") + 1
    told = [frame.columns[at : at + 2] for frame in frames if (frame.iloc[:, at + 1] != "").any()]
    for frame in frames if told else []:
        frame.columns = [*frame.columns[:at], *told[0], *frame.columns[at + 2 :]]
    every = pd.concat(frames)
    write_text(table, every[[*every.columns.drop(last), *last]].to_csv(index=False))
