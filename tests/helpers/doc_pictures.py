"""The pictures of the documentation: ``python -m tests.helpers.doc_pictures [NAME ...]``.

All but the picture of the page (`tests.helpers.page_picture`) and the published figures.
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch

from biogrip import library
from biogrip.arrays import Array
from biogrip.cli import main as command
from biogrip.experiment.noise import Noise, add_noise
from biogrip.experiment.noise_parts import AR1, Drift, Flicker, Outliers
from biogrip.products.figures.profiles import draw_profiles
from biogrip.products.figures.style import (
    BLUE,
    FITTED,
    GREEN,
    GREY,
    MEASURED,
    PAGE_IN,
    SHADE,
    TARGET,
    figure,
    save_png,
    styled,
)
from tests.helpers.places import EXAMPLE, ROOT

DOCS = ROOT / "docs"
TIMES = np.linspace(0.0, 400.0, 801)
DROP = {"k": 1.0, "k_p": 1e-4, "c": 10.0, "c_p": 1e-3}
CASES = {
    "endothelial cell": {"k": 35.0, "k_p": 12.3, "c": 299.9, "c_p": 1e-3},
    "liquid drop 1": {"k": 9.5, "k_p": 1e-4, "c": 10.0, "c_p": 1e-4},
    "liquid drop 2": DROP,
}


def experiment(model: str = "generalized_maxwell") -> library.CaseProblem:
    """The default study's gripper and protocol."""
    arm = library.Arm(inertia_kgm2=1e-14, damping_Nms_per_rad=3.3e-12, stiffness_Nm_per_rad=4.4e-7)
    gripper = library.Gripper(arm_length_m=1.5e-3, reference_angle_deg=75.0, left=arm, right=arm)
    protocol = (library.hold(200.0, 1.6e-9), library.hold(200.0, 0.32e-9))
    return library.set_up(gripper, protocol, library.Sample(model))


def answer() -> Figure:
    """Gripper, trace, and what a determined and an undetermined parameter look like."""
    case_problem, times = experiment(), np.linspace(0.0, 400.0, 4001)
    rotation = library.simulate(case_problem, DROP, times)
    noise = Noise("gaussian", 0.1, "peak")
    trace = add_noise(rotation, noise, np.random.default_rng(0))
    found = library.identify_sample(case_problem, times, trace)
    told = library.judge(case_problem, times, trace, found)
    fitted = library.simulate(
        case_problem,
        dict(zip(case_problem.searched.names, map(float, found.parameters), strict=True)),
        times,
    )
    drawn = figure(PAGE_IN, 2.2)
    grid = drawn.subplots(1, 4, width_ratios=(0.75, 1.3, 1, 1))
    _gripper(grid[0])
    grid[1].plot(times, 1e3 * trace, ".", color=MEASURED, markersize=0.7, label="trace")
    grid[1].plot(times, 1e3 * fitted, color=FITTED, label="fit")
    grid[1].set(xlabel="time (s)", ylabel="closing rotation (mrad)", title="2  its rotation")
    grid[1].legend()
    findings = {finding.quantity.label: finding for finding in told.findings}
    for axes, name, title in (
        (grid[2], "c + c_p", "3  c + c$_p$: determined"),
        (grid[3], "c_p", "4  c$_p$: only bounded"),
    ):
        profile = findings[name].profile
        axes.plot(np.exp(profile.log_values), profile.increases, color=FITTED)
        axes.axhline(3.84, color=TARGET, linestyle="--", linewidth=0.7)
        low, high = findings[name].low, findings[name].high
        axes.axvspan(low or 1e-5, high, color=SHADE, zorder=0)
        axes.set(ylim=(0, 12), xlabel=f"{title[3:].split(':')[0]} (N s/m)", title=title)
    grid[2].set(xlim=(9.6, 10.4), ylabel="increase of χ²")
    grid[2].text(9.62, 4.1, "95 %", fontsize=7)
    grid[3].set(xscale="log", xlim=(1e-5, 5))
    return drawn


