"""A sheet of traces as a study: what is made, and what is fitted again."""

import json
from pathlib import Path

import pandas as pd
import pytest

from biogrip.errors import BiogripError
from biogrip.own_traces.fitted_cells import check_sheet
from biogrip.own_traces.fitted_traces import trace_of
from biogrip.own_traces.one_trace import case_of
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Study
from tests.helpers.drops import write_trace
from tests.helpers.places import CONFIG as CONFIG_FILE
from tests.helpers.runs import Run, biogrip, called, replaced, snakemake

SHEET = """file\tcell\tdish\tmeasurement.noise_rad
a.csv\tfirst\tA\t
b.csv\tsecond\tA\t1e-6
c.csv\tthird\tB\t
"""
CONFIG = """traces: cells.tsv
least_squares: {candidates: 50, starts: 3}
model_selection: {models: [damper, liquid_drop]}
"""


def run(folder: Path) -> Run:
    """Run the study of the folder, which must succeed."""
    done = called(folder, "run", "lab.yaml", "-j2")
    assert done.status == 0, done.output
    assert "other studies" not in done.output
    return done


def results(folder: Path) -> dict[str, tuple[bytes, int]]:
    """Bytes and time of every trace's results, by the trace."""
    found = {}
    for file in (folder / "results" / "traces").glob("*.json"):
        found[file.name.partition("-")[0]] = file.read_bytes(), file.stat().st_mtime_ns
    return found


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    for seed, name in enumerate("abc"):
        write_trace(tmp_path / f"{name}.csv", seed)
    (tmp_path / "cells.tsv").write_text(SHEET)
    (tmp_path / "lab.yaml").write_text(CONFIG)
    return tmp_path


def table(folder: Path) -> pd.DataFrame:
    return pd.read_csv(folder / "results" / "tables" / "traces.csv").set_index("cell")


def test_only_what_is_new_or_has_changed_is_fitted(lab: Path) -> None:
    """A row, a trace, a setting; not a row's place or factor. What was edited is made again."""
    run(lab)
    first = results(lab)
    assert table(lab)["dish"].tolist() == ["A", "A", "B"]
    assert not list((lab / "results" / "tables").glob("errors*"))
    page = (lab / "results" / "traces.html").read_text()
    assert all(name in page for name in ("a.csv", "b.csv", "c.csv"))
    again = snakemake(lab, "-n", config=CONFIG)
    assert "Nothing to be done" in again.output, again.output

    write_trace(lab / "new.csv", 3)
    lines = replaced(SHEET, "b.csv", "new.csv\tnew\tB\t\nb.csv")
    (lab / "cells.tsv").write_text(replaced(lines, "third\tB", "third\tC"))
    run(lab)
    more = results(lab)
    assert {name for name in more if more[name] != first.get(name)} == {"new"}
    assert table(lab)["dish"].to_dict() == {"first": "A", "new": "B", "second": "A", "third": "C"}

    write_trace(lab / "a.csv", 4)
    (lab / "cells.tsv").write_text(replaced(lines, "third\tB\t", "third\tC\t2e-6"))
    run(lab)
    changed = results(lab)
    assert {name for name in more if more[name] != changed[name]} == {"a", "c"}

    (edited,) = (lab / "results" / "traces").glob("b-*.json")
    edited.write_text(replaced(edited.read_text(), '"fit": "ok"', '"fit": "rejected"'))
    run(lab)
    mended = results(lab)
    assert mended["b"][0] == changed["b"][0]
    assert {name for name in more if mended[name] != changed[name]} == {"b"}


def test_a_study_says_of_a_trace_what_the_command_says(lab: Path) -> None:
    """Of each alone, by the same settings: the same numbers, digit by digit."""
    run(lab)
    (lab / "own.yaml").write_text(CONFIG.partition("\n")[2])
    for name, more in (("a", []), ("b", ["--noise", "1e-6"])):
        # A sheet in the config is meant for the study.
        config = "lab.yaml" if name == "a" else "own.yaml"
        done = biogrip(lab, "identify", f"{name}.csv", "--config", config, *more)
        assert done.returncode == 0, done.stderr
        alone = json.loads((lab / f"{name}.identified.json").read_text())
        (file,) = (lab / "results" / "traces").glob(f"{name}-*.json")
        data = json.loads(file.read_text())["data"]
        for key in ("fit", "quantities", "models", "misfit_rad", "notes"):
            assert data[key] == alone[key], key


def test_a_trace_that_cannot_be_read_is_a_row_that_says_so(lab: Path) -> None:
    (lab / "b.csv").write_text("time_s,rotation_rad\n0,1e-6\nten,2e-6\n")
    run(lab)
    found = table(lab)
    assert found["fit"].to_dict()["second"] == "none"
    assert found["fit"].to_dict()["third"] == "ok"
    assert "line 3" in (lab / "results" / "traces.html").read_text()
    asked = called(lab, "make", "traces_ok")
    assert asked.status == 1
    assert "b.csv" in asked.output
    write_trace(lab / "b.csv", 1)
    run(lab)
    assert called(lab, "make", "traces_ok").status == 0


