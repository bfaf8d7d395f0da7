import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip.physics.instruments import ROTATION
from biogrip.traces import recordings, rows
from biogrip.traces.columns import Columns
from biogrip.traces.reader import Recording, read_recording
from biogrip.traces.columns import TIME_UNITS, unit_of

PLAIN = Columns("time_s", "rotation_rad")
ROWS = tuple(f"{i},{i}e-6" for i in range(12))


def written(path: Path, lines: Sequence[str], newline: str = "\n", encoding: str = "utf-8") -> Path:
    path.write_bytes("".join(line + newline for line in lines).encode(encoding))
    return path


def with_row(row: int, text: str) -> list[str]:
    """A good file with one row replaced; row n stands on line n + 2."""
    return ["time_s,rotation_rad", *ROWS[:row], text, *ROWS[row + 1 :]]


def refusal(path: Path, columns: Columns = PLAIN) -> str:
    """What is said of a bad file, after the file's name."""
    with pytest.raises(BiogripError) as error:
        read_recording(path, columns)
    message = str(error.value)
    assert message.startswith(str(path))
    return message.removeprefix(str(path))


def samples(rng: np.random.Generator, count: int = 50) -> tuple[list[str], list[str]]:
    """Times and rotations as text, of all sizes and in several notations."""
    times = np.cumsum(rng.uniform(1e-3, 10, count))
    angles = rng.standard_normal(count) * 10 ** rng.uniform(-7, 3, count)
    formats = rng.choice(["{:.6e}", "{:+.9f}", "{:.7g}", "{:E}"], count)
    return [f"{t:.5f}" for t in times], [
        form.format(a) for form, a in zip(formats, angles, strict=True)
    ]


def assert_holds(recording: Recording, times: Sequence[float], angles: Sequence[float]) -> None:
    np.testing.assert_allclose(recording.time_s, times, rtol=1e-15)
    np.testing.assert_allclose(recording.rotation_rad, angles, rtol=1e-15)


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", "."), ("\t", "."), (";", ","), ("\t", ",")]
)
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
@pytest.mark.parametrize("padding", ["", '"', " ", ' "'])
def test_every_way_to_write_a_table_gives_the_same_numbers(
    tmp_path: Path, separator: str, decimal: str, newline: str, encoding: str, padding: str
) -> None:
    times, angles = samples(np.random.default_rng(1))
    rows = [
        separator.join(
            padding + cell + padding[::-1]
            for cell in (a, "any, thing" if separator != "," else "nan", t)
        )
        for t, a in zip(
            (t.replace(".", decimal) for t in times),
            (a.replace(".", decimal) for a in angles),
            strict=True,
        )
    ]
    header = separator.join(padding + n + padding[::-1] for n in ("rotation_rad", "x", "time_s"))
    path = written(tmp_path / "t.csv", [header, *rows], newline, encoding)
    recording = read_recording(path, PLAIN)
    np.testing.assert_array_equal(recording.time_s, [float(t) for t in times])
    np.testing.assert_array_equal(recording.rotation_rad, [float(a) for a in angles])
    np.testing.assert_array_equal(recording.lines, np.arange(2, len(times) + 2))
    assert recording.without_number == 0


@pytest.mark.parametrize(
    ("time_unit", "second"), [("s", 1), ("ms", 1e-3), ("min", 60), ("h", 3.6e3)]
)
@pytest.mark.parametrize(
    ("angle_unit", "radian"),
    [
        ("rad", 1),
        ("mrad", 1e-3),
        ("urad", 1e-6),
        ("µrad", 1e-6),
        ("μrad", 1e-6),
        ("deg", 0.0174532925199432958),
    ],
)
@pytest.mark.parametrize("form", ["{}_{}", "{} ({})", "{} [{}]", "{}({})", "{}_2_{}", "{} ( {} )"])
def test_units_are_read_off_the_names_or_stated(
    tmp_path: Path, time_unit: str, second: float, angle_unit: str, radian: float, form: str
) -> None:
    times, angles = samples(np.random.default_rng(2))
    rows = [f"{t},{a}" for t, a in zip(times, angles, strict=True)]
    expected = [float(t) * second for t in times], [float(a) * radian for a in angles]
    names = form.format("time", time_unit), form.format("phi", angle_unit)
    path = written(tmp_path / "named.csv", [",".join(names), *rows])
    assert_holds(read_recording(path, Columns(*names)), *expected)
    assert_holds(read_recording(path, Columns(*names, time_unit, angle_unit)), *expected)
    path = written(tmp_path / "stated.csv", ["t,phi_left", *rows])
    assert_holds(read_recording(path, Columns("t", "phi_left", time_unit, angle_unit)), *expected)


