"""Damaged traces: `biogrip identify` gives an answer or one message, and no traceback."""

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.identified import FEW, identify
from tests.helpers.places import EXAMPLE

FILES = 300
FAILED: list[int] = []
"""Seeds that once failed; they are tried with every change."""

NUMBERS = ["", "nan", "inf", "-0", "1e308", "1e-320", "-1e30", "1,5", "0x1F", "٣", "1e400", "$x$"]
NAMES = ["time_ms", "time [h]", "rotation_deg", "rotation [mrad]", "file", "", "\x1b[31m", "<b>"]
MARKS = [";", "\t", " ", ",,", "\r", "\n\n", "\0", '"', "#", "\\", "é", "\ufeff", "\u202e"]


def damaged(seed: int) -> bytes:
    """Return the example, with every tenth reading, damaged in one to four ways."""
    rng = np.random.default_rng([2026, seed])
    header, *lines = EXAMPLE.read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in [header, *lines[::10]]]
    separator, ending = ",", "\n"
    for way in rng.integers(0, 9, rng.integers(1, 5)):
        some = rng.integers(1, len(rows), rng.choice([1, 5, 100]))
        column = int(rng.integers(2))
        if way == 0:
            for row in some:
                rows[row] = [*rows[row], str(rng.choice(NUMBERS))][-2:]
        elif way == 1:
            rows[0] = [
                str(rng.choice(NAMES)) if own == column else it for own, it in enumerate(rows[0])
            ]
        elif way == 2:
            factor = 10.0 ** int(rng.integers(-13, 14))
            rows[1:] = [[_times(it, factor) for it in row] for row in rows[1:]]
        elif way == 3:
            rows = rows[: 1 + int(rng.integers(20))]
            rows *= int(rng.integers(1, 3))
        elif way == 4:
            rows[1:] = [rows[1 + int(row)] for row in rng.permutation(len(rows) - 1)]
        elif way == 5:
            separator, ending = str(rng.choice(MARKS)), str(rng.choice(["\n", "\r\n", "\r"]))
        elif way == 6:
            rows = [[*row, *row[:column], "0"] for row in rows]
        elif way == 7:
            rows[1:] = [[row[0], rows[1][-1]] for row in rows[1:]]
        else:
            for row in some:
                rows[row % len(rows)] = [str(rng.choice(MARKS)).join(rows[row % len(rows)])]
        if len(rows) < 2:
            break
    content = bytearray(ending.join(separator.join(row) for row in rows).encode())
    if seed % 3 == 0:
        for place in rng.integers(0, len(content), 3):
            content[place] = int(rng.integers(256))
    return bytes(content)


def _times(cell: str, factor: float) -> str:
    try:
        return f"{float(cell) * factor:.9g}"
    except ValueError:
        return cell


@pytest.mark.parametrize(
    "seed",
    [*FAILED, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(FILES))],
)
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
