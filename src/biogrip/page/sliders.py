"""What the page's sliders show: a trace, and what `sliders.js` computes its response from."""

import math
from pathlib import Path
from typing import Any

from biogrip.digits import significant, with_unit
from biogrip.figures.fit import scale_of
from biogrip.physics.noise import rms
from biogrip.records.traces import read_measurements
from biogrip.stages.identification import TRACE
from biogrip.study.study import Case

NAMES = "k", "k_p", "c", "c_p"
"""Parameters that have a slider."""
# As many readings as a curve of a few hundred pixels shows.
_MOST_READINGS = 800
# More digits than a screen shows, and fewer than those in which processors differ.
_DIGITS = 6
# How far a slider goes below the least and above the largest parameter.
_BEYOND = 10.0


def has_sliders(case: Case) -> bool:
    """Tell whether a case has the response of the script: one branch, equal arms, only steps."""
    arms = case.experiment.gripper.left, case.experiment.gripper.right
    simulated = case.instrument.has_jaws and not case.recorded
    alone = {*case.parameters} == {*NAMES} and min(case.parameters.values()) > 0
    return simulated and alone and arms[0] == arms[1] and not case.torque.changes[:, 1:].any()


def slid(case: Case, measurements: Path) -> dict[str, Any]:
    """Return a case's first trace, thinned, with its parameters, arm and steps, in SI units."""
    recorded, gripper = read_measurements(measurements, [TRACE]), case.experiment.gripper
    readings, target = recorded.readings[TRACE], recorded.target
    assert target is not None
    factor, unit = scale_of(readings, case.instrument.read.unit)
    stride = -(-len(readings) // _MOST_READINGS)
    values = case.parameters.values()
    return {
        "title": case.title,
        "noise": f"{factor * rms((readings - target)[::stride]):.4g}",
        "times": recorded.time_s[::stride].tolist(),
        "readings": significant(readings[::stride], _DIGITS).tolist(),
        "factor": factor,
        "unit": unit,
        "read": with_unit(case.instrument.read.title, unit),
        "sample": {name: case.parameters[name] for name in NAMES},
        "ends": [math.log10(min(values) / _BEYOND), math.log10(max(values) * _BEYOND)],
        "arm": {
            "stiffness": gripper.left.stiffness_Nm_per_rad,
            "damping": gripper.left.damping_Nms_per_rad,
            "lever": 2 * gripper.lever_m**2,
        },
        "steps": [(start, height) for start, _, height in case.torque.jumps],
    }
