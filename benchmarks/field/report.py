"""Runs the comparison and writes what came of it as Markdown and JSON, all numbers from the run."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from benchmarks.field import by_biogrip, by_lmfit, by_mcreep, by_pyvisco, by_rheojax
from benchmarks.field.by_biogrip import OURS
from benchmarks.field.compared import compared
from benchmarks.field.dish import dish_section
from benchmarks.field.fitted import CREEP, TIME_LIMIT_S
from benchmarks.field.measured import BIOGRIP, PYRHEO, measured_section
from benchmarks.field.measured_peers import PEERS as MEASURED_BY
from benchmarks.field.traces import DURATION_S, INTERVALS, NOISE, SAMPLES
from benchmarks.machine import machine
from benchmarks.section import Row, Section, markdown, number, renewed, times_ours, written
from benchmarks.timing import clocked
from biogrip.files import write_text

RESULTS = Path(__file__).parent / "results"

METHODS = (
    *by_biogrip.METHODS,
    *by_lmfit.METHODS,
    *by_mcreep.METHODS,
    *by_rheojax.METHODS,
    *by_pyvisco.METHODS,
)
PEERS = ("lmfit", "mcreep", "pyvisco", "rheojax", "nlsq", "jax")
COUNT = 50
STARTED_BY_EYE = ("lmfit", "mcreep, times fitted from a guess")
PROFILED = (OURS, "lmfit")
CONFIDENCE = 0.95

# What is less is no difference: of errors by ratio, of coverage in shares.
_ERROR, _COVERAGE = 0.95, 0.02

SECTIONS: Mapping[str, Callable[[], Section]] = {
    "dish": partial(dish_section, METHODS),
    "measured": partial(measured_section, (BIOGRIP, *MEASURED_BY, PYRHEO)),
}

_INTRODUCTION = f"""\
# Against what the field uses

Written by `make bench-field`. Samples with {min(SAMPLES)} to {max(SAMPLES)} Maxwell branches beside
a spring are held by arms so soft that the force on them is the given one, so a trace is the creep
compliance ({INTERVALS} samples in {DURATION_S:g} s, noise of {100 * NOISE.level:g} % of the peak;
`benchmarks/field/traces.py`). {COUNT} traces of each are identified by biogrip's least squares and
by other libraries as their documentation shows: lmfit, mcreep, RheoJAX; the first lines of each
`benchmarks/field/by_*.py` say what is called and where it is documented. lmfit, and mcreep in one
row, start from what the eye reads off a trace (`benchmarks/field/starts.py`). pyvisco takes no
creep; it is given the relaxation of the same samples with noise of the same share, which is another
measurement: its errors do not compare with the others'.

