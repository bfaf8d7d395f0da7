"""Which run a figure shows; what is drawn of fits, profiles and valleys; files and styles."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from biogrip.arrays import Array
from biogrip.figures.course import draw_convergence, draw_scatter
from biogrip.figures.fit import Fit, draw_fit, draw_fits, scale_of
from biogrip.figures.likelihood import draw_profile, draw_valley
from biogrip.figures.style import (
    ALL_SEEDS,
    RUNS,
    figure,
    line_of,
    literal,
    points_within,
    save,
    styled,
)
from biogrip.fit.problem import METHODS
from biogrip.physics.instruments import MODULUS
from biogrip.physics.models import MODELS, Sample
from biogrip.records.identifications import columns
from biogrip.records.rows import write_arrays, write_object
from biogrip.records.traces import Measurements, write_measurements
from biogrip.stages import targets
from tests.helpers.default import STUDY, seen, study_of
from tests.helpers.problems import rotation
from workflow.paper.gripper import draw_torque

CASE = "liquid_drop_2"
TRUTH = [1.0, 1e-4, 10.0, 1e-3]
TIME_S = np.arange(0.0, 400.5, 1.0)
FEW = "seeds: 3\nmethods: [genetic]\n"
MODEL = MODELS["generalized_maxwell"]


@pytest.fixture
def identifications(tmp_path: Path) -> Path:
    """Of the seeds 1 and 2 near the noise, and 0 above it."""
    runs = (0, 9.0, 1.3e-4, 1e-4), (1, 0.7, 5.05e-5, 5e-5), (2, 1e-6, 3e-5, 3e-5)
    rows = [
        [CASE, "genetic", seed, k, *TRUTH[1:], *misfits, 7, 100, "stalled"]
        for seed, k, *misfits in runs
    ]
    frame = pd.DataFrame(rows, columns=columns(MODEL))
    frame.to_csv(tmp_path / f"{CASE}.csv", index=False)
    return tmp_path / f"{CASE}.csv"


@pytest.fixture
def measurements(tmp_path: Path) -> Path:
    """Three traces whose noise falls from seed to seed."""
    target, rng = rotation(MODEL, TRUTH, TIME_S), np.random.default_rng(0)
    noise = 1e-4 / np.array([[1], [2], [3]]) * rng.standard_normal((3, len(TIME_S)))
    traces = dict(enumerate(target + noise))
    write_measurements(tmp_path / "seeds_0-2.npz", Measurements(TIME_S, target, traces))
    return tmp_path / "seeds_0-2.npz"


def curve(found: Any, label: str) -> Array:
    (line,) = (line for line in found.axes[0].lines if label in str(line.get_label()))
    return np.asarray(line.get_ydata(), dtype=float)


def test_the_first_run_of_each_basin_is_drawn(identifications: Path, measurements: Path) -> None:
    with styled():
        drawn = draw_fits(study_of(FEW).cases[CASE], identifications, [measurements], [])
    for label, k in (("seed 1, near the noise", 0.7), ("seed 0, above the noise", 9.0)):
        expected = 1e3 * rotation(MODEL, [k, *TRUTH[1:]], TIME_S)
        np.testing.assert_allclose(curve(drawn, label), expected, rtol=1e-9)
    # Of the second the target's residual.
    left = np.asarray(drawn.axes[1].lines[2].get_ydata(), dtype=float)
    apart = rotation(MODEL, TRUTH, TIME_S) - rotation(MODEL, [9.0, *TRUTH[1:]], TIME_S)
    np.testing.assert_allclose(left, 1e3 * apart)
    # The paper's axis is on it, and all that was measured.
    low, high = drawn.axes[0].get_ylim()
    assert low <= -0.6 < 4.2 <= high


@pytest.mark.parametrize(
    ("time_s", "sd", "scale", "residual"),
    [
        (np.geomspace(0.01, 1000.0, 200), None, "log", "residual (Pa)"),
        (np.linspace(0.0, 10.0, 200), None, "linear", "residual (Pa)"),
        (np.linspace(0.0, 10.0, 200), 0.5, "linear", "residual / sd"),
    ],
)
def test_axes_suit_the_sampling_and_residuals_are_in_the_unit_that_was_minimised(
    time_s: Array, sd: float | None, scale: str, residual: str
) -> None:
    modulus = 100 / (1 + time_s)
    sds = None if sd is None else np.full(len(time_s), sd)
    fit = Fit(time_s, None, 1.01 * modulus, modulus, sds, MODULUS)
    traces, residuals = draw_fit({"fit": fit}, "").axes
    assert (traces.get_xscale(), traces.get_yscale()) == (scale, scale)
    assert traces.get_ylabel() == "modulus (Pa)"
    assert (residuals.get_yscale(), residuals.get_ylabel()) == ("linear", residual)
    points = np.asarray(residuals.lines[0].get_ydata(), dtype=float)
    np.testing.assert_allclose(points, 0.01 * modulus / (sd or 1))


@pytest.mark.parametrize(
    ("seeds", "above", "others", "label"),
    [(50, 7, 48, "all 50 seeds"), (1500, 1000, 99, "first 100 of 1500 seeds")],
)
def test_no_more_seeds_are_drawn_than_can_be_seen(
    tmp_path: Path, seeds: int, above: int, others: int, label: str
) -> None:
    """And the first above the noise, wherever it is; of the study's own method."""
    numbers = np.arange(seeds)
    misfit = np.where(numbers < above, 1.0, 1.5)
    found = pd.DataFrame({"seed": numbers, "misfit": misfit, "noise_rms": 1.0})
    found = found.assign(case="x", generations=1, evaluations=1, stop_reason=1, method="genetic")
    found = found.assign(**{p.column: 1.0 for p in MODEL.parameters})
    found.to_csv(tmp_path / "found.csv", index=False)
    history = {"seed": np.tile(numbers, 4), "generation": np.repeat([0, 1, 0, 1], seeds)}
    history["best_misfit"] = np.tile(misfit, 4)
    history["method"] = np.repeat(["genetic", "least_squares"], 2 * seeds)
    write_arrays(tmp_path / "history.npz", history)
    study = seen(
        shown_method=METHODS["genetic"], near_noise_tolerance=0.02, config=seen(methods=["genetic"])
    )
    block = seen(genetic_algorithm=seen(mutation_start=20))
    known = {"name": "x", "seeds": seeds, "sample": Sample(MODEL.name), "study": study}
    case = seen(title="A cell", block=block, **known)
    drawn = draw_convergence(case, tmp_path / "found.csv", tmp_path / "history.npz")
    (axes,), (legend,) = drawn.axes, drawn.legends
    colors = [line.get_color() for line in axes.lines if len(np.asarray(line.get_xdata()))]
    assert [colors.count(each) for each in (ALL_SEEDS, *RUNS)] == [others, 1, 1]
    assert legend.get_texts()[0].get_text() == label


