"""Check of the values in Tables 5 to 7 against the paper's own encoding and error formula.

Sampling rate at which the paper's errors agree with Cramér-Rao bounds.

Evidence for the reconstructed values, and contradictions within the paper.
"""

import math
from pathlib import Path

import numpy as np

from biogrip.digits import counted
from biogrip.fit.genome import nearest_encodable
from biogrip.judging.fisher import DETERMINED_PERCENT, bounds_percent
from biogrip.judging.quantities import Quantity
from biogrip.physics import actuator
from biogrip.physics.models import Truth
from biogrip.physics.protocol import sample_times
from biogrip.physics.sample_model import SINGLE_BRANCH
from biogrip.records.identifications import read_identifications
from biogrip.records.traces import (
    each_trace,
    read_jaw_force,
)
from biogrip.study.study import Case, Study
from biogrip.tables.errors_of_case import error_percent
from biogrip.tables.layout import Cell, Column, Table

_PRINTED_COLUMNS = (
    Column("case", "Case"),
    Column("parameter", "Parameter"),
    Column("quantity", "Quantity"),
    Column("printed", "Printed", 4),
    Column("nearest_encodable", "Nearest encodable", 2),
    Column("distance_percent", "Distance %", 2),
    Column("within_range", "Within range"),
    Column("printed_error_percent", "Printed error %"),
    Column("recomputed_error_percent", "Recomputed error %", 3),
)


def printed_values(study: Study) -> Table:
    """Compare published values with encoding, range and error formula."""
    ranges = study.ranges
    rows: list[tuple[Cell, ...]] = []
    for case, reported in study.cases.items():
        truth = reported.truth
        printed = truth.published
        for name in truth.model.names:
            target = truth.parameters[name]
            identified = printed.identified.get(name)
            for quantity, value in (("target", target), ("identified", identified)):
                if value is None or value <= 0:
                    continue
                genes = ranges[name]
                nearest = nearest_encodable(value, genes)
                errors: tuple[Cell, Cell] = (None, None)
                if quantity == "identified" and target:
                    printed_percent = printed.error_percent.get(name)
                    errors = (printed_percent, float(error_percent(target, np.array([value]))[0]))
                distance = 100 * (value - nearest) / value
                within = "yes" if genes.low <= value <= genes.high else "no"
                rows.append(
                    (case, name, quantity, value, nearest, distance, within, *errors),
                )
    caption = (
        "Printed values of Tables 5 to 7 against the two-digit encoding of eq. (10), the ranges "
        "of Table 4, and the printed errors against (target - identified) / target."
    )
    return Table(caption, _PRINTED_COLUMNS, rows)


_RATES_HZ = (0.1, 1.0, 10.0, 100.0)
# Factor of a parameter's bound over that of the sum above which the two count as exchangeable.
_TRADING = 2.0

_SAMPLING_COLUMNS = (
    Column("case", "Case"),
    Column("parameter", "Parameter"),
    Column("paper_error_percent", "Paper's error %", 2),
    *(Column(f"bound_percent_{rate:g}_Hz", f"Bound % at {rate:g} Hz", 2) for rate in _RATES_HZ),
)
_CAPTION = (
    "The paper's errors beside the standard deviations that the study's noise leaves at least "
    "(Cramer-Rao bounds at the true parameters), at several sampling rates. Of c and c_p the sum "
    "stands where they trade against each other at the paper's answer. Last row: the paper's "
    "error over the bound, root mean square over the rows above; about 1 is to be expected of an "
    "identification that is as good as noise allows."
)


def sampling_evidence(study: Study) -> Table:
    """Compare errors of the paper with bounds at several sampling rates."""
    rows: list[tuple[Cell, ...]] = []
    for name, case in study.cases.items():
        rows += _case_rows(name, case)
    if rows:
        table = np.array([row[2:] for row in rows], dtype=float)
        ratios = np.sqrt(np.mean((table[:, :1] / table[:, 1:]) ** 2, axis=0))
        rows.append(("all", "error / bound", None, *(float(ratio) for ratio in ratios)))
    return Table(_CAPTION, _SAMPLING_COLUMNS, rows)


def _case_rows(name: str, case: Case) -> list[tuple[Cell, ...]]:
    """Return a row per quantity that is determined at some rate and that the paper reports."""
    truth, identified = case.truth.parameters, case.truth.published.identified
    problem, noise = case.problem, case.noise
    names = list(problem.searched.names)
    end_s = problem.torque.end_s
    times = [sample_times(end_s, rate) for rate in _RATES_HZ]
    at_truth = [bounds_percent(problem, noise, truth, time_s) for time_s in times]
    shown = [q for q, _ in at_truth[0]]
    if set(names) <= set(identified):
        shown = _drop_redundant(bounds_percent(problem, noise, identified, times[-1]))
    rows: list[tuple[Cell, ...]] = []
    for index, (q, _) in enumerate(at_truth[0]):
        bounds = [found[index][1] for found in at_truth]
        members = [names[member] for member in q.members]
        known = all(member in identified for member in members)
        if q in shown and known and min(bounds) < DETERMINED_PERCENT:
            target, found = (sum(of[m] for m in members) for of in (truth, identified))
            error = float(error_percent(target, np.array([found]))[0])
            rows.append((name, q.label, error, *bounds))
    return rows


def _drop_redundant(bounds: list[tuple[Quantity, float]]) -> list[Quantity]:
    """Leave out sums whose members are determined, and members that only the sum determines."""
    sums = [(q, percent) for q, percent in bounds if q.form == "sum"]
    left_out = []
    for total, percent in sums:
        members = [(q, alone) for q, alone in bounds if set(q.members) < set(total.members)]
        if min(alone for _, alone in members) > _TRADING * percent:
            left_out += [q for q, _ in members]
        else:
            left_out.append(total)
    return [q for q, _ in bounds if q not in left_out]


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
