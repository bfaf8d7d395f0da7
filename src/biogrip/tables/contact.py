"""What it takes to close the jaws onto samples of the sizes that the gripper is made for."""

from pathlib import Path
from typing import Any

import numpy as np

from biogrip.contact import LARGEST_M, SMALLEST_M
from biogrip.errors import BiogripError
from biogrip.study import build
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("size_um", "Sample (um)"),
    Column("closing_mrad", "Closing rotation (mrad)"),
    Column("reference_angle_deg", "Reference angle (deg)", 4),
    Column("torque_nNm", "Torque (nN m)"),
    Column("voltage_V", "Voltage (V)"),
    Column("remark", "Remark"),
)


def contact(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Close the jaws onto samples from the smallest to the largest.

    Parameters
    ----------
    settings
        ``gripper`` in its neutral configuration, and ``actuator``.
    inputs
        None.
    """
    rows: list[tuple[Cell, ...]] = []
    for size_um in np.arange(1e6 * SMALLEST_M, 1e6 * LARGEST_M + 1, 15.0):
        try:
            found = build.contact_of(settings["gripper"], settings["actuator"], 1e-6 * size_um)
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
