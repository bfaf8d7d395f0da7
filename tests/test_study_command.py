import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.cli import main
from tests.helpers.identified import FEW, write_trace
from tests.helpers.places import EXAMPLE
from tests.helpers.runs import called


def refused(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    assert main([*map(str, arguments)]) == 1
    return capsys.readouterr().err


def test_command_and_study_are_one_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLE, "cell.csv")
    Path("mine.yaml").write_text(f"{FEW}gripper: {{arm_length_m: 1.2e-3}}\n", encoding="utf-8")
    options = ["cell.csv", "--config", "mine.yaml", "--fix", "c_p=0", "--no-compare"]
    assert main(["identify", *options, "--output", "found.json"]) == 0
    capsys.readouterr()
    assert main(["study", *options, "--output", "own"]) == 0
    said = capsys.readouterr().out
    (command,) = (line.split() for line in said.splitlines() if line.startswith("  snakemake"))
    target = "results/identifiability/cell.json"
    called(tmp_path, *command[1:], "--", target)

    def told(found: Path) -> dict[str, Any]:
        return {q["quantity"]: q["in_words"] for q in json.loads(found.read_text())["quantities"]}

    assert told(Path("own/results/identifiability/cell.json")) == told(Path("found.json"))
    assert told(Path("found.json"))["k"].startswith("determined: 3")


def test_a_folder_is_new_and_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "own"
    broken = tmp_path / "broken.csv"
    broken.write_text("time_s,rotation_rad\n0,1e-5\n1,x\n", encoding="utf-8")
    of_both = ("study", EXAMPLE, broken, "--output", folder)
    assert "broken.csv" in refused(capsys, *of_both)
    assert list(tmp_path.iterdir()) == [broken]
    assert "there is no file" in refused(capsys, "study", tmp_path / "none.csv")
    text = refused(capsys, "study", EXAMPLE, "--set", "gripper.arm_length_m=-1", "--output", folder)
    assert "gripper.arm_length_m" in text
    assert main(["study", str(EXAMPLE), "--output", str(folder)]) == 0
    before = (folder / "study.yaml").read_bytes()
    assert "exists; allowed is" in refused(capsys, "study", EXAMPLE, "--output", folder)
    assert (folder / "study.yaml").read_bytes() == before


def test_traces_of_one_name_are_cases_of_their_own(tmp_path: Path) -> None:
    times = np.arange(1.0, 40.0)
    strain = 0.01 + 0.001 * times + 1e-5 * (times % 3)
    traces = [str(tmp_path / name / "gel.csv") for name in ("a", "b")]
    for trace in map(Path, traces):
        trace.parent.mkdir()
        write_trace(trace, times, strain, header="time_s,strain")
    options = ["--reading", "strain", "--hold", "5", "--model", "zener_kelvin"]
    assert main(["study", *traces, *options, "--output", str(tmp_path / "own")]) == 0
    study = yaml.safe_load((tmp_path / "own" / "study.yaml").read_text())
    assert study["only"] == [*study["cases"]] == ["gel", "gel_2"]
    assert study["methods"] == ["least_squares"]
    for name, case in zip(("a", "b"), study["cases"].values(), strict=True):
        assert case["instrument"] == "creep"
        assert case["sample"]["model"] == "zener_kelvin"
        assert case["protocol"]["phases"] == [{"duration_s": 39.0, "stress_Pa": 5.0}]
        assert case["measurement"]["file"] == f"../{name}/gel.csv"
        assert "gripper" not in case
