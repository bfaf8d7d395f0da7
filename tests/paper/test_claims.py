"""Verdicts on the paper's claims: the rules, and what they make of runs written by hand."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.physics.models import Published, Sample
from biogrip.records.rows import read_table, write_arrays
from tests.helpers.default import seen
from tests.helpers.places import ROOT
from workflow.paper.claims import (
    CLOSE,
    FEW,
    FEWEST_SEEDS,
    IN_PART,
    MOST,
    NEAR,
    NOT,
    OUTSIDE,
    REPLICATED,
    UNDECIDED,
    LackingError,
    Results,
    add_columns,
    altogether,
    by_share,
    is_encodable,
    judge,
    judge_all,
    of_seeds,
    read_runs,
    values_of,
)

CLAIMS = yaml.safe_load((ROOT / "workflow/paper/claims.yaml").read_text(encoding="utf-8"))
SEEDS = 40
HALF = np.arange(SEEDS) < SEEDS // 2
TRUE = {"k": 8.0, "k_p": 2.0, "c": 100.0, "c_p": 1e-3}
PRINTED = {"k": 7.0, "k_p": 2.0, "c": 97.0, "c_p": 3.0}
NAMES = (*TRUE, "c + c_p")


def claim(words: str, place: str = "") -> Any:
    """The only claim at a place that begins with some words."""
    (found,) = (c for c in CLAIMS if c["words"].startswith(words) and place in c["place"])
    return found


@pytest.mark.parametrize(
    ("judged", "verdict"),
    [
        *((by_share(share), REPLICATED) for share in (1, 0.9)),
        *((by_share(share), IN_PART) for share in (0.89, 0.11)),
        *((by_share(share), NOT) for share in (0.1, 0)),
        # Of several things, it holds in part if they differ.
        *((altogether([REPLICATED, other]), IN_PART) for other in (NOT, IN_PART, OUTSIDE)),
        *((altogether([NOT, NOT]), NOT), (altogether([UNDECIDED, IN_PART]), IN_PART)),
        # What no run can meet neither flatters nor condemns.
        *((altogether([OUTSIDE, UNDECIDED]), OUTSIDE), (altogether([]), UNDECIDED)),
        (altogether([NOT, OUTSIDE, UNDECIDED]), NOT),
    ],
)
def test_shares_and_several_things_have_verdicts(judged: str, verdict: str) -> None:
    assert judged == verdict


def test_a_number_that_the_paper_rounds_may_be_five_percent_off() -> None:
    told = {"quantity": "voltage for 1.6e-09 N m", "paper": "about 17", "unit": "V"}
    rows = [told | {"this_study": volts} for volts in (17.84, 17.86, 16.0)]
    tables = {"evidence": pd.DataFrame([*rows, told | {"quantity": "arm", "this_study": 17.0}])}
    add_columns(tables)
    assert tables["evidence"]["as_printed"].tolist()[:3] == [True, False, False]
    assert tables["evidence"]["as_printed"].isna().tolist() == [False, False, False, True]


@pytest.mark.parametrize(
    ("printed", "nearest", "holds"),
    [
        *((12.3, 12.0, False), (5.6e-5, 1.1e-4, False), (302.5, 310.0, False), (9.7, 9.7, True)),
        # One digit is printed, and 9.9e-5 rounds to it; two are, and it does not.
        *((1e-4, 9.9e-5, True), (1e-4, 1.6e-4, False), (1.1e-4, 9.9e-5, False)),
    ],
)
def test_genes_hold_a_printed_value_if_theirs_would_be_printed_alike(
    printed: float, nearest: float, holds: bool
) -> None:
    assert is_encodable(printed, nearest) is holds


def test_shares_of_seeds_have_limits() -> None:
    """Wilson's for 23 of 50, by hand: 33 to 60 %."""
    assert of_seeds(np.arange(50) < 23) == "46 % (33 to 60)"


def case_of(table: int) -> Any:
    published = Published(table=table, generation=70, identified=PRINTED, error_percent={})
    known = {"sample": Sample("generalized_maxwell"), "parameters": TRUE, "published": published}
    study = seen(near_noise_tolerance=0.02, config=seen(methods=["genetic"]))
    return seen(name="mine", seeds=3, title="Mine", noise=seen(level=0.1), study=study, **known)


def identified(
    table: int, nearest: dict[str, float] | None = None, told: str = "determined", **runs: Any
) -> Results:
    """Of runs at the truth but for what is given for each seed; genes hold the nearest values."""
    case = case_of(table)
    found = pd.DataFrame({"seed": range(SEEDS), **TRUE, **runs})
    rows = [
        {"case": "mine", "parameter": name, "quantity": what, "nearest_encodable": value}
        for what in ("target", "identified")
        for name, value in (nearest or PRINTED).items()
    ]
    verdicts = {"expected_verdict": "determined", "expected_high": np.nan}
    expected = pd.DataFrame({"quantity": NAMES, **verdicts})
    expected.loc[expected["quantity"] == "c", "expected_verdict"] = told
    tables = {"printed_values": pd.DataFrame(rows), "verdicts_mine": expected}
    values = values_of(case, found, tables).assign(of_table=table)
    return Results(seen(cases={"mine": case}), {"values": values, "values at 20": values})


