"""What tests say of the columns of a trace."""

from typing import Any

from biogrip.physics.noise import Noise
from biogrip.traces.measurement_block import ByOptions, MeasurementBlock

NONE = Noise("gaussian", 0.0, "peak")


def columns_of(
    time: str = "time_s",
    reading: str = "rotation_rad",
    quantity: str = "rotation",
    *,
    by_options: bool = False,
    **keys: Any,
) -> MeasurementBlock:
    """The measurement of a file, with the column of a quantity, and other keys."""
    if quantity == "rotation" and "reading_unit" in keys:
        keys["rotation_unit"] = keys.pop("reading_unit")
    keys |= {"rate_Hz": 1.0, "noise": NONE, "time": time, quantity: reading}
    return (ByOptions if by_options else MeasurementBlock)(**keys)
