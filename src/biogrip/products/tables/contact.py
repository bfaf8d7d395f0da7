"""Table of rotation, torque and voltage at contact with samples of several sizes."""

from dataclasses import dataclass

import numpy as np

from biogrip.errors import BiogripError
from biogrip.experiment.protocol import Phase, largest_torque, torque_history
from biogrip.instrument import actuator
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
    Column("gripping_voltage_V", "while gripping (V)"),
    Column("remark", "Remark"),
)


@dataclass(frozen=True)
class Settings:
    """Neutral gripper, jaw gap, comb drive and protocol."""

    gripper: Gripper
    jaw_gap_m: float
    actuator: CombDrive
    phases: tuple[Phase, ...]


def contacts(settings: Settings) -> Table:
    """Return the state of the gripper closed onto samples from the smallest to the largest."""
    grip_Nm = largest_torque(torque_history(settings.phases))
    rows: list[tuple[Cell, ...]] = []
    for size_um in np.arange(1e6 * SMALLEST_M, 1e6 * LARGEST_M + 1, 15.0):
        try:
            found = contact(settings.gripper, settings.jaw_gap_m, settings.actuator, 1e-6 * size_um)
        except BiogripError as error:
            rows.append((float(size_um), *5 * (None,), str(error)))
            continue
        numbers = (
            1e3 * found.closing_rad,
            found.reference_angle_deg,
            1e9 * found.torque_Nm,
            found.voltage_V,
            float(actuator.voltage(settings.actuator, found.torque_Nm + grip_Nm)),
        )
        rows.append((float(size_um), *(float(number) for number in numbers), ""))
    caption = (
        "Closing the jaws from the neutral configuration onto a sample: rotation of each arm, its "
        "angle at contact, and the torque and voltage that hold it there. Grip torques come on "
        f"top; the last voltage is with the protocol's largest, {1e9 * grip_Nm:.3g} nN m."
    )
    return Table(caption, _COLUMNS, rows)


CONTACT = table(
    contacts,
    name="contact",
    item="input: contact",
    caption="Rotation, torque and voltage that close the jaws onto samples of several sizes.",
    settings=lambda study: Settings(study.gripper, study.jaw_gap_m, study.actuator, study.phases),
    rule="tables",
)
