"""Files for a waveform generator and a camera: what is held against time, and when to read."""

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from biogrip import __version__
from biogrip.arrays import Array
from biogrip.design.schedule import forces
from biogrip.design.settings import largest_key
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import largest_load
from biogrip.files import atomic_write
from biogrip.instrument.actuator import voltage
from biogrip.own_design.breakpoints import breakpoints
from biogrip.own_design.designed import Designed
from biogrip.own_traces.outputs import WRITTEN_BY, check_output
from biogrip.response.sensitivity import linear_responses
from biogrip.study.study import Case
from biogrip.terminal import visible

_FILES = ("protocol", "readings")
# Digits of times and of what is held; in further ones of a root, processors may differ.
_TIME_DIGITS, _DIGITS = 15, 9
# Rounding of a largest value.
_ROUNDING = 1e-9


def export_paths(folder: Path, cases: Iterable[Case], number: int = 0) -> list[Path]:
    """Return the files of cases: of each that of breakpoints, and that of instants of readings.

    The number is that of an experiment in a chosen set, from one.
    """
    of_set = f"_{number}" if number else ""
    return [folder / f"{case.name}{of_set}_{what}.csv" for case in cases for what in _FILES]


def check_export(folder: Path, paths: Iterable[Path], *, force: bool) -> None:
    """Refuse files of `export_paths` like `check_output`; their folder may have yet to be made.

    Raises
    ------
    BiogripError
        If a file cannot be written or must not be replaced, or the folder cannot be made.
    """
    if os.path.isdir(folder):
        for path in paths:
            check_output(path, force=force)
    elif os.path.lexists(folder) or not os.access(folder.parent, os.W_OK | os.X_OK):
        raise BiogripError(
            f"{visible(folder)}: cannot be made; allowed with --export is a folder, or a new one "
            "in a folder that you may write to."
        )


def check_limits(found: Designed) -> None:
    """Refuse a design that exceeds the largest load of its config, or the arms' stroke.

    Rotations are those of the linear model with inertia, of both arms and all plausible samples, at
    instants that are dense after each step.

    Raises
    ------
    BiogripError
        Names the key of the limit.
    """
    case, inputs = found.case, found.inputs
    of_set = f", experiment {found.number}" if found.number else ""
    place, largest = f"--export: {case.name}{of_set}", largest_load(found.plan.phases)
    if abs(largest) > inputs.largest_Nm * (1 + _ROUNDING):
        key, unit = largest_key(case.instrument), case.instrument.controlled.unit
        values = np.array([abs(largest), inputs.largest_Nm])
        if case.design.largest_voltage_V is not None:
            key, unit, values = "largest_voltage_V", "V", voltage(case.actuator, values)
        there, allowed = (f"{value:.6g} {unit}".rstrip() for value in values)
        raise BiogripError(f"{place}: found {there}, allowed by design.{key} is {allowed}.")
    if inputs.instrument.has_jaws and (turned_rad := _turned(found)) > inputs.stroke_rad:
        raise BiogripError(
            f"{place}: found an arm that turns by {1e3 * turned_rad:.6g} mrad, allowed is what "
            f"actuator.stroke_deg leaves for gripping, {1e3 * inputs.stroke_rad:.6g} mrad."
        )


def _turned(found: Designed) -> float:
    """Return the largest rotation of either arm, both of which are driven alike, in rad."""
    inputs = found.inputs
    network = inputs.model.network(inputs.parameters)
    time_s, _ = forces(inputs.gripper, network, found.plan.phases)
    left = inputs.gripper
    right = replace(left, left=left.right, right=left.left)
    rotations = (
        linear_responses(
            arms,
            inputs.model,
            inputs.history(found.plan.phases),
            time_s,
            inputs.parameters,
            inertia=True,
            slopes=False,
        )
        for arms in ((left,) if left.left == left.right else (left, right))
    )
    return max(float(np.abs(rows[:, 0]).max()) for rows in rotations)


def write_export(found: Designed, folder: Path) -> list[Path]:
    """Write the breakpoints and the instants of readings of a design, as CSV files."""
    protocol, readings = export_paths(folder, [found.case], found.number)
    if found.inputs.instrument.has_jaws:
        drawn = "volts on both comb drives from contact by equation (9)"
    else:
        drawn = f"the {found.inputs.instrument.controlled.name}"
    said = f"{drawn}; linear between rows; two rows of the same time are a jump"
    _write(protocol, said, ["time_s", *_columns(found)], _rows(found))
    _write(readings, "when to read", ["time_s"], _texts(found.plan.time_s))
    return [protocol, readings]


def _columns(found: Designed) -> dict[str, Callable[[Array], Array]]:
    """Return the columns of what is held, with the functions that convert it to them."""
    case, instrument = found.case, found.inputs.instrument
    if not instrument.has_jaws:
        return {instrument.controlled.column: np.asarray}
    columns: dict[str, Callable[[Array], Array]] = {
        "voltage_V": lambda torque_Nm: voltage(case.actuator, torque_Nm)
    }
    if case.size_m is not None:
        closing_Nm = case.block.gripper.contact(case.actuator, case.size_m).torque_Nm
        columns["with_closing_V"] = lambda torque_Nm: voltage(case.actuator, torque_Nm + closing_Nm)
    return columns


def _rows(found: Designed) -> Iterator[str]:
    """Yield rows of times and of what is held, from nothing at the start; none of them twice."""
    columns, root = _columns(found).values(), found.inputs.instrument.has_jaws
    nothing = np.zeros(1), np.zeros(1)
    last = ""
    for times, values in chain([nothing], breakpoints(found.plan.phases, root=root)):
        cells = [[f"{value:.{_DIGITS}g}" for value in of(values)] for of in columns]
        for row in map(",".join, zip(_texts(times), *cells, strict=True)):
            if row != last:
                yield row
            last = row


def _texts(time_s: Array) -> Iterator[str]:
    return (f"{time:.{_TIME_DIGITS}g}" for time in time_s.tolist())


def _write(path: Path, said: str, columns: list[str], rows: Iterable[str]) -> None:
    with atomic_write(path) as scratch, scratch.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(f"# {WRITTEN_BY} {__version__}: {said}\n{','.join(columns)}\n")
        stream.writelines(f"{row}\n" for row in rows)
