"""The campaign behind the documentation's table of noise, with a few traces."""

import numpy as np
import pandas as pd
import pytest

from tests.helpers.noise_campaign import KINDS, TABLE, counted, seen


@pytest.mark.parametrize("name", ["drift", "gripper"])
def test_intervals_hold_the_truth_where_those_for_white_noise_do_not(name: str) -> None:
    """Of 4 traces and 4 quantities, intervals of 95 % fail 4 times or more once in 140."""
    found = [seen(KINDS[name], seed) for seed in range(4)]
    table = counted(KINDS[name], found)
    assert table["coverage_percent"].mean() >= 100 * 13 / 16 - 1e-9
    assert table["white_coverage_percent"].mean() < 85
    if name == "drift":
        assert np.all(table["flagged_percent"] == 100)


def test_the_table_is_of_these_kinds() -> None:
    table = pd.read_csv(TABLE)
    titles = {kind.title for kind in KINDS.values()}
    assert set(table["noise"]) <= titles
    assert {"white", KINDS["slow"].title, KINDS["flicker"].title} <= set(table["noise"])
    assert table["traces"].min() >= 500


def test_noise_that_grows_is_seen_and_its_intervals_hold_the_truth() -> None:
    """Of 4 traces and 4 quantities, intervals of 95 % fail 4 times or more once in 140."""
    table = counted(KINDS["growing"], [seen(KINDS["growing"], seed) for seed in range(4)])
    assert table["coverage_percent"].mean() >= 100 * 13 / 16 - 1e-9
    assert np.all(table["flagged_percent"] == 100)
