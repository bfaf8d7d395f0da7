"""Errors of identifications that wrongly assume bilateral contact."""

from collections.abc import Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.least_squares import identify_many
from biogrip.physics.jaw_force import compute_grip
from biogrip.physics.noise import add_noise, stream
from biogrip.physics.protocol import torque_history
from biogrip.physics.simulation import simulated_rotation
from biogrip.physics.unilateral import unilateral_response
from biogrip.records.traces import as_written
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Column, Row, Table

_MOST_SEEDS = 20
# Error in percent beyond which a number means little.
_LARGEST_PERCENT = 1000.0
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
        f"{_LARGEST_PERCENT:g} %."
    )
    return Table(caption, _COLUMNS, rows)


def _rows(study_seed: int, name: str, case: Case) -> list[Row]:
    """Return a row for every quantity and the misfit; none if the jaws keep contact."""
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
        for seed in range(min(case.seeds, _MOST_SEEDS))
    ]
    lost = free.parted_s[0]
    whole, until = np.ones(len(time_s), dtype=bool), time_s < lost
    medians, misfits = {}, {}
    for column, rotation, kept in (
        ("held", held, whole),
        ("let_go", let_go, whole),
        ("until_lost", let_go, until),
    ):
        traces = [(rotation + n)[kept] for n in noise]
        medians[column] = _medians(study_seed, name, case, time_s[kept], traces)
        rms = float(np.sqrt(np.mean(np.square([n[kept] for n in noise]))))
        found = medians[column]
        misfits[column] = found[-1] / rms if found and rms else None
    rows: list[Row] = []
    for index, quantity in enumerate(model.quantities):
        names = [parameter.name for parameter in quantity]
        target = sum(case.parameters[each] for each in names)
        row: Row = {"case": name, "lost_at_s": lost, "quantity": " + ".join(names)}
        row |= {"unit": quantity[0].unit, "target": target}
        row |= {column: found[index] for column, found in medians.items() if found}
        row["error_percent"] = _error_percent(target, row.get("let_go"))
        row["until_lost_error_percent"] = _error_percent(target, row.get("until_lost"))
        rows.append(row)
    head: Row = {
        "case": name,
        "lost_at_s": lost,
        "quantity": "misfit",
        "unit": "noise",
        "target": 1.0,
    }
    return [*rows, head | misfits]


def _medians(
    study_seed: int, name: str, case: Case, time_s: Array, traces: Sequence[Array]
) -> list[float]:
    """Return the median of every quantity and of the misfit in rad; none of too few readings."""
    problem = case.problem.to_identify()
    searched, model = problem.searched, problem.model
    nuisance = problem.offset + problem.drift
    if len(time_s) <= len(searched.names) + nuisance + 1:
        return []
    problems = problem.of_each(time_s, traces)
    rngs = [stream(study_seed, name, seed, "contact_loss") for seed in range(len(traces))]
    found = identify_many(problems, case.least_squares, rngs)
    values = [
        {**problem.fixed, **dict(zip(searched.names, one.parameters, strict=True))} for one in found
    ]
    medians = [
        float(np.median([sum(value[p.name] for p in quantity) for value in values]))
        for quantity in model.quantities
    ]
    return [*medians, float(np.median([one.misfit_rad for one in found]))]


def _error_percent(target: float, value: float | None) -> float | None:
    error = 100 * (target - value) / target if target and value is not None else None
    return None if error is None or abs(error) > _LARGEST_PERCENT else error
