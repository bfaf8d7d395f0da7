"""What CONTRIBUTING says of how to add something is enough: it is added so, and a study uses it."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from biogrip.products.files.traces import read_measurements
from tests.helpers.places import ROOT
from tests.helpers.recipes import CONFIG, RECIPES, Recipe
from tests.helpers.runs import copied_tree, snakemake

ROW = re.compile(r"^\| (a [\w ]+) \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)


def rows() -> dict[str, str]:
    """What to touch, by what is to be added."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    _, _, text = text.partition("## Where a change goes")
    return {thing: touch for thing, touch, _ in ROW.findall(text)}


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.thing)
def test_a_recipe_names_every_file_that_it_touches(recipe: Recipe) -> None:
    """New modules by their folder; and in files that are there it adds a few lines."""
    touched = rows()[recipe.thing]
    for name in recipe.edits:
        assert f"`src/biogrip/{name}`" in touched or recipe.thing == "a config key"
    for name in recipe.new:
        assert f"`src/biogrip/{Path(name).parent}/`" in touched
    assert recipe.lines < 10
    assert len(recipe.files) <= 2


def test_a_study_uses_one_more_of_each(tmp_path: Path) -> None:
    tree = copied_tree(tmp_path)
    tree.study.mkdir()
    for recipe in RECIPES:
        recipe.follow(tree.root)
    run = snakemake(tree.study, config=CONFIG, tree=tree)
    assert run.status == 0, run.output
    results = tree.study / "results"
    found = pd.read_csv(results / "identifications" / "my_cell.csv")
    assert found["method"].tolist() == 2 * ["random_search"] + 2 * ["least_squares"]
    assert {"k_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m"} <= set(found)
    noise = pd.read_csv(results / "tables" / "noise_levels.csv")
    assert noise["kind"].tolist() == ["laplace"]
    models = pd.read_csv(results / "tables" / "models.csv")
    assert models["model"].tolist() == ["Maxwell liquid", "Jeffreys fluid (made the traces)"]
    (measured,) = (results / "measurements" / "my_cell").glob("*.parquet")
    steps = read_measurements(measured, [0]).rotation_rad[0] / 1e-6
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    for figure in ("heights", "scatter_my_cell", "waterfall_my_cell", "moduli"):
        assert (results / "figures" / f"{figure}.png").stat().st_size > 5000
    page = (results / "report.html").read_text(encoding="utf-8")
    for text in ("random search", "Jeffreys fluid", "How high every case rises", "noise_levels"):
        assert text in page
