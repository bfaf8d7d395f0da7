"""Evidence for the reconstructed values, and contradictions within the paper."""

import math
from pathlib import Path

import numpy as np

from biogrip.digits import counted
from biogrip.experiment.sample import SINGLE_BRANCH
from biogrip.experiment.truth import Truth
from biogrip.instrument import actuator
from biogrip.records.identifications import read_identifications
from biogrip.records.traces import (
    each_trace,
    read_jaw_force,
)
from biogrip.study.study import Study
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("paper", "Paper"),
    Column("this_study", "This study", 3),
    Column("remark", "Remark"),
)

# Section 3: torque in N m, voltage in V as the paper rounds it, and a remark.
_PRINTED_VOLTAGES = (
    (1.6e-9, "about 17", "eq. (9) with Table 2"),
    (0.32e-9, "about 7", "eq. (9) with Table 2"),
    (1.6e-6, "about 17", "section 3 prints 1.6 uN m without the factor 1e-3"),
)
_PRINTED_GENE_VALUES = "9 or 12"


def evidence(
    study: Study,
    identifications: list[Path],
    measurements: list[Path],
    targets: list[Path],
) -> Table:
    """Compare statements of the paper with results of the study."""
    rows = [*_actuator_rows(study), *_gripper_rows(study), *_gene_rows(study)]
    for name, case in study.cases.items():
        truth = case.truth
        rows += [row for path in targets if path.stem == name for row in _grip_rows(truth, path)]
        traces = [path for path in measurements if path.parent.name == name]
        identified = [path for path in identifications if path.stem == name]
        rows += _axis_rows(truth, traces)
        if study.shown == "genetic":
            rows += _generation_rows(truth, identified)
    return Table("Statements of the paper beside what the study computes.", _COLUMNS, rows)


def _actuator_rows(study: Study) -> list[tuple[Cell, ...]]:
    comb = study.actuator
    rows: list[tuple[Cell, ...]] = []
    for torque, printed, remark in _PRINTED_VOLTAGES:
        volts = float(actuator.voltage(comb, torque))
        rows.append((f"voltage for {torque:g} N m", "V", printed, volts, remark))
    remark = "has to be less than the arm length"
    rows.append(("outer radius of the comb", "mm", None, 1e3 * comb.outer_radius_m, remark))
    return rows


def _gripper_rows(study: Study) -> list[tuple[Cell, ...]]:
    gripper = study.gripper
    comb = study.actuator
    stroke = gripper.left.stiffness_Nm_per_rad * math.radians(comb.stroke_deg)
    volts = float(actuator.voltage(comb, stroke))
    arm = gripper.left
    rows = (
        ("arm length", "mm", 1e3 * gripper.arm_length_m, "config"),
        ("natural frequency of the free arm", "Hz", arm.natural_frequency_Hz, "config"),
        ("quality factor of the free arm", "", arm.quality_factor, "config"),
        ("voltage for the full stroke, no sample", "V", volts, "config's k_2"),
    )
    return [(name, unit, None, value, f"from the {source}") for name, unit, value, source in rows]


def _gene_rows(study: Study) -> list[tuple[Cell, ...]]:
    ranges = study.ranges
    rows: list[tuple[Cell, ...]] = []
    for parameter in SINGLE_BRANCH:
        low, high = ranges[parameter.name].exponent
        remark = "from the config, made after Table 4"
        quantity = f"values of the exponent gene of {parameter.name}"
        rows.append((quantity, "", _PRINTED_GENE_VALUES, high - low + 1, remark))
    return rows


def _grip_rows(case: Truth, target: Path) -> list[tuple[Cell, ...]]:
    """Return the jaw force at the lower torque, which the paper says maintains the grip."""
    time_s, torque, force = read_jaw_force(target)
    # The first such sample may coincide with the step, so skip it.
    reduced = np.flatnonzero(torque < torque.max())[1:]
    if not len(reduced):
        return []
    lowest = reduced[np.argmin(force[reduced])]
    remark = (
        f"lowest of the samples, at {time_s[lowest]:.4g} s; negative: the jaws would have to pull"
    )
    quantity = f"{case.title}: jaw force at the lower torque"
    return [(quantity, "uN", "maintains the grip", 1e6 * float(force[lowest]), remark)]


def _axis_rows(case: Truth, traces: list[Path]) -> list[tuple[Cell, ...]]:
    axis = case.published.axis_rad
    if not axis or not traces:
        return []
    # Keep only extremes: traces of many seeds exceed the memory.
    extremes = [(trace.min(), trace.max()) for path in traces for trace in each_trace(path)]
    low, high = (1e3 * float(value) for value in np.median(extremes, axis=0))
    remark = (
        f"median of {counted(len(extremes), 'noisy trace')}; the paper's is the end of its axis"
    )
    ends = zip(("smallest", "largest"), axis, (low, high), strict=True)
    return [
        (f"{case.title}: {end} sample", "mrad", f"{1e3 * printed:g}", ours, remark)
        for end, printed, ours in ends
    ]


def _generation_rows(case: Truth, identified: list[Path]) -> list[tuple[Cell, ...]]:
    generation = case.published.generation
    if not generation or not identified:
        return []
    found = read_identifications(identified[0], "genetic")
    median = float(np.median(found["generations"]))
    quantity = f"{case.title}: generation of the fit"
    return [(quantity, "", str(generation), median, "median generation at which ours stops")]
