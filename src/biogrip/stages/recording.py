"""Stage 2 for recorded traces: from the user's file to a measurement like the simulated ones."""

from pathlib import Path
from typing import Any

from biogrip.plausibility import check_recording
from biogrip.recordings import Columns, read_recording
from biogrip.response.nuisance import nuisance_basis
from biogrip.study import build
from biogrip.traces import Measurements, write_measurements


def run(settings: dict[str, Any], recorded: Path, output: Path) -> None:
    """Read, check and convert a recorded trace.

    Parameters
    ----------
    settings
        ``gripper``, ``protocol`` (and ``actuator``, if that is in volts),
        ``measurement``: the keys of that block which concern the file.
    recorded
        The user's file.
    output
        The measurement, Parquet: ``time_s`` and ``seed_0``.

    Raises
    ------
    BiogripError
        With file, line and column, if the trace cannot be used.
    """
    write_measurements(output, read_checked(settings, recorded))


def read_checked(settings: dict[str, Any], recorded: Path) -> Measurements:
    """Read a recorded trace, and refuse what its gripper and protocol cannot have given."""
    block = settings["measurement"]
    columns = Columns(
        block["time"], block["rotation"], block.get("time_unit"), block.get("rotation_unit")
    )
    trace = read_recording(recorded, columns)
    nuisance = nuisance_basis(
        trace.time_s, offset=block.get("offset", False), drift=block.get("drift", False)
    )
    check_recording(
        trace,
        build.gripper(settings["gripper"]),
        build.torque(settings),
        recorded,
        columns,
        nuisance,
        block.get("noise_rad"),
    )
    return Measurements(trace.time_s, None, {0: trace.rotation_rad})
