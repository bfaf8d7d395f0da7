"""Table of rotation, torque and voltage at contact with samples of several sizes.

Size of the physical effects that the model leaves out.

Strain, force, stiffness and apparent modulus of every sample.

Domain in which the paper's linearisation is accurate.
"""

from pathlib import Path

import numpy as np

from biogrip.errors import BiogripError
from biogrip.physics import actuator
from biogrip.physics.contact import (
    LARGEST_M,
    SMALLEST_M,
    apparent_modulus,
    contact,
    drag_of_arm,
    drag_of_sample,
    fringing_of_comb,
    mass_of_sample,
    rolling_of_contact,
)
from biogrip.physics.gripper import Gripper
from biogrip.physics.jaw_force import compute_grip, jaw_force
from biogrip.physics.protocol import largest_load, torque_history
from biogrip.physics.simulation import simulated_shortening
from biogrip.records.identifications import DIFFERENCES
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Cell, Column, Table

_CONTACT_COLUMNS = (
    Column("size_um", "Sample (um)"),
    Column("closing_mrad", "Closing rotation (mrad)"),
    Column("reference_angle_deg", "Reference angle (deg)", 4),
    Column("off_percent", "Stiffness found is off by (%)", 2),
    Column("torque_nNm", "Torque (nN m)"),
    Column("voltage_V", "Voltage (V)"),
    Column("gripping_voltage_V", "while gripping (V)"),
    Column("remark", "Remark"),
)


def contacts(study: Study) -> Table:
    """Return the state of the gripper closed onto samples from the smallest to the largest."""
    grip_Nm = largest_load(study.phases)
    rows: list[tuple[Cell, ...]] = []
    for size_um in np.arange(1e6 * SMALLEST_M, 1e6 * LARGEST_M + 1, 15.0):
        try:
            found = contact(study.gripper, study.jaw_gap_m, study.actuator, 1e-6 * size_um)
        except BiogripError as error:
            rows.append((float(size_um), *6 * (None,), str(error)))
            continue
        numbers = (
            1e3 * found.closing_rad,
            found.reference_angle_deg,
            _off_percent(study.gripper, found.reference_angle_deg),
            1e9 * found.torque_Nm,
            found.voltage_V,
            float(actuator.voltage(study.actuator, found.torque_Nm + grip_Nm)),
        )
        rows.append((float(size_um), *(float(number) for number in numbers), ""))
    caption = (
        "Closing the jaws from the neutral configuration onto a sample: rotation of each arm, its "
        "angle at contact, by how much stiffnesses and dampings of the linear model are off if the "
        "neutral angle is taken for it (they go with one over the square of its sine), and the "
        "torque and voltage that hold it there. Grip torques come on top; the last voltage "
        f"is with the protocol's largest, {1e9 * grip_Nm:.3g} nN m."
    )
    return Table(caption, _CONTACT_COLUMNS, rows)


def _off_percent(neutral: Gripper, angle_deg: float) -> float:
    """Return the error of values that are found with the neutral angle, and not this one."""
    sines = np.sin(np.radians([angle_deg, neutral.reference_angle_deg]))
    return float(100 * ((sines[0] / sines[1]) ** 2 - 1))


