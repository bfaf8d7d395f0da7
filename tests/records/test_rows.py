"""CSV files as spreadsheets open them, and as we read them back."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from biogrip.command.outputs import COLUMNS, join_tables
from biogrip.errors import BiogripError
from biogrip.files import as_it_was, escape_formula, read_rows, write_rows
from biogrip.physics.instruments import GRIPPER
from biogrip_study.records.rows import RowFile
from biogrip_study.records.traces import (
    Measurements,
    read_measurements,
    read_target,
    write_measurements,
    write_target,
)

FORMULAS = ("=1+1", "+1+1", "-1+1", "@SUM(A1)", "\t=1", "\r=1", "-x", "=", "'=1", "''=1", "+")
PLAIN = ("-1", "+2.5", "-1e-05", "-inf", "-", "a=b", "'a", "", "1.5", "it's", "NaN-1")


@pytest.mark.parametrize("text", FORMULAS)
def test_no_cell_is_a_formula_and_all_are_read_back(tmp_path: Path, text: str) -> None:
    file, rows = tmp_path / "a.csv", [[text, "1"], ["b", "-2.5"]]
    write_rows(file, ("name", "value"), rows)
    with file.open(newline="") as stream:
        assert list(csv.reader(stream)) == [["name", "value"], [f"'{text}", "1"], ["b", "-2.5"]]
    assert read_rows(file) == [["name", "value"], *rows]
    frame = RowFile("rows", ("name", "value"), ("name",)).read(file)
    assert list(frame["name"]) == [text, "b"]
    assert list(frame["value"]) == [1.0, -2.5]


@pytest.mark.parametrize("text", PLAIN)
def test_numbers_and_other_text_are_written_as_they_are(text: str) -> None:
    assert escape_formula(text) == as_it_was(text) == text


def test_ends_of_lines_are_within_quotes_and_what_is_no_text_is_written(tmp_path: Path) -> None:
    rows = [["a\rb", "c\nd"], ["e\r\nf", "a\udcff.csv"]]
    write_rows(tmp_path / "a.csv", ("one", "other"), rows)
    assert read_rows(tmp_path / "a.csv")[1:] == [rows[0], ["e\r\nf", "a\\udcff.csv"]]
    assert (tmp_path / "a.csv").read_bytes().endswith(b'\n"e\r\nf",a\\udcff.csv\n')


def test_what_cannot_be_read_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("a,b\n1,2,3\n")
    with pytest.raises(BiogripError, match=r"a.csv, line 2: part of the line is missing\.$"):
        read_rows(tmp_path / "a.csv")


def test_text_in_a_column_of_numbers_is_refused(tmp_path: Path) -> None:
    """In one, too, that not all files of its kind have."""
    write_rows(tmp_path / "a.csv", ("name", "value", "more"), [["a", 1, "1.0.5"]])
    with pytest.raises(BiogripError, match=r"a.csv: cannot be read as rows: .*1\.0\.5"):
        RowFile("rows", ("name", "value"), ("name",)).read(tmp_path / "a.csv")


def test_a_batch_that_lost_a_trace_is_named(tmp_path: Path) -> None:
    parts = [tmp_path / "0-1.csv", tmp_path / "2-3.csv"]
    for part, names in zip(parts, ("ab", "c"), strict=True):
        write_rows(part, COLUMNS, [[name] * len(COLUMNS) for name in names])
    join_tables(parts, tmp_path / "all.csv", 3)
    assert [row[0] for row in read_rows(tmp_path / "all.csv")] == ["trace", "a", "b", "c"]
    write_rows(parts[0], COLUMNS, [["a"] * len(COLUMNS)])
    with pytest.raises(BiogripError, match=r"0-1.csv: found 1 traces, wanted 2"):
        join_tables(parts, tmp_path / "all.csv", 3)


TIMES = np.arange(5.0)

# Rounding is all that is in the second.
FORCE = np.array([0.0, -3.1e-23, 1e-6 / 3, -7e-7 / 3, 1e-12 / 7])


def written(tmp_path: Path) -> Path:
    write_target(tmp_path / "t.csv", GRIPPER, TIMES, 1e-9 * np.ones(5), 1e-5 * TIMES / 3, FORCE)
    return tmp_path / "t.csv"


def test_a_target_is_read_back_to_nine_digits(tmp_path: Path) -> None:
    time_s, torque, rotation = read_target(written(tmp_path), TIMES)
    np.testing.assert_array_equal(time_s, TIMES)
    np.testing.assert_array_equal(torque, 1e-9)
    np.testing.assert_allclose(rotation, 1e-5 * TIMES / 3, rtol=5e-9)
    force = pd.read_csv(written(tmp_path))["jaw_force_N"].to_numpy()
    np.testing.assert_allclose(force, FORCE, rtol=0, atol=5e-16)
    assert force[1] == 0
    assert ",-0" not in written(tmp_path).read_text()


@pytest.mark.parametrize("readings", [0, 4])
def test_a_damaged_target_is_explained(tmp_path: Path, readings: int) -> None:
    path = written(tmp_path)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines).replace("1e-09", "abc", 1))
    with pytest.raises(BiogripError, match="cannot be read as a target: could not convert string"):
        read_target(path, TIMES)
    path.write_text("".join(lines[: 1 + readings]))
    with pytest.raises(BiogripError, match=rf"t.csv: found {readings} readings, wanted 5"):
        read_target(path, TIMES)


@pytest.mark.parametrize("known", [{}, {"target": TIMES - 1}, {"known": {"sd": TIMES + 0.1}}])
def test_measurements_are_read_back(tmp_path: Path, known: dict[str, Any]) -> None:
    path = tmp_path / "seeds_3-7.npz"
    traces = {seed: np.random.default_rng(seed).random(5) for seed in (3, 4, 5, 6, 7)}
    given = replace(Measurements(TIMES, None, traces), **known)
    write_measurements(path, given)
    for seeds in (None, [6, 4]):
        read = read_measurements(path, seeds)
        assert list(read.readings) == (seeds or list(traces))
        for seed, trace in read.readings.items():
            np.testing.assert_array_equal(trace, traces[seed])
            assert trace.flags.c_contiguous
        for name in ("time_s", "target", "known"):
            np.testing.assert_equal(getattr(read, name), getattr(given, name))


def test_damaged_measurements_are_named(tmp_path: Path) -> None:
    path = tmp_path / "m.npz"
    write_measurements(path, Measurements(TIMES, None, {0: TIMES}))
    with pytest.raises(BiogripError, match=r"m.npz: has no trace of seed 3"):
        read_measurements(path, [0, 3])
    whole = path.read_bytes()
    # A comment that hides the arrays after the first; no list of arrays.
    hidden, empty = bytearray(whole), bytearray(whole)
    hidden[whole.index(b"PK\1\2") + 33] = 1
    end = whole.rindex(b"PK\5\6")
    empty[end + 4 : end + 16] = bytes(12)
    changed = whole.replace(TIMES.tobytes(), (TIMES + 1).tobytes())
    for content in (whole[:-9], b"time_s,target\n0,1\n", changed, hidden, empty, None):
        path.unlink() if content is None else path.write_bytes(content)
        with pytest.raises(BiogripError, match=r"m.npz: cannot be read"):
            read_measurements(path)
