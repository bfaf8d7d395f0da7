"""Evidence for the reconstructed values, and contradictions within the paper.

Three tables: statements of the paper beside results; the values in its Tables 5 to 7 against its
own encoding and error formula; and the sampling rate at which its errors agree with Cramér-Rao
bounds.
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import chdtri

from biogrip.digits import counted
from biogrip.judging.likelihood import Quantity, bounds_percent
from biogrip.levels import DETERMINED_PERCENT
from biogrip.physics import gripper as actuator
from biogrip.physics.protocol import sample_times
from biogrip_study.config.study import Case, Study
from biogrip_study.methods.genome import encodable_values, nearest_encodable
from biogrip_study.records.traces import read_measurements
from biogrip_study.stages.job import job_study, logged, paths
from biogrip_study.stages.targets import noise_of_readings
from biogrip_study.tables.cases import error_percent, value_in_case
from biogrip_study.tables.layout import Column, Row, ShownTable, titled, write

if TYPE_CHECKING:
    snakemake: Any

_COLUMNS = (
    *titled("quantity", "unit", "paper"),
    Column("this_study", "This study", 3),
    Column("remark", "Remark"),
)
# Section 3: torque in N m, voltage in V as the paper rounds it, and a remark.
_PRINTED_VOLTAGES = (
    (1.6e-9, "about 17", "eq. (9) with Table 2"),
    (0.32e-9, "about 7", "eq. (9) with Table 2"),
    (1.6e-6, "about 17", "section 3 prints 1.6 uN m without the factor 1e-3"),
)


# Quantity, unit, what the paper has, what the study has, and a remark.
_Told = tuple[str, str, str | None, float, str]


def evidence(study: Study, measurements: list[Path]) -> ShownTable:
    """Compare statements of the paper with results of the study."""
    told = _of_device(study)
    for name, case in study.cases.items():
        told += _axis(case, [path for path in measurements if path.parent.name == name])
    names = [column.name for column in _COLUMNS]
    rows = [dict(zip(names, cells, strict=True)) for cells in told]
    return ShownTable("Statements of the paper beside what the study computes.", _COLUMNS, rows)


def _of_device(study: Study) -> list[_Told]:
    """Return what the paper says of actuator, gripper and genes."""
    comb, gripper, arm = study.actuator, study.gripper, study.gripper.left
    stroke = _volts(study, arm.stiffness_Nm_per_rad * math.radians(comb.stroke_deg))
    remark, config = "has to be less than the arm length", "from the config"
    told: list[_Told] = [
        (f"voltage for {torque:g} N m", "V", printed, _volts(study, torque), source)
        for torque, printed, source in _PRINTED_VOLTAGES
    ]
    told += [
        ("outer radius of the comb", "mm", None, 1e3 * comb.outer_radius_m, remark),
        ("arm length", "mm", None, 1e3 * gripper.arm_length_m, config),
        ("natural frequency of the free arm", "Hz", None, arm.natural_frequency_Hz, config),
        ("quality factor of the free arm", "", None, arm.quality_factor, config),
        ("voltage for the full stroke, no sample", "V", None, stroke, f"{config}'s k_2"),
    ]
    return told


def _volts(study: Study, torque_Nm: float) -> float:
    return float(actuator.voltage(study.actuator, torque_Nm))


def _axis(case: Case, traces: list[Path]) -> list[_Told]:
    """Return the ends of an axis that the paper shows, and of our traces."""
    axis = case.published.axis_rad
    if not axis or not traces:
        return []
    # Keep only extremes: traces of many seeds exceed the memory.
    extremes = [
        (trace.min(), trace.max())
        for path in traces
        for trace in read_measurements(path).readings.values()
    ]
    remark = (
        f"median of {counted(len(extremes), 'noisy trace')}; the paper's is the end of its axis"
    )
    ends = zip(("smallest", "largest"), axis, np.median(extremes, axis=0), strict=True)
    return [
        (f"{case.title}: {end} sample", "mrad", f"{1e3 * printed:g}", 1e3 * ours, remark)
        for end, printed, ours in ends
    ]


_PRINTED_COLUMNS = (
    *titled("case", "parameter", "quantity"),
    Column("printed", "Printed", 4),
    Column("nearest_encodable", "Nearest encodable", 2),
    Column("distance_percent", "Distance %", 2),
    Column("within_range", "Within range"),
    Column("printed_from", "Printed from", 5),
    Column("printed_to", "to", 5),
    Column("encodable", "Two digits hold it"),
    Column("printed_error_percent", "Printed error %"),
    Column("recomputed_error_percent", "Recomputed error %", 3),
)


def printed_values(study: Study) -> ShownTable:
    """Compare published values with encoding, range and error formula."""
    rows, ranges = [], vars(study.config.search_range)
    for name_of_case, case in study.cases.items():
        printed = case.published
        for name, target in case.parameters.items():
            genes, identified = ranges[name], printed.identified.get(name)
            for quantity, value in (("target", target), ("identified", identified)):
                if value is None or value <= 0:
                    continue
                nearest = nearest_encodable(value, genes)
                row: Row = {
                    "case": name_of_case,
                    "parameter": name,
                    "quantity": quantity,
                    "printed": value,
                    "nearest_encodable": nearest,
                    "distance_percent": 100 * (value - nearest) / value,
                    "within_range": "yes" if genes.low <= value <= genes.high else "no",
                }
                if quantity == "identified":
                    _, low, high = value_in_case(case, [name]) or (value, value, value)
                    values = encodable_values(genes)
                    held = (values >= low) & (values <= high)
                    row |= {"printed_from": low, "printed_to": high}
                    row["encodable"] = "yes" if held.any() else "no"
                if quantity == "identified" and target:
                    row["printed_error_percent"] = printed.error_percent.get(name)
                    error = error_percent(target, np.array([value]))[0]
                    row["recomputed_error_percent"] = error
                rows.append(row)
    caption = (
        "Printed values of Tables 5 to 7 against the two-digit encoding of eq. (10), the ranges "
        "of Table 4, and the printed errors against (target - identified) / target. From and to: "
        "the numbers that are printed so with the printed error, each rounded or cut off; two "
        "digits hold the value if they hold such a number."
    )
    return ShownTable(caption, _PRINTED_COLUMNS, rows)


_RATES_HZ = (0.1, 1.0, 10.0, 100.0)
# Factor of a parameter's bound over that of the sum above which the two count as exchangeable.
_TRADING = 2.0
# Rate (Hz) from which bounds are taken to others, and the share of chi-squared that counts.
_NEAR, _MIDDLE = 10.0, 0.95
_SAMPLING_COLUMNS = (
    *titled("case", "parameter"),
    Column("paper_error_percent", "Paper's error %", 2),
    Column("paper_error_from_percent", "from", 2),
    Column("paper_error_to_percent", "to", 2),
    *(Column(f"bound_percent_{rate:g}_Hz", f"Bound % at {rate:g} Hz", 2) for rate in _RATES_HZ),
)


def sampling_evidence(study: Study) -> ShownTable:
    """Compare errors of the paper with bounds at several sampling rates."""
    found = [
        (name, *cells) for name, case in study.cases.items() for cells in _errors_and_bounds(case)
    ]
    if found:
        table = np.array([cells[2:] for cells in found], dtype=float)
        errors, ends, bounds = table[:, :1], table[:, 1:3], table[:, 3:]
        ratios = np.sqrt(np.mean((errors / bounds) ** 2, axis=0))
        found.append(("all", "error / bound", None, None, None, *ratios))
        near = bounds[:, _RATES_HZ.index(_NEAR)]
        fine = np.ptp(ends, axis=1) <= near
        least = np.where(ends.prod(axis=1) < 0, 0.0, np.abs(ends).min(axis=1))
        sums = [np.sum((sizes / near)[fine] ** 2) for sizes in (np.abs(ends).max(axis=1), least)]
        tails = chdtri(np.sum(fine), [(1 + _MIDDLE) / 2, (1 - _MIDDLE) / 2])
        found.append(("all", "rates (Hz)", None, *(_NEAR * tails / sums)))
    caption = (
        "The paper's errors, with what value and printed error leave of them, beside the standard "
        "deviations that the study's noise leaves at least (Cramer-Rao bounds at the true "
        "parameters), at several sampling rates. Of c and c_p the sum stands where they trade "
        "against each other at the paper's answer. Last rows: the paper's error over the bound, "
        "root mean square over the rows above, of which about 1 is to be expected of an "
        "identification that is as good as noise allows; and, given Gaussian noise of this level, "
        "the lowest and highest rate at which chi-squared of any errors from their least to their "
        f"largest is in the middle {_MIDDLE:.0%}, bounds taken from {_NEAR:g} Hz with the root of "
        "the rate. Rows whose digits leave more than a bound are left out of it."
    )
    names = [column.name for column in _SAMPLING_COLUMNS]
    rows = [dict(zip(names, cells, strict=False)) for cells in found]
    return ShownTable(caption, _SAMPLING_COLUMNS, rows)


def _errors_and_bounds(case: Case) -> list[tuple[Any, ...]]:
    """Return a row of each quantity that is determined at some rate and that the paper reports.

    Errors are the paper's, and the lowest and the highest that it may have printed so.
    """
    truth, identified = case.parameters, case.published.identified
    problem = case.experiment
    names = list(problem.searched.names)
    times = [sample_times(problem.torque.end_s, rate) for rate in _RATES_HZ]
    sampled = [(noise_of_readings(case, time_s), time_s) for time_s in times]
    at_truth = [bounds_percent(problem, sd, truth, time_s) for sd, time_s in sampled]
    shown = [quantity for quantity, _ in at_truth[0]]
    if set(names) <= set(identified):
        shown = _drop_redundant(bounds_percent(problem, sampled[-1][0], identified, times[-1]))
    found: list[tuple[Any, ...]] = []
    for index, (quantity, _) in enumerate(at_truth[0]):
        bounds = [at_rate[index][1] for at_rate in at_truth]
        members = [names[member] for member in quantity.members]
        told = value_in_case(case, members)
        if quantity in shown and told and min(bounds) < DETERMINED_PERCENT:
            target = sum(truth[member] for member in members)
            middle, high, low = error_percent(target, np.array(told))
            found.append((quantity.label, middle, low, high, *bounds))
    return found


def _drop_redundant(bounds: list[tuple[Quantity, float]]) -> list[Quantity]:
    """Leave out sums whose members are determined, and members that only the sum determines."""
    left_out = []
    for total, percent in [(q, percent) for q, percent in bounds if q.sense > 0]:
        members = [(q, alone) for q, alone in bounds if set(q.members) < set(total.members)]
        if min(alone for _, alone in members) > _TRADING * percent:
            left_out += [q for q, _ in members]
        else:
            left_out.append(total)
    return [q for q, _ in bounds if q not in left_out]


if __name__ == "__main__":
    with logged(snakemake):
        of_paper = job_study(snakemake)
        of_paper = of_paper.of(of_paper.published)
        given, made = snakemake.input, snakemake.output
        told = evidence(of_paper, paths(given.measurements))
        write(told, Path(made.evidence))
        write(printed_values(of_paper), Path(made.printed_values))
        write(sampling_evidence(of_paper), Path(made.sampling_evidence))
