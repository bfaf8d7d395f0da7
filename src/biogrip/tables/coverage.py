"""Coverage of confidence intervals, and spread of estimates over the Cramér-Rao bound."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.judging.fisher import bound
from biogrip.judging.quantities import parameters_and_sum
from biogrip.judging.verdicts import (
    BOUNDED_ABOVE,
    BOUNDED_BELOW,
    DETERMINED,
    NOT_DETERMINED,
)
from biogrip.physics.noise import standard_deviation
from biogrip.records.identifications import INTERVALS
from biogrip.records.traces import read_target
from biogrip.study.study import Study
from biogrip.tables.layout import Cell, Column, Table

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


def coverage(
    study: Study,
    targets: list[Path],
    intervals: list[Path],
    calibrated: list[Path],
) -> Table:
    """Compare estimates and intervals of many seeds with the true values and the bound."""
    calibrations = iter(calibrated)
    rows: list[tuple[Cell, ...]] = []
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
            # The config's value: `log_truth` is clipped to the search range.
            names = [case_problem.searched.names[index] for index in quantity.members]
            truth = sum(case.parameters[member] for member in names)
            head = (name, quantity.label, quantity.unit, truth)
            limit = 100 * bound(sensitivity, noise_rad, log_truth, quantity)
            fitted = mine[mine["estimate_rest_known"].notna()]
            shown = mine[mine["verdict"].notna()]
            if len(fitted) or np.any(shown["verdict"] != NOT_DETERMINED):
                numbers = _spreads(fitted, truth, limit, case.confidence)
                rows.append((*head, *numbers, len(shown), *_shown(shown, truth)))
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


def _spreads(found: pd.DataFrame, truth: float, bound: float, confidence: float) -> list[Cell]:
    """Return bound, spread and coverage of a determined quantity, else empty cells."""
    if found.empty:
        return [None] * 8
    spread = _spread(found["estimate"])
    return [
        bound,
        spread,
        spread / bound,
        _spread(found["estimate_rest_known"]) / bound,
        float(np.mean(100 * np.log(found["estimate"].to_numpy(float) / truth))),
        100 * confidence,
        100 * float(np.mean(holds(found, truth))),
        len(found),
    ]


def _shown(found: pd.DataFrame, truth: float) -> Iterator[int]:
    """Yield counts of determined verdicts and true ones among them, then of one-sided verdicts."""
    held = holds(found, truth, "shown_")
    for verdicts in ((DETERMINED,), (BOUNDED_BELOW, BOUNDED_ABOVE)):
        chosen = found["verdict"].isin(verdicts).to_numpy()
        yield int(np.sum(chosen))
        yield int(np.sum(held[chosen]))


def _spread(estimates: "pd.Series[float]") -> float:
    """Return the standard deviation of the logarithm in percent."""
    return 100 * float(np.std(np.log(estimates.to_numpy(float)), ddof=1))


def holds(found: pd.DataFrame, truth: float, which: str = "") -> Array:
    """Return 1 for every row whose limits hold the true value, else 0; (n_rows,)."""
    low = found[f"{which}low"].fillna(0.0).to_numpy(float)
    high = found[f"{which}high"].fillna(np.inf).to_numpy(float)
    return ((low <= truth) & (truth <= high)).astype(float)