def test_the_two_micro_signs_are_one_name(tmp_path: Path) -> None:
    path = written(tmp_path / "t.csv", ["time_s,phi (\u00b5rad)", *ROWS])
    for sign in "\u00b5\u03bcu":
        recording = read_recording(path, Columns("time_s", f"phi ({sign}rad)"))
        np.testing.assert_allclose(recording.rotation_rad, 1e-12 * np.arange(12), rtol=1e-15)


@pytest.mark.parametrize(
    ("column", "given", "message"),
    [
        ("phi", None, "found no unit, .*allowed are rad, mrad, urad, deg"),
        ("phi_left", None, "found no unit"),
        ("phi (rad/s)", None, "found no unit"),
        ("phi_s", None, "found no unit"),
        ("phi_Mrad", None, "found no unit"),
        ("phi", "degrees", "found the unit 'degrees', allowed are rad, mrad, urad, deg.*'deg'"),
        ("phi_mrad", "urad", "found the unit 'urad' where the name says 'mrad'"),
        ("phi [deg]", "rad", "found the unit 'rad' where the name says 'deg'"),
    ],
)
def test_units_are_never_guessed(
    tmp_path: Path, column: str, given: str | None, message: str
) -> None:
    path = written(tmp_path / "t.csv", [f"time_s,{column}", *ROWS])
    said = refusal(path, Columns("time_s", column, reading_unit=given))
    assert said.startswith(f", column '{column}': ")
    assert re.search(message, said)


def test_a_time_has_units_of_time() -> None:
    assert unit_of(Path("t"), "time_min", None, TIME_UNITS, "time_unit") == "min"
    assert unit_of(Path("t"), "phi_2", "\u03bcrad", ROTATION.units, "rotation_unit") == "urad"
    with pytest.raises(BiogripError, match=r"^t, column 'time_rad': found no unit.*s, ms, min, h"):
        unit_of(Path("t"), "time_rad", None, TIME_UNITS, "time_unit")