*Reaches the best fit*: chi^2 is less than 1 above the lowest that any method with the samples'
model, or a fit from the truth, has on the trace. mcreep's model has a damper more and may come
below. Errors are relative, medians over the traces: of the compliance its RMS over the trace, of
the parameters (k_p, springs and relaxation times, branches by relaxation time) the best and the
worst known. A dash: no answer with as many branches on half of the traces. *Limits hold the truth*:
of all that are given, for the parameters that the method has; {100 * CONFIDENCE:g} % are aimed at.
biogrip and lmfit give profile likelihoods, the others covariances. Times are wall times on one
thread, after a warm-up, all methods trace by trace in turn; ratios to biogrip's on the same trace,
medians (lowest to highest). A fit may take {TIME_LIMIT_S:g} s, and so may its limits; what fails or
takes longer has not reached anything."""


def run(sections: Sequence[str] = ()) -> None:
    """Run the comparison and write `benchmarks/field/results`.

    Parameters
    ----------
    sections
        Of the report; what it has of the others stays. By default all are run.
    """
    if unknown := set(sections) - SECTIONS.keys():
        raise SystemExit(f"found {min(unknown)}, allowed are {', '.join(SECTIONS)}.")
    page, numbers = RESULTS / "field.md", RESULTS / "field.json"
    rows = [] if sections else _simulated()
    described = machine(PEERS)
    ran = [SECTIONS[name]() for name in sections or SECTIONS]
    if sections:
        text = renewed(page.read_text(encoding="utf-8"), described, ran)
        found = json.loads(numbers.read_text(encoding="utf-8"))
        alone = {section.name: described for section in ran}
        found["machine_of"] = {**found.get("machine_of", {}), **alone}
    else:
        text = report(described, rows, ran)
        found = {"machine": described, "field": rows}
    found |= {section.name: section.rows for section in ran}
    write_text(page, text)
    write_text(numbers, json.dumps(found, indent=1) + "\n")
    print(f"\n{text}")


def _simulated() -> list[Row]:
    rows: list[Row] = []
    for branches in SAMPLES:
        seconds, found = clocked(partial(compared, METHODS, OURS, branches, COUNT))
        print(f"{_branches(branches)}: {seconds:.0f} s", flush=True)
        rows += found
    return rows


def report(described: Mapping[str, str], rows: Sequence[Row], sections: Sequence[Section]) -> str:
    """Return everything as Markdown."""
    parts = [_INTRODUCTION, markdown([described])]
    for branches in SAMPLES:
        own = [row for row in rows if row["branches"] == branches]
        cells = [{head: cell(row) for head, cell in COLUMNS.items()} for row in own]
        parts += [f"## {_branches(branches).capitalize()}", markdown(cells)]
    parts += ["## Where a peer is better", _better(rows), "## Failures", _failures(rows)]
    return "\n\n".join([*parts, *map(written, sections)]) + "\n"


def _limits_share(row: Row) -> float | None:
    """Share of the limits that hold the truth."""
    return row["intervals_hold"] / row["intervals"] if row["intervals"] else None


def _percent(share: float | None, digits: int = 2) -> str:
    return "–" if share is None else f"{number(100 * share, digits)} %"


def _known(row: Row) -> str:
    errors = row["parameter_errors"].values()
    if None in errors:
        return "–"
    return f"{_percent(min(errors))} to {_percent(max(errors))}"


def _limits(row: Row) -> str:
    if not row["intervals"]:
        return "gives none" if row["method"].startswith("pyvisco") else "–"
    found = f"{_percent(_limits_share(row), 3)} of {row['intervals']}"
    opened = row["intervals"] - row["intervals_closed"]
    return f"{found}, {opened} open" if opened else found


def _whole(row: Row) -> str:
    return times_ours(_part(row, "whole")) if row["intervals"] else ""


def _part(row: Row, part: str) -> Row:
    """Return the times of a part under the names of any other benchmark's."""
    return {key.removeprefix(f"{part}_"): x for key, x in row.items() if key.startswith(part)}


COLUMNS: dict[str, Callable[[Row], str]] = {
    "method": lambda row: row["method"],
    "from": lambda row: row["measured"],
    "reaches the best fit": lambda row: f"{row['reached']} of {row['traces']}",
    "error of the compliance": lambda row: _percent(row["compliance_error"]),
    "of the parameters": _known,
    "limits hold the truth": _limits,
    "time of the fit (ms)": lambda row: number(row["fit_time_ms"], 2),
    "times ours": lambda row: times_ours(_part(row, "fit")),
    "with limits, times ours": _whole,
}


def _branches(count: int) -> str:
    return f"{('one', 'two', 'three')[count - 1]} branch{'es' if count > 1 else ''}"


def _better(rows: Sequence[Row]) -> str:
    """Say of each peer in what it is better, with how many branches."""
    lines = []
    for method in METHODS[1:]:
        found: dict[str, list[str]] = {}
        for row in rows:
            if row["method"] != method.name:
                continue
            (ours,) = (r for r in rows if (r["branches"], r["method"]) == (row["branches"], OURS))
            for what, how in _advantages(row, ours).items():
                found.setdefault(what, []).append(f"{_branches(row['branches'])}: {how}")
        if found:
            said = "; ".join(f"{what} ({', '.join(how)})" for what, how in found.items())
            lines.append(f"- **{method.name}**: {said}.")
    return "\n".join([*(lines or ["Nowhere."]), *_lessons(rows)])


