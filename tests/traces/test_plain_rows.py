"""Plain tables in bulk: the numbers of the careful reader, and nothing that is not plain."""

from pathlib import Path

import numpy as np
import pytest

from biogrip.traces.columns import Columns
from biogrip.traces.plain_rows import plain_rows
from biogrip.traces.reader import read_recording

VALUES = np.random.default_rng(0).standard_normal(50).tolist()
NUMBERS = [f"{t:.6g},{y!r}" for t, y in enumerate(VALUES)]
PLAIN = {
    "numbers": NUMBERS,
    "gaps": [*NUMBERS, "100,", "101,NaN", "102,-", "103,N/A", "104,1e-3"],
    "padded": [line.replace(",", " , ") for line in NUMBERS],
    "subnormal": [*NUMBERS, "100,4.9e-324", "101,2.2250738585072011e-308", "102,-0.0"],
    "digits": [*NUMBERS, "100,0.1000000000000000055511151231257827021181583404541015625"],
}
ODD = {
    "comment": [*NUMBERS, "# pause", "100,1"],
    "empty line": [*NUMBERS, "", "100,1"],
    "blank line": [*NUMBERS, "  ", "100,1"],
    "quotes": [*NUMBERS, '"100",1'],
    "too many cells": [*NUMBERS, "100,1,2"],
    "too few cells": [*NUMBERS, "100"],
    "separator at the end": [f"{line}," for line in NUMBERS],
    "word": [*NUMBERS, "100,high"],
    "infinity": [*NUMBERS, "100,inf"],
    "underscore": [*NUMBERS, "100,1_000"],
    "hexadecimal": [*NUMBERS, "100,0x10"],
    "binary": [*NUMBERS, "100,\0"],
    "not ASCII": [*NUMBERS, "100,\u0661"],
    "old line ends": ["\r".join(NUMBERS)],
}


def written(folder: Path, lines: list[str], header: str = "time_s,rotation_rad") -> Path:
    path = folder / "trace.csv"
    path.write_bytes("\n".join(["# made up", header, *lines, ""]).encode())
    return path


@pytest.mark.parametrize("how", PLAIN)
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_the_same_numbers_and_lines(
    how: str, ends: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, PLAIN[how])
    path.write_bytes(path.read_bytes().replace(b"\n", ends.encode()))
    assert plain_rows(path, 2, 2, [0, 1], ",") is not None
    columns = Columns("time_s", "rotation_rad")
    bulk = read_recording(path, columns)
    monkeypatch.setattr("biogrip.traces.plain_rows.plain_rows", lambda *_: None)
    careful = read_recording(path, columns)
    for name in ("time_s", "rotation_rad", "lines", "without_number"):
        np.testing.assert_array_equal(getattr(bulk, name), getattr(careful, name))


def test_decimal_commas_and_other_columns(tmp_path: Path) -> None:
    lines = [f"x;{line.replace(',', ';').replace('.', ',')}" for line in NUMBERS]
    rows = plain_rows(written(tmp_path, lines, "note;time_s;rotation_rad"), 2, 3, [2, 1], ";")
    assert rows is not None
    np.testing.assert_array_equal(rows[:, ::-1], [[*map(float, r.split(","))] for r in NUMBERS])


@pytest.mark.parametrize("how", ODD)
def test_what_is_not_plain_is_left_to_the_careful_reader(how: str, tmp_path: Path) -> None:
    assert plain_rows(written(tmp_path, ODD[how]), 2, 2, [0, 1], ",") is None


def test_a_header_without_rows(tmp_path: Path) -> None:
    assert plain_rows(written(tmp_path, []), 2, 2, [0, 1], ",") is None
