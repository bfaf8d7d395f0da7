from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.physics.models import Sample
from biogrip_study.config.study_blocks import Published
from biogrip_study.records.rows import write_arrays
from tests.helpers.default import seen
from tests.helpers.places import ROOT
from workflow.paper import claims
from workflow.paper.claims import (
    DEPENDS,
    ELSEWHERE,
    IN_PART,
    NOT,
    REPLICATED,
    TEXT,
    TOLD,
    UNDECIDED,
    UNIDENTIFIABLE,
)

CLAIMS = yaml.safe_load((ROOT / "workflow/paper/claims.yaml").read_text(encoding="utf-8"))
SEEDS = 40
HALF = np.arange(SEEDS) < SEEDS // 2
TRUE = {"k": 8.0, "k_p": 2.0, "c": 100.0, "c_p": 1e-3}
PRINTED = {"k": 7.0, "k_p": 2.0, "c": 97.0, "c_p": 3.0}


def claim(words: str) -> Any:
    (found,) = (c for c in CLAIMS if c["words"].startswith(words))
    return found


def test_only_whole_intervals_decide() -> None:
    told = {(0.9, 1.0): REPLICATED, (0.89, 1.0): UNDECIDED, (0.11, 0.89): IN_PART, (0.0, 0.1): NOT}
    told |= dict.fromkeys(((0.05, 0.89), (0.0, 0.11), (0.0, 1.0)), UNDECIDED)
    assert {ends: claims.by_interval(*ends) for ends in told} == told


def test_a_number_that_the_paper_rounds_may_be_five_percent_off() -> None:
    rows = pd.DataFrame({"this_study": [17.84, 17.86, 16.0, 17.0]})
    rows = rows.assign(paper="about 17", unit="V")
    rows["quantity"] = [*3 * ["voltage for 1.6e-09 N m"], "arm"]
    claims.add_columns({"evidence": rows})
    assert rows["as_printed"].tolist()[:3] == [True, False, False]
    assert np.isnan(rows["as_printed"][3])


def case_of(table: int) -> Any:
    published = Published(table=table, identified=PRINTED, error_percent={})
    known = {"sample": Sample("generalized_maxwell"), "parameters": TRUE, "published": published}
    study = seen(near_noise_tolerance=0.02, config=seen(methods=["genetic"]))
    return seen(name="mine", seeds=3, title="Mine", noise=seen(level=0.1), study=study, **known)


def identified(table: int, told: str = "determined", *others: dict[str, Any], **runs: Any) -> Any:
    """Of runs at the truth but for what is given for each seed; by the text's encoding or others.

    Runs of the text's encoding stand beside those of others, and do not judge.
    """
    case = case_of(table)
    every = [
        pd.DataFrame({"seed": range(SEEDS), **TRUE, **values}).assign(
            case="mine", reading=title, near_noise=True, judging=title != TEXT or not others
        )
        for title, values in ((TEXT, runs), *zip(("four", "five"), others, strict=False))
    ]
    found = pd.concat(every)
    known = {"case": "mine", "quantity": "identified", "encodable": "no"}
    expected = pd.DataFrame({"quantity": [*TRUE, "c + c_p"], "expected_high": 7.0})
    verdicts = expected["quantity"].replace("c", told)
    expected["expected_verdict"] = verdicts.where(verdicts == told, "determined")
    printed = pd.DataFrame({"parameter": [*PRINTED], **known})
    tables = {"printed_values": printed, "verdicts_mine": expected}
    values = claims.values_of(case, found.reset_index(drop=True), tables).assign(of_table=table)
    return claims.Results(seen(cases={"mine": case}), {"values": values})


def verdicts_of(words: str, results: claims.Results) -> dict[str, str]:
    return {what: verdict for what, verdict, _ in claims.judge(claim(words), results)}


def test_each_quantity_has_a_verdict_of_its_own() -> None:
    """Of half a decade on both sides: 3.17 is beyond it, 3.16 is not."""
    k = np.resize([8 / 3.17, 8 / 3.16, 8, 25.2, 25.4], SEEDS)
    decades = identified(6, k=k).tables["values"].query("quantity == 'k'")["decades"]
    assert (decades <= 0.5).tolist()[:5] == [False, True, True, True, False]
    judged = claims.judge(claim("catch k_p and k"), identified(6, k=k))
    said = "Within half a decade of the target end {} of 40 runs. Runs have two digits from 1."
    assert judged == [
        ("Table 6, k", IN_PART, said.format("60 % (45 to 74 %)")),
        ("Table 6, k_p", REPLICATED, said.format("100 % (91 to 100 %)")),
    ]


