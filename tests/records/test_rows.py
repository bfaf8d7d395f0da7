"""CSV files as spreadsheets open them, and as we read them back."""

import csv
from pathlib import Path

import pytest

from biogrip.command.outputs import COLUMNS, join_tables
from biogrip.errors import BiogripError
from biogrip.records.rows import as_it_was, escape_formula, read_frame, read_rows, write_rows

FORMULAS = ("=1+1", "+1+1", "-1+1", "@SUM(A1)", "\t=1", "\r=1", "-x", "=", "'=1", "''=1", "+")
PLAIN = ("-1", "+2.5", "-1e-05", "-inf", "-", "a=b", "'a", "", "1.5", "it's", "NaN-1")


@pytest.mark.parametrize("text", FORMULAS)
def test_no_cell_is_a_formula_and_all_are_read_back(tmp_path: Path, text: str) -> None:
    file, rows = tmp_path / "a.csv", [[text, "1"], ["b", "-2.5"]]
    write_rows(file, ("name", "value"), rows)
    with file.open(newline="") as stream:
        assert list(csv.reader(stream)) == [["name", "value"], [f"'{text}", "1"], ["b", "-2.5"]]
    assert read_rows(file) == [["name", "value"], *rows]
    frame = read_frame(file, "rows", ("name", "value"), words=("name",))
    assert list(frame["name"]) == [text, "b"]
    assert list(frame["value"]) == [1.0, -2.5]


@pytest.mark.parametrize("text", PLAIN)
def test_numbers_and_other_text_are_written_as_they_are(text: str) -> None:
    assert escape_formula(text) == as_it_was(text) == text


def test_a_name_that_is_no_text_is_written(tmp_path: Path) -> None:
    write_rows(tmp_path / "a.csv", ("name",), [["a\udcff.csv"]])
    assert (tmp_path / "a.csv").read_text() == "name\na\\udcff.csv\n"


def test_an_end_of_line_of_any_kind_is_within_quotes(tmp_path: Path) -> None:
    rows = [["a\rb", "c\nd"], ["e\r\nf", "g"]]
    write_rows(tmp_path / "a.csv", ("one", "other"), rows)
    assert read_rows(tmp_path / "a.csv")[1:] == rows
    assert (tmp_path / "a.csv").read_bytes().endswith(b'\n"e\r\nf",g\n')


def test_what_cannot_be_read_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("a,b\n1,2,3\n")
    with pytest.raises(BiogripError, match=r"a.csv: cannot be read: [^\n]* saw 3\.$"):
        read_rows(tmp_path / "a.csv")


def test_text_in_a_column_of_numbers_is_refused(tmp_path: Path) -> None:
    """In one, too, that not all files of its kind have."""
    write_rows(tmp_path / "a.csv", ("name", "value", "more"), [["a", 1, "1.0.5"]])
    with pytest.raises(BiogripError, match=r"a.csv: more: not all are numbers"):
        read_frame(tmp_path / "a.csv", "rows", ("name", "value"), words=("name",))


def test_a_batch_that_lost_a_trace_is_named(tmp_path: Path) -> None:
    """Of three traces, two a batch."""
    parts = [tmp_path / "0-1.csv", tmp_path / "2-3.csv"]
    for part, names in zip(parts, ("ab", "c"), strict=True):
        write_rows(part, COLUMNS, [[name] * len(COLUMNS) for name in names])
    join_tables(parts, tmp_path / "all.csv", 3)
    assert [row[0] for row in read_rows(tmp_path / "all.csv")] == ["trace", "a", "b", "c"]
    write_rows(parts[0], COLUMNS, [["a"] * len(COLUMNS)])
    with pytest.raises(BiogripError, match=r"0-1.csv: found 1 traces, wanted 2"):
        join_tables(parts, tmp_path / "all.csv", 3)
