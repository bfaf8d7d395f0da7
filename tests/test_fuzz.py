"""Damaged files: each command gives an answer or one message, and no traceback."""

import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from biogrip.cli import main
from biogrip.command.files import _made_from
from biogrip.command.outputs import check_outputs, read_result
from biogrip.command.settings import Asked, check_settings, is_table
from biogrip.command.sheet import read_table
from biogrip.config.loading import trace_defaults
from biogrip.errors import BiogripError
from biogrip.terminal import visible_lines
from tests.helpers.identified import identify, write_drop
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


# Shapes that are small on the disk, or slow to read, times how often they are said.
SHAPES = [
    b",",
    b'"',
    b"\0",
    b"[",
    b"\n",
    b"\r",
    b"1",
    b"-",
    b"9e9,",
    b"\xff\xfe",
    b"\t\n",
    b"(a",
    b"#\n",
]
SHAPES += [b"0,0\n", b"1e-9;", b"nan,nan\n", "٣,٣\n".encode(), b"a b\n", b"=A1\n", b"1:2:3,4\n"]


def test_a_thousand_hostile_files_have_a_row_each_in_bounded_memory_and_time(
    tmp_path: Path, few: Path
) -> None:
    """At most 1 GB, some seconds a file; half are damaged, half of hostile shape."""
    readings, rng = np.loadtxt(EXAMPLE, delimiter=",", skiprows=1)[::10], np.random.default_rng(0)
    rows = [[f"{it:.9g}" for it in row] for row in readings]
    names = [f"{number:04}.csv" for number in range(1000)]
    for number, name in enumerate(names):
        content = damaged(number, ["time_s", "rotation_rad"], rows, NUMBERS)
        if number % 2:
            often = int(10 ** rng.uniform(1, 5.5))
            shape = SHAPES[number // 2 % len(SHAPES)] * often
            place = int(rng.integers(len(content) + 1))
            content = content[:place] + shape + content[place:]
        (tmp_path / name).write_bytes(content)
    (tmp_path / "sheet.tsv").write_text("\n".join(["file", *names]))
    code = "import resource, sys; from biogrip.cli import main; main(sys.argv[1:]); "
    code += "print(max(resource.getrusage(of).ru_maxrss for of in (0, -1)))"
    given = ["identify", tmp_path / "sheet.tsv", "--config", few, "--csv", tmp_path / "found.csv"]
    command = [sys.executable, "-c", code, *map(str, given)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=7200)
    assert int(run.stdout.split()[-1]) < 1e6, "kB"
    found = pd.read_csv(tmp_path / "found.csv")
    assert [Path(trace).name for trace in found.iloc[:, 0]] == names
    assert set(found["fit"]) <= {"ok", "doubtful", "rejected", "failed"}
    assert "Traceback" not in run.stderr
    assert "fault of biogrip" not in run.stderr + run.stdout


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


MARKS_OF_YAML = ["[", "]", "{", "}", ": ", "- ", "&a ", "*a", "? ", "|", "\t", "\0", "\x1b", "<<: "]
MARKS_OF_YAML += ["é", "\ud800".encode("utf-8", "surrogatepass").decode("latin-1"), '"', "'", "#"]
MARKS_OF_YAML += [".inf", ".nan", "1e400", "1:30", "010", "null", "yes", "__use_yte__: true\n"]


def mixed(seed: int, text: str, marks: list[str]) -> str:
    """Return text with pieces of itself moved, doubled or lost, and marks put in, maybe often."""
    rng = np.random.default_rng([88, seed])
    for _ in range(rng.integers(1, 5)):
        first, last = sorted(rng.integers(0, len(text) + 1, 2).tolist())
        way, last = rng.integers(4), min(last, first + 40)
        mark = str(rng.choice(marks)) * int(rng.choice([1, 1, 1, 3, 3000]))
        inserted = ["", text[first:last] * 2, mark, text[-40:]][way]
        text = text[:first] + inserted + text[last:]
    return text


@pytest.mark.parametrize("hundred", range(15))
def test_a_damaged_config_is_used_or_refused(tmp_path: Path, hundred: int) -> None:
    config, text = tmp_path / "lab.yaml", trace_defaults().read_text()
    (tmp_path / "a.csv").write_text("time_s,rotation_rad\n0,1e-6\n")
    for seed in range(FILES * hundred, FILES * (hundred + 1)):
        config.write_text(mixed(seed, text, MARKS_OF_YAML), errors="surrogateescape")
        said = ""
        try:
            check_settings([Asked(tmp_path / "a.csv", config)])
        except BiogripError as error:
            said = visible_lines(error)
        assert len(said.splitlines()) <= 11, seed
        assert "\x1b" not in said, seed


OPTIONS = ["--time", "--reading", "--hold", "--load", "--sphere", "--start", "--from", "--until"]
OPTIONS += [
    "--model",
    "--fix",
    "--at",
    "--noise",
    "--noise-share",
    "--sd",
    "--noise-model",
    "--set",
]
GIVEN = [
    "measurement.time_unit=ms",
    "strain=A 1",
    "k_p=0",
    "1,10,100",
    "20 pN",
    "2.5 um",
    "maxwell",
]
GIVEN += ["protocol.phases=[{duration_s: 1, torque_Nm: 1e-9}]", "fit", "time_s", "-3", "0.1"]


@pytest.mark.parametrize("hundred", range(5))
def test_options_of_any_kind_end_with_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], hundred: int
) -> None:
    """Of a trace that is refused in the end, so that none is fitted."""
    (trace := tmp_path / "a.csv").write_text("time_s,rotation_rad\n0,1e-6\n")
    for seed in range(FILES * hundred, FILES * (hundred + 1)):
        rng = np.random.default_rng([89, seed])
        options: list[str] = []
        for option in rng.choice(OPTIONS, rng.integers(1, 4)):
            given = mixed(seed + len(options), str(rng.choice(GIVEN)), [*MARKS_OF_YAML, "\udce9"])
            options.append(f"{option}={given}")
        try:
            status = main(["identify", str(trace), *options])
        except SystemExit as ended:
            status = int(str(ended.code))
        said, text = capsys.readouterr()
        assert status in (1, 2), (seed, options)
        assert "Traceback" not in text, (seed, options)
        assert "fault of biogrip" not in text, (seed, options)
        assert "\x1b" not in said + text, (seed, options)


def test_a_damaged_result_is_refused(tmp_path: Path, few: Path) -> None:
    """Or was not changed but in how it is written."""
    write_drop(tmp_path / "a.csv", 0)
    assert identify(tmp_path / "a.csv", "--config", few)[0] == 0
    result = tmp_path / "a.identified.json"
    text, made_from = result.read_text(), _made_from(Asked(tmp_path / "a.csv", few))
    whole = read_result(result, made_from)
    for seed in range(2 * FILES):
        result.write_text(mixed(seed, text, MARKS_OF_YAML))
        changed = None
        with suppress(BiogripError):
            changed = read_result(result, made_from)
        assert changed in (None, whole), seed
        with suppress(BiogripError):
            check_outputs([("a.csv", result)], [])
