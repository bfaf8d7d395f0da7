"""Verdicts on the paper's claims: the rules, and what they make of runs written by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from biogrip.physics.models import Published, Sample
from biogrip.records.rows import read_table
from biogrip.tables import claims_on_method as method
from biogrip.tables import claims_on_results as results
from biogrip.tables.claim_rules import (
    CLAIMS,
    IN_PART,
    NOT,
    OUTSIDE,
    REPLICATED,
    RULES,
    UNDECIDED,
    Judged,
    LackingError,
    Results,
    Runs,
    altogether,
    by_number,
    by_share,
    is_encodable,
    of_seeds,
    within_a_decade,
)
from biogrip.tables.claims import count_verdicts
from tests.helpers.default import seen
from tests.helpers.places import ROOT

SEEDS = 40
TRUE = {"k": 8.0, "k_p": 2.0, "c": 100.0, "c_p": 1e-3}


@pytest.mark.parametrize(
    ("judged", "verdict"),
    [
        *((by_share(share), REPLICATED) for share in (1, 0.9)),
        *((by_share(share), IN_PART) for share in (0.89, 0.11)),
        *((by_share(share), NOT) for share in (0.1, 0)),
        *(
            (by_number(17, 17.84), REPLICATED),
            (by_number(17, 17.86), NOT),
            (by_number(17, 16), NOT),
        ),
        # Of several things, it holds in part if they differ.
        *((altogether([REPLICATED, other]), IN_PART) for other in (NOT, IN_PART, OUTSIDE)),
        *((altogether([NOT, NOT]), NOT), (altogether([UNDECIDED, IN_PART]), IN_PART)),
        # What no run can meet neither flatters nor condemns.
        *((altogether([OUTSIDE, UNDECIDED]), OUTSIDE), (altogether([]), UNDECIDED)),
        (altogether([NOT, OUTSIDE, UNDECIDED]), NOT),
    ],
)
def test_shares_numbers_and_several_things_have_verdicts(judged: str, verdict: str) -> None:
    assert judged == verdict


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


def test_an_order_of_magnitude_is_half_a_decade_on_both_sides() -> None:
    found = pd.Series([10 / 3.17, 10 / 3.16, 10, 31.6, 31.7])
    assert within_a_decade(found, 10).tolist() == [False, True, True, True, False]


def runs(rows: list[dict[str, float]], table: int = 5, **printed: float) -> Results:
    """Results with the runs on one sample, a row a seed and generation, and nothing else."""
    published = Published(table=table, generation=70, identified=printed, error_percent={})
    history = pd.DataFrame(rows)
    found = history.groupby("seed").last().reset_index()
    sample = Sample("generalized_maxwell")
    known = {"sample": sample, "parameters": TRUE, "published": published}
    case = seen(name="mine", noise=seen(level=0.1), **known)
    study = seen(cases={"mine": case}, near_noise_tolerance=0.02)
    return Results(study, {}, {table: Runs(case, found, history)}, {})


def test_orders_of_magnitude_at_generation_20_are_those_of_that_generation() -> None:
    """Every seed has k_p from the start and k from generation 30; a third stop before, with c."""
    rows = [
        {
            **{"seed": seed, "generation": generation, "best_misfit": 1.0},
            **{"k": 8.0 if generation == 30 else 8e3, "k_p": 3.0},
            **{"c": 100.0 if seed % 3 == 0 else 1.0, "c_p": 7.0},
        }
        for seed in range(3 * SEEDS)
        for generation in ((0, 10) if seed % 3 == 0 else (0, 10, 19, 30))
    ]
    judged = results.judge_early_orders(runs(rows))
    assert judged.verdict == IN_PART
    assert "generation 20: k 0 % (0 to 3), k_p 100 % (97 to 100), c 33 %" in judged.evidence


def test_the_last_improvement_is_the_last_fall_of_the_best_misfit() -> None:
    misfits = {0: [5.0, 4.0, 4.0, 3.0, 3.0], 1: [5.0, 5.0, 5.0], 2: [9.0, 1.0, 1.0]}
    rows = [
        {"seed": seed, "generation": generation, "best_misfit": misfit, "k": 1.0}
        for seed, each in misfits.items()
        for generation, misfit in enumerate(each)
    ]
    found = runs(rows).runs[5]
    assert found.last_improvement.tolist() == [3, 0, 1]


def identified(table: int, **columns: Any) -> Results:
    """Of runs of one generation, at the truth but for what is given for each seed."""
    rows = [
        {"seed": seed, "generation": 1, "best_misfit": 1.0, **TRUE, **own}
        for seed, own in enumerate(pd.DataFrame(columns).to_dict("records"))
    ]
    return runs(rows, table=table, k=7.0, k_p=2.0, c=97.0, c_p=3.0)


def test_the_sum_of_dampers_may_be_right_where_c_is_not() -> None:
    c = np.linspace(5, 60, SEEDS)
    judged = results.judge_key_damper(identified(6, c=c, c_p=100.0 - c))
    assert judged.verdict == IN_PART
    assert "3 %: 0 % (0 to 9) for c, 100 % (91 to 100) for c + c_p" in judged.evidence
    assert results.judge_key_damper(identified(6, c=c, c_p=0 * c)).verdict == NOT


def test_identified_values_are_judged_where_genes_hold_and_traces_determine_them() -> None:
    """Of 7, 2, 97 and 3: near it 1, 1, 0.5 and 0 of the seeds; the sum of dampers is right."""
    c = np.where(np.arange(SEEDS) < SEEDS // 2, 97.0, 60.0)
    known = identified(7, k=np.full(SEEDS, 7.1), c=c, c_p=100.0 - c)

    def verdict(nearest: dict[str, float], **told: str) -> Judged:
        told = {**dict.fromkeys((*TRUE, "c + c_p"), "determined"), **told}
        rows = [
            {"case": "mine", "parameter": name, "quantity": what, "nearest_encodable": value}
            for what in ("target", "identified")
            for name, value in nearest.items()
        ]
        limits = pd.DataFrame({"quantity": told.keys(), "expected_verdict": told.values()})
        tables = {"printed_values": pd.DataFrame(rows), "verdicts_mine": limits}
        return results.judge_values(replace(known, tables=tables), 7)

    every = verdict({"k": 7.0, "k_p": 2.0, "c": 97.0, "c_p": 3.0}, c="not determined")
    assert every.verdict == IN_PART
    for said in (
        *("k = 7 replicated: 100 %", "c = 97 cannot be told: 50 %", "c_p = 3 in part: 50 %"),
        "c + c_p = 100 replicated, provided that the branch, k and c in series, relaxes",
    ):
        assert said in every.evidence
    beyond = verdict({"k": 8.0, "k_p": 3.0, "c": 90.0, "c_p": 4.0}, c="not determined")
    assert beyond.verdict == OUTSIDE
    assert "k = 7 outside the printed encoding: 100 %" in beyond.evidence


@pytest.mark.parametrize(("nearest", "verdict"), [(2.0, IN_PART), (2.1, OUTSIDE)])
def test_an_error_below_that_of_every_gene_is_outside_of_the_encoding(
    nearest: float, verdict: str
) -> None:
    """Of k_p the paper has none and of c 3 %; half of the runs are as close."""
    half = np.arange(SEEDS) < SEEDS // 2
    found = identified(5, k_p=np.where(half, 2.0, 9.0), c=np.where(half, 103.0, 900.0))
    held = {"parameter": ["k_p", "c"], "nearest_encodable": [nearest, 100 * nearest / 2]}
    tables = {
        "printed_values": pd.DataFrame(held).assign(case="mine", quantity="target"),
        "methods": pd.DataFrame({"method": ["other"], "case": ["mine"]}),
    }
    judged = results.judge_negligible(replace(found, tables=tables))
    assert judged.verdict == verdict
    assert f"genes allow {50 * (nearest - 2):.2g} % at best" in judged.evidence


def test_errors_are_held_against_the_level_of_the_noise() -> None:
    k = np.where(np.arange(SEEDS) < 10, 8.7, 8.9)
    judged = results.judge_below_noise(identified(5, k=k))
    assert (judged.verdict, judged.evidence[:4]) == (IN_PART, "25 %")


def test_jaws_that_would_have_to_pull_hold_one_sample_in_three() -> None:
    forces = pd.DataFrame({"case": ["a", "a", "b", "c"], "lowest_force_uN": [0.2, 0.3, -0.7, -0.6]})
    cases = {
        name: seen(title=name, published=seen(table=table))
        for name, table in (("a", 5), ("b", 6), ("c", 7))
    }
    judged = method.judge_grip(Results(seen(cases=cases), {"mechanics": forces}, {}, {}))
    assert judged.verdict == IN_PART
    assert "0.2 µN (Table 5), -0.7 µN (Table 6), -0.6 µN (Table 7)" in judged.evidence


@pytest.mark.parametrize(
    ("refuted", "verdict"),
    [((9, 9, 9), REPLICATED), ((11, 9, 9), IN_PART), ((11, 11, 11), NOT)],
)
def test_models_that_fit_as_well_are_held_against_the_one_that_made_the_traces(
    refuted: tuple[float, ...], verdict: str
) -> None:
    columns = ("model", "parameters", "median_delta_bic", "chosen_by_bic")
    rows = [
        {"case": case, "seeds": 50, **dict(zip(columns, row, strict=True))}
        for case, bic in zip("abc", refuted, strict=True)
        for row in (
            ("damper", 1, bic, 0),
            ("drop", 3, 2.0, 43),
            ("general (made the traces)", 4, 8.0, 7),
            ("richer", 6, 99.0, 0),
        )
    ]
    tables = zip("abc", (5, 6, 7), strict=True)
    cases = {name: seen(published=seen(table=table)) for name, table in tables}
    found = Results(seen(cases=cases), {"models": pd.DataFrame(rows)}, {}, {})
    judged = results.judge_cell_model(found)
    assert judged.verdict == verdict
    assert "7 of 50 traces" in judged.evidence


def test_few_seeds_and_missing_tables_tell_nothing() -> None:
    few = identified(5, k=np.full(19, 8.0))
    with pytest.raises(LackingError, match="19 seeds, and it takes 20"):
        results.judge_below_noise(few)
    with pytest.raises(LackingError, match="no table models"):
        results.judge_cell_model(few)
    with pytest.raises(LackingError, match="Table 7"):
        results.judge_good_identification(few)


def test_every_claim_of_the_published_study_has_a_verdict_and_evidence() -> None:
    rows = read_table(ROOT / "results" / "published" / "tables" / "claims.csv")
    assert [(row["place"], row["claim"]) for row in rows] == [(c.place, c.words) for c in CLAIMS]
    assert {row["verdict"] for row in rows} == {REPLICATED, IN_PART, NOT, OUTSIDE, UNDECIDED}
    assert [row for row in rows if "Not here" in row["evidence"] or not row["evidence"]] == []


def test_the_rules_are_told_where_the_table_stands() -> None:
    caption = ROOT / "workflow" / "report" / "tables" / "claims.rst"
    assert RULES in " ".join(caption.read_text(encoding="utf-8").split())


def test_verdicts_are_counted() -> None:
    counted = count_verdicts([IN_PART, NOT, REPLICATED, IN_PART, UNDECIDED, OUTSIDE, IN_PART])
    assert counted == (
        "Of the paper's 7 claims 1 are replicated, 3 in part, 1 not; 1 are outside the printed "
        "encoding, and 1 cannot be told."
    )
    assert count_verdicts([]) == ""
