"""Table and page of the traces of a study's sheet."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.identifiability.fit_status import REJECTED
from biogrip.own_traces.fitted_traces import (
    BATCHES,
    FittedTrace,
    TraceToFit,
    every_trace,
    read_every,
)
from biogrip.own_traces.groups_of_study import DATA
from biogrip.own_traces.many_traces import Outcome, for_table, write_table
from biogrip.own_traces.page import write_page
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Reads
from biogrip.study.sheet import MOST_SHOWN, Row
from biogrip.study.study import Study
from biogrip.terminal import visible

CATEGORY = "Traces"


@dataclass(frozen=True)
class TracesShown:
    """Traces of a sheet, with what it says of their cells."""

    traces: list[TraceToFit]
    cells: list[str]
    factors: list[dict[str, str]]

    @property
    def rows(self) -> dict[str, Row]:
        """Row of each trace by its file."""
        rows = zip(self.traces, self.cells, self.factors, strict=True)
        return {
            own.file: Row(Path(own.file), 1, Path(own.file), cell, factors)
            for own, cell, factors in rows
        }

    def results(self) -> Iterator[tuple[str, FittedTrace]]:
        """Yield the results of each trace, with its cell and factors, by file."""
        rows = self.rows
        for own, results in zip(self.traces, read_every(self.traces), strict=True):
            row = rows[own.file]
            said = {"cell": row.cell, "factors": dict(row.factors)}
            data = results.data and {**results.data, **said}
            on_page = results.on_page and {**results.on_page, **said}
            yield own.file, FittedTrace(data, on_page, results.refused)


def shown(study: Study) -> TracesShown:
    """Return the traces of a study's sheet, with what it says of their cells."""
    rows = study.traces.rows if study.traces else ()
    return TracesShown(
        every_trace(study), [row.cell for row in rows], [dict(row.factors) for row in rows]
    )


def list_traces(traces: TracesShown, batches: list[Path], csv: Path) -> None:
    """Write a row for each trace: its fit, verdicts, values and limits."""
    outcome = Outcome([], {})
    for file, results in traces.results():
        if results.data is None:
            outcome.refused[file] = results.refused or ""
        else:
            # Of very many traces all data would fill the memory.
            outcome.found.append(for_table(results.data))
    write_table(outcome, csv, traces.rows)


def show_traces(traces: TracesShown, batches: list[Path], groups: list[Path], page: Path) -> None:
    """Write the page of all traces, with the comparison of groups if there are any."""
    on_page, refused = [], {}
    for file, results in traces.results():
        if results.on_page is None:
            refused[file] = results.refused or ""
        else:
            on_page.append(results.on_page)
    compared = [json.loads(file.read_text(encoding="utf-8")) for file in groups]
    write_page(on_page, refused, page, *compared)


def check_traces(traces: TracesShown, batches: list[Path], ok: Path) -> None:
    """Write the number of traces if all could be read and no fit is rejected.

    Raises
    ------
    BiogripError
        With the first few others.
    """
    unusable, rejected = [], []
    for file, results in traces.results():
        if results.data is None:
            unusable.append(f"{visible(file)}: cannot be used.")
        elif results.data["fit"] == REJECTED:
            reason = results.data["reasons"][0]
            rejected.append(f"{visible(file)}: the fit is rejected: {reason}")
    problems = unusable + rejected
    if problems:
        more = len(problems) - MOST_SHOWN
        raise BiogripError(
            "\n".join(problems[:MOST_SHOWN] + ([f"... and {more} more."] if more > 0 else []))
        )
    write_text(ok, f"{len(traces.traces)}\n")


def once(plan: Plan) -> list[Wildcards]:
    """Return the one job of a product of all traces, if there is a sheet."""
    return [{}] if plan.study.traces else []


EVERY_BATCH = Reads(lambda plan, _: [BATCHES.format(**job) for job in plan.row_jobs])
"""The lists of all batches."""

TABLE = Product(
    "traces",
    {"csv": "results/tables/traces.csv"},
    list_traces,
    lambda study, _: shown(study),
    once,
    message="Listing all traces",
    reads={"batches": EVERY_BATCH},
    of_traces=True,
)

PAGE = Product(
    "traces_page",
    {"page": "results/traces.html"},
    show_traces,
    lambda study, _: shown(study),
    once,
    message="Writing the page of all traces",
    reads={
        "batches": EVERY_BATCH,
        "groups": Reads(lambda plan, _: [DATA] if plan.study.cells else []),
    },
    category=CATEGORY,
    item="All traces",
    caption="Every trace of the sheet: status of its fit, verdicts, values and limits.",
    of_traces=True,
)

ALL_OK = Product(
    "traces_ok",
    {"ok": "results/traces/ok.txt"},
    check_traces,
    lambda study, _: shown(study),
    lambda plan: [],
    message="Looking for traces that cannot be used or whose fits are rejected",
    reads={"batches": EVERY_BATCH},
    by_default=False,
    of_traces=True,
)
