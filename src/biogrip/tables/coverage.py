"""Whether intervals keep their promise, and estimates reach the Cramer-Rao bound."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.identifiability.fisher import bound
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.measurement import Noise, standard_deviation
from biogrip.study.case_problem import case_problem
from biogrip.tables.layout import Cell, Column, Table
from biogrip.traces import read_target

_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("bound_percent", "Cramér-Rao bound %", 3),
    Column("spread_percent", "Spread %", 3),
    Column("spread_over_bound", "Spread / bound", 3),
    Column("rest_known_over_bound", "The same, rest known", 3),
    Column("bias_percent", "Bias %", 2),
    Column("coverage_percent", "Intervals that hold the truth %", 3),
    Column("seeds", "Seeds"),
)


def coverage(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Hold estimates and intervals of many seeds against the truth and the bound.

    Parameters
    ----------
    settings
        ``cases`` by name. Of each case, there or for all of them: what `case_problem`
        needs, ``parameters`` and ``noise``.
    inputs
        For each case its target and its intervals, CSV, named after it.
    """
    rows: list[tuple[Cell, ...]] = []
    for name, own in settings["cases"].items():
        case = {**settings, **own}
        posed = case_problem(case)
        log_truth = posed.logs(case["parameters"])
        target, intervals = (path for path in inputs if path.stem == name)
        found = _read(intervals)
        time_s, _, rotation = read_target(target)
        _, sensitivity = posed.of(time_s, rotation).residuals(log_truth)
        noise_rad = standard_deviation(rotation, Noise(**case["noise"]))
        for quantity in parameters_and_sum(posed.searched):
            mine = found[found["quantity"] == quantity.label]
            if mine.empty:
                continue
            truth = float(np.exp(quantity.log(log_truth)))
            best = 100 * bound(sensitivity, noise_rad, log_truth, quantity)
            error = 100 * np.log(mine["estimate"].to_numpy(float) / truth)
            spread = _spread(mine["estimate"], truth)
            rows.append(
                (
                    name,
                    quantity.label,
                    quantity.unit,
                    truth,
                    best,
                    spread,
                    spread / best,
                    _spread(mine["estimate_rest_known"], truth) / best,
                    float(np.mean(error)),
                    100 * float(np.mean(_holds(mine, truth))),
                    len(mine),
                )
            )
    caption = (
        "Least squares over many seeds, for every quantity that a case's traces should determine: "
        "standard deviation of the estimates' logarithms beside the Cramér-Rao bound, and how "
        "often the 95 % intervals hold the truth. Rest known: with the parameters of which the "
        "traces carry no information at their true values, as the bound has them."
    )
    return Table(caption, _COLUMNS, rows)


def _spread(estimates: "pd.Series[float]", truth: float) -> float:
    """Standard deviation of the logarithm in percent."""
    return 100 * float(np.std(np.log(estimates.to_numpy(float) / truth), ddof=1))


def _holds(found: pd.DataFrame, truth: float) -> Array:
    low = found["low"].fillna(0.0).to_numpy(float)
    high = found["high"].fillna(np.inf).to_numpy(float)
    return ((low <= truth) & (truth <= high)).astype(float)


def _read(path: Path) -> pd.DataFrame:
    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as intervals: {error}.") from error
