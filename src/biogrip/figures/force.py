"""Force of the jaws, and rotation of jaws that cannot pull."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.figures.results import scale_of
from biogrip.figures.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    ORANGE,
    figure,
)
from biogrip.physics.simulation import jaw_force
from biogrip.physics.unilateral import UnilateralResponse, unilateral_response
from biogrip.records.traces import read_target
from biogrip.study.study import Case


def draw_force(case: Case, target: Path) -> Figure:
    """Draw the jaw force under bilateral contact, and the rotation with and without adhesion."""
    time_s, _, rotation = read_target(target, case.times_s)
    device = case.gripper, case.network, case.torque
    # Without inertia, since the jaws ring for less than a sampling interval after a step.
    sticking = jaw_force(*device, time_s, nonlinear=case.nonlinear_target, inertia=False)[0]
    drawn = figure(COLUMN_IN, 3.2)
    forces, rotations = drawn.subplots(2, 1, sharex=True, height_ratios=[1.25, 1])
    factor, unit = scale_of(sticking, "N")
    forces.axhline(0, color=BLACK, linewidth=0.6)
    forces.plot(time_s, factor * sticking, color=BLUE, label="jaws that hold the sample")
    negative = np.minimum(factor * sticking, 0)
    pulling = bool(negative.min() < -1e-9 * factor * np.abs(sticking).max())
    if pulling:
        forces.fill_between(
            time_s, negative, 0, color=ORANGE, alpha=0.35, linewidth=0, hatch="////",
            label="the jaws would have to pull",
        )  # fmt: skip
    apart = None
    if pulling and not case.nonlinear_target:
        apart = unilateral_response(*device, time_s)
        shown = _from_loss(apart, apart.jaw_force_N)
        forces.plot(time_s, factor * shown, "--", color=ORANGE, label="jaws that let go")
    forces.set_ylabel(f"jaw force ({unit})")
    low, high = float(negative.min()), factor * float(sticking.max())
    forces.set_ylim(low - 0.08 * (high - low), high + (0.62 if apart else 0.42) * (high - low))
    forces.legend(loc="upper right")
    forces.set_title(case.title)

    factor, unit = scale_of(rotation, "rad")
    name = "target" + (", jaws that let go" if case.unilateral else "")
    rotations.plot(time_s, factor * rotation, color=BLACK, label=name)
    if apart and not case.unilateral:
        shown = _from_loss(apart, apart.rotation[0])
        rotations.plot(time_s, factor * shown, "--", color=ORANGE, label="jaws that let go")
    rotations.set_ylabel(f"rotation ({unit})")
    low, high = (factor * float(end) for end in (min(rotation.min(), 0), rotation.max()))
    rotations.set_ylim(low, high + 0.4 * (high - low))
    rotations.set_xlabel("time (s)")
    rotations.set_xlim(time_s[0], time_s[-1])
    rotations.legend(loc="upper right", ncols=2)
    drawn.align_ylabels()
    return drawn


def _from_loss(found: UnilateralResponse, values: Array) -> Array:
    """Return values from the last sample before contact is first lost, NaN before."""
    lost = np.flatnonzero(~found.touching)
    start = max(lost[0] - 1, 0) if len(lost) else len(values)
    return np.where(np.arange(len(values)) >= start, values, np.nan)