def test_readings_that_are_not_excluded_judge_with_the_text_s_beside_them() -> None:
    """All of the text's runs are right, none of one other's, whose errors are 12 %; half of one."""
    none, half = {"k": np.full(SEEDS, 9.0)}, {"k": np.where(HALF, 8.0, 9.0)}
    words = "the error on k is lower"
    ((_, verdict, said),) = claims.judge(claim(words), identified(5, "determined", none))
    assert verdict == NOT
    assert (
        "end 0 % (0 to 9 %) of 40 runs. Runs have four; with two digits from 1 it is 100 %" in said
    )
    ((_, verdict, said),) = claims.judge(claim(words), identified(5, "determined", none, half))
    assert verdict == DEPENDS
    assert said.endswith(
        "; over 2 interpretations 0 % (“four”) to 50 % (“five”), 1 not, 1 in part."
    )
    assert verdicts_of(words, identified(5, "determined", none, none)) == {"Table 5, k": NOT}
    assert verdicts_of(words, identified(5, k=none["k"])) == {"Table 5, k": NOT}


def test_an_undecided_reading_denies_no_other() -> None:
    decided = {REPLICATED: [REPLICATED, REPLICATED], UNDECIDED: [NOT, UNDECIDED]}
    decided |= {DEPENDS: [NOT, REPLICATED, UNDECIDED]}
    assert {verdict: claims.agreed(of) for verdict, of in decided.items()} == dict(
        zip(decided, decided, strict=True)
    )


CONSTANT = dict.fromkeys(TRUE, 1e-3)


def useless(rng: np.random.Generator) -> dict[str, Any]:
    """Answers that tell nothing: always one number, heads or tails, any number of the range."""
    coin = {name: rng.choice([1e-4, 1e7], 500) for name in TRUE}
    prior = {name: 10 ** rng.uniform(-4, 8, 500) for name in TRUE}
    return {"constant": CONSTANT, "coin": coin, "prior": prior}


