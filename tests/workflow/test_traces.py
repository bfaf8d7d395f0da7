from pathlib import Path
from typing import Any

import pytest

from biogrip.cli import main
from biogrip.config.source import overlaid
from tests.helpers.identified import write_drop
from tests.helpers.places import CONFIG
from tests.helpers.runs import planned, snakemake

TABLE = "results/tables/traces.csv"
TRACES = {"table": "cells.tsv", "config": "lab.yaml", "model": "maxwell", "rows_a_batch": 2}
STUDY: dict[str, Any] = {"traces": TRACES}
LAB = """measurement: {noise_rad: 1.0e-6}
least_squares: {candidates: 50, starts: 2}
model_selection: {models: []}
"""
CELLS = """file\tdish\tfixed.c
0.csv\tA\t
1.csv\tB\t
2.csv\tA\t300
3.csv\tB\t
4.csv\tA\t
"""


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Four traces, of which one is not there, and one cannot be read."""
    for number in (0, 2):
        write_drop(tmp_path / f"{number}.csv", number)
    (tmp_path / "1.csv").write_text("time_s,rotation_rad\n0,1e-6\nten,2e-6\n")
    (tmp_path / "cells.tsv").write_text(CELLS)
    (tmp_path / "lab.yaml").write_text(LAB)
    # Paths are of the folder in which Snakemake runs.
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.nightly
def test_batches_give_the_table_of_the_command(lab: Path) -> None:
    """Of rows with another gripper and another comb, too."""
    columns = "gripper.arm_length_m\tactuator.thickness_m", "\t", "\t", "1.6e-3\t4.0e-5"
    rows = zip(CELLS.splitlines(), columns, strict=False)
    (lab / "cells.tsv").write_text("".join(f"{row}\t{more}\n" for row, more in rows))
    snakemake(lab, "--", TABLE, config=STUDY)
    options = ("--config", "lab.yaml", "--model", "maxwell", "--csv", "found.csv")
    assert main(["identify", "cells.tsv", *options]) == 1
    assert (lab / TABLE).read_bytes() == (lab / "found.csv").read_bytes()


@pytest.mark.nightly
def test_what_is_changed_and_only_that_is_identified_again(lab: Path) -> None:
    snakemake(lab, "--", TABLE, config=STUDY)
    assert planned(lab, TABLE, config=STUDY) == {}
    inputs = snakemake(lab, "--detailed-summary", "--", TABLE, config=STUDY)
    assert inputs.count(str(CONFIG)) == 3
    for old, new, batches in (
        ("4.csv\tA\t\n", "4.csv\tA\t\n5.csv\tC\t\n", 1),
        ("2.csv\tA", "2.csv\tC", 1),
        ("1.csv\tB\t\n2.csv\tA", "1.csv\tC\t\n2.csv\tC", 2),
    ):
        assert old in CELLS
        (lab / "cells.tsv").write_text(CELLS.replace(old, new))
        assert planned(lab, TABLE, config=STUDY) == {"traces_batch": batches, "traces": 1}
    (lab / "cells.tsv").write_text(CELLS)
    write_drop(lab / "3.csv", 7)
    assert planned(lab, TABLE, config=STUDY) == {"traces_batch": 1, "traces": 1}
    (lab / "lab.yaml").write_text(LAB.replace("1.0e-6", "2.0e-6"))
    assert planned(lab, TABLE, config=STUDY) == {"traces_batch": 3, "traces": 1}
    other = overlaid(STUDY, {"traces": {"model": "liquid_drop"}})
    assert planned(lab, TABLE, config=other) == {"traces_batch": 3, "traces": 1}


def test_a_table_that_cannot_be_used_stops_with_line_and_key(lab: Path) -> None:
    for number in (2, 3):
        write_drop(lab / f"{number}.csv", number)
    table = lab / "cells.tsv"
    table.write_text(CELLS.replace("fixed.c\n", "fixed.x\n"))
    run = snakemake(lab, "-n", "--", TABLE, config=STUDY, status=1)
    assert "cells.tsv, line 4, column 'fixed.x': fixed.x: is no parameter of the sample" in run
    assert "Traceback" not in run
