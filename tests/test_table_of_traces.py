import csv
import json
import multiprocessing
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.command import files as command
from biogrip.command.files import identify_batch
from biogrip.command.options import Setting
from biogrip.command.outputs import read_result, write_result
from biogrip.command.settings import Asked, is_table
from biogrip.command.sheet import read_table
from biogrip.errors import BiogripError
from biogrip.library import Sample, hold, set_up, simulate
from tests.helpers.default import STUDY
from tests.helpers.identified import identify as run
from tests.helpers.identified import write_trace

FEW = "least_squares: {candidates: 50, starts: 2}\nmodel_selection: {models: []}\n"
HEADER = "file|dish|protocol.phases|measurement.time|gripper.arm_length_m"
PHASES = "[{duration_s: 100.0, torque_Nm: 2e-9}]"
OTHER = f"other.csv|right|{PHASES}|t_s|3e-3"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder, worked in: a trace of the usual protocol, one of another, a table and a config."""
    rng, other = np.random.default_rng(4), (hold(100.0, 2e-9),)
    for name, column, phases in (("usual", "time_s", STUDY.phases), ("other", "t_s", other)):
        experiment = set_up(STUDY.gripper, phases, Sample("kelvin_voigt"))
        times = np.linspace(0, experiment.torque.end_s, 81)
        clean = simulate(experiment, {"k_p": 10.0, "c_p": 300.0}, times)
        measured = clean + 0.05 * clean.max() * rng.standard_normal(len(times))
        write_trace(tmp_path / f"{name}.csv", times, measured, header=f"{column},rotation_rad")
    write(tmp_path / "cells.tsv", HEADER, "usual.csv|left|||", OTHER)
    (tmp_path / "few.yaml").write_text(FEW)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(path: Path, *rows: str) -> None:
    path.write_text("\n".join(rows).replace("|", "\t") + "\n")


def identify(*arguments: str) -> tuple[int, str, str]:
    return run(*arguments, "--config", "few.yaml", "--model", "kelvin_voigt")


def found(trace: str) -> dict[str, Any]:
    """Return what a JSON file says, whatever it was made from."""
    data: dict[str, Any] = json.loads(Path(trace).with_suffix(".identified.json").read_text())
    return {key: value for key, value in data.items() if key != "digest"}


def listed(table: str = "found.csv") -> list[dict[str, str]]:
    with Path(table).open(newline="") as stream:
        return list(csv.DictReader(stream))


def refused(path: Path) -> list[str]:
    with pytest.raises(BiogripError) as error:
        read_table(path)
    return str(error.value).splitlines()


def test_a_trace_may_stand_beside_a_table_that_does_not_name_it(here: Path) -> None:
    said = "other.identified.json: would be written for 'other.csv' and for 'other.csv'"
    assert said in identify("cells.tsv", "other.csv")[2]
    write(here / "cells.tsv", HEADER, OTHER)
    status, printed, _ = identify("usual.csv", "cells.tsv", "--csv", "found.csv")
    assert status == 0
    assumed = "the gripper and the protocol (200 s at 1.6e-09 N m, "
    assert (
        f"\nusual.csv: Assumed: {assumed}200 s at 3.2e-10 N m) of the published gripper study; give"
        in printed
    )
    assert "other.csv: Assumed" not in printed
    rows = Path("found.csv").read_text().splitlines()
    starts = ["trace,dish,fit,", "usual.csv,,ok,", "other.csv,right,ok,"]
    assert [row[: len(start)] for row, start in zip(rows, starts, strict=True)] == starts


def test_a_table_is_told_by_its_column_of_files(tmp_path: Path) -> None:
    """Also as Excel writes it: a mark of the byte order, empty lines and columns, no last cells."""
    for name, separator, column in (
        *(("c.tsv", "\t", "file"), ("c.csv", ",", "File"), ("c.txt", ";", "file_name")),
        *(("c.tsv", "\t", name) for name in ("File name", "filename", "File-Name")),
    ):
        path = tmp_path / name
        text = f"\ufeff{column}|dish||fixed.c_p|'cell, no'\n"
        text += "d1/a.csv|left|||\n\n|||\nb.csv||| 0\nc.csv|NA\n"
        path.write_text(text.replace("|", separator).replace("'", '"'), encoding="utf-8")
        assert is_table(Asked(path))
        own = Setting(f"{path}, line 5, column 'fixed.c_p'", ("fixed", "c_p"), 0)
        told = (2, "d1/a.csv", (), "left"), (5, "b.csv", (own,), ""), (6, "c.csv", (), "NA")
        assert [(row.place, row.trace, row.settings, row.copied) for row in read_table(path)] == [
            (f"{path}, line {line}", tmp_path / trace, settings, {"dish": dish, "cell, no": ""})
            for line, trace, settings, dish in told
        ]


def test_traces_side_by_side_are_a_row_each(here: Path) -> None:
    times, readings = np.loadtxt(here / "usual.csv", delimiter=",", skiprows=1).T
    write_trace(Path("both.csv"), times, readings, 2 * readings, header="time_s,A 1,A/2")
    fixed = "k=0.001 c=0.001 c_p=150"
    rows = "both.csv|rotation=A 1|||x", f"both.csv|A/2|generalized_maxwell|{fixed}|y"
    write(here / "wells.tsv", "file|reading|model|fix|well", *rows)
    unit = "--set", "measurement.rotation_unit=rad"
    assert identify("wells.tsv", "--csv", "found.csv", *unit)[0] == 0
    one, other = listed()
    assert one["trace"] == "both.csv rotation=A 1"
    assert other["trace"] == f"both.csv A/2 generalized_maxwell {fixed}"
    assert float(one["k_p value (N/m)"]) == pytest.approx(10, rel=0.05)
    assert float(other["k_p value (N/m)"]) == pytest.approx(5, rel=0.05)
    assert other["fixed"] == "k = 0.001 N/m; c = 0.001 N s/m; c_p = 150 N s/m"
    assert Path("both.rotation=A 1.identified.json").exists()
    assert Path(f"both.A%2F2 generalized_maxwell {fixed}.identified.json").exists()


def test_all_that_is_wrong_with_a_table_is_said_at_once(tmp_path: Path) -> None:
    path = tmp_path / "cells.tsv"
    rows = "a.csv|||||1:30|soon", "./a.csv|||||[1", "a.csv|||||[1"
    write(path, "file|dish|dish|fit|k value|measurement.skip|hold", *rows)
    lines = [line.removeprefix(f"{path}, line ") for line in refused(path)]
    below = [lines.pop(5).split(":")[:2] for _ in range(2)]
    assert lines == [
        "1, column 'dish': stands twice; allowed is each name once.",
        "1, column 'fit': is a column of the results; allowed is another name.",
        "1, column 'k value': is a column of the results; allowed is another name.",
        "2, column 'measurement.skip': not usable YAML: found 1:30, which YAML reads in base 60; "
        "allowed is a number without colons, or text in quotes.",
        "2, column 'hold': found 'soon', allowed is a number, or one with its unit",
        f"4, column 'file': found '{tmp_path}/a.csv' again, as on line 3; allowed is each trace "
        "once, or a column 'reading' that tells which, as in strain=COLUMN.",
    ]
    assert below == [[f"{n}, column 'measurement.skip'", " not usable YAML"] for n in (3, 4)]
    write(path, "file|fixed.c", *(f"{number}.csv|[1" for number in range(30)))
    assert refused(path)[10:] == ["... and 20 more."]


def test_text_that_is_no_table_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cells.csv"
    for text, said in (
        ("fil,dish\na.csv,1\n", "line 1: found no column 'file' among fil, dish; allowed is one"),
        ("file\n", "found no traces, allowed is a row for each."),
        ("file,dish\n,left\n", "line 2, column 'file': found nothing, allowed is a trace."),
        ("file\na.csv,left\n", "line 2: found 2 cells in the row, allowed are the header's 1."),
        ("file\n\udcff\n", "cannot be read as a table: "),
    ):
        path.write_text(text, errors="surrogateescape")
        (line,) = refused(path)
        assert line.startswith(str(path))
        assert said in line


def test_settings_that_cannot_be_used_are_said_at_once(here: Path) -> None:
    header = "file|measurement.noise_rad|fixed.k_s|sample.model|measurment.skip"
    write(here / "cells.tsv", header, "usual.csv|-1||maxwel|2", "other.csv||2||")
    status, _, error = identify("cells.tsv")
    assert status == 1
    said = [
        "line 2, column 'measurement.noise_rad': measurement.noise_rad: found -1, allowed is",
        "line 2, column 'measurment.skip': measurment: unknown key. Did you mean 'measurement'",
        "line 2, column 'sample.model': sample.model: found 'maxwel'. Did you mean 'maxwell' or",
        "line 3, column 'fixed.k_s': fixed.k_s: is no parameter of the sample, which has k_p",
    ]
    lines = [line.partition("cells.tsv, ")[2] for line in error.splitlines()]
    assert [line[: len(own)] for line, own in zip(lines, said, strict=True)] == said
    assert not list(here.glob("*.json"))


def test_traces_of_a_command_read_one_quantity(here: Path) -> None:
    phases = "{phases: [{duration_s: 400, strain: 1}]}"
    (here / "few.yaml").write_text(f"instrument: relaxation\nprotocol: {phases}\n")
    header = "file|measurement.modulus|measurement.stress"
    write(here / "cells.tsv", header, "usual.csv|G|", "other.csv||S")
    said = "cells.tsv, line 3: found a reading of stress, but a reading of modulus before"
    assert said in identify("cells.tsv")[2]


def test_a_trace_that_fails_is_a_row_that_says_why(here: Path) -> None:
    for few in (3, 2):
        write(here / "cells.tsv", *("file|dish", "gone.csv|lost", "usual.csv|left")[:few])
        given = ("--csv", "found.csv", "--report", "page.html")
        status, printed, _ = identify("cells.tsv", *given)
        assert status == 1
        assert f"Not identified, 1 of {few - 1}:" in printed
        assert "cells.tsv, line 2: there is no file gone.csv in /" in printed
        whole = [("gone.csv", "lost", "failed", True), ("usual.csv", "left", "ok", False)]
        row = ((it["trace"], it["dish"], it["fit"], it["failed"] != "") for it in listed())
        assert [*row] == whole[: few - 1]
        assert '<td class="aside">lost</td>' in (here / "page.html").read_text()


def killed_at_other(asked: Any, outputs: Any, *, drawn: bool) -> Any:
    if any(own.trace.name == "other.csv" for own in asked):
        os.kill(os.getpid(), signal.SIGKILL)
    return identify_batch(asked, outputs, drawn=drawn)


@pytest.mark.nightly
def test_a_killed_process_costs_a_batch_its_trace_alone(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what is done is not done again: the next run says and writes what a first would."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    # Traces of one batch, each with limits of its own.
    of_each = f"{HEADER}|identifiability.confidence", "usual.csv|left||||0.9", f"{OTHER}|"
    write(here / "cells.tsv", *of_each)
    undisturbed = identify("cells.tsv", "--csv", "first.csv")
    assert [row["confidence"] for row in listed("first.csv")] == ["0.9", "0.95"]
    results = {name: found(name) for name in ("usual.csv", "other.csv")}
    for path in here.glob("*.json"):
        path.unlink()
    with monkeypatch.context() as patched:
        # Killed is every process that is to identify that trace, with all others of its batch.
        patched.setattr(command, "identify_batch", killed_at_other)
        status, printed, said = identify("cells.tsv", "--csv", "found.csv")
    assert status == 1
    assert "its traces are identified one by one." in said
    assert "other.csv: a process was killed, perhaps because memory ran out, twice" in printed
    assert [row["fit"] for row in listed()] == [results["usual.csv"]["fit"], "failed"]
    assert not (here / "other.identified.json").exists()
    done = (here / "usual.identified.json").stat().st_mtime_ns
    status, printed, said = identify("cells.tsv", "--csv", "first.csv")
    assert "1 of 2 traces are taken from their JSON files" in said
    assert (status, printed) == undisturbed[:2]
    assert (here / "usual.identified.json").stat().st_mtime_ns == done
    assert {name: found(name) for name in results} == results
    table = (here / "first.csv").read_bytes()
    assert identify("cells.tsv", "--csv", "found.csv")[2].startswith("2 of 2 traces are taken")
    assert (here / "found.csv").read_bytes() == table
    # No JSON file has a picture.
    assert identify("cells.tsv", "--report", "page.html")[2].startswith("1 of 2: usual.csv")


def test_a_result_is_made_from_trace_config_and_options(tmp_path: Path) -> None:
    trace, config = tmp_path / "a.csv", tmp_path / "few.yaml"
    at = Setting("--at", ("identifiability", "at_s"), [10])
    made_from = set()
    for value, keys, own in (
        (1, "", ()),
        (2, "", ()),
        (2, "study_seed: 9", ()),
        (2, "study_seed: 9", (at,)),
    ):
        trace.write_text(f"time_s,rotation_rad\n0,{value}\n")
        config.write_text(keys)
        made_from.add(command._made_from(Asked(trace, config, own)))
    assert len(made_from) == 4


def test_results_in_any_unit_are_read_as_they_were_written(tmp_path: Path) -> None:
    for reads, unit in (("strain", ""), ("displacement", "_m")):
        data = {"reads": {"quantity": reads}, "noise_rad": 1.5, "assumed": {"noise_rad": 1 / 3}}
        data |= {"notes": [{"drift_rad_per_s": None}]}
        write_result(tmp_path / "a.json", data, "this")
        written = json.loads((tmp_path / "a.json").read_text())
        assert (written[f"noise{unit}"], written.pop("assumed")) == (1.5, data["assumed"])
        assert "_rad" not in json.dumps(written)
        assert read_result(tmp_path / "a.json", "this") == data
        text = (tmp_path / "a.json").read_text()
        for changed, digest in ((text, "that"), (text.replace("1.5", "1.6"), "this")):
            (tmp_path / "a.json").write_text(changed)
            with pytest.raises(BiogripError, match="its digest is another one"):
                read_result(tmp_path / "a.json", digest)


def test_what_a_row_says_goes_before_options(here: Path) -> None:
    header = "file|measurement.start_s|fixed.c_p|sample.model|measurement.noise_rad"
    write(here / "cells.tsv", header, "usual.csv|0|200||2e-6")
    options = ("--start", "fit", "--fix", "c_p=100", "--noise", "1e-6", "--drift")
    assert identify("cells.tsv", *options)[0] == 0
    data = found("usual.csv")
    assert data["fixed"] == ["c_p = 200 N s/m"]
    said = {"start_s": 0, "drift": True, "noise_rad": 2e-6}
    assert said.items() <= data["assumed"]["measurement"].items()
    assert "onset_s" not in data


def test_a_trace_is_no_table_though_it_has_a_column_of_files(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    plain = "", "time_s,rotation_rad\n1,2\n", "profile\n1\n", "\0\xff"
    named = "time_s,rotation_rad,file\n0,1,run7\n", "path,C:/run7.dat\ntime_s,rotation_rad\n0,1\n"
    for text in plain + named:
        path.write_text(text)
        assert not is_table(Asked(path))
    path.write_text("t,file,phi_rad\n0,run7,1\n1,run7,2\n")
    keys = {"time": "t", "rotation": "phi_rad"}
    given = (Setting("--x", ("measurement", key), it) for key, it in keys.items())
    assert not is_table(Asked(path, settings=tuple(given)))


def test_an_option_is_a_column_too_and_words_are_no_setting(tmp_path: Path) -> None:
    path = tmp_path / "cells.csv"
    names = "file,hold,Start,noise-model,model,stress_Pa"
    path.write_text(f"{names}\na.csv,10,fit,coloured,maxwell,10\n")
    (own,) = read_table(path)
    assert [(".".join(setting.path), setting.value) for setting in own.settings] == [
        *(("--hold", 10), ("measurement.fit_start", True)),
        *(("measurement.noise_model", "coloured"), ("sample.model", "maxwell")),
    ]
    assert own.copied == {"stress_Pa": "10"}
    alike = ["arm_length_m", "stress_Pa", "noise (rad)", "start_s"]
    others = ["length_um", "passage", "day", "time_h"]
    path.write_text(f"file,{','.join(alike + others)}\na.csv{',low' * len(alike)},12,3,4,5\n")
    assert list(read_table(path)[0].copied) == alike + others


def test_what_looks_like_a_setting_is_not_copied_beside_the_result(tmp_path: Path) -> None:
    for meant, names, cell in (
        ("hold", ("stress_Pa", "hold_Pa", "hodl", "pressure_mbar", "Force (pN)"), "1"),
        *(("hold", ["stress"], "8 Pa"), ("start", ["start_s"], "1")),
        *(("noise", ["noise (rad)", "noize"], "1"), ("noise_model", ["noise_modle"], "coloured")),
        ("model", ["modle", "sample type"], "sls"),
    ):
        path = tmp_path / "cells.csv"
        for name in names:
            path.write_text(f"file,{name}\na.csv,{cell}\n")
            said = f"looks like a setting and is none; allowed is '{meant}' for a column that sets "
            said += "it, in SI units, or a name unlike a setting's."
            assert refused(path) == [f"{path}, line 1, column '{name}': {said}"]


def test_jobs_are_done_one_after_another_where_nothing_forks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As on Windows."""
    monkeypatch.setattr(multiprocessing, "get_all_start_methods", lambda: ["spawn"])
    assert [*command.side_by_side(abs, [-1, 2, -3], 2)] == [1, 2, 3]
