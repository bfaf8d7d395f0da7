"""Tables 1 to 4: what goes into the study, as the config has it."""

from pathlib import Path
from typing import Any

from biogrip.sample import SINGLE_BRANCH
from biogrip.study import build
from biogrip.tables.layout import Column, Table

_SOURCE = Column("source", "Source")
_LEGEND = (
    " Stated: by the paper, or by whoever changed the config. "
    "Reconstructed: the paper's value is not available to us."
)


def gripper(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Table 1: parameters of the gripper."""
    block = settings["gripper"]
    rows = [
        _row(
            settings,
            "gripper.arm_length_m",
            "l",
            "arm length",
            block["arm_length_m"],
            "m",
        ),
        _row(
            settings,
            "gripper.reference_angle_deg",
            "hat-theta_2",
            "reference angle, left",
            block["reference_angle_deg"],
            "deg",
        ),
        _row(
            settings,
            "gripper.reference_angle_deg",
            "hat-theta_4",
            "reference angle, right",
            180 - block["reference_angle_deg"],
            "deg",
        ),
    ]
    for key, symbol, meaning, unit in (
        ("inertia_kgm2", "I", "moment of inertia", "kg m2"),
        ("damping_Nms_per_rad", "c", "damping", "N m s/rad"),
        ("stiffness_Nm_per_rad", "k", "stiffness", "N m/rad"),
    ):
        for arm, index in (("left", 2), ("right", 4)):
            path, value = f"gripper.{arm}.{key}", block[arm][key]
            rows.append(
                _row(
                    settings,
                    path,
                    f"{symbol}_{index}",
                    f"{meaning}, {arm}",
                    value,
                    unit,
                )
            )
    return _quantities("Table 1. Parameters of the gripper.", rows)


def actuator(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Table 2: geometry of the comb drive."""
    block = settings["actuator"]
    rows = [
        _row(settings, f"actuator.{key}", symbol, meaning, block[key], unit)
        for key, symbol, meaning, unit in (
            ("thickness_m", "h", "thickness of the device layer", "m"),
            ("finger_width_m", "d", "finger width", "m"),
            ("finger_gap_m", "g", "finger gap", "m"),
            ("fingers", "n", "number of floating fingers", ""),
            ("finger_angle_deg", "alpha", "finger angle", "deg"),
            ("stroke_deg", "beta", "finger stroke", "deg"),
            ("initial_overlap_deg", "theta", "initial overlap", "deg"),
            ("first_radius_m", "r_0", "radius of the first finger", "m"),
        )
    ]
    return _quantities("Table 2. Geometric parameters of the comb-drive actuator.", rows)


def gene_ranges(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Table 3: values that the genes may take."""
    rows = []
    for parameter in SINGLE_BRANCH:
        block = settings["search_range"][parameter.name]
        for index, gene in enumerate(("exponent", "digit", "digit"), start=1):
            low, high = block[gene]
            source = _source(settings, f"search_range.{parameter.name}.{gene}")
            name = f"g_{parameter.name}{index}"
            rows.append((name, parameter.name, gene, low, high, high - low + 1, source))
    columns = (
        Column("gene", "Gene"),
        Column("parameter", "Parameter"),
        Column("role", "Role"),
        Column("min", "Min"),
        Column("max", "Max"),
        Column("values", "Values"),
        _SOURCE,
    )
    caption = "Table 3. Values that the genes of the chromosome may take."
    return Table(caption + _LEGEND, columns, rows)


def parameter_ranges(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Table 4: ranges of the parameters, as they follow from the genes."""
    ranges = build.gene_ranges(settings["search_range"])
    rows = [
        (p.name, p.meaning, p.unit, ranges[p.name].low, ranges[p.name].high) for p in SINGLE_BRANCH
    ]
    columns = (
        Column("parameter", "Parameter"),
        Column("meaning", "Meaning"),
        Column("unit", "Unit"),
        Column("min", "Min", 2),
        Column("max", "Max", 2),
    )
    caption = "Table 4. Ranges of the sample's parameters, computed from the genes of Table 3."
    return Table(caption, columns, rows)


def _row(
    settings: dict[str, Any],
    key: str,
    symbol: str,
    meaning: str,
    value: float,
    unit: str,
) -> tuple[str, str, float, str, str]:
    return symbol, meaning, value, unit, _source(settings, key)


def _source(settings: dict[str, Any], key: str) -> str:
    marked = any(key == name or key.startswith(f"{name}.") for name in settings["reconstructed"])
    return "reconstructed" if marked else "stated"


def _quantities(caption: str, rows: list[tuple[str, str, float, str, str]]) -> Table:
    columns = (
        Column("symbol", "Symbol"),
        Column("meaning", "Meaning"),
        Column("value", "Value"),
        Column("unit", "Unit"),
        _SOURCE,
    )
    caption += _LEGEND
    return Table(caption, columns, rows)