def _gripper(axes: Axes) -> None:
    for side in (-1, 1):
        axes.plot([side * 0.55, side * 0.16], [0, 1.5], color=BLUE, linewidth=4)
        axes.plot([side * 0.55], [0], "o", color="white", markeredgecolor=TARGET)
        axes.annotate("", (side * 0.24, 0.75), (side * 0.62, 0.75), arrowprops={"arrowstyle": "->"})
    axes.add_patch(Circle((0, 1.5), 0.16, color=FITTED))
    axes.text(0, 1.75, "sample", ha="center", fontsize=7)
    axes.text(0, 0.62, "torque", ha="center", fontsize=7)
    axes.set(xlim=(-0.8, 0.8), ylim=(-0.2, 2.0), title="1  two arms squeeze")
    axes.set_aspect("equal")
    axes.axis("off")


def identified() -> dict[str, Any]:
    """Return what `biogrip identify` writes of the example."""
    with TemporaryDirectory() as folder:
        command(["identify", str(EXAMPLE), "--output", f"{folder}/found.json"])
        found: dict[str, Any] = json.loads(Path(f"{folder}/found.json").read_text("utf-8"))
    return found


def example_profiles() -> Figure:
    """Profiles of the example trace."""
    return draw_profiles("data/example_trace.csv", {}, identified())


def example_fit() -> Figure:
    """The example trace, its fit, and the residual."""
    time_s, rotation = np.loadtxt(EXAMPLE, delimiter=",", skiprows=1, unpack=True)
    case_problem = experiment()
    return library.plot(
        case_problem, time_s, rotation, library.identify_sample(case_problem, time_s, rotation)
    )


def groups() -> Figure:
    """Cells of two dishes with intervals, and the medians of their groups: drawn, not fitted."""
    rng = np.random.default_rng(4)
    drawn = figure(PAGE_IN / 2, 2.2)
    axes = drawn.subplots()
    for row, (by, colour) in enumerate(((1.0, BLUE), (1.5, FITTED))):
        cells = np.log(20 * by) + 0.1 * rng.standard_normal(5)
        error = 0.05 + 0.03 * rng.random(5)
        places = row + np.linspace(-0.3, 0.1, 5)
        low, high = np.exp(cells - 2 * error), np.exp(cells + 2 * error)
        axes.hlines(places, low, high, color=colour, linewidth=1)
        axes.plot(np.exp(cells), places, "o", color=colour, markersize=3)
        mean, half = cells.mean(), 2.78 * cells.std(ddof=1) / np.sqrt(5)
        axes.hlines(row + 0.3, np.exp(mean - half), np.exp(mean + half), color=TARGET, linewidth=2)
        axes.plot(np.exp(mean), row + 0.3, "D", color=TARGET, markersize=5)
    axes.set(yticks=[0, 1], yticklabels=["control", "treated"], xlabel="k (N/m)", ylim=(-0.5, 1.5))
    axes.set_title("cells (dots) and group medians (diamonds)")
    return drawn


def _kinds() -> dict[str, Noise]:
    white: tuple[str, float, str] = ("gaussian", 0.1, "peak")
    return {
        "Gaussian": Noise(*white),
        "uniform": Noise("uniform", 0.1, "peak"),
        "ar1: AR(1)": Noise(*white, ar1=AR1(0.5, 20.0)),
        "flicker: 1/f": Noise(*white, flicker=Flicker(0.8)),
        "drift": Noise(*white, drift=Drift(4.0)),
        "outliers": Noise(*white, outliers=Outliers(0.02, 8.0)),
    }


def noise() -> Figure:
    """One trace with each kind of noise."""
    rotation = library.simulate(experiment(), DROP, TIMES)
    drawn = figure(PAGE_IN, 3.0)
    grid = drawn.subplots(2, 3, sharex=True, sharey=True)
    for axes, (name, kind) in zip(grid.flat, _kinds().items(), strict=True):
        noisy = add_noise(rotation, kind, np.random.default_rng(1), TIMES)
        axes.plot(TIMES, 1e3 * noisy, ".", color=MEASURED, markersize=1.2)
        axes.plot(TIMES, 1e3 * rotation, color=TARGET, linewidth=0.8)
        axes.set_title(name)
    for axes in grid[1]:
        axes.set_xlabel("time (s)")
    for axes in grid[:, 0]:
        axes.set_ylabel("rotation (mrad)")
    return drawn


