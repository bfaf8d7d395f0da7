"""A sweep from its config to heat maps, and what a value more on an axis runs again."""

import shutil
from pathlib import Path

import pandas as pd
import pytest

from tests.helpers.pictures import assert_drawn
from tests.helpers.runs import replaced, snakemake, tables

pytestmark = pytest.mark.nightly

SWEEP = """
seeds: 2
measurement: {rate_Hz: 1.0}
methods: [genetic, least_squares]
genetic_algorithm: {population: 60, survivors: 30, min_generations: 10, max_generations: 25}
least_squares: {candidates: 100, starts: 4}
cases:
  liquid_drop_1: null
  endothelial_cell: null
sweeps:
  small:
    cases: [liquid_drop_2]
    rows: {label: level, key: measurement.noise.level, values: [0.0, 0.1]}
    columns:
      label: length
      unit: mm
      unit_in_si: 1.0e-3
      key: gripper.arm_length_m
      values: [1.0e-3, 1.5e-3]
"""
WANTED = ("results/figures/robustness_small.png", "results/tables/robustness_small.csv")
POINTS = [f"liquid_drop_2--small--{level}--0_00{mm}" for level in ("0", "0_1") for mm in (1, 15)]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("robustness")
    run = snakemake(folder, *WANTED, config=SWEEP)
    assert run.status == 0, run.output
    return folder


def test_a_sweep_has_its_results(study: Path) -> None:
    judged = pd.read_csv(study / "results/robustness/small/liquid_drop_2.csv")
    assert judged["point"].unique().tolist() == POINTS
    assert len(judged) == 4 * 2 * 5
    assert judged["bound_percent"].notna().sum() == 2 * 2 * 5
    assert (judged["seeds"] == 2).all()
    table = pd.read_csv(study / "results/tables/robustness_small.csv")
    assert set(table["column"]) == {1.0, 1.5}
    assert_drawn(study / "results/figures/robustness_small.png")
    for suffix in (".md", ".tex", ".html"):
        text = (study / f"results/tables/robustness_small{suffix}").read_text()
        assert "c + c" in text


def test_all_asks_for_heat_maps_but_for_no_figure_of_a_point(study: Path) -> None:
    run = snakemake(study, "-n", config=SWEEP)
    assert run.status == 0, run.output
    assert run.jobs("case_figures") == run.jobs("verdicts") == 1
    assert run.jobs("identification") == 2
    fresh = snakemake(study, "-n", "--forceall", config=SWEEP)
    assert fresh.jobs("robustness_figure") == fresh.jobs("robustness") == 1
    assert fresh.jobs("case_figures") == 1
    assert fresh.jobs("identification") == 2 * (4 + 1)


def test_a_value_more_runs_its_own_points_alone(study: Path, tmp_path: Path) -> None:
    study = shutil.copytree(study, tmp_path / "study")
    before = tables(study)
    more = replaced(SWEEP, "values: [0.0, 0.1]", "values: [0.3, 0.1, 0.0]")
    run = snakemake(study, *WANTED, config=more)
    assert run.status == 0, run.output
    assert (run.jobs("target"), run.jobs("identification"), run.jobs("sweep_points")) == (2, 4, 1)
    after = tables(study)
    assert [
        name for name in before if before[name] != after[name] and not name.startswith("tables/")
    ] == []
    assert set(pd.read_csv(study / "results/tables/robustness_small.csv")["row"]) == {0.3, 0.1, 0.0}
