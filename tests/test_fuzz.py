"""Damaged files: each command gives an answer or one message, and no traceback."""

import re
from pathlib import Path

import numpy as np
import pytest

from biogrip.cli import main
from biogrip.command.settings import Asked, check_settings
from biogrip.command.sheet import is_table, read_table
from biogrip.errors import BiogripError
from tests.helpers.identified import identify
from tests.helpers.places import EXAMPLE

pytestmark = [pytest.mark.nightly, pytest.mark.filterwarnings("error")]
# Files of a test, one after the other: tests are counted by every worker, run or not.
FILES = 100

NUMBERS = ["", "nan", "inf", "-0", "1e308", "1e-320", "-1e30", "1,5", "0x1F", "٣", "1e400", "$x$"]
NAMES = ["time_ms", "time [h]", "rotation_deg", "rotation [mrad]", "x", "", "\x1b[31m", "<b>"]
MARKS = [";", "\t", " ", ",,", "\r", "\n\n", "\0", '"', "#", "\\", "é", "\ufeff", "\u202e"]


def damaged(seed: int, header: list[str], rows: list[list[str]], words: list[str]) -> bytes:
    """Return a table with cells, columns, rows, marks or bytes damaged in one to four ways."""
    rng = np.random.default_rng([2026, seed])
    cells = np.array([header, *rows], object)
    separator, ending = ",", "\n"
    for way in rng.integers(0, 10, rng.integers(1, 5)):
        some = rng.integers(1, len(cells), rng.choice([1, 5, 100]))
        column = rng.integers(cells.shape[1])
        if way <= 2:
            cells[some, column] = rng.choice(words)
        elif way == 3:
            cells[0, column] = rng.choice([*header, *NAMES])
        elif way == 4:
            cells = np.delete(cells, column, axis=1) if cells.shape[1] > 1 else cells
        elif way == 5:
            cells[1:, column] = cells[1:, rng.integers(cells.shape[1])]
        elif way == 6:
            cells = np.tile(cells[: some[0] + 1], (int(rng.integers(1, 3)), 1))
        elif way == 7:
            cells[1:] = rng.permutation(cells[1:])
        elif way == 8:
            separator, ending = rng.choice(MARKS), rng.choice(["\n", "\r\n", "\r"])
        else:
            cells[some, column] += rng.choice(MARKS)
    content = bytearray(ending.join(map(separator.join, cells)).encode() + b"\n")
    if seed % 3 == 0:
        content[rng.integers(len(content))] = rng.integers(256)
    return bytes(content if seed % 7 else content[: rng.integers(len(content))])


@pytest.mark.parametrize("hundred", range(3))
def test_a_damaged_trace_gives_an_answer_or_one_message(
    tmp_path: Path, few: Path, hundred: int
) -> None:
    readings = np.loadtxt(EXAMPLE, delimiter=",", skiprows=1)[::10]
    for seed in range(FILES * hundred, FILES * (hundred + 1)):
        scale = 10.0 ** np.random.default_rng(seed).choice([0, 0, *range(-13, 14)], 2)
        rows = [[f"{it:.9g}" for it in row] for row in readings * scale]
        trace = damaged(seed, ["time_s", "rotation_rad"], rows, NUMBERS)
        (tmp_path / "trace.csv").write_bytes(trace)
        status, said, text = identify(tmp_path / "trace.csv", "--config", few)
        assert status in (0, 1), seed
        # What is recognised in an unusual file is told before.
        assert said if status == 0 else f"\n{text}".count("\nbiogrip: ") == 1, seed
        assert "fault of biogrip" not in text, seed
        assert "\x1b" not in said + text, seed


WORDS = [*NUMBERS, "0", "-1", "1e-400", "0.9", "2", "1_0", "b", "a1", "<b>", "\x1b[31m", "=1+1"]
WORDS += ["determined", "Determined", "bounded above", "not determined", "fit rejected"]
WORDS += ["ok", "doubtfull", "rejected", "failed"]


def found(trace: str, group: str, value: float) -> list[str]:
    """Return a row of what `identify --csv` writes: k determined, c bounded or not told."""
    numbers = [f"{it:.5g}" for it in (value, value / 1.1, value * 1.1)]
    others = ["bounded above", "", "", "9"] if value > 20 else ["not determined", "", "", ""]
    return [trace, group, trace, "ok", "0.95", "determined", *numbers, *others]


@pytest.mark.parametrize("hundred", range(20))
def test_a_damaged_table_of_groups_gives_numbers_or_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], hundred: int
) -> None:
    header = ["trace", "dish", "cell", "fit", "confidence"]
    for name in ("k", "c"):
        header += [f"{name} verdict", *(f"{name} {it} (N/m)" for it in ("value", "low", "high"))]
    rows = [
        found(f"{group}{n}", group, 18 + n + 9 * (group == "b")) for group in "ab" for n in range(4)
    ]
    for seed in range(FILES * hundred, FILES * (hundred + 1)):
        (tmp_path / "found.csv").write_bytes(damaged(seed, header, rows, WORDS))
        status = main(["groups", str(tmp_path / "found.csv"), "--by", "dish"])
        said, text = capsys.readouterr()
        assert status in (0, 1), seed
        assert text.count("\n") == status, seed
        # A trace or a group may have such a name.
        assert not re.search(r"\b(nan|inf) (\(\d|to \d)|\d to (nan|inf)", said), seed
        assert "\x1b" not in said + text, seed


def test_a_damaged_sheet_asks_for_traces_or_is_refused(tmp_path: Path) -> None:
    header = ["file", "dish", "measurement.time", "fixed.c_p", "protocol.phases"]
    header += ["gripper.arm_length_m"]
    rows = [[f"{n}.csv", "left", "time_s", "0", "[]", "3e-3"] for n in range(4)]
    odd = [*NUMBERS, "1:30", "[1", "{a: 1}", "&a [*a]", "!!python/none", "? x", "off"]
    odd += ["0.csv", ".", "/"]
    for seed in range(5 * FILES):
        (tmp_path / "cells.csv").write_bytes(damaged(seed, header, rows, odd))
        said = ""
        try:
            check_settings(read_table(tmp_path / "cells.csv"))
        except BiogripError as error:
            said = str(error)
        assert len(said.splitlines()) <= 11, seed
        assert is_table(Asked(tmp_path / "cells.csv")) in (True, False), seed
