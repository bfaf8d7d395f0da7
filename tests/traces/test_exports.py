"""Exports of rheometers: preambles, rows of units, blocks, and clocks that are rounded."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip.physics.instruments import COMPLIANCE, MODULUS, STRAIN, STRESS
from biogrip.traces.columns import Columns
from biogrip.traces.reader import average_repeated, read_recording
from biogrip.traces.columns import TIME_UNITS, unit_of

ROWS = 14
"""Rows of each block."""

RELAXATION = Columns("Time", "Relaxation Modulus", quantity=MODULUS)
NAMES = ("Point No.", "Time", "Shear Strain", "Relaxation Modulus", "Torque", "Status")
UNITS = ("", "[s]", "[%]", "[kPa]", "[mN\u00b7m]", "")


def numbers(block: int) -> np.ndarray:
    """Times and moduli, in the units of the file."""
    times = ROWS * block + 0.5 * np.arange(1, ROWS + 1)
    return np.stack([times, (block + 1) / times])


def table(block: int, *, decimal: str = ",") -> list[list[str]]:
    """Rows as Anton Paar's programs write them."""
    cells = [[f"{number:.9g}".replace(".", decimal) for number in row] for row in numbers(block).T]
    return [[str(i), t, "1", g, "7,9E-05", "Dy_auto"] for i, (t, g) in enumerate(cells, 1)]


def interval(number: int, style: str, separator: str, *, decimal: str = ",") -> list[str]:
    """One interval with its preamble, in one of the two styles that there are."""
    first = {"old": [], "new": ["Interval data:"]}[style]
    empty = [""] * len(first)
    heads = {"old": ["Interval:"], "new": ["Interval and data points:", str(ROWS)]}
    rows = [
        [heads[style][0], str(number), *heads[style][1:]],
        [*first, *NAMES],
        [""] * (len(first) + len(NAMES)),
        [*empty, *UNITS],
        *([*empty, *row] for row in table(number - 1, decimal=decimal)),
    ]
    return [separator.join(row) for row in rows]


def anton_paar(
    path: Path, count: int = 1, style: str = "old", encoding: str = "utf-16", separator: str = "\t"
) -> Path:
    decimal = "." if separator == "," else ","
    lines = [f"Test:{separator}gel 3", f"Result:{separator}Step strain"]
    for number in range(1, count + 1):
        lines += [*interval(number, style, separator, decimal=decimal), "", ""]
    if separator == ",":
        lines = [line.replace("7,9E-05", "7.9E-05") for line in lines]
    path.write_bytes("\r\n".join(lines).encode(encoding))
    return path


def trios(path: Path, separator: str = "\t") -> Path:
    """Three steps as TRIOS writes them, with a preamble of sections; the last has a modulus."""
    preamble = [
        ["Filename", "gel"],
        ["Procedure name", "Conditioning"],
        ["", "Stress relaxation"],
        ["[File Parameters]"],
        ["Run date", "01/02/2026"],
        ["[Geometry Parameters]"],
        ["Gap", "1000 \u00b5m"],
        ["Notes", ""],
    ]
    steps = []
    for number in range(2):
        rows = numbers(number).T.tolist()
        steps += [["[step]"], [f"Flow sweep - {number + 1}"], ["Shear rate", "Time", "Stress"]]
        steps += [["1/s", "min", "MPa"], *([f"{t}", f"{t}", f"{g:.5e}"] for t, g in rows), []]
    names = ["1/temperature", "Step time", "Date and time", "Tan(delta)", "Modulus", "Compliance"]
    rows = numbers(2).T.tolist()
    steps += [["[step]"], ["Stress relaxation - 3"], names]
    steps += [["1/K", "min", "", "", "MPa", "1/MPa"]]
    date = "10/17/2026 10:27:02 AM"
    steps += [["0.003", f"{t:.9g}", date, "", f"{g:.9g}", f"{1 / g:.9g}"] for t, g in rows]
    path.write_text("\n".join(separator.join(row) for row in [*preamble, *steps]))
    return path


def refusal(path: Path, columns: Columns) -> str:
    with pytest.raises(BiogripError) as error:
        read_recording(path, columns)
    return str(error.value).removeprefix(str(path))


