"""Size of the physical effects that the model leaves out."""

from biogrip.experiment.protocol import largest_load
from biogrip.instrument.contact import LARGEST_M
from biogrip.instrument.left_out import (
    drag_of_arm,
    drag_of_sample,
    fringing_of_comb,
    mass_of_sample,
    rolling_of_contact,
)
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("effect", "Left out"),
    Column("size", "Size", 2),
    Column("unit", "Unit"),
    Column("beside", "Beside"),
    Column("beside_size", "which is", 2),
    Column("share_percent", "Share (%)", 2),
    Column("remark", "Remark"),
)


def _damping(case: Case) -> float:
    model = case.sample.model
    if model.power_law:
        return 0.0
    network = model.sample(case.parameters)
    return float(network.c_p[0] + network.c[0].sum())


def left_out(study: Study) -> Table:
    """Estimate effects that the model leaves out, for the largest sample."""
    gripper, comb = study.gripper, study.actuator
    dampings = [damping for name in study.gripped if (damping := _damping(study.cases[name])) > 0]
    least = min(dampings, default=None)
    b, arm = gripper.lever_m, gripper.left
    turn = largest_load(study.phases) / arm.stiffness_Nm_per_rad
    rows: list[tuple[Cell, ...]] = []
    if least is not None:
        drag = drag_of_sample(LARGEST_M)
        remark = "the sample in water, Stokes; of the case with the least damping"
        rows.append(_row("drag on the sample", drag, "N s/m", "its dampers", least, remark))
    drag = drag_of_arm(gripper, comb.thickness_m)
    remark = "all of an arm in water; the paper keeps the device out of it"
    beside = "the hinge's damping"
    damping = arm.damping_Nms_per_rad
    rows.append(_row("drag on an arm", drag, "N m s/rad", beside, damping, remark))
    if least is not None:
        remark = "the same, beside what a rotation trace is made of"
        beside, share = "the sample's, 2 b^2 c", 2 * b * b * least
        rows.append(_row("drag on an arm", drag, "N m s/rad", beside, share, remark))
    length = 1e3 * gripper.arm_length_m
    moved = length * rolling_of_contact(gripper, LARGEST_M, turn)
    remark = "a sphere that rolls on the jaw, at the free arm's rotation under the largest torque"
    rows.append(_row("contact point along the jaw", moved, "mm", "the arm length", length, remark))
    remark = "at most: fingers shield each other; the voltage for a torque is less by half of it"
    fringing = fringing_of_comb(comb)
    rows.append(_row("fringing of the comb", fringing, "", "its capacitance", 1.0, remark))
    remark = "felt for milliseconds after a step, as the arms' own"
    beside, mass = "an arm's at the jaw, I/b^2", arm.inertia_kgm2 / b**2
    rows.append(
        _row("inertia of the sample", mass_of_sample(LARGEST_M), "kg", beside, mass, remark)
    )
    caption = (
        f"What the model leaves out, estimated for a sample of {1e6 * LARGEST_M:g} um: its size, "
        "and its share of what it would add to."
    )
    return Table(caption, _COLUMNS, rows)


def _row(
    effect: str, size: float, unit: str, beside: str, whole: float, remark: str
) -> tuple[Cell, ...]:
    return effect, size, unit, beside, whole, 100 * size / whole, remark