def scattered(overlay: str, identifications: Path) -> Any:
    """Of a case of which the sum alone is determined."""
    folder, case = identifications.parent, study_of(f"{FEW}{overlay}").cases[CASE]
    targets.simulate(case, folder / "target.csv")
    verdicts = dict.fromkeys(["k", "k_p", "c", "c_p"], "not determined")
    verdicts["c + c_p"] = "determined"
    items = [{"quantity": name, "verdict": verdict} for name, verdict in verdicts.items()]
    content = {"quantities": items, "trades": [], "notes": []}
    write_object(folder / "expected.json", content)
    with styled():
        files = identifications, folder / "target.csv", folder / "expected.json"
        return draw_scatter(case, *files, [])


def test_bands_of_the_confidence_are_drawn_of_what_is_determined(identifications: Path) -> None:
    drawn = scattered("", identifications)
    shaded = [any(isinstance(p, Rectangle) for p in axes.patches) for axes in drawn.axes]
    assert shaded == [False] * 4 + [True]
    assert drawn.axes[2].get_yscale() == "log"
    # 1e-6 of 1 is below four decades: one triangle on the edge.
    triangles = [line for line in drawn.axes[0].lines if line.get_marker() == "v"]
    assert [len(np.asarray(line.get_xdata())) for line in triangles] == [1]
    narrow = scattered("identifiability: {confidence: 0.6827}", identifications)
    wide, small = (float(f.axes[4].patches[0].get_extents().height) for f in (drawn, narrow))
    assert wide / small == pytest.approx(1.96, rel=1e-3)


def test_a_set_in_two_parts_is_shaded_in_two_parts() -> None:
    """Of a quantity whose profile is a parabola of its logarithm around 2, with few points."""
    logs = np.linspace(-1, 1, 9)
    profile = {"values": list(2 * np.exp(logs)), "increases": list((4 * logs) ** 2)}
    item = {"symbol": "$k$", "unit": "N/m", "low": 1.2, "high": 3.3, "excluded": [[1.9, 2.1]]}
    axes = figure(3, 3).subplots()
    draw_profile(axes, {**item, "profile": profile})
    spans = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    edges = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in spans]
    assert edges == [(1.2, 1.9), (2.1, pytest.approx(3.3))]


def drawn_valley(
    folder: Path, increases: list[list[float]], fits: dict[str, list[float]], **known: Any
) -> Any:
    """Axes of a valley along the sum of 10, with sums of 9, 10 and 11."""
    shares = np.linspace(0.1, 0.9, 5)
    sums = 10 * np.array([[0.9], [1.0], [1.1]])
    grid = {"x_values": sums * shares, "y_values": sums * (1 - shares), "increases": increases}
    axis = {"name": "c", "symbol": "$c$", "unit": "N s/m"}
    other = {**axis, "name": "c_p", "symbol": "$c_p$"}
    grids = [{key: np.asarray(each).tolist() for key, each in grid.items()}]
    path, valley = folder / "v.json", {"x": axis, "y": other, "grids": grids, "best": [9.0, 1.0]}
    write_object(path, {"valley": valley})
    rows: dict[str, Any] = {p.column: 1.0 for p in MODEL.parameters}
    rows |= {f"{name}_Ns_per_m": values for name, values in fits.items()}
    frame = pd.DataFrame(rows).assign(case="x", method="least_squares", misfit=1, noise_rms=1)
    frame = frame.assign(seed=range(len(frame)), generations=1, evaluations=1, stop_reason=1)
    frame.to_csv(folder / "found.csv", index=False)
    paper = seen(identified=known.get("paper", {}))
    study = seen(fitting_method=METHODS["least_squares"], config=seen(methods=["least_squares"]))
    known |= {"name": "x", "seeds": len(frame), "sample": Sample(MODEL.name)}
    known |= {"parameters": known.get("truth", {}), "published": paper}
    case = seen(title="A drop", study=study, **known)
    with styled():
        return draw_valley(case, path, folder / "found.csv").axes[0]


