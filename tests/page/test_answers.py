"""The answers on the page: what its tables say, and no more."""

import pytest

from biogrip.page.answers import (
    compared_rows,
    say_what_claims_are,
    say_what_the_study_gives,
    say_what_traces_tell,
    say_which_method_finds_it,
)

TITLES = {"cell": "A cell", "drop": "A drop"}


def verdict(case: str, quantity: str, told: str = "determined") -> dict[str, str]:
    return {"case": case, "quantity": quantity, "verdict": told}


VERDICTS = [
    *(verdict("cell", name) for name in ("k", "c", "c + c_p")),
    verdict("drop", "k", "not determined"),
    verdict("drop", "c"),
    verdict("drop", "c_p", "bounded above"),
]


@pytest.mark.parametrize(
    ("verdicts", "said"),
    [
        (
            VERDICTS,
            "A trace always determines c and c + c_p, provided that the branch, k and c in series, "
            "relaxes within the experiment. It never determines c_p. It determines k in 1 of 2 "
            "samples.",
        ),
        ([VERDICTS[0], VERDICTS[4]], "A trace always determines k and c."),
        ([verdict("cell", "k", "fit rejected")], "A trace never determines k."),
        ([], ""),
    ],
)
def test_what_traces_tell_is_what_the_verdicts_are(
    verdicts: list[dict[str, str]], said: str
) -> None:
    assert say_what_traces_tell(verdicts) == said


def method(name: str, case: str, share: str, responses: str) -> dict[str, str]:
    ends = {"reached_low": "0.1", "reached_high": "1"}
    row = {"method": name, "case": case, "reached_share": share, "median_evaluations": responses}
    return row | ends | {"seeds": "50"}


OWN = "genetic algorithm"
METHODS = [
    *(method(OWN, "cell", "0.18", "18250"), method(OWN, "drop", "1", "15375")),
    *(method("dear search", "cell", "1", "900"), method("dear search", "drop", "0.98", "900")),
    *(method("cheap search", "cell", "1", "90.5"), method("cheap search", "drop", "0.98", "800")),
]


def test_the_study_s_own_method_is_measured_by_what_it_can_encode() -> None:
    assert say_what_the_study_gives(METHODS, OWN, TITLES, "The").replace("\xa0", " ") == (
        "The genetic algorithm finds the best fit that its digits can express in 18 % of 50 runs "
        "(95 % interval: 10 to 100 %) on “A cell” and 100 % (10 to 100 %) on “A drop”."
    )
    assert say_what_the_study_gives(METHODS, "other", TITLES, "The") == ""


def test_the_surest_method_is_named_before_the_study_s_own() -> None:
    """The cheaper of two that are as sure, by the sample of which it fits the fewest traces."""
    assert say_which_method_finds_it(METHODS, OWN).replace("\xa0", " ") == (
        "Cheap search finds that fit, or a better one, in at least 98 % (10 to 100 %) of the runs "
        "on each sample, with 90 to 800 simulated responses; the genetic algorithm takes 15,000 to "
        "18,000."
    )
    assert say_which_method_finds_it([], OWN) == ""


def test_the_paper_s_values_stand_beside_medians_of_each_basin() -> None:
    """Powers as powers, units on their line, no row that no trace determines."""
    row = {"case": "drop", "unit": "N s/m", "target": "0.001", "seeds": "50"}
    row |= {"paper_identified": "5.6e-05", "paper_error_percent": ">100", "basin": "all"}
    row |= {"median_identified": "0.0039", "p25_identified": "1.1e-05", "p75_identified": "3360"}
    every = [row | {"parameter": "c"}, row | {"parameter": "c_p"}]
    found = compared_rows(every, VERDICTS, TITLES)
    assert [text.replace("\xa0", " ") for text in found[0].values()] == [
        *("A drop", "c (N s/m)", "0.001", "5.6·10⁻⁵ (>100 %)", "all", "0.0039 (−290 %)"),
        "1.1·10⁻⁵ to 3360",
    ]
    assert len(found) == 1
    split = [row | {"parameter": "c", "basin": "near the noise", "seeds": "23"}]
    (only,) = compared_rows([*every, *split], VERDICTS, TITLES)
    # Wilson's interval of 23 of 50.
    assert only["runs"].replace("\xa0", " ") == "46 % (33 to 60 %) near the noise"


def test_verdicts_on_claims_are_counted() -> None:
    verdicts = ("in part", "not", "replicated", "in part", "cannot be told")
    claims = [{"verdict": verdict} for verdict in (*verdicts, "outside the printed encoding")]
    assert say_what_claims_are(claims) == (
        "Of the paper's 6 claims 1 are replicated, 2 in part, 1 not; 1 are outside the printed "
        "encoding, and 1 cannot be told."
    )
    assert say_what_claims_are([]) == ""
