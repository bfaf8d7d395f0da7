"""What designed experiments tell beside the study's own, and whether they keep their promise."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.design.experiment import relative_bounds
from biogrip.design.schedule import forces
from biogrip.experiment.protocol import Phase, TorqueHistory, torque_history
from biogrip.experiment.sample import SampleModel
from biogrip.experiment.sampling import Sampling
from biogrip.instrument.gripper import Gripper
from biogrip.products.files.intervals import INTERVALS
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.response.ringing import ringing_responses
from biogrip.study.study import Study

_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("noise_urad", "Noise (µrad)"),
    Column("before_percent", "Bound with the study's protocol %"),
    Column("bound_percent", "Bound with its own %"),
    Column("spread_percent", "Spread of seeds %"),
    Column("spread_over_bound", "Spread / bound"),
    Column("coverage_percent", "Intervals that hold the truth %"),
    Column("seeds", "Seeds"),
    Column("least_force_nN", "Least jaw force after its second step (nN)"),
)


@dataclass(frozen=True)
class CaseSettings:
    """A case's experiment, and the study's.

    Parameters
    ----------
    gripper, model
        What is simulated, with inertia; the model without what is known.
    parameters
        True values by name, SI units.
    noise_rad
        Of the sensor.
    before, after
        Protocol and sampling of the study, and of the case.
    covered
        Whether its seeds are there to be held against the bound.
    """

    gripper: Gripper
    model: SampleModel
    parameters: Mapping[str, float]
    noise_rad: float
    before: tuple[tuple[Phase, ...], Sampling]
    after: tuple[tuple[Phase, ...], Sampling]
    covered: bool


def settings(study: Study) -> dict[str, CaseSettings]:
    """Choose the experiments of cases that ask for a design."""
    shared = study.config
    before = (
        shared.protocol.torques(shared.actuator),
        Sampling(shared.measurement.rate_Hz, shared.measurement.times_s, shared.measurement.bursts),
    )
    found = {}
    for name in _designed(study):
        case = study.cases[name]
        asked = case.block.design
        assert asked is not None
        found[name] = CaseSettings(
            case.gripper,
            case.problem.searched,
            case.parameters,
            asked.noise_rad,
            before,
            (case.phases, case.sampling),
            case.coverage_seeds > 0,
        )
    return found


def designed(settings: Mapping[str, CaseSettings], intervals: list[Path]) -> Table:
    """Hold bounds of both experiments, and estimates of many seeds, against one another.

    Parameters
    ----------
    settings
        The experiments, by case.
    intervals
        Estimates and limits of those cases that have them, CSV, in their order.
    """
    files = iter(intervals)
    rows: list[tuple[Cell, ...]] = []
    for name, case in settings.items():
        found = INTERVALS.read(next(files)) if case.covered else None
        before, after = (_bounds(case, *one) for one in (case.before, case.after))
        least_N = _least_force(case)
        for index, parameter in enumerate(case.model.parameters):
            truth = case.parameters[parameter.name]
            head = (name, parameter.name, parameter.unit, truth, 1e6 * case.noise_rad)
            both = (_percent(before[index]), _percent(after[index]))
            seen = _of_seeds(found, parameter.name, truth, float(after[index]))
            rows.append((*head, *both, *seen, 1e9 * least_N))
    caption = (
        "Cramér-Rao bounds, one standard deviation, with all parameters free and the arms' "
        "inertia in the model, at the same noise: with the protocol and the sampling of the study, "
        "and with the case's own. Without a number: no finite bound. Beside it the standard "
        "deviation of what least squares finds in many seeds, and how often its intervals, of the "
        "study's confidence, hold the truth."
    )
    return Table(caption, _COLUMNS, rows)


def _bounds(case: CaseSettings, phases: tuple[Phase, ...], sampling: Sampling) -> Array:
    torque: TorqueHistory = torque_history(phases)
    values = np.array([[case.parameters[name] for name in case.model.names]])
    times = sampling.over(torque.end_s)
    told = ringing_responses(case.gripper, case.model, torque, times, values)[:, 1:]
    return relative_bounds(told @ told.swapaxes(1, 2) / case.noise_rad**2)[0]


def _least_force(case: CaseSettings) -> float:
    """Least force of the jaws, in N, from the second step on: at first it has to rise."""
    torque = torque_history(case.after[0])
    values = [[case.parameters[name] for name in case.model.names]]
    time_s, force = forces(case.gripper, case.model.network(values), torque)
    second_s = float(torque.time_s[min(1, len(torque.time_s) - 1)])
    return float(force[0, time_s > second_s].min())


def _percent(bound: float) -> Cell:
    """Print no bound of which nobody would say that it is one."""
    return 100 * float(bound) if bound < 10 else None


def _of_seeds(found: pd.DataFrame | None, name: str, truth: float, bound: float) -> list[Cell]:
    """Spread, its share of the bound, coverage, and over how many seeds."""
    if found is None:
        return [None] * 4
    mine = found[(found["quantity"] == name) & found["low"].notna() & found["high"].notna()]
    if len(mine) < 2:
        return [None] * 4
    spread = float(np.std(np.log(mine["estimate"].to_numpy(float)), ddof=1))
    holds = (mine["low"] <= truth) & (truth <= mine["high"])
    return [100 * spread, spread / bound, 100 * float(holds.mean()), len(mine)]


def _designed(study: Study) -> list[str]:
    return [
        name
        for name in study.simulated
        if study.cases[name].block.design and study.cases[name].problem.inertia
    ]


DESIGNED = table(
    designed,
    name="designed",
    item="designed experiments",
    caption="What designed experiments tell beside the study's own, and whether seeds that are "
    "identified on them keep that promise.",
    settings=settings,
    reads={
        "intervals": of_cases(
            INTERVALS.path,
            lambda study: [n for n in _designed(study) if study.cases[n].coverage_seeds > 0],
        )
    },
    when=lambda study: bool(_designed(study)),
)
