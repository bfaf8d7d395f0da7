"""The answers on the page: what its tables say, and no more."""

import pandas as pd
import pytest

from biogrip.page.answers import (
    compare_with_paper,
    say_what_traces_tell,
    say_which_method_finds_it,
)
from biogrip.records.rows import read_table
from tests.helpers.places import ROOT

TABLES = ROOT / "results" / "published" / "tables"
NAMES = {"cell": "Table 5", "drop": "Table 6"}


def error(
    case: str, parameter: str, paper: str, seeds: str = "50", median: str = "2"
) -> dict[str, str]:
    """A row of a quantity that 90 % of the seeds find between 1 and 3."""
    row = {"case": case, "parameter": parameter, "paper_identified": paper, "seeds": seeds}
    row |= {"basin": "all", "median_identified": median}
    return row | {"p05_identified": "1", "p95_identified": "3"}


def verdict(case: str, quantity: str, told: str = "determined") -> dict[str, str]:
    low, high = ("1.9", "2.1") if told == "determined" else ("", "5")
    row = {"case": case, "quantity": quantity, "verdict": told}
    return {**row, "expected_low": low, "expected_high": high}


VERDICTS = [
    *(verdict("cell", name) for name in ("k", "c", "c + c_p")),
    verdict("drop", "k", "not determined"),
    verdict("drop", "c"),
    verdict("drop", "c_p", "bounded above"),
]


def test_a_value_is_replicated_in_full_in_part_or_not() -> None:
    """Or cannot be compared: what the paper has not, and too few seeds for a middle 90 %."""
    errors = [
        error("cell", "k", "2.5"),
        error("cell", "c", "2.5", median="2.2"),
        error("cell", "c + c_p", "3.1"),
        error("drop", "k", "1"),
        error("drop", "c", "3"),
        error("drop", "c_p", ""),
    ]
    said = compare_with_paper(errors, VERDICTS, NAMES)
    assert said.startswith("Of 5 values of the paper, sums included, 2 are replicated (")
    assert "): k of Table 5, c of Table 6; 2 are replicated in part (" in said
    assert said.endswith("): c of Table 5, k of Table 6; 1 is not replicated: c + c_p of Table 5.")
    assert compare_with_paper([error("cell", "k", "")], VERDICTS, NAMES) == ""
    assert "takes 20 seeds" in compare_with_paper([error("cell", "k", "2", "4")], VERDICTS, NAMES)


@pytest.mark.parametrize(
    ("verdicts", "said"),
    [
        (
            VERDICTS,
            "A trace always determines c and c + c_p, never c_p and the rest sometimes: "
            "k in 1 of 2 samples.",
        ),
        ([VERDICTS[0], VERDICTS[3]], "A trace determines each sometimes: k in 1 of 2 samples."),
        ([verdict("cell", "k", "fit rejected")], "A trace never determines k."),
        ([], ""),
    ],
)
def test_what_traces_tell_is_what_the_verdicts_are(
    verdicts: list[dict[str, str]], said: str
) -> None:
    assert say_what_traces_tell(verdicts) == said


def method(name: str, share: str, responses: str) -> dict[str, str]:
    return {"method": name, "reached_share": share, "median_evaluations": responses}


def test_the_surest_method_is_named_before_the_study_s_own() -> None:
    """The cheaper of two that are as sure."""
    own, dear, cheap = "genetic algorithm", "dear search", "cheap search"
    rows = [
        *(method(own, "0", "18250"), method(own, "0.68", "15375")),
        *(method(dear, "1", "900"), method(dear, "0.98", "900")),
        *(method(cheap, "1", "90.5"), method(cheap, "0.98", "800")),
    ]
    assert say_which_method_finds_it(rows, own) == (
        "Cheap search reaches the best encodable fit in 98 to 100 % of the traces, with 90 to 800 "
        "simulated responses in the median; the genetic algorithm in 0 to 68 % of the traces, with "
        "15375 to 18250 simulated responses in the median."
    )
    assert say_which_method_finds_it([], own) == ""


def test_the_published_study_is_counted_as_pandas_counts_it() -> None:
    errors, files = (
        pd.read_csv(TABLES / "errors.csv").query("basin == 'all'"),
        sorted(TABLES.glob("verdicts_*.csv")),
    )
    verdicts = pd.concat(map(pd.read_csv, files)).rename(columns={"quantity": "parameter"})
    both = errors.merge(verdicts, on=["case", "parameter"])
    assert len(both) == len(errors) > 10
    inside = both.paper_identified.between(both.p05_identified, both.p95_identified)
    close = both.median_identified.between(both.expected_low, both.expected_high)
    said = compare_with_paper(
        read_table(TABLES / "errors.csv"),
        [row for file in files for row in read_table(file)],
        {case: case for case in errors.case},
    )
    assert f"Of {len(both)} values" in said
    assert f", {sum(inside & close)} are replicated (" in said
    assert f"; {sum(inside & ~close)} are replicated in part (" in said
    assert f"; {sum(~inside)} are not replicated: " in said