@pytest.mark.parametrize(
    "gap", ["nan", "NaN", "NA", "N/A", "-", "", " ", '""', '" nan "', "n/a", "#N/A", "#NV"]
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_gaps_are_left_out_and_counted(tmp_path: Path, gap: str, separator: str) -> None:
    rows = [row.replace(",", separator) for row in ROWS]
    rows[3:3] = [f"{gap}{separator}1", f"2.5{separator}{gap}", f"{gap}{separator}{gap}"]
    lines = [f"time_s{separator}rotation_rad", *rows]
    recording = read_recording(written(tmp_path / "t.csv", lines), PLAIN)
    np.testing.assert_array_equal(recording.time_s, np.arange(12))
    np.testing.assert_allclose(recording.rotation_rad, 1e-6 * np.arange(12), rtol=1e-15)
    assert recording.without_number == 3
    np.testing.assert_array_equal(recording.lines, [2, 3, 4, *range(8, 17)])


@pytest.mark.parametrize("rows_at_once", [1, 7, 300, 301])
def test_lines_and_gaps_at_random_places_are_told_right(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows_at_once: int
) -> None:
    monkeypatch.setattr(rows, "_ROWS_AT_ONCE", rows_at_once)
    rng = np.random.default_rng(rows_at_once)
    lines, expected, gaps = ["time_s;rotation_rad"], [], 0
    for i, kind in enumerate(rng.choice(["row", "gap", "comment", "empty"], 300)):
        gaps += kind == "gap"
        if kind == "row":
            expected.append((i, len(lines) + 1))
        choices = {"row": f"{i},5;{i}e-6", "gap": ";1", "comment": "#;;", "empty": ""}
        lines.append(choices[kind])
    recording = read_recording(written(tmp_path / "t.csv", lines), PLAIN)
    numbers, at = np.array(expected).T
    np.testing.assert_array_equal(recording.time_s, numbers + 0.5)
    np.testing.assert_array_equal(recording.lines, at)
    assert recording.without_number == gaps


def test_other_columns_may_hold_anything(tmp_path: Path) -> None:
    odd = ["", "inf", "x", '"a,b"', '5" pipe', "#", "1_0", "é", '"a ""b"""', "-", "\x0b", "\u2028"]
    rows = [
        f"{row.split(',')[0]},{o},{row.split(',')[1]}" for row, o in zip(ROWS, odd, strict=True)
    ]
    path = written(tmp_path / "t.csv", ["time_s,note,rotation_rad", *rows])
    recording = read_recording(path, PLAIN)
    np.testing.assert_array_equal(recording.time_s, np.arange(12))
    np.testing.assert_array_equal(recording.lines, np.arange(2, 14))


@pytest.mark.parametrize("row", [0, 5, 11])
@pytest.mark.parametrize(
    "text", ["abc", "1_0", "1.2.3", "0x1", "--", "1 2", "inf", "-inf", "1e999"]
)
@pytest.mark.parametrize("in_time", [True, False])
def test_other_text_than_a_number_is_named(
    tmp_path: Path, row: int, text: str, in_time: bool
) -> None:
    line = f"{text},1e-6" if in_time else f"{row},{text}"
    said = refusal(written(tmp_path / "t.csv", with_row(row, line)))
    column = "time_s" if in_time else "rotation_rad"
    assert said.startswith(
        f", line {row + 2}, column '{column}': found '{text}', allowed is a finite number"
    )


@pytest.mark.parametrize(
    ("row", "text", "message"),
    [
        (
            4,
            "3,1e-6",
            ", line 6, column 'time_s': found 3 repeated (line 5), allowed are times that",
        ),
        (
            4,
            "2.5,1",
            ", line 6, column 'time_s': found 2.5 after 3 (line 5), allowed are times that",
        ),
        (11, "-1,1", ", line 13, column 'time_s': found -1 after 10 (line 12), allowed"),
        (4, "4", ", line 6, column 'rotation_rad': found only 1 cell in the row, allowed are the"),
        (0, "0,1,2", ", line 2: found 3 cells in the row, allowed are the header's 2"),
        (3, '3,"1e-6', ", line 5: found a quote without its end"),
        (3, "3,\0", ", line 5: found binary data, allowed is text"),
        (3, '"' + 200_000 * "3" + '",1', ", line 5: cannot be read as a row: field larger"),
        (3, '"3,5",1e-6', ", line 5, column 'time_s': found '3,5', allowed is a finite number"),
    ],
)
def test_a_bad_row_is_named(tmp_path: Path, row: int, text: str, message: str) -> None:
    assert refusal(written(tmp_path / "t.csv", with_row(row, text))).startswith(message)


def test_times_are_compared_over_gaps_and_blocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rows, "_ROWS_AT_ONCE", 2)
    lines = ["time_s,rotation_rad", *ROWS, "11,nan", "# note", "11,2e-6"]
    said = refusal(written(tmp_path / "t.csv", lines))
    assert said.startswith(", line 16, column 'time_s': found 11 repeated (line 13)")


def test_a_decimal_comma_among_commas_is_not_read_as_cells(tmp_path: Path) -> None:
    lines = ["time_s,rotation_rad", *(f"{i},5,0,{i}" for i in range(12))]
    said = refusal(written(tmp_path / "t.csv", lines))
    assert said.startswith(", line 2: found 4 cells")
    assert said.endswith("A decimal comma needs semicolons or tabs as separators.")


FEW = "rows with a number in both time_s and rotation_rad"
LEAST = "allowed are at least 10."
SAY = "Say which is which by time and rotation under measurement."
NO_TRACE = {
    ": found no header, allowed is a line with column names.": ["# only", "", "# comments"],
    f": found 0 {FEW}, {LEAST}": ["time_s,rotation_rad"],
    f": found 2 {FEW}, {LEAST}": ["time_s,rotation_rad", *ROWS[:2]],
    f": found 0 {FEW} (4001 rows with NaN), {LEAST}": [
        *("time_s,rotation_rad", *(f"{i},NaN" for i in range(4001))),
    ],
    f": found 9 {FEW} (1 row with NaN), {LEAST}": ["time_s,rotation_rad", *ROWS[:9], "10,-"],
    ", line 2, column 'rotation_rad': found no such column, allowed are time_s, rotation. Did you "
    f"mean 'rotation'? {SAY}": ["# x", "time_s,rotation", *ROWS],
    f", line 1, column 'time_s': found no such column, allowed are 0, 0e-6. {SAY}": [*ROWS],
    ", line 1, column 'time_s': found 2 columns of this name, allowed is one.": [
        *("time_s,rotation_rad,time_s", *ROWS),
    ],
}