def residuals() -> Figure:
    """What fits leave of traces: white noise, autocorrelated noise, and outliers."""
    case_problem = experiment()
    rotation = library.simulate(case_problem, DROP, TIMES)
    drawn = figure(PAGE_IN, 1.9)
    grid = drawn.subplots(1, 3, sharey=True)
    kinds = _kinds()
    for axes, name, title in zip(
        grid,
        ("Gaussian", "ar1: AR(1)", "outliers"),
        ("white: no note", "autocorrelated: it wanders", "outliers"),
        strict=True,
    ):
        trace = add_noise(rotation, kinds[name], np.random.default_rng(2), TIMES)
        found = library.identify_sample(case_problem, TIMES, trace)
        values = dict(zip(case_problem.searched.names, map(float, found.parameters), strict=True))
        left: Array = trace - library.simulate(case_problem, values, TIMES)
        left /= left.std() if name != "outliers" else 1.48 * np.median(np.abs(left))
        axes.plot(TIMES, left, ".", color=MEASURED, markersize=1.5)
        means = [part.mean() for part in np.array_split(left, 20)]
        axes.step(np.arange(20) * 20 + 10, means, where="mid", color=FITTED)
        axes.axhline(0, color=TARGET, linewidth=0.6)
        axes.set(title=title, xlabel="time (s)", ylim=(-6, 6))
    grid[0].set_ylabel("residual / noise")
    return drawn


def heights() -> Figure:
    """The figure that the how-to adds."""
    drawn = figure(PAGE_IN / 2, 2)
    axes = drawn.subplots()
    highest = [library.simulate(experiment(), CASES[name], TIMES).max() for name in CASES]
    axes.bar(list(CASES), highest, color=BLUE)
    axes.tick_params("x", labelsize=6)
    axes.set_ylabel("highest rotation (rad)")
    return drawn


def flow() -> Figure:
    """From a config to a page."""
    drawn = figure(PAGE_IN, 1.5)
    axes = drawn.subplots()
    boxes = (
        ("config", "your YAML over\nthe default study"),
        ("target", "noise-free,\none a case"),
        ("measurement", "noisy traces,\na batch of seeds"),
        ("identification", "method by method,\na batch of seeds"),
        ("judgement", "what a trace\ndetermines"),
        ("tables, figures,\npage", "published,\ncompared, packed"),
    )
    for number, (name, what) in enumerate(boxes):
        box = FancyBboxPatch(
            (number * 1.25, 0.45), 1.0, 0.5, boxstyle="round,pad=0.02", facecolor=SHADE
        )
        axes.add_patch(box)
        axes.text(number * 1.25 + 0.5, 0.7, name, ha="center", va="center", fontsize=7)
        axes.text(number * 1.25 + 0.5, 0.3, what, ha="center", va="top", fontsize=6, color="#444")
        if number:
            arrow = {"arrowstyle": "->", "color": GREEN}
            axes.annotate("", (number * 1.25, 0.7), (number * 1.25 - 0.23, 0.7), arrowprops=arrow)
    axes.plot([1.25, 7.25], [1.15, 1.15], color=GREY)
    axes.text(4.25, 1.2, "results/, every file on record", ha="center", fontsize=7, color="#444")
    axes.set(xlim=(-0.1, 7.4), ylim=(-0.1, 1.4))
    axes.axis("off")
    return drawn


PICTURES: dict[str, Callable[[], Figure]] = {
    made.__name__: made
    for made in (
        answer,
        example_profiles,
        example_fit,
        groups,
        noise,
        residuals,
        heights,
        flow,
    )
}


def main(names: list[str]) -> None:
    """Draw those that are named, or all."""
    for name in names or PICTURES:
        with styled():
            save_png(PICTURES[name](), DOCS / f"{name}.png")


if __name__ == "__main__":
    main(sys.argv[1:])