KNOWN = ("truth", "paper")
DEEP = [[50.0] * 5, [0.0] * 5, [60.0] * 5]
# Deep at its last point alone, where c is 9.
CLOSED = [[900.0] * 5, [900.0, 900.0, 900.0, 900.0, 0.0], [900.0] * 5]


def test_a_valleys_axes_end_around_what_is_in_it(tmp_path: Path) -> None:
    """Fits, truth, paper and where it is deep; each of them widens the axes, none is cut off."""
    near = {"c": [8.9, 9.05], "c_p": [1.1, 0.95]}
    narrow = drawn_valley(tmp_path, CLOSED, near)
    # The root of the rise, 30 at the next point, (7, 3), is below that of 10.83 for 0.11 of the way
    # there, which is as far as (8.78, 1.22); the fits end at (9.05, 0.95).
    low, high = narrow.get_xlim()
    assert 8.5 < low < 8.78 < 9.05 < high < 9.3
    low, high = narrow.get_ylim()
    assert 0.7 < low < 0.95 < 1.22 < high < 1.5
    low, high = drawn_valley(tmp_path, DEEP, near).get_xlim()
    assert low < 1 < 9 < high
    known = {"c": 6.0, "c_p": 4.0}
    more = drawn_valley(tmp_path, CLOSED, {"c": [6.0, 9.05], "c_p": [4.0, 0.95]})
    for axes in (more, *(drawn_valley(tmp_path, CLOSED, near, **{n: known}) for n in KNOWN)):
        assert axes.get_xlim()[0] < 6 < 9.05 < axes.get_xlim()[1]
        assert axes.get_ylim()[0] < 0.95 < 4 < axes.get_ylim()[1]


def test_a_matplotlibrc_changes_no_figure(tmp_path: Path) -> None:
    theirs = tmp_path / "matplotlibrc"
    for name, content in (("a", ""), ("b", "text.color: red\nsavefig.facecolor: yellow\n")):
        theirs.write_text(content)
        with mpl.rc_context(fname=theirs), styled():
            save(draw_torque(STUDY), tmp_path / f"{name}.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_figure_for_print_has_fonts_that_publishers_take(tmp_path: Path) -> None:
    with styled():
        save(draw_torque(STUDY), tmp_path / "torque.png", tmp_path / "torque.pdf")
    content = (tmp_path / "torque.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert b"/CIDFontType2" in content
    assert b"/Type3" not in content


@pytest.mark.parametrize("title", [r"$\frac{$", "5$ a day, 10$ a week", r"a_b ^ \ % # & < {"])
def test_a_title_sets_no_mathematics(tmp_path: Path, title: str) -> None:
    with styled():
        for name, text, parsed in (("a", literal(title), True), ("b", title, False)):
            drawn = figure(3, 2)
            drawn.suptitle(text, parse_math=parsed)
            save(drawn, tmp_path / f"{name}.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("value", "expected"),
    [(2.0, (1.0, "rad")), (3e-3, (1e3, "mrad")), (3e-5, (1e6, "µrad")), (3e-8, (1e9, "nrad"))],
)
def test_prefixes(value: float, expected: tuple[float, str]) -> None:
    assert scale_of(np.array([-value, 0.0]), "rad") == expected


def test_every_method_is_drawn_as_no_other() -> None:
    lines = [tuple(line_of(method).values()) for method in METHODS.values()]
    assert len(set(lines)) == len(lines)
    for method in METHODS.values():
        Line2D([], [], **line_of(method))


def test_points_beyond_an_axis_are_triangles_at_its_edge() -> None:
    axes = figure(3, 3).subplots()
    points = np.array([[1.0, 0.5], [2.0, 2.0], [3.0, -7.0], [4.0, 7.0], [99.0, 2.0]])
    points_within(axes, points, (0, 0), (9, 5), {"marker": "o"}, edge_size=3)
    drawn_at = {line.get_marker(): np.asarray(line.get_xydata()) for line in axes.lines}
    np.testing.assert_array_equal(drawn_at["o"], points[:2])
    edges = {"v": [[3, 0]], "^": [[4, 5]], ">": [[9, 2]]}
    assert {marker: at.tolist() for marker, at in drawn_at.items() if marker != "o"} == edges
