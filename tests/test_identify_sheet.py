"""`biogrip identify` with sheets: a row says what options and config say of one trace."""

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.cli import main
from biogrip.experiment.protocol import torque_history
from biogrip.experiment.sample import MODELS
from biogrip.library import hold
from biogrip.products.tables.contact import contacts
from biogrip.response.linear import rotation, step_response
from tests.helpers.default import STUDY
from tests.helpers.problems import GRIPPER, TORQUE

SHORT = {"phases": [{"duration_s": 100.0, "torque_Nm": 2e-9}]}
FEW = {
    "least_squares": {"candidates": 50, "starts": 2},
    "model_selection": {"models": []},
    "blocks": {"protocol": {"short": SHORT}},
}
SHEET = [
    ["file", "cell", "dish", "fit", "protocol", "measurement.time", "gripper.arm_length_m"],
    ["usual.csv", "one", "left", "yes", "", "", ""],
    ["other.csv", "two", "right", "", "short", "t_s", "3e-3"],
]


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a trace of the usual protocol, one of another, a sheet and its config."""
    folder = tmp_path_factory.mktemp("laboratory")
    rng = np.random.default_rng(4)
    network = MODELS["kelvin_voigt"].network([[10.0, 300.0]])
    for name, column, torque, end in (
        ("usual", "time_s", TORQUE, 400),
        ("other", "t_s", torque_history((hold(100.0, 2e-9),)), 100),
    ):
        times = np.linspace(0, end, 81)
        clean = rotation(step_response(GRIPPER, network), torque, times)[0]
        measured = clean + 0.05 * clean.max() * rng.standard_normal(len(times))
        rows = np.column_stack((times, measured))
        header = f"{column},rotation_rad"
        np.savetxt(folder / f"{name}.csv", rows, "%.9g", ",", header=header, comments="")
    write(folder / "cells.tsv", SHEET)
    (folder / "few.yaml").write_text(yaml.safe_dump(FEW))
    return folder


@pytest.fixture
def here(laboratory: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the folder, worked in."""
    shutil.copytree(laboratory, tmp_path / "l")
    monkeypatch.chdir(tmp_path / "l")
    return tmp_path / "l"


def write(path: Path, rows: list[list[str]]) -> None:
    path.write_text("\n".join("\t".join(row) for row in rows) + "\n")


def identify(*arguments: str) -> int:
    return main(["identify", *arguments, "--model", "kelvin_voigt"])


def found(trace: str) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(Path(trace).with_suffix(".identified.json").read_text())
    return data


