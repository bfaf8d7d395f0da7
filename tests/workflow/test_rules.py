"""Rules as Snakemake's own commands show them."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.places import ROOT


def shown(folder: Path, *arguments: str) -> str:
    """What Snakemake says of the default study, without being told of processors."""
    command = [sys.executable, "-m", "snakemake", "--directory", str(folder), *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.mark.parametrize("graph", ["--dag", "--rulegraph"])
def test_graphs_need_no_number_of_processors(tmp_path: Path, graph: str) -> None:
    assert "digraph snakemake_dag {" in shown(tmp_path, graph)


def test_a_table_of_errors_plans_only_what_it_needs(tmp_path: Path) -> None:
    """Targets, noise and identifications of three cases by four methods, put together."""
    rows = [
        line.split() for line in shown(tmp_path, "-n", "results/tables/errors.csv").splitlines()
    ]
    jobs = {row[0]: int(row[1]) for row in rows if len(row) == 2 and row[1].isdigit()}
    assert jobs == {
        "target": 3,
        "measurement": 3,
        "identification": 12,
        "identifications": 3,
        "errors_of_case": 3,
        "errors": 1,
        "total": 25,
    }


def test_linting_wants_conda_and_nothing_else(tmp_path: Path) -> None:
    """Which nobody needs here: the environment is locked."""
    command = [sys.executable, "-m", "snakemake", "--directory", str(tmp_path), "--lint"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    wanted = {line.strip() for line in done.stderr.splitlines() if line.startswith("    * ")}
    assert wanted == {"* Specify a conda environment or container for each rule.:"}