def test_an_order_of_magnitude_is_half_a_decade_on_both_sides() -> None:
    k = np.resize([8 / 3.17, 8 / 3.16, 8, 25.2, 25.4], SEEDS)
    decades = identified(6, k=k).tables["values"].query("quantity == 'k'")["decades"]
    assert (decades <= 0.5).tolist()[:5] == [False, True, True, True, False]
    verdict, evidence = judge(claim("catch k_p and k"), identified(6, k=k))
    assert verdict == IN_PART
    assert evidence.endswith("Table 6: k 60 % (45 to 74), k_p 100 % (91 to 100).")


def test_runs_are_read_at_generations_and_with_their_last_improvement(tmp_path: Path) -> None:
    """With the generation as the value of every parameter."""
    at = [*(0, 10, 19, 30, 40), *(0, 10, 19), *(0, 10, 19)]
    misfits = [*(5.0, 4.0, 4.0, 3.0, 3.0), *(5.0, 5.0, 5.0), *(9.0, 1.0, 1.5)]
    columns = {p.column: at for p in case_of(5).sample.model.parameters}
    columns |= {"seed": [*5 * [0], *3 * [1], *3 * [2]], "generation": at}
    history = {"method": 11 * ["genetic"], "best_misfit": misfits, **columns}
    write_arrays(tmp_path / "h.npz", {name: np.array(each) for name, each in history.items()})
    known = {"case": "mine", "method": "genetic", "misfit": 1.02, "noise_rms": 1.0}
    known |= {"generations": 9, "evaluations": 9, "stop_reason": "stalled"}
    last = pd.DataFrame(columns).groupby("seed", as_index=False).last().assign(**known)
    last.to_csv(tmp_path / "f.csv", index=False)
    runs = read_runs(case_of(5), tmp_path / "f.csv", tmp_path / "h.npz")
    assert runs[""]["last_improvement"].tolist() == [30, 0, 10]
    assert runs[""]["rises"].tolist() == [False, False, True]
    assert runs[""]["near_noise"].all()
    assert runs[" at 20"]["k"].tolist() == [19, 19, 19]
    assert runs[" at 60"]["k"].tolist() == [40, 19, 19]


def test_the_sum_of_dampers_may_be_right_where_c_is_not() -> None:
    c = np.linspace(5, 60, SEEDS)
    verdict, evidence = judge(claim("identify with small error"), identified(6, c=c, c_p=100.0 - c))
    assert verdict == IN_PART
    assert "3 %: 0 % (0 to 9) for c, 100 % (91 to 100) for c + c_p" in evidence
    assert judge(claim("identify with small error"), identified(6, c=c, c_p=0 * c + 1))[0] == NOT


def test_identified_values_are_judged_where_genes_hold_and_traces_determine_them() -> None:
    """Of 7, 2, 97 and 3: near it 1, 1, 0.5 and 0 of the seeds; the sum of dampers is right."""
    c = np.where(HALF, 97.0, 60.0)
    known: dict[str, Any] = {
        "told": "not determined",
        "k": np.full(SEEDS, 7.1),
        "c": c,
        "c_p": 100.0 - c,
    }
    values = claim("identified values", "Table 7")
    verdict, evidence = judge(values, identified(7, **known))
    assert verdict == IN_PART
    for said in (
        *("k = 7 replicated: 100 %", "c = 97 cannot be told: 50 %", "c_p = 3 in part: 50 %"),
        "c + c_p = 100 replicated, provided that the branch, k and c in series, relaxes",
    ):
        assert said in evidence
    beyond = {"k": 8.0, "k_p": 3.0, "c": 90.0, "c_p": 4.0}
    verdict, evidence = judge(values, identified(7, nearest=beyond, **known))
    assert verdict == OUTSIDE
    assert "k = 7 outside the printed encoding: 100 %" in evidence


@pytest.mark.parametrize(("nearest", "verdict"), [(2.0, IN_PART), (2.1, OUTSIDE)])
def test_an_error_below_that_of_every_gene_is_outside_of_the_encoding(
    nearest: float, verdict: str
) -> None:
    """Of k_p the paper has none and of c 3 %; half of the runs are as close."""
    genes = PRINTED | {"k_p": nearest, "c": 100 * nearest / 2}
    runs: dict[str, Any] = {"k_p": np.where(HALF, 2.0, 9.0), "c": np.where(HALF, 103.0, 900.0)}
    negligible = claim("k_p and c have")["parts"][0]
    judged, evidence = judge(negligible, identified(5, nearest=genes, **runs))
    assert judged == verdict
    assert f"genes allow {50 * (nearest - 2):.2g} % at best" in evidence