@pytest.mark.parametrize("style", ["old", "new"])
@pytest.mark.parametrize("encoding", ["utf-16", "utf-8", "cp1252"])
@pytest.mark.parametrize("separator", ["\t", ";", ","])
def test_an_interval_of_anton_paar(
    tmp_path: Path, style: str, encoding: str, separator: str
) -> None:
    path = anton_paar(tmp_path / "t.csv", 1, style, encoding, separator)
    found = read_recording(path, RELAXATION)
    times, moduli = numbers(0)
    np.testing.assert_allclose(found.time_s, times, rtol=1e-8)
    np.testing.assert_allclose(found.rotation_rad, 1e3 * moduli, rtol=1e-8)
    np.testing.assert_array_equal(found.lines, np.arange(7, 7 + ROWS))
    strain = read_recording(path, Columns("Time", "Shear Strain", quantity=STRAIN))
    np.testing.assert_allclose(strain.rotation_rad, 0.01, rtol=1e-15)
    form = found.recognised
    assert form is not None
    assert (form.header_line, form.units_line, form.block, form.rows) == (4, 6, None, ROWS)
    assert form.decimal_comma == (separator != ",")
    assert form.columns == {"time": ("Time", "s"), "modulus": ("Relaxation Modulus", "kPa")}
    assert form.title.startswith("Test: gel 3; Result: Step strain; Interval")
    assert not form.is_usual(RELAXATION)


@pytest.mark.parametrize("style", ["old", "new"])
def test_one_of_several_intervals_is_read(tmp_path: Path, style: str) -> None:
    path = anton_paar(tmp_path / "t.csv", 3, style)
    for block in (1, 2, 3):
        found = read_recording(path, replace(RELAXATION, block=block))
        times, moduli = numbers(block - 1)
        np.testing.assert_allclose(found.time_s, times, rtol=1e-8)
        np.testing.assert_allclose(found.rotation_rad, 1e3 * moduli, rtol=1e-8)
        assert found.recognised is not None
        assert (found.recognised.block, found.recognised.blocks) == (block, 3)


def test_several_intervals_are_listed(tmp_path: Path) -> None:
    path = anton_paar(tmp_path / "t.csv", 2)
    said = refusal(path, replace(RELAXATION, by_options=True))
    assert said == (
        ": found 2 blocks with the columns 'Time', 'Relaxation Modulus', allowed is one: say which "
        "by --block."
        "\n  1: line 4, Test: gel 3; Result: Step strain; Interval: 1; Point No., Time, Shear "
        "Strain, Relaxation Modulus, Torque, Status; 14 rows, 0,5 to 7 s"
        "\n  2: line 24, Interval: 2; Point No., Time, Shear Strain, Relaxation Modulus, Torque, "
        "Status; 14 rows, 14,5 to 21 s"
    )
    assert "by block under measurement." in refusal(path, RELAXATION)
    said = refusal(path, replace(RELAXATION, block=3))
    assert said.startswith(": found no block 3, allowed are 1 to 2:\n  1: line 4, Test: gel 3;")


@pytest.mark.parametrize("separator", ["\t", ","])
def test_a_step_of_trios(tmp_path: Path, separator: str) -> None:
    """The only step that has the columns is no guess; its number is that of the file."""
    path = trios(tmp_path / "t.txt", separator)
    times, moduli = numbers(2)
    found = read_recording(path, Columns("Step time", "Modulus", quantity=MODULUS))
    np.testing.assert_allclose(found.time_s, 60 * times, rtol=1e-8)
    np.testing.assert_allclose(found.rotation_rad, 1e6 * moduli, rtol=1e-8)
    assert found.recognised is not None
    assert (found.recognised.block, found.recognised.title) == (3, "Stress relaxation - 3")
    found = read_recording(path, Columns("Step time", "Compliance", quantity=COMPLIANCE))
    np.testing.assert_allclose(found.rotation_rad, 1e-6 / moduli, rtol=1e-8)
    flow = Columns("Time", "Stress", quantity=STRESS)
    assert "found 2 blocks with the columns 'Time', 'Stress'" in refusal(path, flow)
    found = read_recording(path, replace(flow, block=2))
    np.testing.assert_allclose(found.time_s, 60 * numbers(1)[0], rtol=1e-8)
    np.testing.assert_allclose(found.rotation_rad, 1e6 * numbers(1)[1], rtol=1e-4)


def test_a_column_that_no_block_has_is_named_with_those_of_the_nearest(tmp_path: Path) -> None:
    path = anton_paar(tmp_path / "t.csv")
    said = refusal(path, Columns("Time", "Creep Compliance", quantity=COMPLIANCE))
    assert said.startswith(
        ", line 4, column 'Creep Compliance': found no such column, allowed are Point No., Time,"
    )
    said = refusal(trios(tmp_path / "t.txt"), Columns("Time", "Shear stress", quantity=STRESS))
    assert said.startswith(", line 11, column 'Shear stress': found no such column, allowed are")


def test_names_that_are_repeated_are_refused_only_if_they_are_read(tmp_path: Path) -> None:
    path = anton_paar(tmp_path / "t.csv", encoding="utf-8")
    text = path.read_text()
    path.write_text(text.replace("Torque", "Shear Strain"))
    assert len(read_recording(path, RELAXATION).time_s) == ROWS
    path.write_text(text.replace("Torque", "Time"))
    assert refusal(path, RELAXATION).startswith(", line 4, column 'Time': found 2 columns of this")


