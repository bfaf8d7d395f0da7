"""How often limits hold the truth: of intervals and verdicts, beside spreads and bounds."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from biogrip.judging.levels import WIDE
from biogrip.judging.likelihood import bound
from biogrip.judging.quantities import parameters_and_sum
from biogrip.judging.verdicts import BOUNDED_ABOVE, BOUNDED_BELOW, DETERMINED, NOT_DETERMINED
from biogrip.physics.noise import standard_deviation
from biogrip.records.identifications import INTERVALS
from biogrip.records.traces import read_target
from biogrip.study.study import Study
from biogrip.tables.cases import target_of
from biogrip.tables.layout import Column, Row, ShownTable

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
) -> ShownTable:
    """Compare estimates and intervals of many seeds with the true values and the bound.

    Targets are files of all cases, in their order; calibrated grippers those of the cases that have
    one.
    """
    calibrations = iter(calibrated)
    rows: list[Row] = []
    estimated = pd.concat([INTERVALS.read(it) for it in intervals], ignore_index=True)
    for (name, case), target in zip(study.cases.items(), targets, strict=True):
        experiment = case.experiment.calibrated([next(calibrations)] if case.is_calibrated else [])
        log_truth = experiment.logs(case.parameters)
        found = estimated[estimated["case"] == name]
        time_s, _, rotation = read_target(target)
        _, sensitivity = experiment.of(time_s, rotation).residuals(log_truth)
        noise_sd = standard_deviation(rotation, case.noise)
        for quantity in parameters_and_sum(experiment.searched):
            mine = found[found["quantity"] == quantity.label]
            fitted = mine[mine["estimate_rest_known"].notna()]
            shown = mine[mine["verdict"].notna()]
            if fitted.empty and not np.any(shown["verdict"] != NOT_DETERMINED):
                continue
            # The config's value: `log_truth` is clipped to the search range.
            names = [experiment.searched.names[index] for index in quantity.members]
            truth = sum(case.parameters[member] for member in names)
            head = {"case": name, "quantity": quantity.label, "unit": quantity.unit}
            limit = 100 * bound(sensitivity, noise_sd, log_truth, quantity)
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
    return ShownTable(caption, _COLUMNS, rows)


def _judged_seeds(study: Study) -> str:
    """Return in words which seeds have verdicts."""
    every = {case.block.identifiability.verdicts_every for case in study.cases.values()}
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
        "coverage_percent": 100 * np.mean(_holds(found, truth)),
        "seeds": len(found),
    }


def _shown(found: pd.DataFrame, truth: float) -> Row:
    """Count verdicts from whole profiles, and the true ones among them."""
    counts: Row = {"shown_seeds": len(found)}
    held = _holds(found, truth, "shown_")
    for name, verdicts in _COUNTED.items():
        chosen = found["verdict"].isin(verdicts)
        counts[f"shown_{name}"] = int(np.sum(chosen))
        counts[f"shown_{name}_true"] = int(np.sum(held[chosen]))
    return counts


def _holds(found: pd.DataFrame, truth: float, which: str = "") -> "pd.Series[bool]":
    """Return whether limits hold the true value, (n_rows,); an open side does."""
    low, high = found[f"{which}low"].fillna(0.0), found[f"{which}high"].fillna(np.inf)
    return low.le(truth) & high.ge(truth)


_COUNT_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("verdict", "Verdict"),
    Column("seeds", "Seeds"),
    Column("reached", "With this verdict"),
    *(Column(f"reached_{end}_percent", f"{end.title()} %") for end in ("from", "to")),
    Column("narrow", f"Within a factor of {WIDE:g}"),
    Column("true", "True"),
    Column("true_percent", "True %"),
    *(Column(f"true_{end}_percent", f"{end.title()} %") for end in ("from", "to")),
)


def verdict_counts(study: Study, intervals: list[Path]) -> ShownTable:
    """Count verdicts of whole profiles, and those whose limits hold the true value."""
    rows: list[Row] = []
    estimated = pd.concat([INTERVALS.read(it) for it in intervals], ignore_index=True)
    for name, case in study.cases.items():
        found = estimated[estimated["case"] == name]
        for quantity in parameters_and_sum(case.experiment.searched):
            mine = found[(found["quantity"] == quantity.label) & found["verdict"].notna()]
            target = target_of(quantity.label, case.parameters)
            head: Row = {"case": name, "quantity": quantity.label, "unit": quantity.unit}
            rows += [head | row for row in _counts(mine, target)]
    percents = " or ".join(sorted({f"{100 * case.confidence:g}" for case in study.cases.values()}))
    caption = (
        f"Verdicts from whole profiles at {percents} %, as users are shown them, in every seed: "
        "how often each is reached, with the 95 % interval of its share, and how often its limits "
        "hold the true value, with the 95 % interval of that share (Clopper and Pearson)."
    )
    return ShownTable(caption, _COUNT_COLUMNS, rows)


def _counts(found: pd.DataFrame, target: float | None) -> Iterator[Row]:
    """Yield a row for every verdict on a quantity."""
    for verdict, mine in found.groupby("verdict"):
        count = len(mine)
        row: Row = {"target": target, "verdict": verdict, "seeds": len(found), "reached": count}
        row |= _interval("reached", count, len(found))
        if verdict == DETERMINED:
            row["narrow"] = np.sum(mine["shown_high"] <= WIDE**2 * mine["shown_low"])
        if verdict != NOT_DETERMINED and target is not None:
            true = int(np.sum(_holds(mine, target, "shown_")))
            row |= {"true": true, "true_percent": 100 * true / count}
            row |= _interval("true", true, count)
        yield row


def _interval(name: str, count: int, tried: int) -> Row:
    """Return the 95 % interval of Clopper and Pearson for a share, in percent."""
    low, high = binomtest(count, tried).proportion_ci(0.95, method="exact")
    return {f"{name}_from_percent": 100 * low, f"{name}_to_percent": 100 * high}
