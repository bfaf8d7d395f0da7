"""Posteriors in a study: made where a case asks for them, told in tables, drawn, and repeatable."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.products.figures.corner import draw_corner
from biogrip.products.figures.style import styled
from biogrip.products.files.posterior import POSTERIOR, SAMPLES, read_samples
from biogrip.products.plan import Plan
from biogrip.products.stages.judgement import JUDGED
from biogrip.products.stages.measurement import MEASUREMENT
from biogrip.products.stages.posterior import SAMPLED
from biogrip.products.stages.target import TARGET
from biogrip.products.tables.posterior import POSTERIOR_MODELS, POSTERIOR_TABLE
from biogrip.study.study import Study
from tests.helpers.default import plan_of, study_of

OVERLAY = """
seeds: 1
methods: [least_squares]
measurement: {rate_Hz: 1.0}
identifiability: {coverage_seeds: 0}
model_selection: {models: [maxwell]}
cases:
  endothelial_cell: null
  liquid_drop_1: null
  liquid_drop_2:
    fixed: {c_p: 1.0e-3}
    posterior: {evidence: true}
  mine:
    sample: {model: maxwell, k: 1.0, c: 10.0}
    posterior: {walkers: 60, evidence: true}
"""
CASES = ("liquid_drop_2", "mine")


@pytest.fixture(scope="module")
def study() -> Study:
    return study_of(OVERLAY)


def sampled(study: Study, folder: Path) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        plan = Plan(study, Path("results"))
        for name in CASES:
            case = {"case": name}
            TARGET.run(plan, case)
            MEASUREMENT.run(plan, case | {"batch": "seeds_0-0"})
            JUDGED.run(plan, case)
            SAMPLED.run(plan, case)
        POSTERIOR_TABLE.run(plan, {})
        POSTERIOR_MODELS.run(plan, {})
    return folder


@pytest.fixture(scope="module")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return sampled(study, tmp_path_factory.mktemp("posterior"))


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_default_study_samples_nothing() -> None:
    plan = plan_of()
    products = (SAMPLED, POSTERIOR_TABLE, POSTERIOR_MODELS)
    assert [job for product in products for job in product.jobs(plan)] == []


def test_the_table_has_every_quantity_beside_its_profile(folder: Path, study: Study) -> None:
    rows = rows_of(folder / "results/tables/posterior.csv")
    assert [(row["case"], row["quantity"]) for row in rows] == [
        *(("liquid_drop_2", name) for name in ("k", "k_p", "c")),
        *(("mine", name) for name in ("k", "c")),
    ]
    for row in rows:
        numbers = [float(row[key]) for key in ("low", "half_low", "median", "half_high", "high")]
        assert numbers == sorted(numbers)
        # Within four standard deviations, two of which are half of the interval.
        truth = study.case(row["case"]).parameters[row["quantity"]]
        if row["against_profile"] == "the same":
            reach = (numbers[4] / numbers[0]) ** 1.0
            assert numbers[2] / reach < truth < numbers[2] * reach
    told = {(row["case"], row["quantity"]): row["against_profile"] for row in rows}
    assert told["mine", "c"] == "the same"
    # A membrane too soft to be seen: no lower limit but the prior's.
    assert told["liquid_drop_2", "k_p"] == "an end is the prior's"
    assert [row["profile_low"] for row in rows if row["quantity"] == "k_p"] == [""]


def test_models_are_compared_where_nothing_is_known(folder: Path) -> None:
    """Not with c_p fixed, as other models do not have it."""
    rows = rows_of(folder / "results/tables/posterior_models.csv")
    assert [(row["case"], row["model"]) for row in rows] == [("mine", "Maxwell liquid")]
    assert float(rows[0]["delta_log_evidence"]) == 0.0
    assert rows[0]["reliable"] == "yes"
    assert (
        json.loads((folder / POSTERIOR.format(case="liquid_drop_2")).read_text())["evidence"] == []
    )


def test_a_second_run_gives_the_same_bytes(folder: Path, study: Study, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        plan, case = Plan(study, Path("results")), {"case": "mine"}
        TARGET.run(plan, case)
        MEASUREMENT.run(plan, case | {"batch": "seeds_0-0"})
        JUDGED.run(plan, case)
        SAMPLED.run(plan, case)
    for pattern in (POSTERIOR, SAMPLES):
        file = pattern.format(case="mine")
        assert (tmp_path / file).read_bytes() == (folder / file).read_bytes()


def test_the_figure_shows_samples_interval_and_truth(folder: Path, study: Study) -> None:
    case = study.case("mine")
    told: dict[str, Any] = json.loads((folder / POSTERIOR.format(case="mine")).read_text())
    model = case.sample.model
    values = read_samples(folder / SAMPLES.format(case="mine"), model)
    with styled():
        drawn = draw_corner(model.parameters, values, told, case.parameters, "mine")
    grid = np.array(drawn.axes, dtype=object).reshape(2, 2)
    assert [axes.axison for axes in grid.ravel()] == [True, False, True, True]
    pair = grid[1, 0]
    assert pair.get_xscale() == pair.get_yscale() == "log"
    # Both axes have numbers on them, however little they span.
    assert min(len(axis.get_major_ticks()) for axis in (pair.xaxis, pair.yaxis)) >= 1
    lines = [line.get_xdata()[0] for line in pair.lines if len(line.get_xdata()) == 2]
    assert lines[0] == 1.0
    texts = [text.get_text() for text in drawn.legends[0].get_texts()]
    assert texts == ["half of the samples", "95 % of them", "95 % interval", "truth"]
    # Half of the samples are within the inner outline.
    (outline,) = (c for c in pair.collections if hasattr(c, "levels"))
    from matplotlib.path import Path as Outline

    inner = outline.get_paths()[1]
    inside = Outline(inner.vertices, inner.codes).contains_points(values)
    # It is smoothed, and steps of a bin.
    assert np.mean(inside) == pytest.approx(0.5, abs=0.12)
    with styled():
        unknown = draw_corner(model.parameters, values, told, {}, "")
    assert "truth" not in [text.get_text() for text in unknown.legends[0].get_texts()]