def test_a_row_says_what_options_and_config_say_of_one_trace(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert identify("cells.tsv", "--config", "few.yaml", "--csv", "table.csv") == 0
    # What is not so of all traces is said of each.
    printed = capsys.readouterr().out
    assert "\nusual.csv: Assumed: the default study's gripper and the default study's" in printed
    assert "other.csv: Assumed" not in printed
    assert "\nLimits are statistical only: the gripper is taken as exact.\n" in printed
    rows = {name: found(name) for name in ("usual.csv", "other.csv")}
    assert [each.pop("cell") for each in rows.values()] == ["one", "two"]
    factors = [each.pop("factors") for each in rows.values()]
    assert factors == [{"dish": "left", "fit": "yes"}, {"dish": "right", "fit": ""}]
    assert [each["by_default"] for each in rows.values()] == [["gripper", "protocol"], []]
    alone = {key: value for key, value in FEW.items() if key != "blocks"}
    (here / "few.yaml").write_text(yaml.safe_dump(alone))
    assert identify("usual.csv", "--config", "few.yaml") == 0
    assert found("usual.csv") == rows["usual.csv"]
    said = {"protocol": SHORT, "gripper": {"arm_length_m": 3e-3}}
    (here / "few.yaml").write_text(yaml.safe_dump(alone | said))
    assert identify("other.csv", "--config", "few.yaml", "--time", "t_s") == 0
    assert found("other.csv") == rows["other.csv"]
    with (here / "table.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert [row["trace"] for row in table] == ["usual.csv", "other.csv"]
    # A factor named like a column of the table is told from it.
    columns = ("cell", "dish", "factor fit", "fit")
    assert [[row[name] for name in columns] for row in table] == [
        ["one", "left", "yes", rows["usual.csv"]["fit"]],
        ["two", "right", "", rows["other.csv"]["fit"]],
    ]


def test_sheets_and_traces_may_be_mixed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A trace that cannot be read is a row that says so, with its cell."""
    (here / "bad.csv").write_text("time_s,rotation_rad\n0,0\n1,high\n")
    write(here / "cells.tsv", [["file", "cell", "dish"], ["bad.csv", "lost", "left"]])
    (here / "few.yaml").write_text(yaml.safe_dump({**FEW, "blocks": {}}))
    arguments = ("usual.csv", "cells.tsv", "--config", "few.yaml", "--csv", "table.csv")
    assert identify(*arguments) == 1
    assert "bad.csv, line 3, column 'rotation_rad': found 'high'" in capsys.readouterr().out
    with (here / "table.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert [[row[name] for name in ("trace", "cell", "dish", "fit")] for row in table] == [
        ["usual.csv", "", "", "ok"],
        ["bad.csv", "lost", "left", "failed"],
    ]
    assert "cell" not in found("usual.csv")


def test_traces_none_of_which_is_there_are_listed(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert identify("usuel.csv", "otter.csv") == 1
    assert "Not identified, 2 of 2:" in capsys.readouterr().out


def test_what_a_row_says_goes_before_options(here: Path) -> None:
    write(
        here / "cells.tsv",
        [
            ["file", "measurement.start_s", "fix.c_p", "sample.model", "measurement.noise_rad"],
            ["usual.csv", "0", "200", "", "2e-6"],
        ],
    )
    (here / "few.yaml").write_text(yaml.safe_dump({**FEW, "blocks": {}}))
    options = ("--start", "fit", "--fix", "c_p=100", "--noise", "1e-6", "--drift")
    assert identify("cells.tsv", "--config", "few.yaml", *options) == 0
    data = found("usual.csv")
    assert data["fixed"] == ["c_p = 200 N s/m"]
    assert data["assumed"]["measurement"]["start_s"] == 0
    assert data["assumed"]["measurement"]["drift"] is True
    assert data["assumed"]["measurement"]["noise_rad"] == 2e-6
    assert "onset_s" not in data
    assert data["cell"] == "usual"


def test_traces_of_other_settings_are_identified_as_if_alone(here: Path) -> None:
    """In one batch: noise, drift, equations, gripper, known and unknown parameters, and model."""
    settings = {
        "measurement.noise_model": "coloured",
        "measurement.drift": "true",
        "measurement.noise_rad": "1e-6",
        "models.identification": "nonlinear",
        "gripper.uncertainty.arm_length_m": "1e-5",
        "fix.c_p": "250",
        "sample.model": "maxwell",
    }
    # Half of the readings are enough.
    first, *lines = (here / "usual.csv").read_text().splitlines(keepends=True)
    rows = [["file", *settings], ["usual.csv", *[""] * len(settings)]]
    for number, value in enumerate(settings.values()):
        (here / f"{number}.csv").write_text("".join([first, *lines[::2]]))
        rows.append(
            [f"{number}.csv", *["" if n != number else value for n in range(len(settings))]]
        )
    (here / "few.yaml").write_text(yaml.safe_dump({**FEW, "blocks": {}}))
    write(here / "cells.tsv", rows)
    assert identify("cells.tsv", "--config", "few.yaml") == 0
    written = {row[0]: found(row[0]) for row in rows[1:]}
    for row in rows[1:]:
        write(here / "cells.tsv", [rows[0], row])
        assert identify("cells.tsv", "--config", "few.yaml") == 0
        assert found(row[0]) == written[row[0]]


@pytest.mark.parametrize(
    ("rows", "options", "said"),
    [
        (
            [["file", "measurement.noise_rad"], ["usual.csv", "1e-6"]],
            ("--noise-model", "coloured"),
            ["cells.tsv, line 2: measurement.noise_rad: is that of white noise; leave it out"],
        ),
        (
            [["file", "sample.branches"], ["usual.csv", "2"]],
            (),
            ["cells.tsv, line 2: cases.usual.sample.branches: only generalized_maxwell has"],
        ),
        (
            [["file", "fix.k"], ["usual.csv", "2"], ["other.csv", ""]],
            (),
            ["cells.tsv, line 2: fixed.k: is no parameter of the sample, which has"],
        ),
        (
            [["file", "measurement.start_s"], ["usual.csv", "1"], ["usual.csv", "x"]],
            (),
            ["line 3, column 'measurement.start_s': found 'x', allowed is a number", "again, as"],
        ),
        (
            [
                ["file", "instrument", "measurement.modulus"],
                ["usual.csv", "", ""],
                ["other.csv", "relaxation", "G"],
            ],
            (),
            ["cells.tsv, line 3: found a reading of modulus, but a reading of rotation of "],
        ),
        ([["file", "protocol"], ["usual.csv", ""]], (), ["blocks.protocol.short: is named by no"]),
        (SHEET, ("--output", "x.json"), ["--output: only for one trace"]),
        (SHEET, ("usual.csv",), ["found the same file to be written twice"]),
        (SHEET, ("--csv", "other.csv"), ["other.csv: is read; allowed is another file to write."]),
    ],
)
def test_a_sheet_is_checked_whole_before_anything_is_fitted(
    here: Path,
    capsys: pytest.CaptureFixture[str],
    rows: list[list[str]],
    options: tuple[str, ...],
    said: list[str],
) -> None:
    write(here / "cells.tsv", rows)
    blocks = {} if rows is not SHEET and "protocol" not in rows[0] else FEW["blocks"]
    (here / "few.yaml").write_text(yaml.safe_dump({**FEW, "blocks": blocks}))
    assert identify("cells.tsv", *options, "--config", "few.yaml") == 1
    error = capsys.readouterr().err
    for words in said:
        assert words in error
    assert not list(here.glob("*.json"))


def test_settings_of_several_rows_are_refused_together(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(
        here / "cells.tsv",
        [["file", "fix.k", "fix.x"], ["usual.csv", "2", ""], ["other.csv", "", "3"]],
    )
    (here / "few.yaml").write_text(yaml.safe_dump({**FEW, "blocks": {}}))
    assert identify("cells.tsv", "--config", "few.yaml") == 1
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition(": ")[0] for line in lines[1:]] == [
        "cells.tsv, line 2",
        "cells.tsv, line 3",
    ]


def test_the_size_of_a_sample_sets_the_angle_at_which_it_is_met(here: Path) -> None:
    """A trace tells stiffnesses times the square of the sine: smaller samples seem stiffer.

    The table of contact says so of a config in which the neutral angle is taken for all sizes.
    """
    shutil.copy(here / "usual.csv", here / "small.csv")
    rows = [["file", "sample.size_m"], ["usual.csv", ""], ["small.csv", "30e-6"]]
    write(here / "cells.tsv", rows)
    (here / "few.yaml").write_text(yaml.safe_dump({**FEW, "blocks": {}}))
    assert identify("cells.tsv", "--config", "few.yaml") == 0
    unsized, sized = (
        {each["quantity"]: each["value"] for each in found(name)["quantities"]}
        for name in ("usual.csv", "small.csv")
    )
    # From 150 to 30 um each jaw moves by 60 um, on a circle of 1.5 mm.
    angle = np.arccos(np.cos(np.radians(75)) + 60e-6 / 1.5e-3)
    ratio = (np.sin(angle) / np.sin(np.radians(75))) ** 2
    for name in ("k_p", "c_p"):
        assert unsized[name] / sized[name] == pytest.approx(ratio, rel=1e-3)
    smallest = contacts(STUDY).rows[0]
    assert smallest[0] == pytest.approx(30)
    assert smallest[3] == pytest.approx(100 * (ratio - 1))