_LEFT_OUT_COLUMNS = (
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
    return Table(caption, _LEFT_OUT_COLUMNS, rows)


def _row(
    effect: str, size: float, unit: str, beside: str, whole: float, remark: str
) -> tuple[Cell, ...]:
    return effect, size, unit, beside, whole, 100 * size / whole, remark


_COLUMNS = (
    Column("case", "Case"),
    Column("size_um", "Size (um)"),
    Column("shortening_um", "Shortening (um)"),
    Column("strain_percent", "Strain (%)"),
    Column("largest_force_uN", "Largest force (uN)"),
    Column("lowest_force_uN", "Lowest force (uN)"),
    Column("lowest_at_s", "at (s)"),
    Column("stiffness_at_once_N_per_m", "Stiffness at once (N/m)"),
    Column("stiffness_in_the_end_N_per_m", "in the end (N/m)"),
    Column("gripper_stiffness_N_per_m", "of the gripper (N/m)"),
    Column("stiffness_over_gripper", "Sample over gripper"),
    Column("apparent_modulus_kPa", "Apparent modulus (kPa)"),
)


def mechanics(study: Study) -> Table:
    """Compute strain, force, stiffness and modulus of every sample."""
    caption = (
        "Each sample while jaws hold it: shortening and strain at the end of the first phase; the "
        "largest force, and the lowest, which is negative where the jaws would have to pull; "
        "stiffness of the sample at once (all springs) and in the end (the parallel one), of the "
        "gripper (both hinges, at the jaws), and the first of these over the last. The modulus is "
        "that of an incompressible sphere between two flat jaws (Hertz) with force and shortening "
        "of the end of the first phase; cells have about 1 kPa, give or take a factor of 30 by the "
        "method of measurement. A case that gives no size has a row for the smallest and the "
        "largest sample that the gripper takes."
    )
    return Table(caption, _COLUMNS, [row for case in study.cases.values() for row in _rows(case)])


def _rows(case: Case) -> list[tuple[Cell, ...]]:
    torque = torque_history(case.phases)
    network = case.sample.model.sample(case.parameters)
    # Immediately before the first change of torque.
    end = np.array([np.nextafter(case.phases[0].duration_s, 0)])
    given = case.gripper, network, torque
    shortening = float(simulated_shortening(*given, end, nonlinear=case.nonlinear_target)[0, 0])
    force = float(jaw_force(*given, end, nonlinear=case.nonlinear_target)[0, 0])
    grip = compute_grip(*given, nonlinear=case.nonlinear_target)
    # A springpot has neither instantaneous nor long-term stiffness.
    power_law = case.sample.model.power_law
    in_the_end = None if power_law else float(network.k_p[0])
    at_once = None if power_law else float(network.k_p[0] + network.k[0].sum())
    own = case.gripper.jaw_stiffness_N_per_m
    rows: list[tuple[Cell, ...]] = []
    for size in (SMALLEST_M, LARGEST_M) if case.size_m is None else (case.size_m,):
        modulus = apparent_modulus(force, shortening, size) if shortening > 0 else None
        rows.append(
            (
                case.title,
                1e6 * size,
                1e6 * shortening,
                100 * shortening / size,
                1e6 * grip.largest_N,
                1e6 * grip.lowest_N,
                grip.lowest_at_s,
                at_once,
                in_the_end,
                own,
                None if at_once is None else at_once / own,
                None if modulus is None else 1e-3 * modulus,
            )
        )
    return rows


LIMIT_PERCENT = 1.0
"""Difference up to which it counts as accurate, as a share of the peak."""

_LINEARISATION_COLUMNS = (
    Column("case", "Case"),
    Column("reference_angle_deg", "Reference angle (deg)"),
    Column("difference_percent", "Difference at the protocol's torque (%)", 2),
    Column(f"factor_for_{LIMIT_PERCENT:g}_percent", f"Torque factor for {LIMIT_PERCENT:g} %", 3),
)


def linearisation(_: Study, differences: Path) -> Table:
    """Return, for every case and angle, the torque factor that reaches `LIMIT_PERCENT`."""
    rows: list[tuple[Cell, ...]] = []
    for (case, angle), group in DIFFERENCES.read(differences).groupby(
        ["case", "reference_angle_deg"], sort=False
    ):
        factor = group["torque_factor"].to_numpy(float)
        share = group["difference_over_peak"].to_numpy(float)
        known = np.isfinite(share)
        at_one = np.exp(np.interp(0.0, np.log(factor[known]), np.log(share[known])))
        rows.append((case, float(angle), 100 * float(at_one), _crossing(factor, share)))
    caption = (
        "Largest difference of the linear from the nonlinear model, as a share of the peak, at the "
        "torque of the case's protocol, and the multiple of that torque at which it reaches "
        f"{LIMIT_PERCENT:g} % (empty: not up to {factor[-1]:g})."
    )
    return Table(caption, _LINEARISATION_COLUMNS, rows)


def _crossing(factor: np.ndarray, share: np.ndarray) -> float | None:
    limit = LIMIT_PERCENT / 100
    above = np.flatnonzero(share >= limit)
    if not len(above) or above[0] == 0:
        return None if not len(above) else float(factor[0])
    last = above[0]
    pair = slice(last - 1, last + 1)
    return float(np.exp(np.interp(np.log(limit), np.log(share[pair]), np.log(factor[pair]))))
