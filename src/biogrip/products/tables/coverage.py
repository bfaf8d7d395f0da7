"""Whether intervals keep their promise, and estimates reach the Cramer-Rao bound."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.experiment.noise import Noise, standard_deviation
from biogrip.identifiability.fisher import bound
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identify.case_problem import CaseProblem
from biogrip.products.files.intervals import INTERVALS
from biogrip.products.files.traces import TARGETS, read_target
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.study.study import Study

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


@dataclass(frozen=True)
class CaseSettings:
    """What the intervals of a case are held against.

    Parameters
    ----------
    problem
        What the identification assumes.
    parameters
        True values by name, SI units.
    noise
        What is added to the target.
    """

    problem: CaseProblem
    parameters: Mapping[str, float]
    noise: Noise


def settings(study: Study) -> dict[str, CaseSettings]:
    """Choose what the intervals are held against, by case."""
    cases = {name: study.cases[name] for name in study.covered}
    return {n: CaseSettings(c.problem, c.parameters, c.noise) for n, c in cases.items()}


def coverage(
    settings: Mapping[str, CaseSettings], targets: list[Path], intervals: list[Path]
) -> Table:
    """Hold estimates and intervals of many seeds against the truth and the bound.

    Parameters
    ----------
    settings
        Against what, by case.
    targets, intervals
        Those of the cases, CSV, in their order.
    """
    rows: list[tuple[Cell, ...]] = []
    for (name, case), target, file in zip(settings.items(), targets, intervals, strict=True):
        posed = case.problem
        log_truth = posed.logs(case.parameters)
        found = INTERVALS.read(file)
        time_s, _, rotation = read_target(target)
        _, sensitivity = posed.of(time_s, rotation).residuals(log_truth)
        noise_rad = standard_deviation(rotation, case.noise)
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


COVERAGE = table(
    coverage,
    name="coverage",
    item="coverage",
    caption="Estimates of least squares over many seeds beside the Cramér-Rao bound, and how often "
    "their 95 % intervals hold the truth.",
    sheet="tables",
    settings=settings,
    reads={
        "targets": of_cases(TARGETS, lambda study: study.covered),
        "intervals": of_cases(INTERVALS.path, lambda study: study.covered),
    },
    when=lambda study: bool(study.covered),
)
