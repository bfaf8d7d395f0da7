"""Tables 1 to 4: inputs of the study, from its config."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from biogrip.physics.sample_model import SINGLE_BRANCH
from biogrip_study.config.study import Study
from biogrip_study.stages.job import job_study, logged
from biogrip_study.tables.layout import Column, ShownTable, titled, write

if TYPE_CHECKING:
    snakemake: Any

_LEGEND = (
    " Stated: by the paper, or by whoever changed the config. "
    "Reconstructed: the paper's value is not available to us."
)
_QUANTITY_COLUMNS = titled("symbol", "meaning", "value", "unit", "source")
# Key of the config, symbol, meaning and unit.
_OF_ARM = (
    ("inertia_kgm2", "I", "moment of inertia", "kg m²"),
    ("damping_Nms_per_rad", "c", "damping", "N m s/rad"),
    ("stiffness_Nm_per_rad", "k", "stiffness", "N m/rad"),
)
_OF_ACTUATOR = (
    ("thickness_m", "h", "thickness of the device layer", "m"),
    ("finger_width_m", "d", "finger width", "m"),
    ("finger_gap_m", "g", "finger gap", "m"),
    ("fingers", "n", "number of floating fingers", ""),
    ("finger_angle_deg", "alpha", "finger angle", "deg"),
    ("stroke_deg", "beta", "finger stroke", "deg"),
    ("initial_overlap_deg", "theta", "initial overlap", "deg"),
    ("first_radius_m", "r_0", "radius of the first finger", "m"),
)
_GENE_COLUMNS = titled("gene", "parameter", "role", "min", "max", "values", "source")
_RANGE_COLUMNS = (
    *titled("parameter", "meaning", "unit"),
    Column("min", "Min", 2),
    Column("max", "Max", 2),
)


def gripper(study: Study) -> ShownTable:
    """Table 1: parameters of the gripper."""
    block = study.gripper
    angle = block.reference_angle_deg
    rows = [
        ("arm_length_m", "l", "arm length", block.arm_length_m, "m"),
        ("reference_angle_deg", "hat-theta_2", "reference angle, left", angle, "deg"),
        ("reference_angle_deg", "hat-theta_4", "reference angle, right", 180 - angle, "deg"),
    ]
    for key, symbol, meaning, unit in _OF_ARM:
        for side, arm, index in (("left", block.left, 2), ("right", block.right, 4)):
            names = f"{symbol}_{index}", f"{meaning}, {side}"
            rows.append((f"{side}.{key}", *names, getattr(arm, key), unit))
    return _quantities(study, "gripper", "Table 1. Parameters of the gripper.", rows)


def actuator(study: Study) -> ShownTable:
    """Table 2: geometry of the comb drive."""
    rows = [
        (key, symbol, meaning, getattr(study.actuator, key), unit)
        for key, symbol, meaning, unit in _OF_ACTUATOR
    ]
    caption = "Table 2. Geometric parameters of the comb-drive actuator."
    return _quantities(study, "actuator", caption, rows)


def gene_ranges(study: Study) -> ShownTable:
    """Table 3: values that the genes may take."""
    rows, ranges = [], vars(study.config.search_range)
    for name in (parameter.name for parameter in SINGLE_BRANCH):
        for index, role in enumerate(("exponent", "digit", "digit"), start=1):
            low, high = getattr(ranges[name], role)
            source = _source(study, f"search_range.{name}.{role}")
            gene = {"gene": f"g_{name}{index}", "parameter": name, "role": role, "source": source}
            rows.append(gene | {"min": low, "max": high, "values": high - low + 1})
    caption = "Table 3. Values that the genes of the chromosome may take."
    return ShownTable(caption + _LEGEND, _GENE_COLUMNS, rows)


def parameter_ranges(study: Study) -> ShownTable:
    """Table 4: ranges of the parameters, as they follow from the genes."""
    ranges = vars(study.config.search_range)
    rows = [
        {"parameter": p.name, "meaning": p.meaning, "unit": p.unit}
        | {"min": ranges[p.name].low, "max": ranges[p.name].high}
        for p in SINGLE_BRANCH
    ]
    caption = "Table 4. Ranges of the sample's parameters, computed from the genes of Table 3."
    return ShownTable(caption, _RANGE_COLUMNS, rows)


def _quantities(
    study: Study, block: str, caption: str, rows: list[tuple[str, str, str, float, str]]
) -> ShownTable:
    """Return a table of keys of a block, each with symbol, meaning, value and unit."""
    cells = [
        {"symbol": symbol, "meaning": meaning, "value": value, "unit": unit}
        | {"source": _source(study, f"{block}.{key}")}
        for key, symbol, meaning, value, unit in rows
    ]
    return ShownTable(caption + _LEGEND, _QUANTITY_COLUMNS, cells)


def _source(study: Study, key: str) -> str:
    marked = any(key == name or key.startswith(f"{name}.") for name in study.config.reconstructed)
    return "reconstructed" if marked else "stated"


if __name__ == "__main__":
    with logged(snakemake):
        the_study = job_study(snakemake)
        tables = {
            "gripper": gripper,
            "actuator": actuator,
            "gene_ranges": gene_ranges,
            "parameter_ranges": parameter_ranges,
        }
        for file in map(Path, snakemake.output.tables):
            write(tables[file.stem](the_study), file)
