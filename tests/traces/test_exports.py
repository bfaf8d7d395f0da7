"""What instruments write: headers of several rows, blocks that are one test, several conditions.

Files are written here, as public sources show them; numbers are lines or closed forms.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.command.options import Setting
from biogrip.command.settings import Asked, is_table
from biogrip.errors import BiogripError
from biogrip.traces.conditions import alike, how_they_differ, tells_apart
from biogrip.traces.reader import read_recording
from tests.helpers.columns import columns_of

ROWS = [f"{i / 2},{10 + i},{i % 3}" for i in range(12)]


def read(path: Path, text: str | list[str], **keys: Any) -> Any:
    path.write_text(text if isinstance(text, str) else "\n".join(text), encoding="utf-8")
    quantity = keys.pop("quantity", "strain")
    return read_recording(path, columns_of(**{"quantity": quantity, **keys}))


def said(path: Path, text: list[str], **keys: Any) -> str:
    with pytest.raises(BiogripError) as error:
        read(path, text, **keys)
    return str(error.value)


HEADERS = {
    "units": ["t,x,n", "ms,%,-"],
    "units in brackets": ["t,x,n", "[ms],(%),[]"],
    "names that are said again, and units": ["t,x,n", "Time,X,Count", "Time,X,Count", "(ms),(%),"],
    "units and how it was read": ["t,x,n", "ms,%,", "(set),(meas),(meas)"],
    "comments before the units": ["t,x,n", "from sensor A,from sensor B,", "ms,%,1"],
    "an empty row": ["t,x,n", ",,", "ms,%,1", ",,"],
    "units above the names": ["ms,%,1", "t,x,n"],
    "five rows": ["t,x,n", "a,b,c", "d,e,f", "ms,%,", "g,h,i", "j,k,l"],
    "a comment of units": ["# t,x,n", "# ms,%,-"],
}


@pytest.mark.parametrize("name", HEADERS)
def test_a_header_may_have_several_rows(tmp_path: Path, name: str) -> None:
    found = read(tmp_path / "t.csv", [*HEADERS[name], *ROWS], time="t", reading="x")
    np.testing.assert_allclose(found.time_s, np.arange(12) / 2e3)
    np.testing.assert_allclose(found.readings, 0.1 + np.arange(12) / 100)
    units_line = 1 + next(i for i, row in enumerate(HEADERS[name]) if "ms" in row)
    assert found.form["units_line"] == units_line
    assert found.gaps == 0


def test_minutes_and_seconds_are_times_and_units_may_be_a_comment(tmp_path: Path) -> None:
    rows = [f"{s // 60:02}:{s % 60:02}.5,{s}" for s in range(50, 70)]
    found = read(tmp_path / "t.csv", ["t,x_%", *rows], time="t", reading="x_%")
    np.testing.assert_allclose(found.time_s, np.arange(50, 70) + 0.5)
    # 01:05 may be hours and minutes, and 1:75.5 is none.
    for cell in ("01:05", "1:75.5", "1:05:75"):
        message = said(tmp_path / "t.csv", ["t,x_%", *rows, f"{cell},1"], time="t", reading="x_%")
        assert f"line 22, column 't': found '{cell}'" in message
    for units in (["% ms, %, -", "t,x,n"], ["t,x,n", "% ms, %, -"]):
        found = read(tmp_path / "t.csv", [*units, *ROWS], time="t", reading="x")
        np.testing.assert_allclose(found.time_s, np.arange(12) / 2e3)


def test_what_is_no_header_is_a_damaged_row(tmp_path: Path) -> None:
    for row, message in (
        ("0.5,T,1", "line 3, column 'x': found 'T', allowed is a finite number"),
        ("#REF!,#REF!,1", "line 3, column 't': found '#REF!'"),
    ):
        text = ["t,x,n", "s,%,", row, *ROWS]
        assert message in said(tmp_path / "t.csv", text, time="t", reading="x")
    six = ["t,x,n", "s,%,", *5 * ["a,b,c"], *ROWS]
    assert "line 7, column 't': found 'a'" in said(tmp_path / "t.csv", six, time="t", reading="x")
    for text in (["t,x,n"], ["preamble", "t,x,n", "s,%,", "(set),(meas),"]):
        line = text.index("t,x,n") + 1
        message = f"line {line}: found names of columns without rows of numbers"
        assert message in said(tmp_path / "t.csv", text, time="t", reading="x")


@pytest.mark.parametrize("begins", ["goes on", "anew", "at zero"])
def test_blocks_that_are_one_test_are_joined(tmp_path: Path, begins: str) -> None:
    """The second has its columns in another order, and in other units."""
    first = [f"{s:g},{10 + s:g},5" for s in range(1, 7)]
    later = {"goes on": 6, "anew": 0, "at zero": -1}[begins]
    second = [f"0;{(later + s) / 60:.17g};{100 + s:g}" for s in range(1, 9)]
    text = ["Interval:,1", "t,x,load", "s,%,Pa", *first]
    text += ["Interval:,3", "load,t,x", "Pa,min,‰", *(row.replace(";", ",") for row in second)]
    keys = {"time": "t", "reading": "x", "load": "load"}
    found = read(tmp_path / "t.csv", text, **keys, block=(1, 2))
    np.testing.assert_allclose(found.time_s, np.arange(1, 15))
    expected = np.append((10 + np.arange(1, 7)) / 100, (100 + np.arange(1, 9)) / 1000)
    np.testing.assert_allclose(found.readings, expected)
    np.testing.assert_array_equal(found.load[:, 1], np.repeat([5.0, 0.0], (6, 8)))
    assert found.lines.tolist() == [*range(4, 10), *range(13, 21)]
    assert found.form["block"] == (1, 2)
    again = [it for it in found.remarks() if "Times of block 2 begin anew" in it]
    assert len(again) == (begins != "goes on")
    message = said(tmp_path / "t.csv", text, **keys)
    assert "allowed is one, as by --block 1, or several that are one test, as by --block 1,2." in (
        message
    )


PREAMBLE = ["Data Series Information", "Name: cell gel 7 creep", "Operator: A B", ""]


def test_tabs_part_cells_that_have_blanks_or_nothing(tmp_path: Path) -> None:
    """RheoPlus: words of a preamble have blanks, the first unit is empty, and so are some cells."""
    rows = [f"{i}\t{'' if i % 3 else 25}\t{i / 60:.9f}\t{10 + i}\t" for i in range(1, 9)]
    header = ["Meas. Pts.\tT\tElapsed time\tShear Strain\tGap", "\t[°C]\t[min]\t[%]\t[mm]"]
    keys = {"time": "Elapsed time", "reading": "Shear Strain"}
    found = read(tmp_path / "t.txt", [*PREAMBLE, *header, *rows], **keys)
    # Times are written with nine decimals.
    np.testing.assert_allclose(found.time_s, np.arange(1, 9), atol=1e-7)
    np.testing.assert_allclose(found.readings, (10 + np.arange(1, 9)) / 100)
    assert (found.form["separator"], found.form["units_line"], found.gaps) == ("tabs", 6, 0)
    # Names between blanks in a comment, and rows between tabs.
    commented = ["# n T t_min x_% gap", *rows]
    found = read(tmp_path / "t.txt", commented, time="t_min", reading="x_%")
    np.testing.assert_allclose(found.readings, (10 + np.arange(1, 9)) / 100)
    # Names between tabs, and rows between blanks.
    found = read(tmp_path / "t.txt", ["t_s\tx_%", *(f"{i}   {i}" for i in range(9))], **TX)
    np.testing.assert_allclose(found.readings, np.arange(9) / 100)


TX = {"time": "t_s", "reading": "x_%"}


def test_a_preamble_of_a_step_is_no_table(tmp_path: Path) -> None:
    """TRIOS: its pairs of words are above ``[step]``, which stands in brackets like units."""
    step = ["[step]", "Creep", "Time\tStrain", "s\t%", *(f"{i}\t{10 + i}" for i in range(8))]
    later = [line.replace("\t1", "\t2") for line in step]
    text = ["Filename\tgel 7", "Sample name\tgel A", "", *step, "", *later]
    keys = {"time": "Time", "reading": "Strain"}
    found = read(tmp_path / "t.txt", text, **keys, block=2)
    np.testing.assert_allclose(found.readings, (20 + np.arange(8)) / 100)
    assert found.form["blocks"] == 2
    given = {("measurement", "time"): "Time", ("measurement", "strain"): "Strain"}
    settings = tuple(Setting("", key, name) for key, name in given.items())
    assert not is_table(Asked(tmp_path / "t.txt", settings=settings))
    # A sheet, whose row names these columns, is one.
    (tmp_path / "sheet.csv").write_text("filename,time,strain\na.csv,Time,Strain\n")
    assert is_table(Asked(tmp_path / "sheet.csv"))


def test_a_block_that_is_not_wanted_is_left_out(tmp_path: Path) -> None:
    blocks = [["t_s,strain", *(f"{i},{b}" for i in range(5 * b, 5 * b + 5))] for b in range(3)]
    text = [line for block in blocks for line in block]
    found = read(tmp_path / "t.csv", text, time="t_s", reading="strain", block=(1, 3))
    assert found.time_s.tolist() == [0, 1, 2, 3, 4, 10, 11, 12, 13, 14]
    assert found.readings.tolist() == 5 * [0] + 5 * [2]
    message = said(tmp_path / "t.csv", text, time="t_s", reading="strain", block=(1, 4))
    assert "found no block 4, allowed are 1 to 3" in message


def conditions() -> dict[str, list[str]]:
    """Tables of two samples that relax, of 300 and 500: one below the other, and in turn."""
    rng, times = np.random.default_rng(1), np.arange(0.5, 20, 0.5)
    parts = {
        name: size * (1 + np.exp(-times / 3)) * rng.normal(1, 0.01, len(times))
        for name, size in (("A", 300), ("B", 500))
    }
    rows = [
        f"{t},{c},{y:.6g},{i}"
        for c, g in parts.items()
        for i, (t, y) in enumerate(zip(times, g, strict=True))
    ]
    header = "t_s,cell,G_Pa,n"
    in_turn = sorted(rows, key=lambda row: float(row.split(",")[0]))
    measured = [
        row.replace(",A,", f",{rng.normal(25, 0.03):.2f},").replace(
            ",B,", f",{rng.normal(37, 0.03):.2f},"
        )
        for row in rows
    ]
    return {
        "below": [header, *rows],
        "in turn": [header, *in_turn],
        "measured": [header.replace("cell", "T (C)"), *measured],
    }


@pytest.mark.parametrize("name", conditions())
def test_rows_of_several_conditions_are_told_apart(tmp_path: Path, name: str) -> None:
    text, keys = conditions()[name], {"time": "t_s", "reading": "G_Pa", "quantity": "modulus"}
    column, value = ("T (C)", 25.0) if name == "measured" else ("cell", "A")
    option = "--rows 'T (C)=25'." if name == "measured" else "--rows cell=A."
    for averaged in (False, True):
        assert option in said(tmp_path / "t.csv", text, **keys, average_repeated=averaged)
    found = read(tmp_path / "t.csv", text, **keys, rows={column: value})
    assert len(found.time_s) == 39
    assert found.readings.max() < 600


def test_repeats_are_told_from_conditions_at_the_level() -> None:
    """Of 2000 tables of repeats a thousandth is taken for conditions, of conditions nearly all."""
    rng, places = np.random.default_rng(2), np.tile(np.arange(15.0), 3)
    clean = np.exp(0.1 * places)
    noisy = [clean * rng.normal(1, 0.02, 45) for _ in range(2000)]
    # A binomial of 2 exceeds 12 once in a million times.
    for sweeps in (False, True):
        told = (how_they_differ(places, values[:, None], sweeps=sweeps) for values in noisy)
        assert sum(map(bool, told)) <= 12
    # These scatter by ten times the noise.
    apart = np.repeat([1.0, 1.25, 1.5], 15)
    conditions = ((values * apart)[:, None] for values in noisy[:200])
    assert sum(not how_they_differ(places, of, sweeps=False) for of in conditions) <= 4


def swept(rng: np.random.Generator, *sizes: float) -> tuple[Array, Array]:
    """Return frequencies and both moduli of a Zener solid, with 2 % noise, thirteen a sweep."""
    hertz = np.tile(np.geomspace(0.1, 31.6, 13), len(sizes))
    maxwell = 300 / (1 - 1j / (hertz / 1.6))
    moduli = np.array([100 + maxwell.real, maxwell.imag]) * np.repeat(sizes, 13)
    return hertz, (moduli * rng.normal(1, 0.02, moduli.shape)).T


def test_sweeps_that_differ_are_no_repeats_though_they_are_coarse(tmp_path: Path) -> None:
    """Of two strains, which are measured, and up and down, of which no column tells."""
    rng = np.random.default_rng(3)
    keys = {"frequency": "f (Hz)", "reading": "G' (Pa)", "quantity": "storage", "loss": "G'' (Pa)"}
    hertz, moduli = swept(rng, 1, 0.8)
    strain = np.repeat([1, 5], 13) * rng.normal(1, 0.015, 26)
    rows = [
        f"{f:.4g},{e:.4g},{g:.4g},{h:.4g}"
        for f, e, (g, h) in zip(hertz, strain, moduli, strict=True)
    ]
    text = ["f (Hz),Strain (%),G' (Pa),G'' (Pa)", *rows]
    for averaged in (False, True):
        message = said(tmp_path / "t.csv", text, **keys, average_repeated=averaged)
        assert "--rows 'Strain (%)=" in message
    wanted = float(message.rpartition("=")[2].rstrip("'."))
    found = read(tmp_path / "t.csv", text, **keys, rows={"Strain (%)": wanted})
    assert found.lines.tolist() == [*range(14, 1, -1), *range(2, 15)]
    # Without the column.
    text = [",".join(np.delete(row.split(","), 1)) for row in text]
    message = said(tmp_path / "t.csv", text, **keys)
    # Of ln 0.8, with noise of 2 % * sqrt(2/26) of the mean: five of its deviations are 3 %.
    shift = float(message.partition("moduli that differ by ")[2].partition(" %")[0])
    assert abs(shift - 22.3) < 3
    remarks = read(tmp_path / "t.csv", text, **keys, average_repeated=True).remarks()
    assert any("Rows that were averaged differ by" in text for text in remarks)
    # Repeats have one place: of 200 a fifth of one is blamed, a Poisson that exceeds 4 once in 1e5.
    repeats = (swept(rng, 1, 1) for _ in range(200))
    blamed = (how_they_differ(np.log(f), of, sweeps=True) for f, of in repeats)
    assert sum(map(bool, blamed)) <= 4


def test_measured_numbers_of_one_condition_are_alike() -> None:
    scattered = ["0.98", "1.01", "1.03", "4.9", "5.05", "5.1"]
    assert alike(scattered, 1.0) == {*scattered[:3]}
    assert alike(scattered, 5.02) == {*scattered[3:]}
    assert alike(scattered, 3.0) == {*()}
    # These come again, and are set: none is measured.
    again = 4 * ["1.05", "1.1", "1.15", "9.5", "9.6", "9.7"]
    assert alike(again, 1.1) == {"1.1"}


def test_two_columns_may_tell_apart_and_an_index_does_not() -> None:
    places = np.tile(np.arange(5.0), 4)
    columns = {
        "No": [str(i) for i in range(20)],
        "T": 10 * ["20"] + 10 * ["30"],
        "strain": (5 * ["0.1"] + 5 * ["1"]) * 2,
    }
    assert tells_apart(places, columns) == {"T": ["20", "30"], "strain": ["0.1", "1"]}
    assert tells_apart(places, {"No": columns["No"]}) == {}
