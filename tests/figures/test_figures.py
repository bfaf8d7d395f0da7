"""Figures drawn from the committed study's settings, and read back from their axes."""

import re
import zlib
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from fontTools import subset
from fontTools.ttLib import TTFont
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from biogrip.figures import comb, convergence, linkage, torque
from biogrip.figures.results import scale_of
from biogrip.figures.style import ALL_SEEDS, COLORS, FITTED, figure, line_of, save, styled
from biogrip.fit.methods import METHODS
from tests.helpers.default import STUDY, seen


def drawn(module: Any) -> Figure:
    """A figure of the default study's inputs."""
    with styled():
        found: Figure = module.draw(STUDY)
    return found


def test_torque_shows_the_protocol_and_its_voltages() -> None:
    left, right = drawn(torque).axes
    assert (left.get_ylabel(), right.get_ylabel()) == ("torque (nN m)", "voltage (V)")
    assert [text.get_text() for text in left.texts] == ["1.6 nN m", "0.32 nN m"]
    # 27 to 55 V to touch a sample, whose squares add up with those of the grip.
    volts = [text.get_text() for text in right.texts]
    assert volts == ["57.4 V", "55.6 V", "31.9 V", "28.4 V", "16.3 V", "7.28 V"]
    legend = right.get_legend()
    assert legend
    assert [t.get_text() for t in legend.get_texts()] == ["30 µm", "120 µm", "from contact"]


def test_comb_has_every_finger_where_it_is() -> None:
    whole, _, curve = drawn(comb).axes
    floating, fixed = whole.collections
    assert len(floating.get_paths()) == len(fixed.get_paths()) == 66
    outermost = max(np.hypot(*np.asarray(p.vertices).T).max() for p in fixed.get_paths())
    # Outside the last finger is one more gap; arcs are splines, good to 2e-4.
    assert outermost == pytest.approx(321 + 66 * 14 - 3, rel=3e-4)
    assert re.search(r"\(V\)", curve.get_xlabel())


def test_saved_figures_are_the_same_every_time(tmp_path: Path) -> None:
    for name in ("a", "b"):
        with styled():
            save(torque.draw(STUDY), tmp_path / f"{name}.png")
    for suffix in (".png", ".pdf"):
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize(
    ("seeds", "shown", "others", "label"),
    [
        (50, 7, 49, "all 50 seeds"),
        (1500, 7, 99, "first 100 of 1500 seeds"),
        (1500, 1400, 100, "first 100 of 1500 seeds"),
    ],
)
def test_no_more_seeds_are_drawn_than_can_be_seen(
    tmp_path: Path, seeds: int, shown: int, others: int, label: str
) -> None:
    numbers = np.arange(seeds)
    others_before = np.flatnonzero(numbers != shown)[: (seeds - 1) // 2]
    misfit = np.where(np.isin(numbers, others_before), 1.0, 1.5)
    misfit[shown] = 1.2
    found = pd.DataFrame({"seed": numbers, "misfit": misfit, "noise_rms": 1.0})
    for column in ("case", "generations", "evaluations", "stop_reason"):
        found[column] = 1
    found["method"] = "genetic"
    found.to_csv(tmp_path / "found.csv", index=False)
    history = {"seed": np.repeat(numbers, 2), "generation": np.tile([0, 1], seeds)}
    history["best_misfit"] = np.repeat(misfit, 2)
    pd.DataFrame(history).assign(method="genetic").to_parquet(tmp_path / "history.parquet")
    study = seen(shown_method=METHODS["genetic"], near_noise_tolerance=0.02)
    case = seen(title="A cell", mutation_start=20, study=study)
    files = (tmp_path / "found.csv", tmp_path / "history.parquet")
    axes = convergence.draw(case, *files).axes
    filled = [line for line in axes[0].lines if len(np.asarray(line.get_xdata()))]
    assert sum(line.get_color() == ALL_SEEDS for line in filled) == others
    assert sum(line.get_color() == FITTED for line in filled) == 1
    legend = axes[0].get_legend()
    assert legend
    assert legend.get_texts()[0].get_text() == label
    # Generations end before mutation starts.
    assert not axes[0].texts


@pytest.mark.parametrize(
    ("value", "expected"),
    [(2.0, (1.0, "rad")), (3e-3, (1e3, "mrad")), (3e-5, (1e6, "µrad")), (3e-8, (1e9, "nrad"))],
)
def test_prefixes(value: float, expected: tuple[float, str]) -> None:
    assert scale_of(np.array([-value, 0.0]), "rad") == expected


def test_tips_are_drawn_as_far_closed_as_samples_let_them() -> None:
    """Enlarged, which is said, for 3 mrad would not be seen."""
    tips = drawn(linkage).axes[1]
    legend = tips.get_legend()
    assert legend
    text = legend.get_texts()[1].get_text()
    told = re.fullmatch(r"closed by ([\d.]+) mrad \(drawn (\d+) times\)", text)
    assert told
    # The softest sample of the study gives way by 3.2 mrad.
    assert float(told[1]) == pytest.approx(3.2, abs=0.05)
    at_rest, _, closed, _ = (
        np.asarray(line.get_xydata())
        for line in tips.lines
        if len(np.asarray(line.get_xdata())) == 2 and line.get_linewidth() == 2
    )
    (before,), (after,) = (
        np.degrees(np.arctan2(*np.diff(arm, axis=0).T[::-1])) for arm in (at_rest, closed)
    )
    turned = 1e3 * np.radians(before - after)
    assert turned == pytest.approx(float(told[1]) * int(told[2]), rel=0.02)
    texts = {text.get_text() for text in tips.texts}
    assert {"$x$", "$u_B$", "$u_C$"} <= texts


def test_a_pdf_has_the_glyphs_that_are_drawn_and_no_table_that_lays_text_out(
    tmp_path: Path,
) -> None:
    options = subset.Options
    with styled():
        empty = figure(2, 2)
        empty.subplots().set_title("Wxyz")
        save(empty, tmp_path / "drawn.png")
    assert subset.Options is options
    content = (tmp_path / "drawn.pdf").read_bytes()
    streams = map(decompressed, re.findall(rb"stream\r?\n(.*?)\r?\nendstream", content, re.DOTALL))
    (font,) = (TTFont(BytesIO(text)) for text in streams if text.startswith(b"\x00\x01\x00\x00"))
    assert not {"GDEF", "GPOS", "GSUB", "kern"} & set(font.keys())
    with_outlines = sum(font["glyf"][name].numberOfContours != 0 for name in font.getGlyphOrder())
    # Of the title, and of 0.0, 0.2 ... 1.0 at the ticks: seven digits and the point.
    assert with_outlines >= len("Wxyz") + len("01.2468") - 1


def decompressed(stream: bytes) -> bytes:
    """What is in a stream of a PDF; nothing if it is not compressed."""
    with suppress(zlib.error):
        return zlib.decompress(stream)
    return b""


def test_every_method_is_drawn_as_no_other_and_in_colours_for_all_eyes() -> None:
    lines = [tuple(line_of(method).values()) for method in METHODS.values()]
    assert len(set(lines)) == len(lines)
    for method in METHODS.values():
        Line2D([], [], **line_of(method))
    # Okabe and Ito's, but for their yellow, which is not seen on white; and a grey.
    assert set(COLORS.values()) == {
        *("#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7", "#999999"),
    }