@pytest.mark.parametrize("message", NO_TRACE)
def test_a_file_without_a_trace_is_explained(tmp_path: Path, message: str) -> None:
    assert refusal(written(tmp_path / "t.csv", NO_TRACE[message])) == message


@pytest.mark.parametrize(
    "lines",
    [
        ["time_s,rotation_rad", *ROWS[:10]],
        ["time_s,rotation_rad", *(f"{row}, " for row in ROWS)],
        ["time_s,x,x,rotation_rad", *(row.replace(",", ",,,") for row in ROWS)],
        ["note,time_s,rotation_rad", *(f"#REF!,{row}" for row in ROWS)],
    ],
    ids=["ten samples", "separators at the end", "one name of others", "errors in others"],
)
def test_what_does_no_harm_is_read(tmp_path: Path, lines: list[str]) -> None:
    assert len(read_recording(written(tmp_path / "t.csv", lines), PLAIN).time_s) == len(lines) - 1


def test_one_column_is_not_both(tmp_path: Path) -> None:
    path = written(tmp_path / "t.csv", ["time_s,rotation_rad", *ROWS])
    said = refusal(path, Columns("time_s", "time_s", reading_unit="rad"))
    assert said.startswith(", line 1, column 'time_s': found time and rotation in one column")


def test_a_name_may_hold_another_separator(tmp_path: Path) -> None:
    lines = ['"time, since start, in_s";phi, left_rad', *(f"{i};{i}" for i in range(12))]
    path = written(tmp_path / "t.csv", lines)
    recording = read_recording(path, Columns("time, since start, in_s", "phi, left_rad"))
    np.testing.assert_array_equal(recording.rotation_rad, np.arange(12))


def test_missing_files_and_directories_are_named(tmp_path: Path) -> None:
    assert refusal(tmp_path) == ": found a directory, allowed is a text file with a trace."
    said = refusal(tmp_path / "none.csv")
    assert said == ": found no file, allowed is a text file with a trace."
    assert refusal(tmp_path / (300 * "x")).startswith(": ")


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_bytes_that_are_no_text_are_placed(tmp_path: Path, newline: str) -> None:
    """The byte 0x81 is no character of Windows-1252, and half a pair none of UTF-16."""
    lines = ["time_s,rotation_rad", *(f"{i},{i}" for i in range(5000)), "1,\x81"]
    allowed = "allowed is text in UTF-8, UTF-16 or Windows-1252."
    said = refusal(written(tmp_path / "t.csv", lines, newline, "latin-1"))
    assert said == f", line 5002: found the byte 0x81, {allowed}"
    content = f"time_s,rotation_rad{newline}".encode("utf-16") + b"\x00\xd8a"
    (tmp_path / "t.csv").write_bytes(content)
    assert refusal(tmp_path / "t.csv") == f", line 2: found the byte 0x00, {allowed}"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp1252"])
def test_a_laboratorys_text_is_read(tmp_path: Path, encoding: str) -> None:
    lines = [
        "Nr;Zeit (ms);Winkel (°);Temperatur (°C)",
        *(f"{i};{i},5;{i}e-6;21" for i in range(12)),
    ]
    path = written(tmp_path / "t.csv", lines, "\r\n", encoding)
    found = read_recording(path, Columns("Zeit (ms)", "Winkel (°)"))
    assert found.time_s == pytest.approx(1e-3 * (np.arange(12) + 0.5))
    assert found.rotation_rad == pytest.approx(np.radians(np.arange(12) * 1e-6))


PREAMBLE = ['Messung "12.03.2026', "", "# Kanal;Sensor", "Rate;20;Hz;;", "Zeit (s);U (V)"]


@pytest.mark.parametrize("row", ["{0};{0},5", '{0};"{0},5"'])
def test_a_preamble_is_skipped_and_volts_are_scaled(tmp_path: Path, row: str) -> None:
    """Both readers: Arrow takes no quoted cells."""
    lines = [*PREAMBLE, *(row.format(i) for i in range(12))]
    path = written(tmp_path / "t.csv", lines, encoding="cp1252")
    found = read_recording(path, Columns("Zeit (s)", "U (V)", None, "mrad", 4, -0.25))
    assert found.rotation_rad == pytest.approx(-0.25e-3 * (np.arange(12) + 0.5))
    np.testing.assert_array_equal(found.lines, np.arange(6, 18))


