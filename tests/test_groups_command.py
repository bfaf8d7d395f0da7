"""`biogrip groups`: from a table of traces to differences between groups, and bad tables."""

import csv
import json
import shutil
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.cli import main
from biogrip.experiment.sample import MODELS
from biogrip.response.linear import rotation, step_response
from tests.helpers.problems import GRIPPER, TORQUE

MODEL = MODELS["kelvin_voigt"]
# k_p in N/m by group; cells scatter by a tenth, and the second group is twice as stiff.
MIDDLES = {"control": 10.0, "treated": 20.0}
CELLS = 3


@pytest.fixture(scope="module")
def dishes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with traces of both groups, the first cell of each traced twice, and its table."""
    folder = tmp_path_factory.mktemp("dishes")
    rng = np.random.default_rng(8)
    times = np.linspace(0, 400, 161)
    rows = [["file", "cell", "group"]]
    for group, middle in MIDDLES.items():
        for cell in range(CELLS):
            values = [middle * np.exp(0.1 * rng.standard_normal()), 300.0]
            clean = rotation(step_response(GRIPPER, MODEL.network([values])), TORQUE, times)[0]
            for trace in range(2 if cell == 0 else 1):
                measured = clean + 0.05 * clean.max() * rng.standard_normal(len(times))
                name = f"{group}_{cell}_{trace}.csv"
                np.savetxt(
                    folder / name,
                    np.column_stack((times, measured)),
                    "%.9g",
                    ",",
                    header="time_s,rotation_rad",
                    comments="",
                )
                rows.append([name, f"{group} {cell}", group])
    write_table(folder / "groups.csv", rows)
    return folder


def write_table(path: Path, rows: list[list[str]]) -> None:
    with path.open("w", newline="") as stream:
        csv.writer(stream).writerows(rows)


def table_of(folder: Path) -> list[list[str]]:
    with (folder / "groups.csv").open(newline="") as stream:
        return list(csv.reader(stream))


def groups(table: Path, *arguments: str | Path) -> int:
    return main(["groups", str(table), "--model", "kelvin_voigt", *map(str, arguments)])


def quantity(rows: list[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    return [row for row in rows if row["quantity"] == name]


@pytest.fixture(scope="module")
def compared(dishes: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], str]:
    """What the command finds, and what it says."""
    output, said = tmp_path_factory.mktemp("compared") / "out.json", StringIO()
    with redirect_stdout(said):
        assert groups(dishes / "groups.csv", "--output", output) == 0
    return json.loads(output.read_text()), said.getvalue()


def test_groups_are_compared(compared: tuple[dict[str, Any], str]) -> None:
    found, said = compared
    assert [cell["cell"] for cell in found["cells"]] == [
        f"{group} {cell}" for group in MIDDLES for cell in range(CELLS)
    ]
    assert [len(cell["traces"]) for cell in found["cells"]] == [2, 1, 1, 2, 1, 1]
    for own, (group, middle) in zip(quantity(found["groups"], "k_p"), MIDDLES.items(), strict=True):
        assert own["group"] == group
        assert len(own["determined"]) == len(own["shrunk"]) == CELLS
        assert own["low"] < own["median"] < own["high"]
        # Three standard deviations of a mean of three.
        assert own["median"] == pytest.approx(middle, rel=0.18)
    (apart,) = quantity(found["differences"], "k_p")
    assert (apart["group"], apart["against"]) == ("treated", "control")
    assert apart["low"] < 2 < apart["high"]
    assert apart["low"] > 1
    assert apart["p"] == apart["adjusted_p"] < 0.05
    # Three cells a dish are too few for an interval by ranks.
    assert apart["by_ranks"]["low"] is None
    for word in ("treated over control", f"{apart['ratio']:.3g}", "3 of 3", "control_0_1.csv"):
        assert word in said
    assert found["skipped"] == []
    assert "Limits are statistical only" in found["limits"]
    assert found["limits"] in said


def test_a_cell_is_what_identify_says_of_its_trace(
    dishes: Path, compared: tuple[dict[str, Any], str], tmp_path: Path
) -> None:
    """Whatever others are in the table, in whatever order."""
    shutil.copytree(dishes, tmp_path / "d")
    header, *rows = table_of(dishes)
    write_table(tmp_path / "d" / "groups.csv", [header, *rows[::-1]])
    write_table(tmp_path / "d" / "some.csv", [header, rows[2], rows[0]])
    written = []
    for table in ("groups", "some"):
        assert groups(tmp_path / "d" / f"{table}.csv") == 0
        data = json.loads((tmp_path / "d" / f"{table}.compared.json").read_text())
        written.append({cell["cell"]: cell for cell in data["cells"]})
    assert written[0]["control 1"] == written[1]["control 1"]
    trace = tmp_path / "d" / "control_1_0.csv"
    assert main(["identify", str(trace), "--model", "kelvin_voigt"]) == 0
    alone = json.loads(trace.with_suffix(".identified.json").read_text())
    for key in ("quantities", "misfit_rad", "noise_rad", "notes"):
        assert written[0]["control 1"][key] == alone[key]
    for cell in compared[0]["cells"]:
        assert cell["quantities"] == written[0][cell["cell"]]["quantities"]


def test_bad_traces_are_left_out_and_told(
    dishes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(dishes, tmp_path / "d")
    header, *rows = table_of(dishes)
    (tmp_path / "d" / "bad.csv").write_text("time_s,rotation_rad\n0,0\n1,high\n")
    shutil.copy(tmp_path / "d" / rows[0][0], tmp_path / "d" / "copy.csv")
    extra = [
        ["bad.csv", "control 0", "control"],
        ["copy.csv", "new", "treated"],
    ]
    write_table(tmp_path / "d" / "groups.csv", [header, *rows[:2], *extra])
    assert groups(tmp_path / "d" / "groups.csv") == 1
    said = capsys.readouterr().out
    assert "bad.csv, line 3, column 'rotation_rad': found 'high'" in said
    found = json.loads((tmp_path / "d" / "groups.compared.json").read_text())
    assert [cell["cell"] for cell in found["cells"]] == ["control 0"]
    assert "copy.csv: found the same readings as in " in said
    left_out = [Path(each["trace"]).name for each in found["skipped"]]
    assert left_out == ["bad.csv", "copy.csv"]
    assert found["differences"] == []


def test_a_trace_that_is_not_there_is_told_before_any_is_fitted(
    dishes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(dishes, tmp_path / "d")
    header, *rows = table_of(dishes)
    write_table(tmp_path / "d" / "groups.csv", [header, *rows, ["treated_0_O.csv", "l", "treated"]])
    assert groups(tmp_path / "d" / "groups.csv") == 1
    said = capsys.readouterr().err
    assert f"groups.csv, line {len(rows) + 2}, column 'file': found" in said
    assert "treated_0_O.csv', allowed is a file that exists. Did you mean" in said
    assert not (tmp_path / "d" / "groups.compared.json").exists()


def test_rows_have_settings_and_groups_are_of_any_factor(
    dishes: Path, compared: tuple[dict[str, Any], str], tmp_path: Path
) -> None:
    shutil.copytree(dishes, tmp_path / "d")
    _, *rows = table_of(dishes)
    write_table(
        tmp_path / "d" / "groups.csv",
        [
            ["file", "cell", "dish", "day", "gripper.arm_length_m"],
            *(
                [file, cell, group, "1", "" if cell[-1] == "1" else "3e-3"]
                for file, cell, group in rows
            ),
        ],
    )
    assert groups(tmp_path / "d" / "groups.csv", "--by", "dish") == 0
    found = json.loads((tmp_path / "d" / "groups.compared.json").read_text())
    assert found["by"] == "dish"
    assert "the grippers, which differ from trace to trace" in found["limits"]
    for cell, before in zip(found["cells"], compared[0]["cells"], strict=True):
        now, was = (quantity(it["quantities"], "k_p")[0]["value"] for it in (cell, before))
        # The torque over the square of the arm's length is the scale of stiffness.
        assert now == pytest.approx(was if cell["cell"][-1] == "1" else was / 4, rel=1e-3)


@pytest.mark.parametrize(
    ("column", "first", "second", "said"),
    [
        ("sample.model", "kelvin_voigt", "maxwell", "found the model maxwell, but the model kelv"),
        ("fix.c_p", "", "300", "found c_p known, but nothing known of "),
        ("measurement.noise_rad", "1e-5", "-1", "column 'measurement.noise_rad': found -1"),
        ("gripper", "", "old", "allowed are names of blocks under blocks.gripper"),
    ],
)
def test_rows_that_cannot_be_compared_are_refused(
    dishes: Path,
    capsys: pytest.CaptureFixture[str],
    column: str,
    first: str,
    second: str,
    said: str,
) -> None:
    _, *rows = table_of(dishes)
    write_table(
        dishes / "bad.csv",
        [["file", "cell", "group", column], [*rows[0], first], [*rows[2], second]],
    )
    assert groups(dishes / "bad.csv") == 1
    error = capsys.readouterr().err
    assert "bad.csv, line 3" in error
    assert said in error
    assert error.count("\n") == 1


def test_nothing_to_compare_is_said(
    dishes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(dishes, tmp_path / "d")
    header, *rows = table_of(dishes)
    write_table(tmp_path / "d" / "groups.csv", [header, rows[0], rows[4]])
    assert groups(tmp_path / "d" / "groups.csv") == 0
    assert "nothing is compared" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--noise", "-1"), "--noise: found -1.0, allowed is at least 1e-15"),
        (("--config", "nowhere.yaml"), "nowhere.yaml"),
        (("--output", "groups.csv"), "groups.csv: is read; allowed is another file to write."),
        (("--output", "control_1_0.csv"), "control_1_0.csv: is read; allowed is another file"),
        (("--rotation", "phi_rad"), "none of its traces can be used; the first: "),
    ],
)
def test_what_cannot_be_used_is_one_message(
    dishes: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    said: str,
) -> None:
    monkeypatch.chdir(dishes)
    before = sorted(dishes.iterdir())
    assert groups(Path("groups.csv"), *arguments) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert sorted(dishes.iterdir()) == before


def test_a_table_that_is_not_there_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "groups.csv").touch()
    assert groups(tmp_path / "gruops.csv") == 1
    assert "TABLE: found" in (said := capsys.readouterr().err)
    assert "Did you mean" in said
