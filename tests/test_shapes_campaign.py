"""The campaign behind the documentation's numbers of ramps and sinusoids, with few torques."""

import numpy as np
import pandas as pd

from tests.helpers.shapes_campaign import KINDS, TABLE, told
from tests.published_numbers import PUBLISHED


def test_a_longer_search_is_what_the_table_has() -> None:
    few = told("liquid_drop_2", "sinusoids", 10.0, 128)["bound_percent"].max()
    table = pd.read_csv(TABLE)
    there = table[(table["case"] == "liquid_drop_2") & (table["shape"] == "sinusoids")]
    # The search looks at coarser cells than the plan.
    assert 0.5 * few < there["bound_percent"].max() < 1.05 * few


def test_its_steps_are_those_of_the_published_designs() -> None:
    table = pd.read_csv(TABLE)
    steps = table[table["shape"] == "steps"].set_index(["case", "quantity"])["bound_percent"]
    designed = pd.read_csv(PUBLISHED / "design" / "tables" / "designed.csv")
    published = designed.set_index(["case", "quantity"])["bound_percent"]
    # In print both have four digits or fewer.
    np.testing.assert_allclose(steps[published.index], published, rtol=6e-3)


def test_the_table_has_every_kind_and_each_has_its_proof() -> None:
    table = pd.read_csv(TABLE)
    kinds = set(zip(table["shape"], table["shortest_ms"], strict=True))
    assert kinds == set(KINDS)
    assert len(table) == 3 * 4 * len(KINDS)
    assert table["gap_percent"].max() < 1
