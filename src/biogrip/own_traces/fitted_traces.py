"""Traces of a study's sheet, identified in batches: a file of results for each."""

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from biogrip.digits import rounded_numbers
from biogrip.own_traces.kept_results import (
    FOLDER,
    file_of,
    kept_results,
    read_results,
    write_results,
)
from biogrip.own_traces.many_traces import identify_batch
from biogrip.own_traces.one_trace import IdentifyOptions
from biogrip.own_traces.read_as import ReadAs
from biogrip.products.digest import digest
from biogrip.products.files.rows import write_rows
from biogrip.products.plan import ROWS_A_BATCH, Plan, Wildcards
from biogrip.products.product import Product, Reads, Weight
from biogrip.products.source_files import fingerprint
from biogrip.study.defaults import default_config
from biogrip.study.load import NOT_OF_TRACES, read_configs
from biogrip.study.sheet import Row
from biogrip.study.study import Study
from biogrip.study.traces_block import RowBlock, TracesBlock

BATCHES = f"{FOLDER}/batches/{{rows}}.csv"
"""Lists of the traces of a batch, with the files of their results."""

_COLUMNS = ("trace", "results", "sha256")
_MINUTES, _MEGABYTES = 60, 1000


@dataclass(frozen=True)
class TraceToFit:
    """A trace, and all that its fit depends on but its readings and the code."""

    file: str
    """Its file."""
    model: str
    """Name of the sample model."""
    given: Mapping[str, Any]
    """Blocks that the config gives."""
    settings: Mapping[str, Any]
    """Blocks of its row."""
    default: str
    """Digest of the default study, which holds where neither says otherwise."""

    @property
    def results(self) -> Path:
        """File of its results."""
        return file_of(FOLDER, Path(self.file).stem, self.file)

    @property
    def options(self) -> IdentifyOptions:
        """Options to identify it with."""
        file = Path(self.file)
        # Its cell and factors change no fit: what shows them reads them from the sheet.
        row = Row(file, 1, file, file.stem, {}, self.settings)
        return IdentifyOptions(file, self.model, ReadAs(), None, row=row, blocks=self.given)

    def made_for(self) -> str:
        """Return a digest of its readings, of what its fit depends on, and of the code."""
        readings = hashlib.sha256(Path(self.file).read_bytes()).hexdigest()
        return "-".join((readings, digest(self), fingerprint(__name__)))


@dataclass(frozen=True)
class FittedTrace:
    """Results of a trace, as its file has them.

    Parameters
    ----------
    data
        As `identify_trace` writes it; None if the trace could not be read.
    on_page
        What a page shows of it.
    refused
        Message if it could not be read.
    """

    data: dict[str, Any] | None
    on_page: dict[str, Any] | None
    refused: str | None


def fit(to_fit: list[TraceToFit], traces: list[Path], batch: Path) -> None:
    """Identify those traces of a batch whose results are not there yet, and list all results.

    A result is there if its file says that it was made of the same readings and settings by the
    same code.
    """
    missing = [own for own in to_fit if read_results(own.results, own.made_for()) is None]
    if missing:
        outcome = identify_batch([own.options for own in missing], None, page=True)
        found = {each["trace"]: each for each in outcome.found}
        shown = dict(zip(found, outcome.on_page, strict=True))
        for own in missing:
            results = {
                "refused": outcome.refused.get(own.file),
                "data": found.get(own.file),
                "on_page": shown.get(own.file),
            }
            write_results(own.results, own.made_for(), rounded_numbers(results))
    listed = [(own.file, own.results.name, _hash(own.results)) for own in to_fit]
    write_rows(batch, _COLUMNS, listed)


def read_every(traces: Iterable[TraceToFit]) -> Iterator[FittedTrace]:
    """Yield the results of traces.

    Raises
    ------
    BiogripError
        If the results of a trace are not there, or were changed.
    """
    for own in traces:
        found = kept_results(own.results)
        yield FittedTrace(found["data"], found["on_page"], found["refused"])


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def every_trace(study: Study) -> list[TraceToFit]:
    """Return the traces of a study's sheet."""
    return _of_rows(study, slice(None))


def _of_rows(study: Study, chosen: slice) -> list[TraceToFit]:
    block = study.traces
    return [] if block is None else [trace_of(block, row) for row in block.rows[chosen]]


def trace_of(block: TracesBlock, row: RowBlock | Row) -> TraceToFit:
    """Return the trace of a row of a study's sheet."""
    return TraceToFit(str(row.file), block.model, block.given, row.settings, _default())


@cache
def _default() -> str:
    """Return a digest of what the default study says of traces."""
    said = read_configs([default_config()])
    return digest({key: said[key] for key in said if key not in NOT_OF_TRACES})


def options_of(study: Study) -> list[IdentifyOptions]:
    """Return the options of the first trace of every setting, with lines for messages."""
    block = study.traces
    if block is None:
        return []
    first: dict[str, RowBlock] = {}
    for row in block.rows:
        first.setdefault(json.dumps(row.settings, sort_keys=True), row)
    sheet = Path(block.sheet)
    return [
        replace(
            trace_of(block, row).options,
            row=Row(sheet, row.line, Path(row.file), row.cell, {}, row.settings),
        )
        for row in first.values()
    ]


def _to_fit(study: Study, job: Wildcards) -> list[TraceToFit]:
    first = int(job["rows"])
    return _of_rows(study, slice(first, first + ROWS_A_BATCH))


def _files(plan: Plan, job: Wildcards) -> list[str]:
    return [own.file for own in _to_fit(plan.study, job)]


FITTED_TRACES = Product(
    "fitted_traces",
    {"batch": BATCHES},
    fit,
    _to_fit,
    lambda plan: plan.row_jobs,
    message="Identifying the traces from row {rows}",
    reads={"traces": Reads(_files)},
    weight=Weight(_MINUTES, _MEGABYTES),
    beside=lambda study, job: [str(own.results) for own in _to_fit(study, job)],
    of_traces=True,
)
