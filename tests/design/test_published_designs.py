"""Designs in config/designed.yaml: within their own limits, nothing is better."""

import numpy as np
import pandas as pd
import pytest

from biogrip.design.schedule import presses
from tests.helpers.designs_campaign import (
    GAP,
    KINDS,
    TABLE,
    TRIED,
    published_design,
    summarize,
    try_others,
)

CASES = ["liquid_drop_1", "liquid_drop_2", "endothelial_cell"]
# Ratings are in coarser bins of time than lists; of neighbours their errors are alike.
ROUNDED = 3e-3


@pytest.mark.parametrize("case_name", CASES)
def test_no_train_beside_it_or_at_random_is_better(case_name: str) -> None:
    published = published_design(case_name)
    case, inputs = published.case, published.inputs
    assert len(case.phases) <= inputs.limits.most_steps
    assert max(phase.left.value_Nm for phase in case.phases) <= inputs.largest_Nm
    assert presses(inputs, case.phases)
    assert np.log(published.bound) == pytest.approx(published.rated.logarithm, abs=ROUNDED)
    # Others than those of the table, which are drawn in fewer parts.
    found = summarize(
        pd.concat([try_others(case_name, kind, TRIED, tried=60) for kind in KINDS])
    ).set_index("kind")
    assert found["tried"].tolist() == [60, 60]
    assert not found["better"].any()
    # Of neighbours some change next to nothing.
    assert found.loc["neighbour", "best_excess_percent"] < 1
    assert found.loc["random", "best_excess_percent"] > 5


def test_the_table_has_thousands_of_each() -> None:
    table = pd.read_csv(TABLE)
    assert sorted(map(tuple, table[["case", "kind"]].to_numpy())) == sorted(
        (case_name, kind) for case_name in CASES for kind in KINDS
    )
    assert (table["tried"] == TRIED).all()
    assert not table["better"].any()
    assert (table["best_excess_percent"] >= -100 * GAP).all()
