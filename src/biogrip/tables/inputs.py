"""Tables 1 to 4: inputs of the study, from its config."""

from biogrip.physics.sample_model import SINGLE_BRANCH
from biogrip.study.study import Study
from biogrip.tables.layout import Column, Table

_SOURCE = Column("source", "Source")
_LEGEND = (
    " Stated: by the paper, or by whoever changed the config. "
    "Reconstructed: the paper's value is not available to us."
)


def gripper(study: Study) -> Table:
    """Table 1: parameters of the gripper."""
    block = study.gripper
    angle = block.reference_angle_deg
    rows = [
        ("arm_length_m", "l", "arm length", block.arm_length_m, "m"),
        ("reference_angle_deg", "hat-theta_2", "reference angle, left", angle, "deg"),
        ("reference_angle_deg", "hat-theta_4", "reference angle, right", 180 - angle, "deg"),
    ]
    for key, symbol, meaning, unit in (
        ("inertia_kgm2", "I", "moment of inertia", "kg m2"),
        ("damping_Nms_per_rad", "c", "damping", "N m s/rad"),
        ("stiffness_Nm_per_rad", "k", "stiffness", "N m/rad"),
    ):
        for name, arm, index in (("left", block.left, 2), ("right", block.right, 4)):
            row = f"{symbol}_{index}", f"{meaning}, {name}", getattr(arm, key), unit
            rows.append((f"{name}.{key}", *row))
    return _quantities(study, "gripper", "Table 1. Parameters of the gripper.", rows)


def actuator(study: Study) -> Table:
    """Table 2: geometry of the comb drive."""
    rows = [
        (key, symbol, meaning, getattr(study.actuator, key), unit)
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
    caption = "Table 2. Geometric parameters of the comb-drive actuator."
    return _quantities(study, "actuator", caption, rows)


def gene_ranges(study: Study) -> Table:
    """Table 3: values that the genes may take."""
    rows = []
    for parameter in SINGLE_BRANCH:
        genes = study.ranges[parameter.name]
        for index, gene in enumerate(("exponent", "digit", "digit"), start=1):
            low, high = getattr(genes, gene)
            source = _source(study.reconstructed, f"search_range.{parameter.name}.{gene}")
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


def parameter_ranges(study: Study) -> Table:
    """Table 4: ranges of the parameters, as they follow from the genes."""
    ranges = study.ranges
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


def _source(keys: tuple[str, ...], key: str) -> str:
    found = any(key == name or key.startswith(f"{name}.") for name in keys)
    return "reconstructed" if found else "stated"


def _quantities(
    study: Study, block: str, caption: str, rows: list[tuple[str, str, str, float, str]]
) -> Table:
    """Return a table of keys of a block with symbol, meaning, value and unit."""
    columns = (
        Column("symbol", "Symbol"),
        Column("meaning", "Meaning"),
        Column("value", "Value"),
        Column("unit", "Unit"),
        _SOURCE,
    )
    sourced = [(*row[1:], _source(study.reconstructed, f"{block}.{row[0]}")) for row in rows]
    return Table(caption + _LEGEND, columns, sourced)
