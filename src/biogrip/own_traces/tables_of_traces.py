"""Table and page of the traces of a study's sheet."""

from dataclasses import dataclass
from pathlib import Path

from biogrip.own_traces.fitted_traces import BATCHES, TraceToFit, every_trace, read_every
from biogrip.own_traces.many_traces import Outcome, write_table
from biogrip.own_traces.page import write_page
from biogrip.products.product import Product, Reads
from biogrip.study.sheet import Row
from biogrip.study.study import Study

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

    @property
    def outcome(self) -> Outcome:
        """Results of all traces, with their cells and factors."""
        outcome = Outcome([], {})
        rows = self.rows
        for own, results in zip(self.traces, read_every(self.traces), strict=True):
            row = rows[own.file]
            said = {"cell": row.cell, "factors": dict(row.factors)}
            if results.data is None or results.on_page is None:
                outcome.refused[own.file] = results.refused or ""
            else:
                outcome.found.append({**results.data, **said})
                outcome.on_page.append({**results.on_page, **said})
        return outcome


def shown(study: Study) -> TracesShown:
    """Return the traces of a study's sheet, with what it says of their cells."""
    rows = study.traces.rows if study.traces else ()
    return TracesShown(
        every_trace(study), [row.cell for row in rows], [dict(row.factors) for row in rows]
    )


def list_traces(traces: TracesShown, batches: list[Path], csv: Path) -> None:
    """Write a row for each trace: its fit, verdicts, values and limits."""
    write_table(traces.outcome, csv, traces.rows)


def show_traces(traces: TracesShown, batches: list[Path], page: Path) -> None:
    """Write the page of all traces."""
    outcome = traces.outcome
    write_page(outcome.on_page, outcome.refused, page)


EVERY_BATCH = Reads(lambda plan, _: [BATCHES.format(**job) for job in plan.row_jobs])
"""The lists of all batches."""

TABLE = Product(
    "traces",
    {"csv": "results/tables/traces.csv"},
    list_traces,
    lambda study, _: shown(study),
    lambda plan: [{}],
    message="Listing all traces",
    reads={"batches": EVERY_BATCH},
    of_traces=True,
)

PAGE = Product(
    "traces_page",
    {"page": "results/traces.html"},
    show_traces,
    lambda study, _: shown(study),
    lambda plan: [{}],
    message="Writing the page of all traces",
    reads={"batches": EVERY_BATCH},
    category=CATEGORY,
    item="All traces",
    caption="Every trace of the sheet: status of its fit, verdicts, values and limits.",
    of_traces=True,
)
