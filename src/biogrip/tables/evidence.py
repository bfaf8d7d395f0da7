"""What speaks for the reconstructed values, and where the paper's statements do not agree."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from biogrip import actuator
from biogrip.identify.identifications import read_identifications
from biogrip.sample import SINGLE_BRANCH
from biogrip.study import build
from biogrip.tables.layout import Cell, Column, Table
from biogrip.traces import read_measurements

_COLUMNS = (
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("paper", "Paper"),
    Column("this_study", "This study", 3),
    Column("remark", "Remark"),
)

# Section 3: torque in N m, voltage in V as the paper rounds it.
_PRINTED_VOLTAGES = ((1.6e-9, "about 17"), (0.32e-9, "about 7"))
_PRINTED_GENE_VALUES = "9 or 12"


def evidence(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Hold statements of the paper against what the study computes.

    Parameters
    ----------
    settings
        ``cases`` with published values; ``gripper``, ``actuator``, ``search_range``.
    inputs
        Identifications (CSV) and measurements (Parquet) of the cases.
    """
    rows = [*_actuator_rows(settings), *_gripper_rows(settings), *_gene_rows(settings)]
    for name, case in settings["cases"].items():
        traces = [p for p in inputs if p.suffix == ".parquet" and p.parent.name == name]
        identified = [p for p in inputs if p.suffix == ".csv" and p.stem == name]
        rows += _axis_rows(case, traces)
        if settings["method"] == "genetic":
            rows += _generation_rows(case, identified)
    return Table("Statements of the paper beside what the study computes.", _COLUMNS, rows)


def _actuator_rows(settings: dict[str, Any]) -> list[tuple[Cell, ...]]:
    comb = build.comb_drive(settings["actuator"])
    rows: list[tuple[Cell, ...]] = []
    for torque, printed in _PRINTED_VOLTAGES:
        volts = float(actuator.voltage(comb, torque))
        rows.append((f"voltage for {torque:g} N m", "V", printed, volts, "eq. (9) with Table 2"))
    volts = float(actuator.voltage(comb, 1.6e-6))
    remark = "section 3 prints 1.6 uN m without the factor 1e-3"
    rows.append(("voltage for 1.6e-06 N m", "V", "about 17", volts, remark))
    remark = "has to be less than the arm length"
    rows.append(("outer radius of the comb", "mm", None, 1e3 * comb.outer_radius_m, remark))
    return rows


def _gripper_rows(settings: dict[str, Any]) -> list[tuple[Cell, ...]]:
    gripper = build.gripper(settings["gripper"])
    comb = build.comb_drive(settings["actuator"])
    stroke = gripper.left.stiffness_Nm_per_rad * math.radians(comb.stroke_deg)
    volts = float(actuator.voltage(comb, stroke))
    return [
        ("arm length", "mm", None, 1e3 * gripper.arm_length_m, "from the config"),
        (
            "natural frequency of the free arm",
            "Hz",
            None,
            gripper.left.natural_frequency_Hz,
            "from the config",
        ),
        (
            "quality factor of the free arm",
            "",
            None,
            gripper.left.quality_factor,
            "from the config",
        ),
        (
            "voltage for the full stroke, no sample",
            "V",
            None,
            volts,
            "from the config's k_2",
        ),
    ]


def _gene_rows(settings: dict[str, Any]) -> list[tuple[Cell, ...]]:
    ranges = build.gene_ranges(settings["search_range"])
    rows: list[tuple[Cell, ...]] = []
    for parameter in SINGLE_BRANCH:
        low, high = ranges[parameter.name].exponent
        remark = "from the config, made after Table 4"
        quantity = f"values of the exponent gene of {parameter.name}"
        rows.append((quantity, "", _PRINTED_GENE_VALUES, high - low + 1, remark))
    return rows


def _axis_rows(case: dict[str, Any], traces: list[Path]) -> list[tuple[Cell, ...]]:
    axis = case["published"].get("axis_rad")
    if not axis or not traces:
        return []
    # A batch at a time, and of each trace its two ends: there may be thousands.
    ends = [
        (trace.min(), trace.max())
        for path in traces
        for trace in read_measurements(path).rotation_rad.values()
    ]
    low, high = 1e3 * np.median(ends, axis=0)
    remark = f"median of {len(ends)} noisy traces; the paper's is the end of its axis"
    return [
        (
            f"{case['title']}: smallest sample",
            "mrad",
            f"{1e3 * axis[0]:g}",
            low,
            remark,
        ),
        (
            f"{case['title']}: largest sample",
            "mrad",
            f"{1e3 * axis[1]:g}",
            high,
            remark,
        ),
    ]


def _generation_rows(case: dict[str, Any], identified: list[Path]) -> list[tuple[Cell, ...]]:
    generation = case["published"].get("generation")
    if not generation or not identified:
        return []
    found = read_identifications(identified[0], "genetic")
    median = float(np.median(found["generations"]))
    quantity = f"{case['title']}: generation of the fit"
    return [(quantity, "", str(generation), median, "median generation at which ours stops")]