def test_errors_are_held_against_the_level_of_the_noise() -> None:
    k = np.where(np.arange(SEEDS) < 10, 8.7, 8.9)
    verdict, evidence = judge(claim("the error on k is lower"), identified(5, k=k))
    assert (verdict, evidence[:4]) == (IN_PART, "25 %")


def test_both_are_right_in_the_seeds_in_which_each_is() -> None:
    k, c = np.where(HALF, 8.0, 9.0), np.where(np.arange(SEEDS) < 30, 103.0, 104.0)
    verdict, evidence = judge(claim("good identification"), identified(7, k=k, c=c))
    assert verdict == IN_PART
    assert [part.split(" %")[0] for part in evidence.split(": ")[1].split("), ")] == [
        *("k 50", "c 75", "both 50")
    ]


def test_jaws_that_would_have_to_pull_hold_one_sample_in_three() -> None:
    forces = {"lowest_force_uN": [0.2, 0.3, -0.7, -0.6], "of_table": [5, 5, 6, 7]}
    grip = Results(seen(), {"mechanics": pd.DataFrame(forces)})
    verdict, evidence = judge(claim("in order to maintain"), grip)
    assert verdict == IN_PART
    assert "0.2 µN (Table 5), -0.7 µN (Table 6), -0.6 µN (Table 7)" in evidence


@pytest.mark.parametrize(("refuted", "verdict"), [((9, 9, 9), REPLICATED), ((11, 9, 9), IN_PART)])
def test_models_that_fit_as_well_are_held_against_the_one_that_made_the_traces(
    refuted: tuple[float, ...], verdict: str
) -> None:
    columns = ("model", "parameters", "median_delta_bic", "chosen_by_bic")
    rows = [
        {"case": case, "of_table": table, "seeds": 50, **dict(zip(columns, row, strict=True))}
        for case, table, bic in zip("abc", (5, 6, 7), refuted, strict=True)
        for row in (
            ("damper", 1, bic, 0),
            ("drop", 3, 2.0, 43),
            ("general (made the traces)", 4, 8.0, 7),
            ("richer", 6, 99.0, 0),
        )
    ]
    tables = {"models": pd.DataFrame(rows)}
    add_columns(tables)
    judged, evidence = judge(claim("nor the specific"), Results(seen(), tables))
    assert judged == verdict
    assert f"Table 5: {int(refuted[0] > 10)} of 2, 7 of 50 traces" in evidence


def test_few_seeds_and_missing_tables_tell_nothing() -> None:
    values = identified(5).tables["values"].query("seed < 19")
    few = Results(seen(), {"values": values})
    with pytest.raises(LackingError, match="19 seeds, and it takes 20"):
        judge(claim("the error on k is lower"), few)
    with pytest.raises(LackingError, match="no table models"):
        judge(claim("nor the specific"), few)
    with pytest.raises(LackingError, match="Table 7"):
        judge(claim("good identification"), identified(5))


def test_a_sweep_is_judged_where_it_is_run() -> None:
    """Elsewhere the verdict says which config runs it."""
    robust = claim("highly robust")
    (row,) = judge_all([robust], Results(seen(), {}), "").rows
    assert (row["verdict"], row["evidence"]) == (
        UNDECIDED,
        "Not here: the study has no table robustness_noise; config/robustness.yaml makes it.",
    )
    sweep: dict[str, Any] = {"of_table": [5, 5, 6, 7], "quantity": "k", "row": [0, 2, 2, 2]}
    sweep |= {"error_genetic": [9.0, 1.3, 1.4, 1.3], "bound_percent": 1.0}
    verdict, evidence = judge(robust, Results(seen(), {"robustness_noise": pd.DataFrame(sweep)}))
    assert verdict == IN_PART
    assert "100 % (k, Table 5), 0 % (k, Table 6), 100 % (k, Table 7)" in evidence


def test_every_claim_of_the_published_study_has_a_verdict_and_evidence() -> None:
    rows = read_table(ROOT / "results" / "published" / "tables" / "claims.csv")
    told = [(row["place"], row["claim"]) for row in rows]
    assert told == [(claim["place"], claim["words"]) for claim in CLAIMS]
    assert {row["verdict"] for row in rows} == {REPLICATED, IN_PART, NOT, OUTSIDE, UNDECIDED}
    assert [row for row in rows if not row["evidence"]] == []
    # What this study lacks are sweeps alone.
    lacking = [row["evidence"] for row in rows if "Not here" in row["evidence"]]
    assert len(lacking) == 3
    assert [words for words in lacking if "yaml makes it" not in words] == []


def test_the_rules_are_told_where_the_table_stands() -> None:
    caption = (ROOT / "workflow" / "report" / "tables" / "claims.rst").read_text(encoding="utf-8")
    rules = " ".join(caption.split())
    for number in (MOST, FEW, CLOSE, NEAR):
        assert f" {100 * number:g} % " in rules
    assert f"{FEWEST_SEEDS} seeds" in rules
    assert OUTSIDE in rules
