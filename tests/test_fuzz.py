"""Damaged traces: `biogrip identify` gives an answer or one message, and no traceback."""

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.identified import FEW, identify
from tests.helpers.places import EXAMPLE

FILES = 300

NUMBERS = ["", "nan", "inf", "-0", "1e308", "1e-320", "-1e30", "1,5", "0x1F", "٣", "1e400", "$x$"]
NAMES = ["time_ms", "time [h]", "rotation_deg", "rotation [mrad]", "File", "", "\x1b[31m", "<b>"]
MARKS = [";", "\t", " ", ",,", "\r", "\n\n", "\0", '"', "#", "\\", "é", "\ufeff", "\u202e"]


def damaged(seed: int) -> bytes:
    """Return every tenth reading of the example, perhaps scaled, damaged in one to four ways."""
    rng = np.random.default_rng([2026, seed])
    readings = np.loadtxt(EXAMPLE, delimiter=",", skiprows=1)[::10]
    readings *= 10.0 ** rng.choice([0, 0, *range(-13, 14)], 2)
    cells = [[f"{it:.9g}" for it in row] for row in readings]
    rows = np.array([["time_s", "rotation_rad"], *cells], object)
    separator, ending = ",", "\n"
    for way in rng.integers(0, 7, rng.integers(1, 5)):
        some, column = rng.integers(1, len(rows), rng.choice([1, 5, 100])), rng.integers(2)
        if way == 0:
            rows[some, column] = rng.choice(NUMBERS)
        elif way == 1:
            rows[0, column] = rng.choice(NAMES)
        elif way == 2:
            rows = np.tile(rows[: 2 + rng.integers(20)], (int(rng.integers(1, 3)), 1))
        elif way == 3:
            rows[1:] = rng.permutation(rows[1:])
        elif way == 4:
            separator, ending = rng.choice(MARKS), rng.choice(["\n", "\r\n", "\r"])
        elif way == 5:
            rows[1:, column] = rows[1, column]
        else:
            rows[some, column] += rng.choice(MARKS)
    content = bytearray(ending.join(separator.join(row) for row in rows).encode())
    if seed % 3 == 0:
        for place in rng.integers(0, len(content), 3):
            content[place] = int(rng.integers(256))
    return bytes(content)


@pytest.mark.parametrize("seed", range(FILES))
@pytest.mark.nightly
@pytest.mark.filterwarnings("error")
def test_a_damaged_trace_gives_an_answer_or_one_message(tmp_path: Path, seed: int) -> None:
    (tmp_path / "few.yaml").write_text(FEW)
    (tmp_path / "trace.csv").write_bytes(damaged(seed))
    status, said, text = identify(tmp_path / "trace.csv", "--config", tmp_path / "few.yaml")
    assert status in (0, 1)
    # What is recognised in an unusual file is told before.
    assert said if status == 0 else f"\n{text}".count("\nbiogrip: ") == 1
    assert "fault of biogrip" not in text
    assert "\x1b" not in said + text
