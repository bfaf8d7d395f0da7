"""At which sampling rate the paper's errors are of the size that noise allows."""

from pathlib import Path
from typing import Any

import numpy as np

from biogrip.identifiability.at_truth import bounds_percent
from biogrip.identifiability.quantities import Quantity
from biogrip.protocol import sample_times
from biogrip.study import build
from biogrip.tables.errors import error_percent
from biogrip.tables.layout import Cell, Column, Table

_RATES_HZ = (0.1, 1.0, 10.0, 100.0)
_DETERMINED_PERCENT = 100.0
# Where c and c_p trade, each alone is far less certain than their sum.
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


def sampling_evidence(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Compare what the paper identifies with bounds.

    Parameters
    ----------
    settings
        ``cases`` with ``parameters``, ``published``, and what their bounds depend
        on, see `bounds_percent`.
    inputs
        None.
    """
    rows: list[tuple[Cell, ...]] = []
    for name, case in settings["cases"].items():
        rows += _case_rows(name, case)
    if rows:
        table = np.array([row[2:] for row in rows], dtype=float)
        ratios = np.sqrt(np.mean((table[:, :1] / table[:, 1:]) ** 2, axis=0))
        rows.append(("all", "error / bound", None, *(float(ratio) for ratio in ratios)))
    return Table(_CAPTION, _COLUMNS, rows)


def _case_rows(name: str, case: dict[str, Any]) -> list[tuple[Cell, ...]]:
    """Rows of what the trace determines at some of the rates and the paper has a value of."""
    truth, identified = case["parameters"], case["published"]["identified"]
    names = [p.name for p in build.sample_model(case).parameters if p.name not in case["fixed"]]
    end_s = build.torque(case).end_s
    times = [sample_times(end_s, rate) for rate in _RATES_HZ]
    at_truth = [bounds_percent(case, truth, time_s) for time_s in times]
    shown = [q for q, _ in at_truth[0]]
    if set(names) <= set(identified):
        shown = _told_apart(bounds_percent(case, identified, times[-1]))
    rows: list[tuple[Cell, ...]] = []
    for index, (q, _) in enumerate(at_truth[0]):
        bounds = [found[index][1] for found in at_truth]
        members = [names[member] for member in q.members]
        known = all(member in identified for member in members)
        if q in shown and known and min(bounds) < _DETERMINED_PERCENT:
            target, found = (sum(of[m] for m in members) for of in (truth, identified))
            error = float(error_percent(target, np.array([found]))[0])
            rows.append((name, q.label, error, *bounds))
    return rows


def _told_apart(bounds: list[tuple[Quantity, float]]) -> list[Quantity]:
    """Leave out the sum of what is told apart, and else what it is made of."""
    sums = [(q, percent) for q, percent in bounds if q.form == "sum"]
    left_out = []
    for total, percent in sums:
        members = [(q, alone) for q, alone in bounds if set(q.members) < set(total.members)]
        if min(alone for _, alone in members) > _TRADING * percent:
            left_out += [q for q, _ in members]
        else:
            left_out.append(total)
    return [q for q, _ in bounds if q not in left_out]
