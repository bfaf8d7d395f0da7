"""A dish of a hundred cells, a trace each: programs in a loop, and `biogrip identify` side by side.

The cells are the study's endothelial cell, whose springs and damper differ from cell to cell; all
else is as in `traces.py`, so that every method of `by_*.py` takes the traces as they are.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.field.compared import Runs, chi2, chi2_from_truth, coverage
from benchmarks.field.elements import Maxwell
from benchmarks.field.fitted import CREEP, Fitted, Limits, Method
from benchmarks.field.traces import DURATION_S, INTERVALS, NOISE, Trace
from benchmarks.section import Row, Section, number
from benchmarks.timing import clocked
from biogrip.own_traces.many_traces import Outcome, identify_batch
from biogrip.own_traces.one_trace import IdentifyOptions
from biogrip.own_traces.read_as import ReadAs

CELLS = 100
SPREAD = 0.3
SIDE_BY_SIDE = "biogrip identify, side by side"

_K_P, _K, _C = 12.3, 35.0, 299.9
_BATCH = 25
_NAMES = {"k_p": "k_p", "k": "k_1", "c": "c_1"}


@dataclass(frozen=True)
class CellTrace(Trace):
    """Trace of one cell of the dish; its seed is the number of the cell, too."""

    @property
    def sample(self) -> Maxwell:
        """The cell: each element of the study's cell, times a log-normal factor."""
        factors = np.exp(SPREAD * self._stream("cell").standard_normal(3))
        k_p, k, c = np.array([_K_P, _K, _C]) * factors
        return Maxwell(float(k_p), np.array([k]), np.array([c / k]))


def dish(count: int = CELLS) -> list[CellTrace]:
    """Return the traces."""
    return [CellTrace(1, number) for number in range(count)]


def compared(methods: Sequence[Method], traces: Sequence[Trace]) -> list[Row]:
    """Identify all traces by every method, after a warm-up, and side by side; a row each."""
    runs: dict[str, Runs] = {SIDE_BY_SIDE: side_by_side(traces)}
    runs |= {method.name: Runs() for method in methods}
    for method in methods:
        Runs().run(method, CellTrace(1, len(traces)))
    for trace in traces:
        for method in methods:
            runs[method.name].run(method, trace)
    same_model = [runs[method.name].chi2 for method in methods if not method.more_general]
    from_truth = [chi2_from_truth(trace, CREEP) for trace in traces]
    best = np.min([from_truth, runs[SIDE_BY_SIDE].chi2, *same_model], axis=0)
    samples = [trace.sample for trace in traces]
    return [
        {
            "method": name,
            "traces": len(traces),
            "whole_s": sum(run.whole_s),
            "reached": int(np.sum(np.array(run.chi2) - best < 1)),
            "median_chi2": _finite(np.median(run.chi2 / best)),
            "largest_chi2": _finite(np.max(run.chi2 / best)),
            "failures": dict(run.failures),
            **coverage(samples, run.limits),
        }
        for name, run in runs.items()
    ]


def side_by_side(traces: Sequence[Trace]) -> Runs:
    """Identify traces from their files as `biogrip identify` does, on one core."""
    runs = Runs()
    with TemporaryDirectory() as folder:
        options = [_options(Path(folder), trace) for trace in traces]
        identify_batch(options[:1], None, page=False)
        batches = [options[first : first + _BATCH] for first in range(0, len(options), _BATCH)]
        seconds, outcomes = clocked(partial(_identified, batches))
    found = {each["trace"]: each for outcome in outcomes for each in outcome.found}
    for own, trace in zip(options, traces, strict=True):
        fitted, limits = _read(found.get(str(own.trace)), trace)
        runs.whole_s.append(seconds / len(traces))
        runs.chi2.append(np.inf if fitted is None else chi2(trace, CREEP, fitted))
        runs.limits.append(limits)
    return runs


def _identified(batches: Sequence[Sequence[IdentifyOptions]]) -> list[Outcome]:
    return [identify_batch(batch, None, page=False) for batch in batches]


def _options(folder: Path, trace: Trace) -> IdentifyOptions:
    file = folder / f"cell_{trace.seed}.csv"
    rows = np.column_stack([trace.time_s, trace.compliance])
    np.savetxt(file, rows, "%.17g", ",", header="time_s,compliance_per_Pa", comments="")
    read_as = ReadAs(reading=("compliance", "compliance_per_Pa"), hold=1.0)
    return IdentifyOptions(file, "generalized_maxwell", read_as, None, fixed={"c_p": 0.0})


def _read(data: dict[str, Any] | None, trace: Trace) -> tuple[Fitted | None, Limits | None]:
    own = {q["quantity"]: q for q in data["quantities"]} if data else {}
    if not own:
        return None, None
    k_p, k, c = (own[name]["value"] for name in _NAMES)
    sample = Maxwell(k_p, np.array([k]), np.array([c / k]))
    limits = {
        name: (_end(own[quantity]["low"], -np.inf), _end(own[quantity]["high"], np.inf))
        for quantity, name in _NAMES.items()
    }
    return Fitted(sample, sample.compliance(trace.time_s)), limits


def _end(limit: float | None, without: float) -> float:
    return without if limit is None else limit


def _finite(value: float) -> float | None:
    """JSON has no infinity."""
    return float(value) if np.isfinite(value) else None


def dish_section(methods: Sequence[Method]) -> Section:
    """Compare the methods that take creep on the dish."""
    rows = compared([method for method in methods if method.measured == CREEP], dish())
    return Section("dish", "A dish of a hundred cells", TEXT, COLUMNS, rows)


def _chi2(row: Row) -> str:
    if row["median_chi2"] is None:
        return "–"
    largest = "–" if row["largest_chi2"] is None else number(row["largest_chi2"], 4)
    return f"{number(row['median_chi2'], 4)}, {largest}"


def _limits(row: Row) -> str:
    if not row["intervals"]:
        return "gives none"
    return f"{number(100 * row['intervals_hold'] / row['intervals'])} % of {row['intervals']}"


COLUMNS: dict[str, Callable[[Row], str]] = {
    "method": lambda row: row["method"],
    "all traces, with limits (s)": lambda row: number(row["whole_s"], 3),
    "reaches the best fit": lambda row: f"{row['reached']} of {row['traces']}",
    "chi^2 over the best: median, largest": _chi2,
    "limits hold the truth": _limits,
    "failures": lambda row: ", ".join(f"{k} {n} times" for k, n in row["failures"].items()),
}

TEXT = f"""\
{CELLS} cells, one trace each, of {INTERVALS + 1:,} readings in {DURATION_S:g} s with noise of
{100 * NOISE.level:g} % of the peak (`benchmarks/field/dish.py`). The logarithms of all elements of
the study's endothelial cell spread by {SPREAD:g} from cell to cell. The first row reads files of
compliances, fits {_BATCH} traces side by side, as `biogrip identify` and the jobs of a sheet do,
and judges every trace and its residuals; all others are called as above, trace after trace. Times
are of all traces with their limits, on one core, without the start of a program. Best fit and
limits are as above, chi^2 is of what a method draws."""
