"""Cells of a study's sheet, identified from all their traces in batches."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.digits import rounded_numbers
from biogrip.groups.group_findings import CellProfile, JudgedCell, QuantityProfile
from biogrip.identifiability.profiles import Profile
from biogrip.own_traces.fitted_traces import TraceToFit, options_of, trace_of
from biogrip.own_traces.judged_cells import CellJudge, CellResults
from biogrip.own_traces.kept_results import (
    FOLDER,
    file_of,
    kept_results,
    read_results,
    write_results,
)
from biogrip.own_traces.rows_of_sheets import cases_of, refuse_mixed_models
from biogrip.products.digest import digest
from biogrip.products.files.rows import write_rows
from biogrip.products.plan import ROWS_A_BATCH, Plan, Wildcards
from biogrip.products.product import Product, Reads, Weight
from biogrip.products.source_files import fingerprint
from biogrip.progress import Progress
from biogrip.study.sheet import Cell
from biogrip.study.study import Study

BATCHES = f"{FOLDER}/cells/batches/{{rows}}.csv"
"""Lists of the cells of a batch."""

# Decimals of logarithms: far finer than any limit, and the same on all processors.
_DECIMALS = 9


@dataclass(frozen=True)
class CellToFit:
    """A cell, and all that its fit depends on but the readings and the code."""

    name: str
    """Name of the cell."""
    confidence: float
    """Confidence level of its limits."""
    traces: tuple[TraceToFit, ...]
    """Its traces."""

    @property
    def results(self) -> Path:
        """File of its results."""
        return file_of(FOLDER / "cells", self.name, self.name)

    def made_for(self) -> str:
        """Return a digest of its readings, of what its fit depends on, and of the code."""
        readings = [trace.made_for().partition("-")[0] for trace in self.traces]
        return f"{digest([self, readings])}-{fingerprint(__name__)}"

    @property
    def cell(self) -> Cell:
        """The cell without its group, which changes no fit."""
        rows = tuple(
            replace(row, cell=self.name)
            for row in (trace.options.row for trace in self.traces)
            if row is not None
        )
        return Cell(self.name, "", rows)


def fit(to_fit: list[CellToFit], traces: list[Path], batch: Path) -> None:
    """Identify those cells of a batch whose results are not there yet, and list all."""
    progress = Progress("cells", len(to_fit), quiet=True)
    for own in to_fit:
        made_for = own.made_for()
        if read_results(own.results, made_for) is None:
            judge = CellJudge(own.traces[0].options, own.confidence, progress.within)
            write_results(own.results, made_for, _plain(judge.judged(own.cell)))
    write_rows(batch, ("cell", "results"), [(own.name, own.results.name) for own in to_fit])


def read_cell(to_fit: CellToFit, group: str) -> CellResults:
    """Read the results of a cell that the sheet assigns to a group.

    Raises
    ------
    BiogripError
        If they are not there, or were changed.
    """
    found = kept_results(to_fit.results)
    profiles = tuple(_profile(to_fit.name, own) for own in found["profiles"])
    data = found["data"] and {**found["data"], "group": group}
    judged = JudgedCell(to_fit.name, group, profiles)
    return CellResults(judged, data, found["skipped"], found["readings"])


def _plain(results: CellResults) -> dict[str, Any]:
    return {
        "data": rounded_numbers(results.data),
        "skipped": results.skipped,
        "readings": dict(results.readings),
        "profiles": [
            {
                "quantity": each.quantity,
                "unit": each.unit,
                "log_values": _rounded(each.of_cell.profile.log_values.tolist()),
                "increases": rounded_numbers(each.of_cell.profile.increases.tolist()),
                "ends": _rounded([each.of_cell.profile.low, each.of_cell.profile.high]),
                "best": round(each.of_cell.profile.best, _DECIMALS),
                "threshold": each.of_cell.threshold,
                "freedom": None if np.isinf(each.of_cell.freedom) else each.of_cell.freedom,
            }
            for each in results.judged.profiles
        ],
    }


def _rounded(logarithms: Sequence[float | None]) -> list[float | None]:
    return [None if own is None else round(own, _DECIMALS) for own in logarithms]


def _profile(cell: str, plain: dict[str, Any]) -> QuantityProfile:
    values, increases = np.array(plain["log_values"]), np.array(plain["increases"])
    low, high = plain["ends"]
    profile = Profile(values, increases, plain["best"], low, high, np.zeros(0))
    freedom = np.inf if plain["freedom"] is None else plain["freedom"]
    own = CellProfile(cell, profile, plain["threshold"], freedom)
    return QuantityProfile(plain["quantity"], plain["unit"], own)


def check_sheet(study: Study) -> None:
    """Check all rows of a study's sheet together with its config, and its groups.

    Raises
    ------
    BiogripError
        With the places of the first few problems.
    """
    if traces := options_of(study):
        cases = cases_of(traces)
        if study.cells:
            refuse_mixed_models(traces, cases)


def every_cell(study: Study) -> list[CellToFit]:
    """Return the cells of a study's sheet, if it has groups."""
    return _of_cells(study, slice(None))


def _of_cells(study: Study, chosen: slice) -> list[CellToFit]:
    block = study.traces
    if block is None:
        return []
    confidence = study.config.identifiability.confidence
    return [
        CellToFit(cell.name, confidence, tuple(trace_of(block, row) for row in cell.rows))
        for cell in study.cells[chosen]
    ]


def _to_fit(study: Study, job: Wildcards) -> list[CellToFit]:
    first = int(job["rows"])
    return _of_cells(study, slice(first, first + ROWS_A_BATCH))


def jobs_of_cells(plan: Plan) -> list[Wildcards]:
    """Return the batches of cells: the number of the first cell of each."""
    count = len(plan.study.cells)
    return [{"rows": str(start)} for start in range(0, count, ROWS_A_BATCH)]


def _files(plan: Plan, job: Wildcards) -> list[str]:
    return [trace.file for cell in _to_fit(plan.study, job) for trace in cell.traces]


FITTED_CELLS = Product(
    "fitted_cells",
    {"batch": BATCHES},
    fit,
    _to_fit,
    jobs_of_cells,
    message="Identifying the cells from number {rows} from all their traces",
    reads={"traces": Reads(_files)},
    weight=Weight(60, 1000),
    beside=lambda study, job: [str(own.results) for own in _to_fit(study, job)],
    of_traces=True,
)