def test_a_damaged_row_of_a_block_is_named(tmp_path: Path) -> None:
    """The last of a block, too, is no preamble of the next."""
    for number in (1, ROWS):
        path = anton_paar(tmp_path / "t.csv", 2, encoding="utf-8")
        lines = path.read_text().split("\n")
        lines[5 + number] = "\t".join([str(number), "x", "1", "1", "1", "Dy"])
        path.write_text("\n".join(lines))
        said = refusal(path, replace(RELAXATION, block=1))
        assert said.startswith(
            f", line {6 + number}, column 'Time': found 'x', allowed is a finite"
        )
        assert len(read_recording(path, replace(RELAXATION, block=2)).time_s) == ROWS


def test_tables_with_the_same_header_one_after_the_other_are_blocks(tmp_path: Path) -> None:
    rows = [f"{t},{g}" for t, g in numbers(0).T]
    (tmp_path / "t.csv").write_text("\n".join(2 * ["time_s,modulus_Pa", *rows]))
    columns = Columns("time_s", "modulus_Pa", quantity=MODULUS)
    said = refusal(tmp_path / "t.csv", columns)
    assert "found 2 blocks with the columns" in said
    found = read_recording(tmp_path / "t.csv", replace(columns, block=2))
    assert found.lines[0] == ROWS + 3


@pytest.mark.parametrize("row", ["s,Pa", "[s],[Pa]", "(s),(Pa)", "sec,Pa", "[s], [Pa]"])
def test_units_below_plain_names(tmp_path: Path, row: str) -> None:
    rows = [f"{t},{g}" for t, g in numbers(0).T]
    (tmp_path / "t.csv").write_text("\n".join(["t,G", row, *rows]))
    found = read_recording(tmp_path / "t.csv", Columns("t", "G", quantity=MODULUS))
    np.testing.assert_allclose(found.rotation_rad, numbers(0)[1], rtol=1e-15)
    said = refusal(tmp_path / "t.csv", Columns("t", "G", "ms", "Pa", quantity=MODULUS))
    assert "found the unit 'ms' where the row of units says 's', allowed is one unit" in said


def test_units_that_are_not_known_are_named(tmp_path: Path) -> None:
    rows = [f"{t},{g}" for t, g in numbers(0).T]
    (tmp_path / "t.csv").write_text("\n".join(["t,G", "[s],[V]", *rows]))
    said = refusal(tmp_path / "t.csv", Columns("t", "G", quantity=MODULUS))
    assert said.startswith(", column 'G': found no unit (but '[V]' below it), neither stated")
    found = read_recording(
        tmp_path / "t.csv", Columns("t", "G", None, "Pa", 0, 2.0, quantity=MODULUS)
    )
    np.testing.assert_allclose(found.rotation_rad, 2 * numbers(0)[1], rtol=1e-15)


@pytest.mark.parametrize(
    "cell", ["1/Pa", "Pa^-1", "Pa-1", "Pa**-1", "Pa\u207b\u00b9", "[1/Pa]", "(Pa^-1)", "[ 1/Pa ]"]
)
def test_a_reciprocal_unit_is_spelled_in_many_ways(cell: str) -> None:
    allowed = COMPLIANCE.units
    assert unit_of(Path("t"), "J", None, allowed, "reading_unit", below=cell) == "1/Pa"
    bare = cell.strip("[]() ")
    assert unit_of(Path("t"), f"J ({bare})", None, allowed, "reading_unit") == "1/Pa"


def test_a_lone_m_is_no_minute() -> None:
    with pytest.raises(BiogripError, match="found no unit"):
        unit_of(Path("t"), "t", None, TIME_UNITS, "time_unit", below="[m]")


