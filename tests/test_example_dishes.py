"""The dishes of the tutorial are what their truth makes."""

import pandas as pd

from tests.helpers.example_dishes import FOLDER, SLIPPED, TREATED, files
from tests.helpers.places import ROOT

TABLES = ROOT / "results" / "published" / "dishes" / "tables"


def test_traces_and_sheet_are_what_the_truth_makes() -> None:
    there = {file.name: file.read_text(encoding="utf-8") for file in FOLDER.iterdir()}
    assert there == files()


def test_the_published_comparison_finds_the_truth() -> None:
    """Limits hold 95 % of the time; these do. The trace whose readings jump is rejected alone."""
    rows = pd.read_csv(TABLES / "group_differences.csv").set_index("quantity")
    for quantity, ratio in (("k", TREATED), ("k_p", TREATED), ("c", 1.0)):
        assert rows.loc[quantity, "low"] < ratio < rows.loc[quantity, "high"]
    traces = pd.read_csv(TABLES / "traces.csv")
    assert traces.loc[traces["fit"] == "rejected", "cell"].tolist() == [SLIPPED]
