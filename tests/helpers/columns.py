from typing import Any

from biogrip.traces.measurement_block import UNREAD, ByOptions, MeasurementBlock


def columns_of(
    time: str = "time_s",
    reading: str = "rotation_rad",
    quantity: str = "rotation",
    *,
    by_options: bool = False,
    **keys: Any,
) -> MeasurementBlock:
    """The measurement of a file, not checked, with the column of a quantity, and other keys."""
    made = ByOptions if by_options else MeasurementBlock
    return made(**{**vars(UNREAD), "time": time, quantity: reading, **keys})
