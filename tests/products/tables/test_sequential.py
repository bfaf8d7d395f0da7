"""One experiment after another: what the stage writes of a cell, and what the table makes of many.

Rows are made up where numbers are to be known.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from biogrip.design import within_reach
from biogrip.design.experiment import DesignInputs
from biogrip.design.rating import Rater, Torque
from biogrip.design.shapes import SHAPES
from biogrip.products.files.sequences import SEQUENCES
from biogrip.products.plan import Plan
from biogrip.products.stages.sequence import (
    AFTER,
    BEFOREHAND,
    REPEATED,
    SEQUENCE,
    TRUTH,
    sequence,
    sequences,
)
from biogrip.products.tables.sequential import ALL, IN_WORDS, sequential
from tests.helpers.default import seen, study_of

OVERLAY = """
only: [endothelial_cell]
measurement: {rate_Hz: 0.5}
least_squares: {candidates: 100, starts: 3}
design: {noise_rad: 3.0e-6, readings: 300, fastest_Hz: 1.0e+5, longest_s: 400.0,
         largest_torque_Nm: 1.6e-9, most_steps: 6, plausible_samples: 4, candidates: 128,
         ranges: {c_p: [1.0e-2, 1.0]}, sequence: {cells: 3, experiments: 2}}
"""


def made_up(folder: Path) -> list[Path]:
    """Three cells in each way: c_p is never known, or after one or two experiments in some."""
    files = []
    for cell in range(3):
        rows: list[tuple[object, ...]] = []
        for way, helpful in ((REPEATED, 0.0), (AFTER, 1.0), (BEFOREHAND, 0.4), (TRUTH, 2.0)):
            for count in (1, 2):
                head = "endothelial_cell", cell, way, count
                for quantity, truth in (("k", 35.0), ("k_p", 12.0), ("c", 300.0)):
                    half = 0.015 / count
                    error = 1 + 0.01 * (cell - 1)
                    ends = truth * error * (1 - half), truth * error * (1 + half)
                    rows.append((*head, quantity, truth, truth * error, *ends, int(cell == 2), 1))
                width = 1 + 0.06 * (1 + cell) / (helpful * count) if helpful else 1.0
                low = 1e-2 / width if helpful else ""
                rows.append((*head, "c_p", 1e-2, 1.2e-2, low, 1e-2 * width, int(cell == 2), 1))
        files.append(folder / f"cell_{cell}.csv")
        SEQUENCES.write(files[-1], rows)
    return files


def test_counts_of_made_up_cells(tmp_path: Path) -> None:
    table = sequential(seen(cases={"endothelial_cell": seen(confidence=0.95)}), made_up(tmp_path))
    names = [column.name for column in table.columns]
    found = pd.DataFrame(table.rows, columns=names).set_index(["way", "experiments", "quantity"])
    assert len(found) == 4 * 2 * 5
    c_p = found.xs("c_p", level="quantity")["determined_percent"]
    # Widths are 6, 12 and 18 % in one way, after two experiments half of that, ...
    shares = {
        REPEATED: [0, 0],
        AFTER: [100 / 3, 100],
        BEFOREHAND: [0, 100 / 3],
        TRUTH: [100, 100],
    }
    for way, expected in shares.items():
        assert list(c_p[IN_WORDS[way]]) == pytest.approx(expected)
        together = found.loc[IN_WORDS[way]].xs(ALL, level="quantity")
        assert list(together["determined_percent"]) == pytest.approx(expected)
        assert list(together["missed_percent"]) == pytest.approx([100 / 3] * 2)
    row = found.loc[IN_WORDS[REPEATED], 1, "k"]
    assert row["determined_percent"] == 100
    assert row["error_percent"] == pytest.approx(1.0)
    # From the middle to either end, by a factor: the root of 1.015/0.985.
    assert row["half_width_percent"] == pytest.approx(1.511, abs=0.001)
    assert row["coverage_percent"] == 100
    # Halved intervals no longer hold the truth where the estimate is off by as much.
    assert found.loc[IN_WORDS[REPEATED], 2, "k"]["coverage_percent"] == pytest.approx(100 / 3)
    # An open end is no width, and holds all beyond it.
    never = found.loc[IN_WORDS[REPEATED], 2, "c_p"]
    assert pd.isna(never["half_width_percent"])
    assert never["coverage_percent"] == 100


class OneTorque:
    """A train of steps that is as good as any for a test; a search takes seconds."""

    def __init__(self) -> None:
        self.inputs: list[DesignInputs] = []

    def __call__(self, inputs: DesignInputs, *_: object) -> list[Torque]:
        self.inputs.append(inputs)
        shares = np.array([0.5, 0.3, 0.6, 0.5, 1.0, 1.0, 0.6, 0.6, 0.8])
        return [Rater(inputs).torque(SHAPES["steps"].waveform(shares, inputs.limits))]


def test_a_cell_of_the_stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A trace of the paper's leaves c_p open however often; a designed one after it does not."""
    search = OneTorque()
    monkeypatch.setattr(within_reach, "best_torques", search)
    study = study_of(OVERLAY)
    assert len(SEQUENCE.jobs(Plan(study, tmp_path))) == 3  # type: ignore[arg-type]
    chosen = sequences(study, {"case": "endothelial_cell", "seed": "1"})
    sequence(chosen, 1, tmp_path / "cell.csv")
    found = SEQUENCES.read(tmp_path / "cell.csv").set_index(["way", "experiments", "quantity"])
    assert len(found) == 4 * 2 * 4
    first = found.xs(1, level="experiments")
    pd.testing.assert_frame_equal(first.loc[REPEATED], first.loc[AFTER], rtol=1e-4)
    for way, known in ((REPEATED, False), (AFTER, True), (BEFOREHAND, True), (TRUTH, True)):
        c_p = found.loc[way, 2, "c_p"]
        assert pd.notna(c_p["low"]) == known
        assert 1e-2 < c_p["truth"] < 1
        if known:
            # Some standard deviations of the interval's own.
            assert abs(c_p["estimate"] / c_p["truth"] - 1) < 2 * (c_p["high"] / c_p["low"] - 1)
    # What the first trace told goes into the second's design: k_p as well as its interval says.
    after, beforehand, _ = search.inputs
    assert not beforehand.before.any()
    index = after.model.names.index("k_p")
    spread = np.sqrt(np.linalg.inv(after.before[0] + np.eye(4))[index, index])
    k_p = found.loc[AFTER, 1, "k_p"]
    assert np.log(k_p["high"] / k_p["low"]) / 2 == pytest.approx(1.96 * spread, rel=0.1)
    k = found.xs("k", level="quantity")
    # Without a range all cells are as in the config.
    assert set(k["truth"]) == {35.0}
    for way in (REPEATED, AFTER, BEFOREHAND, TRUTH):
        one, two = (k.loc[way, count] for count in (1, 2))
        assert two["high"] / two["low"] < one["high"] / one["low"]


def test_no_ranges_no_cells() -> None:
    text = OVERLAY.replace("ranges: {c_p: [1.0e-2, 1.0]}, ", "")
    with pytest.raises(Exception, match=r"found no design\.ranges"):
        study_of(text)
