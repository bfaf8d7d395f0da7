"""Errors of identifications that wrongly assume bilateral contact."""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.least_squares import identify_many
from biogrip.fit.problem import Identification
from biogrip.physics.jaw_force import compute_grip
from biogrip.physics.noise import add_noise, stream
from biogrip.physics.protocol import torque_history
from biogrip.physics.simulation import simulated_rotation
from biogrip.physics.unilateral import unilateral_response
from biogrip.records.traces import as_written
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Cell, Column, Table

_MOST_SEEDS = 20
_MEANS_LITTLE = 1000.0
_COLUMNS = (
    Column("case", "Case"),
    Column("lost_at_s", "Contact lost at (s)"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target"),
    Column("held", "Held throughout"),
    Column("let_go", "Let go"),
    Column("error_percent", "Error (%)"),
    Column("until_lost", "Let go, until then"),
    Column("until_lost_error_percent", "Error (%)"),
)


def linear_cases(study: Study) -> list[str]:
    """Return the simulated cases whose target is linear."""
    return [name for name in study.gripped if not study.cases[name].nonlinear_target]


def _few(case: Case) -> int:
    return min(case.seeds, _MOST_SEEDS)


def contact_loss(study: Study) -> Table:
    """Identify traces simulated with bilateral and with unilateral contact, and compare errors."""
    rows = [
        row for name, case in study.cases.items() for row in _rows(study.study_seed, name, case)
    ]
    caption = (
        "Cases in which the jaws would have to pull: what least squares identifies, assuming "
        "bilateral contact, in traces with bilateral contact, in traces with loss of contact where "
        "the force reaches zero, and in the readings of the latter before the loss. "
        f"Medians over the same noise of at most {_MOST_SEEDS} seeds; the misfit is over the RMS "
        "of the noise. Errors are (target - identified)/target; empty beyond "
        f"{_MEANS_LITTLE:g} %."
    )
    return Table(caption, _COLUMNS, rows)


def _rows(study_seed: int, name: str, case: Case) -> list[tuple[Cell, ...]]:
    torque, model = torque_history(case.phases), case.sample.model
    network = model.sample(case.parameters)
    if compute_grip(case.gripper, network, torque, nonlinear=False).pulls_from_s is None:
        return []
    time_s = case.sampling.over(torque.end_s)
    held = as_written(simulated_rotation(case.gripper, network, torque, time_s, nonlinear=False)[0])
    free = unilateral_response(case.gripper, network, torque, time_s)
    let_go = as_written(free.rotation_rad[0])
    if not free.parted_s:
        return []
    noise = [
        add_noise(held, case.noise, stream(study_seed, name, seed, "noise"), time_s) - held
        for seed in range(_few(case))
    ]
    lost = free.parted_s[0]
    whole, until = np.ones(len(time_s), dtype=bool), time_s < lost
    traces = ((held, whole), (let_go, whole), (let_go, until))
    found = [
        _medians(study_seed, name, case, time_s[kept], [(rotation + n)[kept] for n in noise])
        for rotation, kept in traces
    ]
    rms = [float(np.sqrt(np.mean(np.square([n[kept] for n in noise])))) for _, kept in traces]
    rows: list[tuple[Cell, ...]] = []
    for index, quantity in enumerate(model.quantities):
        label = " + ".join(parameter.name for parameter in quantity)
        target = sum(case.parameters[parameter.name] for parameter in quantity)
        given, wrong, cut = (None if values is None else values[index] for values in found)
        errors = [_error(target, value) for value in (wrong, cut)]
        unit = quantity[0].unit
        rows.append((name, lost, label, unit, target, given, wrong, errors[0], cut, errors[1]))
    misfits = [
        None if values is None or not level else values[-1] / level
        for values, level in zip(found, rms, strict=True)
    ]
    rows.append((name, lost, "misfit", "noise", 1.0, *misfits[:2], None, misfits[2], None))
    return rows


def _medians(
    study_seed: int, name: str, case: Case, time_s: Array, traces: Sequence[Array]
) -> list[float] | None:
    """Return the median of every quantity and of the misfit in rad; None for too few samples."""
    problem = case.problem.to_identify()
    searched, model = problem.searched, problem.model
    nuisance = problem.offset + problem.drift
    if len(time_s) <= len(searched.names) + nuisance + 1:
        return None
    problems = [problem.of(time_s, trace) for trace in traces]
    rngs = [stream(study_seed, name, seed, "contact_loss") for seed in range(len(traces))]
    found: list[Identification] = identify_many(problems, case.least_squares, rngs)
    values = [
        {**problem.fixed, **dict(zip(searched.names, one.parameters, strict=True))} for one in found
    ]
    medians = [
        float(np.median([sum(value[p.name] for p in quantity) for value in values]))
        for quantity in model.quantities
    ]
    return [*medians, float(np.median([one.misfit_rad for one in found]))]


def _error(target: float, value: float | None) -> float | None:
    error = 100 * (target - value) / target if target and value is not None else None
    return None if error is None or abs(error) > _MEANS_LITTLE else error
