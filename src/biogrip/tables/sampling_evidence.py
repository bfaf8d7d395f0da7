"""Sampling rate at which the paper's errors agree with Cramér-Rao bounds."""

import numpy as np

from biogrip.experiment.protocol import sample_times
from biogrip.judging.at_truth import DETERMINED_PERCENT, bounds_percent
from biogrip.judging.quantities import Quantity
from biogrip.study.study import Case, Study
from biogrip.tables.errors_of_case import error_percent
from biogrip.tables.layout import Cell, Column, Table

_RATES_HZ = (0.1, 1.0, 10.0, 100.0)
# Factor of a parameter's bound over that of the sum above which the two count as exchangeable.
_TRADING = 2.0

_COLUMNS = (
    Column("case", "Case"),
    Column("parameter", "Parameter"),
    Column("paper_error_percent", "Paper's error %", 2),
    *(Column(f"bound_percent_{rate:g}_Hz", f"Bound % at {rate:g} Hz", 2) for rate in _RATES_HZ),
)
_CAPTION = (
    "The paper's errors beside the standard deviations that the study's noise leaves at least "
    "(Cramer-Rao bounds at the true parameters), at several sampling rates. Of c and c_p the sum "
    "stands where they trade against each other at the paper's answer. Last row: the paper's "
    "error over the bound, root mean square over the rows above; about 1 is to be expected of an "
    "identification that is as good as noise allows."
)


def sampling_evidence(study: Study) -> Table:
    """Compare errors of the paper with bounds at several sampling rates."""
    rows: list[tuple[Cell, ...]] = []
    for name, case in study.cases.items():
        rows += _case_rows(name, case)
    if rows:
        table = np.array([row[2:] for row in rows], dtype=float)
        ratios = np.sqrt(np.mean((table[:, :1] / table[:, 1:]) ** 2, axis=0))
        rows.append(("all", "error / bound", None, *(float(ratio) for ratio in ratios)))
    return Table(_CAPTION, _COLUMNS, rows)


def _case_rows(name: str, case: Case) -> list[tuple[Cell, ...]]:
    """Return a row per quantity that is determined at some rate and that the paper reports."""
    truth, identified = case.truth.parameters, case.truth.published.identified
    problem, noise = case.problem, case.noise
    names = list(problem.searched.names)
    end_s = problem.torque.end_s
    times = [sample_times(end_s, rate) for rate in _RATES_HZ]
    at_truth = [bounds_percent(problem, noise, truth, time_s) for time_s in times]
    shown = [q for q, _ in at_truth[0]]
    if set(names) <= set(identified):
        shown = _drop_redundant(bounds_percent(problem, noise, identified, times[-1]))
    rows: list[tuple[Cell, ...]] = []
    for index, (q, _) in enumerate(at_truth[0]):
        bounds = [found[index][1] for found in at_truth]
        members = [names[member] for member in q.members]
        known = all(member in identified for member in members)
        if q in shown and known and min(bounds) < DETERMINED_PERCENT:
            target, found = (sum(of[m] for m in members) for of in (truth, identified))
            error = float(error_percent(target, np.array([found]))[0])
            rows.append((name, q.label, error, *bounds))
    return rows


def _drop_redundant(bounds: list[tuple[Quantity, float]]) -> list[Quantity]:
    """Leave out sums whose members are determined, and members that only the sum determines."""
    sums = [(q, percent) for q, percent in bounds if q.form == "sum"]
    left_out = []
    for total, percent in sums:
        members = [(q, alone) for q, alone in bounds if set(q.members) < set(total.members)]
        if min(alone for _, alone in members) > _TRADING * percent:
            left_out += [q for q, _ in members]
        else:
            left_out.append(total)
    return [q for q, _ in bounds if q not in left_out]
