"""The campaign behind the documentation's table of fit statuses, with a few traces."""

import pandas as pd
import pytest

from tests.helpers.status_campaign import QUANTITIES, SET_UPS, TABLE, answers, counted


@pytest.mark.parametrize("name", ["white", "jump", "unit"])
def test_right_set_ups_are_ok_and_wrong_ones_are_not(name: str) -> None:
    """Two limits of 95 % miss the truth both once in 400 traces."""
    set_up = SET_UPS[name]
    found = answers(set_up, "white", range(2))
    table = counted(set_up, {"white": found})
    assert len(table) == len(QUANTITIES)
    if set_up.right:
        assert [each.status for each in found] == ["ok", "ok"]
        assert (table["coverage_percent"] > 0).all()
    else:
        assert (table["rejected_percent"] + table["refused_percent"] == 100).all()


def test_the_table_is_of_these_set_ups() -> None:
    table = pd.read_csv(TABLE)
    assert list(table["set_up"].unique()) == [each.title for each in SET_UPS.values()]
    assert set(table["noise_model"]) == {"white", "coloured"}
    assert set(table["traces"]) == {500}