def test_a_sheet_that_cannot_be_used_stops_with_line_and_column(lab: Path) -> None:
    (lab / "cells.tsv").write_text(replaced(SHEET, "\t1e-6", "\tmuch"))
    done = called(lab, "run", "lab.yaml", "-j2")
    assert done.status != 0
    assert "cells.tsv, line 3, column 'measurement.noise_rad': found" in done.output
    (lab / "cells.tsv").write_text(SHEET)
    (lab / "a{b}.csv").write_bytes((lab / "a.csv").read_bytes())
    (lab / "cells.tsv").write_text(replaced(SHEET, "a.csv", "a{b}.csv"))
    done = called(lab, "run", "lab.yaml", "-j2")
    assert "cells.tsv, line 2, column 'file': found 'a{b}.csv', allowed is a name" in done.output
    (lab / "cells.tsv").write_text(SHEET)
    (lab / "lab.yaml").write_text("traces: {sheet: cells.tsv, rows: []}\n")
    done = called(lab, "run", "lab.yaml", "-j2")
    assert done.status != 0
    assert "lab.yaml, line 1: traces.rows: is not for a config" in done.output
    assert "Traceback" not in done.output


def test_groups_of_a_study_are_those_of_the_command(lab: Path) -> None:
    """Medians, limits and differences, from the same sheet; replicates are fitted jointly."""
    for seed, name in enumerate(("d", "e", "f", "g"), 10):
        write_trace(lab / f"{name}.csv", seed)
    rows = "".join(f"{file}.csv\t{cell}\tB\t\n" for file, cell in zip("defg", "vwxx", strict=True))
    (lab / "cells.tsv").write_text(SHEET + rows)
    run(lab)
    (lab / "own.yaml").write_text(CONFIG.partition("\n")[2])
    done = biogrip(lab, "groups", "cells.tsv", "--config", "own.yaml")
    assert done.returncode == 0, done.stderr
    by_command = json.loads((lab / "cells.compared.json").read_text())
    by_study = json.loads((lab / "results" / "traces" / "compared" / "groups.json").read_text())
    assert [cell["cell"] for cell in by_study["cells"]] == ["first", "second", "third", *"vwx"]
    for own, other in zip(by_study["cells"], by_command["cells"], strict=True):
        assert own == other
    assert by_study["by"] == by_command["by"] == "dish"
    for own, other in zip(by_study["groups"], by_command["groups"], strict=True):
        assert own["determined"] == other["determined"]
        if "median" in other:
            # Profiles are kept to nine digits.
            for key in ("median", "low", "high"):
                assert own[key] == pytest.approx(other[key], rel=1e-4)
    table = pd.read_csv(lab / "results" / "tables" / "groups.csv")
    assert set(table["group"]) == {"A", "B"}
    page = (lab / "results" / "traces.html").read_text()
    assert "Medians and spreads of the groups" in page

    before = {file: file.read_bytes() for file in (lab / "results/traces/cells").glob("*.json")}
    write_trace(lab / "f.csv", 20)
    run(lab)
    after = {file: file.read_bytes() for file in before}
    assert {file.name[0] for file in before if before[file] != after[file]} == {"x"}


def test_a_cell_in_two_groups_stops_the_study(lab: Path) -> None:
    (lab / "cells.tsv").write_text(replaced(SHEET, "third\tB", "second\tB"))
    done = called(lab, "run", "lab.yaml", "-j2")
    assert done.status != 0
    assert "cells.tsv, line 4, column 'dish': found 'B' for the cell 'second'" in done.output


def test_a_study_names_the_columns_of_all_its_traces_once(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a config of the command does; a row that names another goes before it."""
    monkeypatch.chdir(lab)
    (lab / "cells.tsv").write_text(
        "file\tmeasurement.time\na.csv\t\nb.csv\tclock_s\nc.csv\t\n", encoding="utf-8"
    )

    def study_with(measured: str) -> Study:
        (lab / "lab.yaml").write_text(f"{CONFIG}measurement: {measured}\n")
        files = [CONFIG_FILE, lab / "lab.yaml"]
        return load_study(read_configs(files), files)

    study = study_with("{time: t_s, rotation: phi_rad, noise_share: 0.01}")
    check_sheet(study)
    assert study.traces is not None
    columns = [case_of(trace_of(study.traces, row).options).columns for row in study.traces.rows]
    assert [each.time for each in columns] == ["t_s", "clock_s", "t_s"]
    assert {each.reading for each in columns} == {"phi_rad"}
    with pytest.raises(BiogripError, match=r"lab.yaml, line 4: measurement.sd: found 1, allowed"):
        study_with("{sd: 1}")
