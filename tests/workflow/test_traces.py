"""A table of traces in a study: batches of its rows, and all in one table."""

from pathlib import Path
from typing import Any

import pytest

from biogrip.cli import main
from tests.helpers.drops import write_trace
from tests.helpers.planned import changed, planned
from tests.helpers.runs import snakemake

TABLE = "results/tables/traces.csv"
STUDY: dict[str, Any] = {
    "traces": {
        "table": "cells.tsv",
        "config": "lab.yaml",
        "model": "liquid_drop",
        "rows_a_batch": 3,
    }
}
LAB = """measurement: {noise_rad: 1.0e-6}
least_squares: {candidates: 50, starts: 2}
model_selection: {models: []}
"""


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Seven traces, of which one is not there, and one cannot be read."""
    rows = ["file\tdish\tfixed.c"]
    for number in range(7):
        if number != 5:
            write_trace(tmp_path / f"{number}.csv", number)
        rows.append(f"{number}.csv\t{'AB'[number % 2]}\t{'300' if number == 2 else ''}")
    (tmp_path / "4.csv").write_text("time_s,rotation_rad\n0,1e-6\nten,2e-6\n")
    (tmp_path / "cells.tsv").write_text("\n".join(rows) + "\n")
    (tmp_path / "lab.yaml").write_text(LAB)
    # Paths are of the folder in which Snakemake runs.
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_batches_give_the_table_of_the_command(lab: Path) -> None:
    """To the byte."""
    run = snakemake(lab, "--", TABLE, config=STUDY)
    assert run.status == 0, run.output
    options = ("--config", "lab.yaml", "--model", "liquid_drop", "--csv", "found.csv")
    assert main(["identify", "cells.tsv", *options]) == 1
    assert (lab / TABLE).read_bytes() == (lab / "found.csv").read_bytes()
    assert planned(lab, TABLE, config=STUDY) == {}


@pytest.mark.nightly
def test_what_is_changed_and_only_that_is_identified_again(lab: Path) -> None:
    assert snakemake(lab, "--", TABLE, config=STUDY).status == 0
    # A row more is in its batch, a word or a trace in that of its row.
    table = (lab / "cells.tsv").read_text()
    for old, new, batches in (
        ("6.csv\tA\t\n", "6.csv\tA\t\n7.csv\tC\t\n", 1),
        ("3.csv\tB", "3.csv\tC", 1),
        ("1.csv\tB\t\n2.csv\tA\t300\n3.csv\tB", "1.csv\tC\t\n2.csv\tA\t300\n3.csv\tC", 2),
    ):
        assert old in table
        (lab / "cells.tsv").write_text(table.replace(old, new))
        assert planned(lab, TABLE, config=STUDY) == {"traces_batch": batches, "traces": 1}
    (lab / "cells.tsv").write_text(table)
    # A trace that was not there, and the config of all.
    write_trace(lab / "5.csv", 7)
    assert planned(lab, TABLE, config=STUDY) == {"traces_batch": 1, "traces": 1}
    (lab / "lab.yaml").write_text(LAB.replace("1.0e-6", "2.0e-6"))
    assert planned(lab, TABLE, config=STUDY) == {"traces_batch": 3, "traces": 1}
    other = changed(STUDY, {"traces": {"model": "maxwell"}})
    assert planned(lab, TABLE, config=other) == {"traces_batch": 3, "traces": 1}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("fixed.c\n", "fixed.x\n", "line 4: fixed.x: is no parameter of the sample"),
        ("3.csv\tB\t\n", "3.csv\tB\tmuch\n", "line 5: fixed.c: found 'much', allowed is a number"),
    ],
)
def test_a_table_that_cannot_be_used_stops_with_line_and_key(
    lab: Path, old: str, new: str, said: str
) -> None:
    table = lab / "cells.tsv"
    table.write_text(table.read_text().replace(old, new, 1))
    run = snakemake(lab, "-n", "--", TABLE, config=STUDY)
    assert run.status == 1
    assert f"cells.tsv, {said}" in run.output
    assert "Traceback" not in run.output