def _advantages(row: Row, ours: Row) -> dict[str, str]:
    """Return in what a row is better than ours on the same measurement, and its time."""
    found = {}
    as_good = row["reached"] >= ours["reached"]
    if row["fit_times_ours"] < 1:
        how = f"{number(row['fit_times_ours'], 2)} times ours"
        if as_good:
            found["takes less time"] = how
        else:
            shares = f"{row['reached']} of {row['traces']} against {ours['reached']}"
            found["takes less time and reaches the best fit less often"] = f"{how}, {shares}"
    if row["intervals"] and row["whole_times_ours"] < 1 and as_good:
        found["with limits, too"] = f"{number(row['whole_times_ours'], 2)} times ours"
    if row["measured"] != CREEP:
        return found
    if row["reached"] > ours["reached"]:
        found["reaches the best fit more often"] = f"{row['reached']} to {ours['reached']}"
    if (row["compliance_error"] or 1.0) < _ERROR * ours["compliance_error"]:
        error = _percent(row["compliance_error"])
        found["errs less in the compliance"] = f"{error} to {_percent(ours['compliance_error'])}"
    theirs, own = _limits_share(row), _limits_share(ours)
    if theirs is not None and own is not None:
        nearer = abs(own - CONFIDENCE) - abs(theirs - CONFIDENCE)
        if nearer > _COVERAGE:
            found["has limits nearer to what they promise"] = (
                f"{_percent(theirs, 3)} to {_percent(own, 3)}"
            )
    return found


def _lessons(rows: Sequence[Row]) -> list[str]:
    """Say what can be learnt from peers that are as good as ours in less time."""
    by_method = {
        method.name: [row for row in rows if row["method"] == method.name]
        for method in METHODS
        if method.measured == CREEP
    }
    ours = by_method.pop(OURS)
    lessons = []
    quick = [
        name
        for name, own in by_method.items()
        if all(
            row["fit_times_ours"] < 1 and row["reached"] >= us["reached"]
            for row, us in zip(own, ours, strict=True)
        )
    ]
    if quick:
        missed = [
            f"{name} misses it on {sum(row['traces'] - row['reached'] for row in own)}"
            for name, own in by_method.items()
            if name in STARTED_BY_EYE and any(row["reached"] < row["traces"] for row in own)
        ]
        from_same = f" From the same start {', '.join(missed)} traces." if missed else ""
        more = any(method.more_general for method in METHODS if method.name in quick)
        lessons.append(
            f"From a single start {', '.join(quick)} reaches the best fit as often as biogrip does "
            "from many: the ends of the trace, and times even on a logarithmic axis, are close to "
            f"the answer.{' A model with a damper more has it easier.' if more else ''}"
            f"{from_same} To be "
            "learnt: try such a start first, and random ones over decades after it."
        )
    plain = [
        name
        for name, own in by_method.items()
        if name not in PROFILED and all(map(_holds_as_well, own, ours))
    ]
    if plain:
        lessons.append(
            "Limits of the covariance hold about as often as profile likelihoods do "
            f"({', '.join(plain)}), and cost next to nothing. To be learnt: where the trace tells "
            "as much as here they are a first answer."
        )
    return ["", *"\n\n".join(lessons).splitlines()] if lessons else []


def _holds_as_well(row: Row, ours: Row) -> bool:
    """Whether limits are about as near to what they promise as ours, of as many best fits."""
    theirs, own = _limits_share(row), _limits_share(ours)
    if theirs is None or own is None or row["reached"] < ours["reached"]:
        return False
    return abs(theirs - CONFIDENCE) <= abs(own - CONFIDENCE) + _COVERAGE


def _failures(rows: Sequence[Row]) -> str:
    lines = [
        f"- {row['method']}, {_branches(row['branches'])}: "
        + ", ".join(f"{kind} {count} times" for kind, count in row["failures"].items())
        for row in rows
        if row["failures"]
    ]
    return "\n".join(lines or ["None."])
