"""`biogrip identify` on exports of rheometers: what is said of the file, and how it is repeated."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.cli import main
from biogrip.progress import QUIET

FEW = {
    "least_squares": {"candidates": 100, "starts": 4},
    "model_selection": {"models": ["maxwell"]},
}
READ = ("--time", "Time", "--reading", "modulus=Relaxation Modulus", "--model", "liquid_drop")
BEGINS_S = 7.0


def exported(path: Path, *, repeated: bool = False) -> Path:
    """A conditioning of 7 s, and a relaxation modulus of 5 + 20 exp(-t / 3) Pa, in two blocks."""
    rng = np.random.default_rng(1)
    times = 0.25 * np.arange(1, 61)
    moduli = 5 + 20 * np.exp(-times / 3) + 0.1 * rng.standard_normal(60)
    clock = np.floor(times / 0.5) * 0.5 if repeated else times
    first = [f"{i}\t{0.5 * i}\t0.01" for i in range(1, 15)]
    second = [
        f"{i}\t{BEGINS_S + t:.3f}\t{1e-3 * g:.7f}"
        for i, (t, g) in enumerate(zip(clock, moduli, strict=True))
    ]
    lines = ["Test:\tgel"]
    for number, rows in enumerate((first, second), 1):
        lines += [f"Interval:\t{number}", "Point No.\tTime\tRelaxation Modulus", "\t\t"]
        lines += ["\t[s]\t[kPa]", *(row.replace(".", ",") for row in rows), "", ""]
    path.write_bytes("\r\n".join(lines).encode("utf-16"))
    return path


def config(path: Path, more: dict[str, Any]) -> str:
    path.write_text(yaml.safe_dump({**FEW, **more}))
    return str(path)


def found(trace: Path) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(trace.with_suffix(".identified.json").read_text())
    return data


def test_the_block_that_is_asked_for_is_identified(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is recognised is said; the same keys in a config give the same, and so does QUIET."""
    trace = exported(tmp_path / "gel.csv")
    few = config(tmp_path / "few.yaml", {})
    command = ["identify", str(trace), *READ, "--config", few]
    assert main(command) == 1
    said = capsys.readouterr().err
    assert "found 2 blocks with the columns 'Time', 'Relaxation Modulus'" in said
    assert "\n  2: line 23, Interval: 2; Point No., Time, Relaxation Modulus; 60 rows, 7,25" in said
    chosen = [*command, "--block", "2", "--start", str(BEGINS_S)]
    assert main(chosen) == 0
    said = capsys.readouterr().err
    assert "gel.csv is read as\n  text      UTF-16, cells between tabs, decimal comma\n" in said
    assert "\n  header    line 23, units in line 25\n  preamble  Interval: 2\n" in said
    assert "\n  block     2 of 2\n  time      Time, in s\n" in said
    assert "\n  modulus   Relaxation Modulus, in kPa\n  rows      60, from 7.25 to 22 s\n" in said
    by_options = found(trace)
    assert by_options["read_as"]["block"] == 2
    assert by_options["read_as"]["encoding"] == "UTF-16"
    limits = {each["quantity"]: (each["low"], each["high"]) for each in by_options["quantities"]}
    assert limits["k"][0] < 20 < limits["k"][1]
    assert limits["k_p"][0] < 5 < limits["k_p"][1]
    monkeypatch.setenv(QUIET, "1")
    measurement = {"time": "Time", "modulus": "Relaxation Modulus", "start_s": BEGINS_S, "block": 2}
    keys = config(tmp_path / "keys.yaml", {"instrument": "relaxation", "measurement": measurement})
    assert main(["identify", str(trace), "--model", "liquid_drop", "--config", keys]) == 0
    assert capsys.readouterr().err == ""
    assert found(trace)["quantities"] == by_options["quantities"]
    assert found(trace)["assumed"]["measurement"] == by_options["assumed"]["measurement"]


def test_readings_of_a_rounded_clock_are_averaged_and_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = exported(tmp_path / "gel.csv", repeated=True)
    few = config(tmp_path / "few.yaml", {})
    command = ["identify", str(trace), *READ, "--config", few, "--block", "2", "--start", "7"]
    assert main(command) == 1
    assert "are averaged by average_repeated: true under measurement." in capsys.readouterr().err
    assert main([*command, "--set", "measurement.average_repeated=true"]) == 0
    notes = found(trace)["notes"]
    assert {"weight": "harmless", "text": "Averaged at repeated times: 58 readings."} in notes
    assert found(trace)["samples"] in (30, 31)


def test_a_usual_file_is_read_without_a_word(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times = 0.25 * np.arange(1, 61)
    rows = [f"{t},{5 + 20 * np.exp(-t / 3) + 0.1 * np.sin(97 * t)}" for t in times]
    trace = tmp_path / "plain.csv"
    trace.write_text("\n".join(["time_s,modulus_Pa", *rows]))
    few = config(tmp_path / "few.yaml", {})
    command = ["identify", str(trace), "--reading", "modulus=modulus_Pa", "--config", few]
    assert main([*command, "--model", "liquid_drop"]) == 0
    assert capsys.readouterr().err == ""
    assert "read_as" not in found(trace)