@pytest.mark.parametrize(
    ("columns", "hint"),
    [
        (Columns("time_s", "rotation_rad"), "skip: 4 there."),
        (Columns("time_s", "rotation_rad", by_options=True), "--skip 4."),
        (Columns("time_s", "U (V)", skip=4), None),
    ],
)
def test_a_header_below_a_preamble_is_named(
    tmp_path: Path, columns: Columns, hint: str | None
) -> None:
    path = written(tmp_path / "t.csv", [*PREAMBLE, *(f"{i};{i},5" for i in range(12))])
    said = refusal(path, columns)
    assert "found no such column" in said
    assert said.endswith(f" Line 5 looks like the header: {hint}") == (hint is not None)


def test_a_header_below_a_preamble_that_has_the_columns_is_read(tmp_path: Path) -> None:
    path = written(tmp_path / "t.csv", [*PREAMBLE, *(f"{i};{i},5" for i in range(12))])
    found = read_recording(path, Columns("Zeit (s)", "U (V)", None, "mrad"))
    np.testing.assert_array_equal(found.lines, np.arange(6, 18))
    assert found.rotation_rad == pytest.approx(1e-3 * (np.arange(12) + 0.5))


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-32"])
def test_other_encodings_are_refused(tmp_path: Path, encoding: str) -> None:
    path = written(tmp_path / "t.csv", ["time_s,rotation_rad", *ROWS], encoding=encoding)
    assert refusal(path).startswith(", line 1: found ")


def test_random_bytes_are_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        (tmp_path / "t.csv").write_bytes(rng.bytes(int(rng.integers(1, 5000))))
        refusal(tmp_path / "t.csv")


def test_a_damaged_byte_is_refused_or_leaves_a_trace(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    content = "\n".join(["time_s;rotation_rad", *(f"{i};{i}e-6" for i in range(30))]).encode()
    refused = 0
    for _ in range(500):
        damaged = bytearray(content)
        damaged[rng.integers(len(damaged))] = rng.integers(256)
        (tmp_path / "t.csv").write_bytes(damaged)
        try:
            recording = read_recording(tmp_path / "t.csv", PLAIN)
        except BiogripError:
            refused += 1
            continue
        assert np.all(np.diff(recording.time_s) > 0)
        assert np.all(np.isfinite(recording.rotation_rad))
        assert len(recording.time_s) + recording.without_number >= 28
    assert 250 < refused < 500


def test_a_file_with_too_many_rows_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path / "t.csv", ["time_s,rotation_rad", *ROWS])
    monkeypatch.setattr(rows, "MOST_ROWS", 12)
    assert len(read_recording(path, PLAIN).time_s) == 12
    monkeypatch.setattr(rows, "MOST_ROWS", 11)
    monkeypatch.setattr(recordings, "MOST_ROWS", 11)
    assert refusal(path) == ": found over 11 rows, allowed are 11."


@pytest.mark.parametrize(
    "error", ["#REF!", "#VALUE!", "#DIV/0!", "#NAME?", "#NUM!", "#NULL!", "#SPILL!", "#BEZUG!"]
)
@pytest.mark.parametrize("separator", [",", ";", "\t", ", "])
def test_a_spreadsheets_error_is_no_comment(tmp_path: Path, error: str, separator: str) -> None:
    lines = [line.replace(",", separator) for line in with_row(4, f"{error},1e-6")]
    said = refusal(written(tmp_path / "t.csv", lines))
    assert said.startswith(
        f", line 6, column 'time_s': found '{error}', allowed is a finite number"
    )
    lines = [line.replace(",", separator) for line in with_row(4, f"4,{error}")]
    said = refusal(written(tmp_path / "t.csv", lines))
    assert said.startswith(f", line 6, column 'rotation_rad': found '{error}', allowed is a finite")


@pytest.mark.parametrize(
    "comment",
    [
        "# 1,2",
        "#",
        "#REF!",
        "#comment, with comma",
        "#WHY? because",
        "#Note!, this",
        " # x",
        "##,1",
    ],
)
def test_comments_are_passed_over(tmp_path: Path, comment: str) -> None:
    lines = ["time_s,rotation_rad", *ROWS[:4], comment, *ROWS[4:]]
    recording = read_recording(written(tmp_path / "t.csv", lines), PLAIN)
    assert recording.without_number == 0
    assert recording.lines.tolist() == [2, 3, 4, 5, *range(7, 15)]


