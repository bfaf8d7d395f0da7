from typing import Any

from biogrip.traces.measurement_block import UNREAD, MeasurementBlock


def columns_of(
    time: str = "time_s",
    reading: str = "rotation_rad",
    quantity: str = "rotation",
    **keys: Any,
) -> MeasurementBlock:
    """The measurement of a file, not checked, with the column of a quantity, and other keys."""
    return MeasurementBlock(**{**vars(UNREAD), "time": time, quantity: reading, **keys})
