"""The answer at a glance: the gripper, a trace, and the profiles of a sum and of its member."""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from biogrip.digits import with_unit
from biogrip.figures.fit import draw_traces, judged_fit
from biogrip.figures.likelihood import draw_profile
from biogrip.figures.style import BLACK, BLUE, COLUMN_IN, ORANGE, figure, panel
from biogrip.records.identifications import read_verdicts
from biogrip.study.study import Case


def draw_answer(case: Case, verdicts: Path, measurements: Path, calibrated: list[Path]) -> Figure:
    """Draw a gripper, the judged trace of a case, and what it tells of two exchangeable dampers."""
    found = read_verdicts(verdicts)
    items = {item["quantity"]: item for item in found["quantities"]}
    drawn = figure(COLUMN_IN, 3.4)
    (device, trace), profiles = drawn.subplots(2, 2)
    _device(device)
    panel(device, "1", "two arms squeeze")
    fit = judged_fit(case, found, measurements, calibrated)
    factor, unit = draw_traces(trace, {"fit": fit})
    trace.set_ylim(top=1.45 * factor * fit.measured_rad.max())
    trace.set(xlabel="time (s)", ylabel=with_unit("rotation", unit))
    handles, _ = trace.get_legend_handles_labels()
    trace.legend(handles[::2], ["trace", "fit"], loc="upper right", ncols=2, columnspacing=1)
    panel(trace, "2", "one of them turns")
    names = [found["valley"][axis]["name"] for axis in "xy"]
    for number, axes, name in zip("34", profiles, (" + ".join(names), names[1]), strict=True):
        draw_profile(axes, items[name])
        axes.axhline(found["threshold"], color=BLACK, linestyle="--", linewidth=0.7)
        place = (0.02, found["threshold"] + 0.2, f"{100 * found['confidence']:g} %")
        axes.text(*place, transform=axes.get_yaxis_transform(), fontsize=7)
        panel(axes, number, f"{items[name]['symbol']}: {items[name]['verdict']}")
    profiles[0].set_ylabel("rise of χ²")
    return drawn


def _device(axes: Axes) -> None:
    """Draw two arms with a sample between their tips, not to scale."""
    axes.add_patch(Circle((0, 3.0), 0.34, color=ORANGE))
    for side in (-1, 1):
        axes.plot([side * 1.2, side * 0.32], [0, 3.1], color=BLUE, linewidth=4)
        axes.plot(side * 1.2, 0, "o", color="white", markeredgecolor=BLACK, markersize=6)
        arrow = {"arrowstyle": "->", "lw": 1.0, "color": BLACK}
        axes.annotate("", (side * 0.65, 1.5), (side * 1.5, 1.5), arrowprops=arrow)
    axes.annotate("torque", (0, 1.5), ha="center", va="center", fontsize=7)
    axes.set(xlim=(-1.8, 1.8), ylim=(-0.3, 3.5), aspect="equal")
    axes.set_axis_off()
