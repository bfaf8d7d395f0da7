"""Files of traces: kept ones, with what is read of them or said of them, and any other ones."""

import csv
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from biogrip.errors import BiogripError
from biogrip.physics.instruments import (
    COMPLIANCE,
    DISPLACEMENT,
    FORCE,
    MODULUS,
    ROTATION,
    STRAIN,
    TORQUE,
)
from biogrip.traces.columns import TIME_UNITS, unit_of
from biogrip.traces.measurement_block import MeasurementBlock
from biogrip.traces.reader import read_recording
from tests.helpers.columns import columns_of

FILES = Path(__file__).with_name("files")
KEPT: list[dict[str, Any]] = yaml.safe_load((FILES / "files.yaml").read_text(encoding="utf-8"))
PLAIN = columns_of()
PLAIN_FORM = {"encoding": "UTF-8", "separator": "commas", "decimal": "point", "header_line": 1}
PLAIN_FORM |= {"rows": 12, "gaps": 0, "first_s": 0.0, "last_s": 11.0}
ROWS = tuple(f"{i},{i}e-6" for i in range(12))


def first_last_sum(values: Any) -> list[float]:
    return [values[0], values[-1], values.sum()]


def refusal(path: Path, columns: MeasurementBlock = PLAIN) -> str:
    with pytest.raises(BiogripError) as error:
        read_recording(path, columns)
    return str(error.value)


