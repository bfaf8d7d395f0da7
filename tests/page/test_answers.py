from biogrip_study.page import answers

TITLES = {"cell": "A cell", "drop": "A drop"}


def counted(case: str, quantity: str, verdict: str, hits: str) -> dict[str, str]:
    return {"case": case, "quantity": quantity, "verdict": verdict, "reached": hits, "seeds": "20"}


def test_a_row_a_sample_tells_how_many_traces_determine_a_quantity() -> None:
    rows = [counted("cell", "k", "determined", "20"), counted("cell", "c_p", "bounded above", "20")]
    rows += [counted("drop", "k", "bounded above", "17"), counted("drop", "k", "determined", "3")]
    assert answers.rows_of_determined(rows, TITLES) == [
        {"sample": "A cell", "k": "all: 20 of 20", "c_p": "none: 0 of 20"},
        {"sample": "A drop", "k": "some: 3 of 20", "c_p": ""},
    ]


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


def test_the_surest_method_is_named_before_the_study_s_own() -> None:
    """The cheaper of two that are as sure, by the sample of which it fits the fewest traces."""
    assert answers.say_which_method_finds_it(METHODS, OWN).replace("\xa0", " ") == (
        "Cheap search comes as low, or lower, in at least 98 % (10 to 100 %) of the runs on each "
        "sample, with 90 to 800 simulated responses; the genetic algorithm takes 15,000 to 18,000."
    )
    assert answers.say_which_method_finds_it([], OWN) == ""
    assert answers.say_what_the_study_gives(METHODS, "other", TITLES, "The", 1.0) == ""
