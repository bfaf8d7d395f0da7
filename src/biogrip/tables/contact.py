"""Table of rotation, torque and voltage at contact with samples of several sizes."""

import numpy as np

from biogrip.errors import BiogripError
from biogrip.experiment.protocol import largest_load
from biogrip.instrument import actuator
from biogrip.instrument.contact import LARGEST_M, SMALLEST_M, contact
from biogrip.instrument.gripper import Gripper
from biogrip.study.study import Study
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
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
    return Table(caption, _COLUMNS, rows)


def _off_percent(neutral: Gripper, angle_deg: float) -> float:
    """Return the error of values that are found with the neutral angle, and not this one."""
    sines = np.sin(np.radians([angle_deg, neutral.reference_angle_deg]))
    return float(100 * ((sines[0] / sines[1]) ** 2 - 1))
