"""Bounds of designed experiments beside the study's own, and coverage of their intervals."""

from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.design.schedule import forces
from biogrip.experiment.protocol import torque_history
from biogrip.products.designed_cases import USED, bounds, designed_cases
from biogrip.products.files.intervals import INTERVALS
from biogrip.products.files.verdicts import EXPECTED, read_verdicts
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.products.uses import each, from_study
from biogrip.study.study import Case, Study

_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("noise_urad", "Noise (µrad)"),
    Column("before_percent", "Bound with the study's protocol %"),
    Column("bound_percent", "Bound with its own %"),
    Column("expected_verdict", "Expected verdict"),
    Column("spread_percent", "Spread of seeds %"),
    Column("spread_over_bound", "Spread / bound"),
    Column("coverage_percent", "Intervals that hold the truth %"),
    Column("seeds", "Seeds"),
    Column("least_force_nN", "Least jaw force after its second step (nN)"),
)


def covered_cases(study: Study) -> list[str]:
    """Return the designed cases that have intervals."""
    return [name for name in designed_cases(study) if study.cases[name].coverage_seeds > 0]


def designed(study: Study, expected: list[Path], intervals: list[Path]) -> Table:
    """Compare bounds of both experiments with estimates of many seeds."""
    files = iter(intervals)
    rows: list[tuple[Cell, ...]] = []
    for (name, case), foreseen in zip(study.cases.items(), expected, strict=True):
        verdicts = {item["quantity"]: item for item in read_verdicts(foreseen)["quantities"]}
        found = INTERVALS.read(next(files)) if case.coverage_seeds else None
        truths = np.array([[case.parameters[name] for name in case.searched.names]])
        before, after = (
            bounds(case, experiment, truths)[0]
            for experiment in (case.study.experiment, case.experiment)
        )
        least_N = _least_force(case)
        for index, parameter in enumerate(case.searched.parameters):
            truth = case.parameters[parameter.name]
            head = (name, parameter.name, parameter.unit, truth, 1e6 * case.design.noise_level)
            both = (_percent(before[index]), _percent(after[index]))
            verdict = verdicts[parameter.name]["verdict"]
            observed = _of_seeds(found, parameter.name, truth, float(after[index]))
            rows.append((*head, *both, verdict, *observed, 1e9 * least_N))
    caption = (
        "Cramér-Rao bounds, one standard deviation, with all parameters free and the arms' "
        "inertia in the model, at the same noise: with the protocol and the sampling of the study, "
        "and with the case's own. Without a number: no finite bound. Beside it what the "
        "case's experiment is to tell by the profile of a trace without noise, the standard "
        "deviation of what least squares finds in many seeds, and how often its intervals, of the "
        "study's confidence, hold the truth."
    )
    return Table(caption, _COLUMNS, rows)


def _least_force(case: Case) -> float:
    """Return the least jaw force in N from the second step on; before, it starts at zero."""
    torque = torque_history(case.experiment[0])
    values = [[case.parameters[name] for name in case.searched.names]]
    time_s, force = forces(case.gripper, case.searched.network(values), case.experiment[0])
    second_s = float(torque.time_s[min(1, len(torque.time_s) - 1)])
    return float(force[0, time_s > second_s].min())


def _percent(bound: float) -> Cell:
    """Return a relative bound in percent; none if it is 1000 % or more."""
    return 100 * float(bound) if bound < 10 else None


def _of_seeds(found: pd.DataFrame | None, name: str, truth: float, bound: float) -> list[Cell]:
    """Return spread, its ratio to the bound, coverage, and number of seeds."""
    if found is None:
        return [None] * 4
    mine = found[(found["quantity"] == name) & found["low"].notna() & found["high"].notna()]
    if len(mine) < 2:
        return [None] * 4
    spread = float(np.std(np.log(mine["estimate"].to_numpy(float)), ddof=1))
    holds = (mine["low"] <= truth) & (truth <= mine["high"])
    return [100 * spread, spread / bound, 100 * float(holds.mean()), len(mine)]


DESIGNED = table(
    designed,
    item="designed experiments",
    caption="Bounds of designed experiments beside those of the study's own, with spread and "
    "coverage over seeds identified in them.",
    uses=from_study(
        cases=each(designed_cases, USED, coverage_seeds=lambda case: case.coverage_seeds > 0)
    ),
    reads={
        "expected": of_cases(EXPECTED, designed_cases),
        "intervals": of_cases(INTERVALS.path, covered_cases),
    },
    when=designed_cases,
)