@pytest.mark.parametrize("kept", KEPT, ids=lambda kept: kept.get("message"))
def test_a_kept_file_is_read_or_refused_as_its_table_says(
    kept: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The numbers are those of a reader by the csv module, from before pandas read the files."""
    monkeypatch.chdir(FILES)
    path, columns = Path(kept.get("file", "plain.csv")), columns_of(**kept.get("columns", {}))
    if "lines" in kept or "text" in kept:
        lines = path.read_bytes().decode("latin-1").splitlines()
        for number, line in kept.get("lines", {}).items():
            lines[number - 1 : number] = [line]
        monkeypatch.chdir(tmp_path)
        path.write_bytes(kept.get("text", "\n".join(lines)).encode("latin-1"))
    if "message" in kept:
        assert refusal(path, columns).startswith(f"{path}{kept['message']}")
        return
    found = read_recording(path, columns)
    names_and_units = (
        {"column": name, "unit": unit}
        for name, unit in zip(columns.named.values(), kept["units"], strict=True)
    )
    form: dict[str, Any] = PLAIN_FORM | kept.get("form", {})
    form["columns"] = dict(zip(columns.named, names_and_units, strict=True))
    ended = path.read_bytes().rstrip(b"\0").endswith((b"\n", b"\r"))
    form.setdefault("lacks", None if ended else "no line end")
    assert found.form == {key: it for key, it in form.items() if it is not None}
    assert found.gaps == form["gaps"]
    assert found.time_s[[0, -1]].tolist() == [form["first_s"], form["last_s"]]
    assert first_last_sum(found.readings) == pytest.approx(kept["reading"], rel=1e-14)
    if "sd" in kept:
        assert found.sd is not None
        assert first_last_sum(found.sd) == pytest.approx(kept["sd"], rel=1e-14)


GAPS = ("", "NaN", "NA", "N/A", "-", '""', '" nan "', "n/a", "#N/A", "#NV", " ", "nan, ")
NO_NUMBERS = ("abc", "1_0", "1.2.3", "0x1", "--", "1 2", "inf", "-1e999", "\0", '"3,5"', "#BEZUG!")


def test_a_row_with_a_gap_is_left_out_and_counted(tmp_path: Path) -> None:
    gaps = [row for gap in GAPS for row in (f"2.5,{gap}", f"{gap},1")]
    text = "\n".join(["time_s,rotation_rad", *ROWS[:3], *gaps, "# note", "", "  ", *ROWS[3:]])
    text += "\n\nEnd of data\n"
    (tmp_path / "t.csv").write_text(text.replace("nan, ,1", "nan,1"))
    found = read_recording(tmp_path / "t.csv", PLAIN)
    assert found.gaps == len(gaps)
    np.testing.assert_array_equal(found.time_s, np.arange(12))
    assert found.lines.tolist() == [2, 3, 4, *range(len(gaps) + 8, len(gaps) + 17)]


@pytest.mark.parametrize("cell", NO_NUMBERS)
def test_a_cell_that_is_neither_a_number_nor_a_gap_is_refused(tmp_path: Path, cell: str) -> None:
    path, shown = tmp_path / "t.csv", cell.strip('"')
    for name, row in (("time_s", f"{cell},1"), ("rotation_rad", f"4, {cell}")):
        path.write_text("\n".join(["time_s,rotation_rad", *ROWS[:4], row, *ROWS[5:]]))
        place = f"{path}, line 6, column '{name}'"
        assert refusal(path).startswith(f"{place}: found '{shown}', allowed is a finite number, or")


ENCODINGS = dict.fromkeys(("utf-8", "utf-8-sig"), "UTF-8")
ENCODINGS |= dict.fromkeys(("utf-16", "utf-16-be"), "UTF-16") | {"cp1252": "Windows-1252"}


SIGNS = [(",", "."), (";", "."), ("\t", "."), (";", ","), ("\t", ",")]
LINE_ENDS = ["\n", "\r\n", "\r"]
MORE = ["", "  ", "# 1,2", "#REF!", " #x", "##;1"]


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_what_pandas_writes_is_read_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """With gaps, other columns, comments and empty lines between the rows."""
    values = data.draw(st.lists(st.floats(-1e300, 1e300), min_size=10, max_size=20))
    separator, decimal = data.draw(st.sampled_from(SIGNS))
    line_end, encoding = data.draw(st.tuples(*map(st.sampled_from, (LINE_ENDS, [*ENCODINGS]))))
    quoting = data.draw(st.sampled_from([csv.QUOTE_ALL, csv.QUOTE_MINIMAL, csv.QUOTE_NONNUMERIC]))
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    times = np.cumsum(rng.uniform(1e-3, 10, len(values)))
    frame = pd.DataFrame({"angle, left (µrad)": values, "time_s": times})
    holes = rng.choice(len(values) + 1, 2)
    frame = pd.concat([frame[: holes[0]], frame[:0].reindex([0]), frame[holes[0] :]])
    frame.insert(1, "note, é; 2", 'any, "thing";')
    path = tmp_path_factory.mktemp("t") / "t.csv"
    form = {"sep": separator, "decimal": decimal, "quoting": quoting}
    lines = frame.to_csv(index=False, na_rep="NA", lineterminator="\n", **form).splitlines()
    for line in data.draw(st.lists(st.sampled_from(MORE), max_size=3)):
        lines.insert(int(rng.integers(len(lines) + 1)), line)
    mark = BOM_UTF16_BE if encoding == "utf-16-be" else b""
    path.write_bytes(mark + "".join(line + line_end for line in lines).encode(encoding))
    found = read_recording(path, columns_of(reading="angle, left (urad)"))
    assert found.form["encoding"] == ENCODINGS[encoding]
    np.testing.assert_array_equal(found.time_s, times)
    np.testing.assert_array_equal(found.readings, np.array(values) * 1e-6)
    assert found.gaps == 1
    for line, time in zip(found.lines, times, strict=True):
        assert repr(float(time)).replace(".", decimal) in lines[line - 1]


TIMES: Any = {"s": 1.0, "Sec": 1.0, "S": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
ANGLES: Any = {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "\u00b5rad": 1e-6, "\u03bcrad": 1e-6}
STRAINS: Any = {"%": 0.01, "pct": 0.01, "mstrain": 1e-3, "ppm": 1e-6, "microstrain": 1e-6}
PER_PA = ("Pa^-1", "Pa**-1", "Pa-1", "Pa\u207b\u00b9")
UNITS = [
    (TIME_UNITS, TIMES | {"days": 86400.0}),
    (ROTATION.units, ANGLES | dict.fromkeys(("deg", "°"), 0.017453292519943295)),
    (MODULUS.units, {"Pa": 1.0, "N/m²": 1.0, "N/m^2": 1.0, "kN/m2": 1e3, "N/mm²": 1e6}),
    (COMPLIANCE.units, {"1/kPa": 1e-3, **dict.fromkeys(PER_PA, 1.0)}),
    (STRAIN.units, STRAINS | {"\u00b5\u03b5": 1e-6, "mm/mm": 1.0, "mm/m": 1e-3}),
    (DISPLACEMENT.units, {"\u00b5m": 1e-6, "um": 1e-6}),
    (FORCE.units, {"kgf": 9.80665, "kN": 1e3, "MN": 1e6}),
    (TORQUE.units, {"mN m": 1e-3, "mN\u00b7m": 1e-3, "uNm": 1e-6}),
]


def unit(column: str, given: str | None, allowed: Any, below: str = "") -> str:
    return unit_of(Path("t.csv"), column, given, allowed, "HOW", below)


@pytest.mark.parametrize(
    ("written", "size", "allowed"),
    [(written, size, allowed) for allowed, sizes in UNITS for written, size in sizes.items()],
)
def test_a_unit_is_read_off_a_name_or_a_row_of_units_or_stated(
    written: str, size: float, allowed: Any
) -> None:
    names = [f"x ({written})", f"x [{written}]", f"x( {written} )", f"2 [{written}]"]
    names += [f"x{{{written}}}", f"x <{written}>"]
    if " " not in written:
        names += [f"x {written}", f"x, {written}", f"x in {written}"]
    if written.isalpha():
        names += [f"x_{written}", f"x_2_{written}", f"x/{written}", f"x / {written}"]
    if written.startswith("1/"):
        names += [f"x_per_{written[2:]}"]
    found = {unit(name, None, allowed) for name in names}
    found |= {unit("x", None, allowed, cell) for cell in (written, f"[{written}]", f"({written})")}
    if "^" not in written and "-1" not in written and "\u207b" not in written:
        found |= {unit(name, written, allowed) for name in ("x", "phi_left", *names)}
    assert [allowed[each] for each in found] == [size]


def test_a_unit_is_never_guessed() -> None:
    for column, stated, below, message in (
        ("x_y", None, "", "found no unit; allowed are rad, mrad, urad, deg, by HOW or at"),
        ("x_uN", None, "", "found the unit 'uN' at the end of the name; allowed"),
        ("phi (mrad) left", None, "", "found no unit"),
        ("phi (rad/s)", None, "", "found the unit 'rad/s' at the end of the name; allowed"),
        ("phi / mm", None, "", "found the unit 'mm' at the end of the name; allowed are rad, mrad"),
        ("phi_Mrad", None, "", "found no unit"),
        ("phi", None, "m", "found no unit (but 'm' below it)"),
        ("phi", "V", "", "found the unit 'V', allowed are rad, mrad, urad, deg."),
        ("phi_mrad", "urad", "", "found the unit 'urad' where the name says 'mrad', allowed is"),
        ("phi", "rad", "deg", "found the unit 'rad' where the row of units says 'deg'"),
        ("phi_mrad", None, "rad", "found the unit 'mrad' where the row of units says 'rad'"),
    ):
        with pytest.raises(BiogripError) as error:
            unit(column, stated, ROTATION.units, below)
        assert str(error.value).startswith(f"t.csv, column '{column}': {message}")


@pytest.mark.parametrize(
    "name", ["strain", "Step", "Shear Strain", "strain_2", "γ", "strain (-)", "Lp/Rp", "dL / L0"]
)
def test_a_strain_without_a_unit_is_a_pure_number(name: str) -> None:
    assert unit(name, None, STRAIN.units) == "1"


STRANGE = ("Strain (a.u.)", "Strain [10^-6]", "1000*strain", "Strain x1000", "Strain/V", "2")
UNKNOWN = [("ns", TIME_UNITS), ("MS", TIME_UNITS), ("pm", DISPLACEMENT.units)]


def test_an_unknown_unit_is_refused_without_one_of_another_size() -> None:
    for name, stated, allowed in (
        *((name, None, STRAIN.units) for name in STRANGE),
        *(("x", *each) for each in [*UNKNOWN, ("lbf", FORCE.units)]),
    ):
        with pytest.raises(BiogripError) as error:
            unit(name, stated, allowed)
        assert f"allowed are {', '.join(allowed)}" in str(error.value)
        assert "Did you mean" not in str(error.value)
        if stated is None:
            assert unit(name, "1", allowed) == "1"


@pytest.mark.parametrize("sd", ["sd", None])
def test_readings_of_equal_times_are_averaged(tmp_path: Path, sd: str | None) -> None:
    rng = np.random.default_rng(1)
    frame = pd.DataFrame({"time_s": np.repeat(np.arange(15), rng.integers(1, 5, 15))})
    frame["rotation_rad"], frame["sd"] = rng.uniform(1, 2, (2, len(frame)))
    frame.to_csv(tmp_path / "t.csv", index=False)
    found = read_recording(tmp_path / "t.csv", columns_of(sd=sd, average_repeated=True))
    groups = frame.groupby("time_s")
    counts = groups.size()
    np.testing.assert_array_equal(found.time_s, np.arange(15))
    np.testing.assert_allclose(found.readings, groups["rotation_rad"].mean(), rtol=1e-13)
    np.testing.assert_array_equal(found.lines, frame.drop_duplicates("time_s").index + 2)
    assert found.form["averaged"] == counts[counts > 1].sum() > 0
    if sd:
        of_means = groups["sd"].apply(lambda own: np.sqrt((own**2).sum())) / counts
        assert found.sd is not None
        np.testing.assert_allclose(found.sd, of_means, rtol=1e-13)


@pytest.mark.parametrize("newline", LINE_ENDS)
def test_a_byte_that_is_no_text_is_placed_however_late_it_is(tmp_path: Path, newline: str) -> None:
    """The byte 0x81 is no character of Windows-1252; UTF-16 has no half of a pair."""
    path = tmp_path / "t.csv"
    text = newline.join(["time_s,rotation_rad", *(f"{i},{i}" for i in range(5000)), "1,"])
    for content, byte in (
        (text.encode() + b"\x81", "0x81"),
        (BOM_UTF16_LE + text.encode("utf-16-le") + b"\0\xd8a", "0x00"),
        (BOM_UTF16_BE + text.encode("utf-16-be") + b"\xd8\0a", "0xd8"),
    ):
        path.write_bytes(content)
        assert f", line 5002: found the byte {byte}, allowed is text in UTF-8" in refusal(path)


@pytest.mark.parametrize("of", ["a name", "a cell", "names"])
def test_endless_text_is_refused_in_few_words(tmp_path: Path, of: str) -> None:
    path, names = tmp_path / "t.csv", ",".join(map(str, range(5000)))
    endless = {"a name": (0, f"time_s,rotation,{200_000 * 'x'}"), "names": (0, names)}
    line, text = endless.get(of, (5, f"4,{200_000 * '1'}"))
    rows = ["time_s,rotation_rad", *ROWS]
    path.write_text("\n".join([*rows[:line], text, *rows[line + 1 :]]))
    said = refusal(path)
    assert said.startswith(f"{path}, line {line + 1}")
    assert len(said) < 1000


# Marks that may be between thousands, of which it is said how they are read.
UNCLEAR = [(";", "5,845"), (";", "5.845"), ("\t", "5,845")]
# Separator, time and reading of row i, and the numbers that they are; None is refused.
MARKED = [
    (";", "{i},5", "{i}.857.123,25", None),
    (";", "{i},5", "{i}.857", None),
    ("\t", "{i}.0", "{i},857", None),
    (",", "{i}.0", '"{i},857"', None),
    (";", "{i}", "{i}.857.123", None),
    (";", "{i}", "{i}'857.5", None),
    (";", "{i}", "{i}\u00a0857,5", None),
    (";", "0,{i}5", "{i},857", lambda i: (float(f"0.{i}5"), i + 0.857)),
    (";", "{i}.500", "{i},857", None),
    (";", "{i}.5", "{i},85", None),
    *((separator, "{i}", mark, lambda i: (i, 5.845)) for separator, mark in UNCLEAR),
    (",", "00:01:{i}.5", "{i}", lambda i: (60.5 + i, i)),
    (";", "2026-11-25T23:59:{i}", "{i}", lambda i: (i - 11, i)),
    (",", "2026-11-25 23:59:{i}Z", "{i}", lambda i: (i - 11, i)),
    ("\t", "2026-11-25T23:59:{i}.5+01:30", "{i}", lambda i: (i - 11, i)),
    (";", "25.11.2026 23:59:{i}", "{i},5", lambda i: (i - 11, i + 0.5)),
]


@pytest.mark.parametrize(("separator", "time", "reading", "right"), MARKED)
def test_a_table_has_one_decimal_mark(
    tmp_path: Path, separator: str, time: str, reading: str, right: Any
) -> None:
    path, rows = tmp_path / "t.csv", range(11, 31)
    lines = [separator.join((time, reading)).format(i=i) for i in rows]
    path.write_text("\n".join([f"t_s{separator}G_Pa", *lines]), encoding="utf-8")
    columns = columns_of("t_s", "G_Pa", "modulus")
    if right is None:
        said = refusal(path, columns)
        assert (
            "line 2, column 'G_Pa': found '{}', allow".format(reading.format(i=11).strip('"'))
            in said
        )
        assert f"a decimal {'comma' if ',5' in time else 'point'}" in said or time == "{i}"
        return
    recorded = read_recording(path, columns)
    np.testing.assert_allclose(recorded.time_s, [right(i)[0] for i in rows])
    np.testing.assert_allclose(recorded.readings, [right(i)[1] for i in rows])
    said = f"of {reading} is read as a decimal mark; where it is between"
    unclear = ["decimal mark" in remark for remark in recorded.remarks()]
    assert any(unclear) == ((separator, reading) in UNCLEAR)
    assert not any(unclear) or said in recorded.remarks()[0]


def test_a_clock_goes_on_after_midnight_and_after_a_change_of_its_zone(tmp_path: Path) -> None:
    path, columns = tmp_path / "t.csv", columns_of("t", "G_Pa", "modulus")
    minutes = (*range(50, 60), *range(10))
    times = [f"{23 if m > 9 else 0:02}:{m:02}:00" for m in minutes]
    for midnight in ("00:00:00", "-"):
        times[10] = midnight
        rows = [f"{t},{m}" for t, m in zip(times, minutes, strict=True)]
        path.write_text("\n".join(["t,G_Pa", *rows]))
        assert np.ptp(read_recording(path, columns).time_s) == 19 * 60
    # An hour of a night in October is there twice.
    hours = [("02", m, "+02:00") for m in range(50, 60)] + [("02", m, "+01:00") for m in range(10)]
    rows = [f"2026-10-25T{h}:{m:02}:00{zone},{m}" for h, m, zone in hours]
    path.write_text("\n".join(["t,G_Pa", *rows]))
    found = read_recording(path, columns)
    assert np.ptp(found.time_s) == 19 * 60
    start = "Times are dates, from the first, when the protocol is taken to start."
    assert start in found.remarks()
    # Dates that fall, of two tests in one file, are no midnight.
    rows = [f"2026-10-{day}T12:00:{s:02},{s}" for day in (26, 25) for s in range(20)]
    path.write_text("\n".join(["t,G_Pa", *rows]))
    assert "line 22, column 't': found 0 after 86419" in refusal(path, columns)