@pytest.mark.parametrize("letters", [131_072, 131_073, 1_000_000])
def test_endless_names_and_cells_are_refused(tmp_path: Path, letters: int) -> None:
    said = refusal(written(tmp_path / "t.csv", [f"time_s,rotation,{'x' * letters}", *ROWS]))
    assert said.startswith(", line 1")
    assert len(said) < 1000
    said = refusal(written(tmp_path / "t.csv", with_row(4, f"4,{'1' * letters}")))
    assert said.startswith(", line 6")
    assert len(said) < 1000
    said = refusal(written(tmp_path / "t.csv", [",".join(map(str, range(letters // 9))), *ROWS]))
    assert len(said) < 1000


@pytest.mark.parametrize(
    ("column", "option", "key"),
    [
        ("psi", "by --time and --rotation.", "by time and rotation under measurement."),
        ("phi", "(by --rotation-unit)", "(by rotation_unit under measurement)"),
    ],
)
def test_what_a_column_is_was_said_by_options_or_by_keys(
    column: str, option: str, key: str, tmp_path: Path
) -> None:
    path = written(tmp_path / "t.csv", ["time_s,phi", *ROWS])
    said = refusal(path, Columns("time_s", column, by_options=True))
    assert option in said
    assert "measurement" not in said
    said = refusal(path, Columns("time_s", column))
    assert key in said
    assert "--" not in said


@pytest.mark.parametrize("more", ["", "# a comment, for which the fast reader gives up"])
def test_standard_deviations_are_read_in_the_unit_of_the_rotations(
    tmp_path: Path, more: str
) -> None:
    lines = ["sd,time_s,phi", *(f"{i + 1},{i},{i}" for i in range(12)), more]
    path = written(tmp_path / "t.csv", lines)
    recording = read_recording(path, Columns("time_s", "phi", reading_unit="mrad", sd="sd"))
    assert recording.sd_rad is not None
    np.testing.assert_allclose(recording.sd_rad, 1e-3 * np.arange(1, 13), rtol=1e-15)
    np.testing.assert_allclose(recording.rotation_rad, 1e-3 * np.arange(12), rtol=1e-15)


def test_what_is_no_standard_deviation_is_refused(tmp_path: Path) -> None:
    rows = [f"{i},{i}e-6,1e-7" for i in range(12)]
    columns = Columns("time_s", "rotation_rad", sd="sd")
    lines = ["time_s,rotation_rad,sd", *rows[:4], "4,4e-6,0", *rows[5:]]
    said = refusal(written(tmp_path / "t.csv", lines), columns)
    assert said == ", line 6, column 'sd': found 0, allowed is a standard deviation above 0."
    lines = ["time_s,rotation_rad,sd_mrad", *rows]
    said = refusal(
        written(tmp_path / "t.csv", lines), Columns("time_s", "rotation_rad", sd="sd_mrad")
    )
    assert "found the unit 'rad' where the name says 'mrad'" in said
    path = written(tmp_path / "t.csv", ["time_s,rotation_rad", *ROWS])
    said = refusal(path, Columns("time_s", "rotation_rad", sd="rotation_rad"))
    assert "found rotation and sd in one column, allowed are two" in said
    gap = ["time_s,rotation_rad,sd", *rows[:4], "4,4e-6,", *rows[5:]]
    assert read_recording(written(tmp_path / "t.csv", gap), columns).without_number == 1


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        *(("hours", "h"), ("hour", "h"), ("HR", "h"), ("minutes", "min"), ("seconds", "s")),
        *(("sec", "s"), ("milliseconds", "ms"), ("mn", "min"), ("radians", "rad")),
        *(("degrees", "deg"), ("milliradians", "mrad"), ("microradians", "urad")),
        *(("microrad", "urad"), ("Rad", "rad")),
    ],
)
def test_a_unit_that_is_spelled_out_is_recognised(given: str, meant: str) -> None:
    units = TIME_UNITS if meant in TIME_UNITS else ROTATION.units
    with pytest.raises(BiogripError, match=re.escape(f"Did you mean '{meant}'?")):
        unit_of(Path("t.csv"), "t", given, units, "unit")