@pytest.mark.parametrize("which", ["constant", "coin", "prior"])
def test_no_rule_replicates_an_algorithm_that_tells_nothing(
    which: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its fits come near no noise, and its best is the first it tries.

    A draw from twelve decades is within half a one on both sides in 8 %: a share near the limit.
    """
    monkeypatch.setitem(globals(), "SEEDS", 500)
    tables: dict[str, list[pd.DataFrame]] = {}
    answers, levels = useless(np.random.default_rng(2))[which], [2, 10, 40]
    for number in (5, 6, 7):
        values = identified(number, **answers).tables["values"]
        values = values.assign(near_noise=False)
        tables.setdefault("values", []).append(values)
        runs = values[["seed", "reading", "judging", "near_noise", "of_table"]]
        tables.setdefault("runs", []).append(runs.assign(last_improvement=0).drop_duplicates())
        error = values[values["quantity"] == "k"]["error"].median()
        noise = {"case": "mine", "quantity": "k", "of_table": number, "bound_percent": levels}
        tables.setdefault("robustness_noise", []).append(
            pd.DataFrame({"row": levels, "error_genetic": error, **noise})
        )
    joined = {name: pd.concat(each, ignore_index=True) for name, each in tables.items()}
    joined["values at 20"] = joined["values"]
    claims.add_columns(joined)
    joined["by_noise"]["of_table"] = 5
    judged = [c for c in CLAIMS if c.get("rows", {}).get("table") in joined and "told" not in c]
    assert len(judged) == 15
    for one in judged:
        for what, verdict, said in claims.judge(one, claims.Results(seen(), joined)):
            assert verdict in {NOT, UNDECIDED, UNIDENTIFIABLE}, (one["words"], what, said)


def test_a_case_of_one_s_own_judges_no_claim() -> None:
    rows = [("cell", 5, 0.01), ("drop", 6, 0.02), ("mine", pd.NA, 2.0)]
    names = ["case", "of_table", "difference_percent"]
    table = pd.DataFrame(rows, columns=names).assign(reference_angle_deg=75.0)
    study = seen(gripper=seen(reference_angle_deg=75.0))
    words = "an approximate linear set"
    with_mine, without = (
        claims.judge(claim(words), claims.Results(study, {"linearisation": of}))
        for of in (table, table.iloc[:2])
    )
    assert with_mine == without
    assert with_mine[0][1] == REPLICATED


def test_robust_is_an_error_that_noise_explains() -> None:
    """At 10 % of noise up to 10 %, and nowhere over twice the median of 0.6745 bounds."""
    levels = np.array([2.0, 10.0, 40.0])
    least = 0.6745 * levels
    errors = {REPLICATED: 1.9 * least * [1, 0.7, 1], IN_PART: [5, 9, 40], NOT: [11, 12, 13]}
    for verdict, error in errors.items():
        rows = pd.DataFrame({"row": levels, "error_genetic": error, "bound_percent": levels})
        tables = {"robustness_noise": rows.assign(case="mine", quantity="k")}
        claims.add_columns(tables)
        tables["by_noise"]["of_table"] = 5
        found = verdicts_of("highly robust", claims.Results(seen(), tables))
        assert found == {"Table 5, k": verdict}


def test_identified_values_are_judged_where_traces_determine_them() -> None:
    c = np.where(HALF, 97.0, 60.0)
    other = {"k": np.full(SEEDS, 7.1), "c": c, "c_p": 100.0 - c}
    values = identified(7, "not determined", other)
    assert verdicts_of("identified values", values) == {
        **{"Table 7, k": REPLICATED, "Table 7, k_p": REPLICATED, "Table 7, c": UNIDENTIFIABLE},
        **{"Table 7, c_p": IN_PART, "Table 7, c + c_p": REPLICATED},
    }
    rows = {(row["reading"], row["quantity"]): row for row in claims.compared(values).rows}
    assert rows["four", "k"]["verdict"] == REPLICATED
    assert rows[TEXT, "k"]["verdict"] == "two digits from 1 cannot write it"
    assert rows["four", "c"]["verdict"] == UNIDENTIFIABLE
    # 7 is printed: 6.5 to 8 err by 0 to 18.75 %; all runs by 11.25 %.
    told = [rows["four", "k"][f"error_{end}_percent"] for end in ("from", "to")]
    assert told == pytest.approx([0, 18.75])
    assert rows["four", "k"]["median_error_percent"] == pytest.approx(11.25)


def test_both_are_right_in_the_runs_in_which_each_is() -> None:
    c = np.where(HALF, 100.0, 1.0)
    judged = claims.judge(claim("generally able"), identified(6, k=np.where(HALF, 1.0, 8.0), c=c))
    assert judged[0][:2] == ("Table 6, k and c", NOT)


def test_runs_are_read_at_generations_and_with_their_last_improvement(tmp_path: Path) -> None:
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
    runs = claims.read_runs(case_of(5), tmp_path / "f.csv", tmp_path / "h.npz")
    assert runs[""]["last_improvement"].tolist() == [30, 0, 10]
    assert runs[""]["near_noise"].all()
    assert runs[" at 20"]["k"].tolist() == [19, 19, 19]


def test_convergence_is_judged_by_the_interval_of_the_median() -> None:
    """Around 60 are 50 to 70; of 41 runs in order the limits are the 14th and the 28th."""
    for shift, verdict in ((0, REPLICATED), (15, UNDECIDED), (40, NOT)):
        rows = pd.DataFrame({"last_improvement": np.arange(40, 81) + shift, "of_table": 5})
        results = claims.Results(seen(), {"runs": rows})
        told = results, "{low:g} to {high:g}", "runs"
        ((_, found, said),) = claims.judge_rows(*told, around=["last_improvement", 60])
        assert (found, said) == (verdict, f"{53 + shift} to {67 + shift}")


def test_jaws_that_would_have_to_pull_hold_one_sample_in_three() -> None:
    forces = {"lowest_force_uN": [0.2, 0.3, -0.7, -0.6], "of_table": [5, 5, 6, 7]}
    grip = claims.Results(seen(), {"mechanics": pd.DataFrame(forces)})
    found = verdicts_of("in order to maintain", grip)
    assert found == {"Table 5": REPLICATED, "Table 6": NOT, "Table 7": NOT}


def test_the_cell_model_need_not_be_assumed_where_the_general_one_fits() -> None:
    rows = [
        {"case": case, "of_table": table, "seeds": 50, "model": model, "parameters": parameters}
        | {"median_delta_bic": bic, "median_delta_aic": bic, "chosen_by_bic": 7}
        for case, table, most in zip("abc", (5, 6, 7), (11, 9, 9), strict=True)
        for model, parameters, bic in (
            *(("damper", 1, 99.0), ("drop", 3, 2.0)),
            *(("general (made the traces)", 4, most), ("richer", 6, 99.0)),
        )
    ]
    tables = {"models": pd.DataFrame(rows)}
    claims.add_columns(tables)
    found = claims.judge(claim("nor the specific"), claims.Results(seen(), tables))
    assert [verdict for _, verdict, _ in found] == [NOT, REPLICATED, REPLICATED]
    assert "refute 1 of 2 simpler ones" in found[0][2]


def test_what_the_study_lacks_is_another_config_s_to_judge() -> None:
    few = claims.Results(seen(), {})
    why = "has what it takes: the study has no"
    told = ("", ELSEWHERE, f"config/robustness.yaml {why} table by_noise.")
    assert claims.judge(claim("highly robust"), few) == [told]
    ((_, verdict, said),) = claims.judge(claim("the error on k is lower"), few)
    assert (verdict, said) == (ELSEWHERE, f"Another study {why} table values.")
    ((_, verdict, said),) = claims.judge(claim("good identification"), identified(5))
    assert (verdict, said) == (ELSEWHERE, f"Another study {why} case of Table 7.")
    runs = pd.DataFrame({"of_table": [5], "last_improvement": [70]})
    told_only = claim("the best fit solution"), claims.Results(seen(), {"runs": runs})
    assert claims.judge(*told_only)[0][1] == TOLD
    (row,) = claims.judge_all([told_only[0]], told_only[1], "").rows
    assert [*row] == ["claim", "place", "of", "verdict", "evidence"]


def test_the_rules_are_told_where_the_table_stands() -> None:
    caption = (ROOT / "workflow" / "report" / "tables" / "claims.rst").read_text(encoding="utf-8")
    rules = " ".join(caption.split())
    for number in (claims.MOST, claims.FEW, claims.CLOSE, claims.NEAR):
        assert f"{100 * number:g} %" in rules
    for words in (f"within {claims.AROUND}", UNDECIDED, DEPENDS[11:], TOLD, ELSEWHERE):
        assert words in rules
