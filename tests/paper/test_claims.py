from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.physics.models import Sample
from biogrip_study.config.published import Published
from biogrip_study.records.rows import write_arrays
from tests.helpers.default import seen
from tests.helpers.places import ROOT
from workflow.paper import claims
from workflow.paper.claims import ELSEWHERE, IN_PART, NOT, REPLICATED, TOLD, TOO_FEW, UNDECIDED

CLAIMS = yaml.safe_load((ROOT / "workflow/paper/claims.yaml").read_text(encoding="utf-8"))
SEEDS = 40
HALF = np.arange(SEEDS) < SEEDS // 2
TRUE = {"k": 8.0, "k_p": 2.0, "c": 100.0, "c_p": 1e-3}
PRINTED = {"k": 7.0, "k_p": 2.0, "c": 97.0, "c_p": 3.0}


def claim(words: str) -> Any:
    (found,) = (c for c in CLAIMS if c["words"].startswith(words))
    return found


def test_only_whole_intervals_decide() -> None:
    told = {(0.9, 1.0): REPLICATED, (0.89, 1.0): TOO_FEW, (0.11, 0.89): IN_PART, (0.0, 0.1): NOT}
    told |= dict.fromkeys(((0.05, 0.89), (0.0, 0.11), (0.0, 1.0)), TOO_FEW)
    assert {ends: claims.by_interval(*ends) for ends in told} == told


def test_a_number_that_the_paper_rounds_may_be_five_percent_off() -> None:
    rows = pd.DataFrame({"this_study": [17.84, 17.86, 16.0, 17.0]})
    rows = rows.assign(paper="about 17", unit="V")
    rows["quantity"] = [*3 * ["voltage for 1.6e-09 N m"], "arm"]
    claims.add_columns({"evidence": rows})
    assert rows["as_printed"].tolist()[:3] == [True, False, False]
    assert np.isnan(rows["as_printed"][3])


def case_of(table: int) -> Any:
    published = Published(table=table, generation=70, identified=PRINTED, error_percent={})
    known = {"sample": Sample("generalized_maxwell"), "parameters": TRUE, "published": published}
    study = seen(near_noise_tolerance=0.02, config=seen(methods=["genetic"]))
    return seen(name="mine", seeds=3, title="Mine", noise=seen(level=0.1), study=study, **known)


def identified(table: int, told: str = "determined", *, able: bool = False, **runs: Any) -> Any:
    """Of runs at the truth but for what is given for each seed; by the able reading, or not.

    Of the able reading's runs, those of the text's encoding stand beside, all at the truth.
    """
    case = case_of(table)
    found = pd.DataFrame({"seed": range(SEEDS), **TRUE, **runs})
    found = found.assign(case="mine", reading="text", able=False)
    if able:
        beside = found.assign(**TRUE)
        found = pd.concat([beside, found.assign(reading="able", able=True, encodable=True)])
    known = {"case": "mine", "quantity": "identified", "encodable": "no"}
    expected = pd.DataFrame({"quantity": [*TRUE, "c + c_p"], "expected_high": np.nan})
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
    said = "Within half a decade of the target end {} of 40 runs."
    assert judged == [
        ("Table 6, k", IN_PART, said.format("60 % (45 to 74 %)")),
        ("Table 6, k_p", REPLICATED, said.format("100 % (91 to 100 %)")),
    ]


def test_the_reading_that_can_print_them_judges_with_the_text_s_beside_it() -> None:
    """All of the text's runs are right, none of the other's; errors of k are 12 %."""
    results = identified(5, able=True, k=np.full(SEEDS, 9.0))
    ((_, verdict, said),) = claims.judge(claim("the error on k is lower"), results)
    assert verdict == NOT
    beside = "with two digits from 1 100 % (91 to 100 %) of 40."
    assert f"end 0 % (0 to 9 %) of 40 runs; {beside}" in said
    own = verdicts_of("the error on k is lower", identified(5, k=np.full(SEEDS, 9.0)))
    assert own == {"Table 5, k": NOT}


def test_identified_values_are_judged_where_traces_determine_them() -> None:
    c = np.where(HALF, 97.0, 60.0)
    values = identified(7, "not determined", able=True, k=np.full(SEEDS, 7.1), c=c, c_p=100.0 - c)
    assert verdicts_of("identified values", values) == {
        **{"Table 7, k": REPLICATED, "Table 7, k_p": REPLICATED, "Table 7, c": UNDECIDED},
        **{"Table 7, c_p": IN_PART, "Table 7, c + c_p": REPLICATED},
    }
    rows = {(row["reading"], row["quantity"]): row for row in claims.compared(values).rows}
    assert rows["able", "k"]["verdict"] == REPLICATED
    assert rows["text", "k"]["verdict"] == "its genes lack the value"
    assert rows["able", "c"]["verdict"] == UNDECIDED
    # 7 is printed: 6.5 to 8 err by 0 to 18.75 %; all runs by 11.25 %.
    told = [rows["able", "k"][f"error_{end}_percent"] for end in ("from", "to")]
    assert told == pytest.approx([0, 18.75])
    assert rows["able", "k"]["median_error_percent"] == pytest.approx(11.25)
    # By the text's encoding no run could be near, which is another config's to judge.
    elsewhere = claims.judge(claim("identified values"), identified(7))
    assert elsewhere == [("", ELSEWHERE, "config/readings.yaml has what it takes.")]


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
    for shift, verdict in ((0, REPLICATED), (15, TOO_FEW), (40, NOT)):
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


def test_one_simpler_model_that_is_refuted_takes_the_cell_model_to_be_known() -> None:
    rows = [
        {"case": case, "of_table": table, "seeds": 50, "model": model, "parameters": parameters}
        | {"median_delta_bic": bic, "chosen_by_bic": 7}
        for case, table, most in zip("abc", (5, 6, 7), (11, 9, 9), strict=True)
        for model, parameters, bic in (
            *(("damper", 1, most), ("drop", 3, 2.0)),
            *(("general (made the traces)", 4, 8.0), ("richer", 6, 99.0)),
        )
    ]
    tables = {"models": pd.DataFrame(rows)}
    claims.add_columns(tables)
    found = claims.judge(claim("nor the specific"), claims.Results(seen(), tables))
    assert [verdict for _, verdict, _ in found] == [NOT, REPLICATED, REPLICATED]
    assert "refute 1 of 2 simpler models" in found[0][2]


def test_what_the_study_lacks_is_another_config_s_to_judge() -> None:
    few = claims.Results(seen(), {})
    told = ("", ELSEWHERE, "config/robustness.yaml has what it takes.")
    assert claims.judge(claim("highly robust"), few) == [told]
    ((_, verdict, said),) = claims.judge(claim("the error on k is lower"), few)
    assert (verdict, said) == (UNDECIDED, "Not here: the study has no table values.")
    ((_, verdict, said),) = claims.judge(claim("good identification"), identified(5))
    assert (verdict, said) == (UNDECIDED, "Not here: the study has no case of Table 7.")
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
    numbers = f"within {claims.AROUND}", f"up to {claims.FASTER:g}"
    for words in (*numbers, "too few runs to tell", TOLD, ELSEWHERE):
        assert words in rules
