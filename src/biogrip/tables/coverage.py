"""Coverage of confidence intervals, and spread of estimates over the Cramér-Rao bound."""

from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.judging.likelihood import bound
from biogrip.judging.quantities import parameters_and_sum
from biogrip.judging.verdicts import BOUNDED_ABOVE, BOUNDED_BELOW, DETERMINED, NOT_DETERMINED
from biogrip.physics.noise import standard_deviation
from biogrip.records.identifications import INTERVALS
from biogrip.records.traces import read_target
from biogrip.study.study import Study
from biogrip.tables.layout import Column, Row, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("bound_percent", "Cramér-Rao bound, rest known %", 3),
    Column("spread_percent", "Spread %", 3),
    Column("spread_over_bound", "Spread / bound", 3),
    Column("rest_known_over_bound", "The same, rest known", 3),
    Column("bias_percent", "Bias %", 2),
    Column("confidence_percent", "Confidence %", 4),
    Column("coverage_percent", "Intervals that hold the truth %", 3),
    Column("seeds", "Seeds"),
    Column("shown_seeds", "Seeds judged in full"),
    Column("shown_determined", "Determined"),
    Column("shown_determined_true", "Determined and true"),
    Column("shown_one_sided", "Bounded on one side"),
    Column("shown_one_sided_true", "Bounded and true"),
)
# Verdicts that are counted together.
_COUNTED = {"determined": (DETERMINED,), "one_sided": (BOUNDED_BELOW, BOUNDED_ABOVE)}


def coverage(
    study: Study, targets: list[Path], intervals: list[Path], calibrated: list[Path]
) -> Table:
    """Compare estimates and intervals of many seeds with the true values and the bound.

    Targets are files of all cases, in their order; calibrated grippers those of the cases that have
    one.
    """
    calibrations = iter(calibrated)
    rows: list[Row] = []
    estimated = pd.concat([INTERVALS.read(file) for file in intervals])
    for (name, case), target in zip(study.cases.items(), targets, strict=True):
        case_problem = case.problem.calibrated([next(calibrations)] if case.is_calibrated else [])
        log_truth = case_problem.logs(case.parameters)
        found = estimated[estimated["case"] == name]
        time_s, _, rotation = read_target(target)
        _, sensitivity = case_problem.of(time_s, rotation).residuals(log_truth)
        noise_rad = standard_deviation(rotation, case.noise)
        for quantity in parameters_and_sum(case_problem.searched):
            mine = found[found["quantity"] == quantity.label]
            fitted = mine[mine["estimate_rest_known"].notna()]
            shown = mine[mine["verdict"].notna()]
            if fitted.empty and not np.any(shown["verdict"] != NOT_DETERMINED):
                continue
            # The config's value: `log_truth` is clipped to the search range.
            names = [case_problem.searched.names[index] for index in quantity.members]
            truth = sum(case.parameters[member] for member in names)
            head = {"case": name, "quantity": quantity.label, "unit": quantity.unit}
            limit = 100 * bound(sensitivity, noise_rad, log_truth, quantity)
            numbers = _spreads(fitted, truth, limit, case.confidence) | _shown(shown, truth)
            rows.append({**head, "target": truth, **numbers})
    caption = (
        "Least squares over many seeds, for every quantity that a case's traces should determine: "
        "standard deviation of the estimates' logarithms beside the Cramér-Rao bound, and how "
        "often the intervals hold the truth. The bound is for a simpler problem than that of the "
        "fits: parameters without information in the traces are fixed. Fits search these too; as "
        "they are near zero they can only be overestimated, at the expense of others: hence the "
        "bias, and a spread above the bound. Rest known: the spread with these parameters at "
        "their true values. On the right: verdicts from whole profiles, as users are shown them, "
        f"in {_judged_seeds(study)}, and how many of them are true; one-sided limits hold more "
        "often than the confidence says."
    )
    return Table(caption, _COLUMNS, rows)


def _judged_seeds(study: Study) -> str:
    """Return in words which seeds have verdicts."""
    every = {case.verdicts_every for case in study.cases.values()}
    if len(every) > 1:
        return "some seeds"
    return "every seed" if 1 in every else f"every {every.pop()}th seed"


def _spreads(found: pd.DataFrame, truth: float, bound: float, confidence: float) -> Row:
    """Return bound, spread and coverage of a quantity; nothing of one without intervals."""
    if found.empty:
        return {}
    spread, rest_known = (
        100 * float(np.std(np.log(found[name].to_numpy(float)), ddof=1))
        for name in ("estimate", "estimate_rest_known")
    )
    return {
        "bound_percent": bound,
        "spread_percent": spread,
        "spread_over_bound": spread / bound,
        "rest_known_over_bound": rest_known / bound,
        "bias_percent": np.mean(100 * np.log(found["estimate"].to_numpy(float) / truth)),
        "confidence_percent": 100 * confidence,
        "coverage_percent": 100 * np.mean(holds(found, truth)),
        "seeds": len(found),
    }


def _shown(found: pd.DataFrame, truth: float) -> Row:
    """Count verdicts from whole profiles, and the true ones among them."""
    counts: Row = {"shown_seeds": len(found)}
    held = holds(found, truth, "shown_")
    for name, verdicts in _COUNTED.items():
        chosen = found["verdict"].isin(verdicts).to_numpy()
        counts[f"shown_{name}"] = int(np.sum(chosen))
        counts[f"shown_{name}_true"] = int(np.sum(held[chosen]))
    return counts


def holds(found: pd.DataFrame, truth: float, which: str = "") -> Array:
    """Return 1 for every row whose limits hold the true value, else 0; (n_rows,)."""
    low = found[f"{which}low"].fillna(0.0).to_numpy(float)
    high = found[f"{which}high"].fillna(np.inf).to_numpy(float)
    return ((low <= truth) & (truth <= high)).astype(float)
