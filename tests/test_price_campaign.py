"""The campaign behind the documentation's numbers of experiments at a price, with few cells."""

import numpy as np
import pandas as pd
import pytest

from biogrip.design.schedule import Plan
from biogrip.experiment.sampling import Burst
from biogrip.study.load import load_study, read_configs
from tests.helpers.places import CONFIG, ROOT
from tests.helpers.price_campaign import CELL, CELLS, DESIGNED_AFTER, TABLE, known_to


@pytest.mark.parametrize(
    ("paper", "often", "known"), [(False, 400, True), (False, 1, False), (True, 400, False)]
)
def test_cells_are_known_by_enough_of_what_shows_them(paper: bool, often: int, known: bool) -> None:
    """At 10 Hz nothing shows c_p; of the designed experiment, often enough is enough."""
    files = [CONFIG] if paper else [CONFIG, ROOT / "config" / "designed.yaml"]
    case = load_study(read_configs(files), files).cases[CELL]
    bursts = (Burst(0.1, 10.0, 4000),) if paper else case.sampling.bursts
    plan = Plan(case.phases, tuple(bursts), np.zeros(0), 0.0)
    assert known_to([plan], [often], 3) is known


def test_the_chosen_set_costs_what_is_said_and_tells_enough() -> None:
    table = pd.read_csv(TABLE)
    chosen = table[table["way"] == "chosen"]
    each = 60 + chosen["seconds"] + 0.01 * chosen["readings"] + chosen["changes"]
    cost, share = chosen["cost"].iloc[0], chosen["share_percent"].iloc[0]
    assert cost == pytest.approx((each * chosen["times"]).sum(), rel=1e-3)
    assert share >= 95
    at_once = table[(table["way"] == "designed at once") & (table["share_percent"] >= 95)]
    assert cost == at_once["cost"].min()
    # Of cells that are neither those that it was chosen for nor those that it was judged by.
    simulated = chosen["simulated_percent"].iloc[0]
    assert chosen["simulated"].iloc[0] == CELLS
    assert abs(simulated - share) < 300 * np.sqrt(0.05 * 0.95 / CELLS)


def test_repeating_one_experiment_is_a_set_too() -> None:
    table = pd.read_csv(TABLE)
    least = table[table["least_percent"].notna()].pivot(
        index="least_percent", columns="way", values="cost"
    )
    assert (least["designed at once"] <= least["one repeated"]).all()
    at_once, repeated = (
        table[(table["way"] == way) & table["least_percent"].isna()]
        for way in ("designed at once", "one repeated")
    )
    for cost, share in zip(repeated["cost"], repeated["share_percent"], strict=True):
        assert at_once[at_once["share_percent"] >= share]["cost"].min() <= cost
    assert least["designed at once"].is_monotonic_increasing
    assert len(table[table["way"] == DESIGNED_AFTER]) == 4
