"""A sweep from its config to heat maps, and what a value more on an axis runs again."""

import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from biogrip.study.source import overlaid
from tests.helpers.pictures import assert_drawn
from tests.helpers.runs import planned, snakemake

pytestmark = pytest.mark.nightly

SWEEP: dict[str, Any] = {
    "seeds": 2,
    "measurement": {"rate_Hz": 1.0},
    "methods": ["genetic", "least_squares"],
    "genetic_algorithm": {
        "population": 60,
        "survivors": 30,
        "min_generations": 10,
        "max_generations": 25,
    },
    "least_squares": {"candidates": 100, "starts": 4},
    "cases": {"liquid_drop_1": None, "endothelial_cell": None},
    "sweeps": {
        "small": {
            "cases": ["liquid_drop_2"],
            "rows": {"label": "level", "key": "measurement.noise.level", "values": [0.0, 0.1]},
            "columns": {
                "label": "length",
                "unit": "mm",
                "unit_in_si": 1.0e-3,
                "key": "gripper.arm_length_m",
                "values": [1.0e-3, 1.5e-3],
            },
        }
    },
}
TABLE = "results/tables/robustness_small.csv"
POINTS = [f"liquid_drop_2--small--{level}--0_00{mm}" for level in ("0", "0_1") for mm in (1, 15)]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("robustness")
    run = snakemake(folder, "--", TABLE, config=SWEEP)
    assert run.status == 0, run.output
    return folder


def test_a_sweep_has_its_results(study: Path) -> None:
    judged = pd.read_csv(study / "results/robustness/small.csv")
    assert judged["point"].unique().tolist() == POINTS
    assert len(judged) == 4 * 2 * 5
    assert judged["bound_percent"].notna().sum() == 2 * 2 * 5
    assert (judged["seeds"] == 2).all()
    table = pd.read_csv(study / TABLE)
    assert set(table["column"]) == {1.0, 1.5}
    assert_drawn(study / "results/figures/robustness_small.png")


def test_the_page_shows_heat_maps_but_no_figure_of_a_point(study: Path) -> None:
    jobs = planned(study, config=SWEEP)
    assert jobs["case_figures"] == jobs["judgement"] == 1
    assert jobs["identification"] == 2
    assert "sweep" not in jobs


def test_a_value_more_runs_its_own_points_alone(study: Path, tmp_path: Path) -> None:
    study = shutil.copytree(study, tmp_path / "study")
    rows = {"values": [0.3, 0.1, 0.0]}
    more = overlaid(SWEEP, {"sweeps": {"small": {"rows": rows}}})
    jobs = planned(study, TABLE, config=more)
    assert jobs == {"target": 2, "measurement": 2, "identification": 4, "sweep": 1}