def rounded(path: Path, *, sd: bool = False) -> tuple[Path, np.ndarray]:
    """A clock of whole seconds that is read several times a second."""
    rng = np.random.default_rng(1)
    times = np.repeat(np.arange(15), rng.integers(1, 5, 15))
    readings = rng.standard_normal(len(times))
    deviations = rng.uniform(1, 2, len(times))
    columns = [times, readings, *([deviations] if sd else [])]
    rows = [",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True)]
    path.write_text("\n".join(["time_s,modulus_Pa" + (",sd" if sd else ""), *rows]))
    return path, np.stack([times, readings, deviations])


@pytest.mark.parametrize("by_options", [True, False])
def test_repeated_times_are_refused_with_the_way_out(tmp_path: Path, by_options: bool) -> None:
    path, _ = rounded(tmp_path / "t.csv")
    columns = Columns("time_s", "modulus_Pa", quantity=MODULUS, by_options=by_options)
    way = "--average-repeated" if by_options else "average_repeated: true under measurement"
    said = refusal(path, columns)
    assert re.search(r"line \d+, column 'time_s': found \d+ repeated \(line \d+\)", said)
    assert said.endswith(f"The readings of equal times are averaged by {way}.")


@pytest.mark.parametrize("sd", [True, False])
def test_readings_of_equal_times_are_averaged(tmp_path: Path, sd: bool) -> None:
    path, (times, readings, deviations) = rounded(tmp_path / "t.csv", sd=sd)
    columns = Columns("time_s", "modulus_Pa", quantity=MODULUS, average_repeated=True)
    found = read_recording(path, replace(columns, sd="sd") if sd else columns)
    np.testing.assert_array_equal(found.time_s, np.arange(15))
    groups = [times == time for time in range(15)]
    means = [np.mean(readings[group]) for group in groups]
    np.testing.assert_allclose(found.rotation_rad, means, rtol=1e-12)
    np.testing.assert_array_equal(found.lines, [2 + np.argmax(group) for group in groups])
    assert found.recognised is not None
    assert found.recognised.averaged == sum(g.sum() for g in groups if g.sum() > 1) > 0
    if sd:
        assert found.sd_rad is not None
        of_means = [np.sqrt(np.sum(deviations[g] ** 2)) / g.sum() for g in groups]
        np.testing.assert_allclose(found.sd_rad, of_means, rtol=1e-12)


def test_only_equal_times_are_averaged() -> None:
    values = np.array([[0.0, 1.0], [1.0, 3.0], [1.0, 1e308], [1.0, 1e308], [0.0, 7.0]])
    means, lines, count = average_repeated(values, np.arange(5))
    np.testing.assert_array_equal(means[:, 0], [0, 1, 0])
    np.testing.assert_array_equal(means[[0, 2], 1], [1, 7])
    assert np.isclose(means[1, 1], 1e308 * (2 / 3))
    assert (lines.tolist(), count) == ([0, 1, 4], 3)


def test_what_was_recognised_is_a_small_table(tmp_path: Path) -> None:
    rows = [f"{t}\t{g}" for t, g in numbers(0).T]
    (tmp_path / "t.tsv").write_text("\n".join(["Time\tRelaxation Modulus", *rows, "8\t"]))
    columns = Columns("Time", "Relaxation Modulus", "s", "Pa", quantity=MODULUS)
    form = read_recording(tmp_path / "t.tsv", columns).recognised
    assert form is not None
    assert form.in_words(Path("t.tsv")).split("\n") == [
        "t.tsv is read as",
        "  text     UTF-8, cells between tabs, decimal point",
        "  header   line 1",
        "  time     Time, in s",
        "  modulus  Relaxation Modulus, in Pa",
        "  rows     15, 1 gap, from 0.5 to 7 s",
    ]
    form = read_recording(tmp_path / "t.tsv", replace(columns, from_s=2.0)).recognised
    assert form is not None
    outside = np.sum(numbers(0)[0] < 2.0)
    assert outside > 0
    rows_in_words = f"15, 1 gap, {outside} not among the times to use, from 2 to 7 s"
    assert form.in_words(Path("t.tsv")).endswith(rows_in_words)


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Content with a piece replaced, left out or repeated, and perhaps without its end."""
    start = int(rng.integers(len(content)))
    piece = content[start : start + int(rng.integers(1, 60))]
    others = [rng.bytes(1), b"", 2 * piece, b"\n", b"[step]\n", b'"', b"9", b"Time\t"]
    made = content[:start] + others[rng.integers(len(others))] + content[start + len(piece) :]
    return made if rng.integers(2) else made[: int(rng.integers(len(made)))]


@pytest.mark.parametrize("kind", ["old", "new", "trios"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_damaged_export_is_refused_or_leaves_a_trace(
    tmp_path: Path, kind: str, encoding: str
) -> None:
    path = tmp_path / "t.csv"
    written = trios(path) if kind == "trios" else anton_paar(path, 2, kind, "utf-8")
    content = written.read_text("utf-8").encode(encoding)
    rng = np.random.default_rng(5)
    columns = Columns("Step time", "Modulus", quantity=MODULUS) if kind == "trios" else RELAXATION
    read = 0
    for number in range(150):
        path.write_bytes(damaged(content, rng))
        block = [3 if kind == "trios" else 1, None, 2][number % 3]
        try:
            found = read_recording(
                path, replace(columns, block=block, average_repeated=number > 49)
            )
        except BiogripError:
            continue
        read += 1
        assert np.all(np.diff(found.time_s) > 0)
        assert np.all(np.isfinite(found.rotation_rad))
        assert found.recognised is not None
        assert found.recognised.in_words(path)
    assert 10 < read < 140
