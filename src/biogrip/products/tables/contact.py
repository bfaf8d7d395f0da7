"""What it takes to close the jaws onto samples of the sizes that the gripper is made for."""

from dataclasses import dataclass

import numpy as np

from biogrip.errors import BiogripError
from biogrip.instrument.actuator import CombDrive
from biogrip.instrument.contact import LARGEST_M, SMALLEST_M, contact
from biogrip.instrument.gripper import Gripper
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("size_um", "Sample (um)"),
    Column("closing_mrad", "Closing rotation (mrad)"),
    Column("reference_angle_deg", "Reference angle (deg)", 4),
    Column("torque_nNm", "Torque (nN m)"),
    Column("voltage_V", "Voltage (V)"),
    Column("remark", "Remark"),
)


@dataclass(frozen=True)
class Settings:
    """What closes onto the samples: the neutral gripper, its jaw gap, its comb drives."""

    gripper: Gripper
    jaw_gap_m: float
    actuator: CombDrive


def contacts(settings: Settings) -> Table:
    """Close the jaws onto samples from the smallest to the largest."""
    rows: list[tuple[Cell, ...]] = []
    for size_um in np.arange(1e6 * SMALLEST_M, 1e6 * LARGEST_M + 1, 15.0):
        try:
            found = contact(settings.gripper, settings.jaw_gap_m, settings.actuator, 1e-6 * size_um)
        except BiogripError as error:
            rows.append((float(size_um), None, None, None, None, str(error)))
            continue
        numbers = (
            1e3 * found.closing_rad,
            found.reference_angle_deg,
            1e9 * found.torque_Nm,
            found.voltage_V,
        )
        rows.append((float(size_um), *(float(number) for number in numbers), ""))
    caption = (
        "Closing the jaws from the neutral configuration onto a sample: rotation of each arm, its "
        "angle at contact, and the torque and voltage that hold it there. Grip torques come on top."
    )
    return Table(caption, _COLUMNS, rows)


CONTACT = table(
    contacts,
    name="contact",
    item="input: contact",
    caption="Rotation, torque and voltage that close the jaws onto samples of several sizes.",
    settings=lambda study: Settings(study.gripper, study.jaw_gap_m, study.actuator),
    sheet="tables",
)
