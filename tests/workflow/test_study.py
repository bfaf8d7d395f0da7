import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.helpers.problems import MODEL, rotation
from tests.helpers.runs import TINY, snakemake

CASE = "liquid_drop_2"
METHODS = ["genetic", "least_squares"]
QUANTITIES = ["k", "k_p", "c", "c_p", "c + c_p"]
PARAMETERS = ["k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m"]


def test_identifications_are_what_their_own_traces_give(tiny: Path) -> None:
    results = tiny / "results"
    every = pd.read_csv(results / "identifications" / f"{CASE}.csv")
    assert every["method"].unique().tolist() == METHODS
    assert every["seed"].tolist() == [0, 1] * 2
    history = pd.DataFrame(dict(np.load(results / "histories" / f"{CASE}.npz")))
    last = history.groupby(["method", "seed"], sort=False)["best_misfit"].last()
    np.testing.assert_allclose(last.to_numpy(), every["misfit"], rtol=1e-6)
    found = every.iloc[-1]
    measured = np.load(results / "measurements" / CASE / "seeds_0-1.npz")
    target, trace = measured["target"], measured["traces"][1]
    fitted = rotation(MODEL, found[PARAMETERS].to_numpy(float), measured["time_s"])
    misfit = np.sqrt(np.mean((fitted - trace) ** 2))
    assert misfit == pytest.approx(found["misfit"], rel=1e-6)
    noise = trace - target
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(found["noise_rms"], rel=1e-6)
    # 201 samples: 5 % of the standard deviation, four times that is allowed.
    assert noise.std() / target.max() == pytest.approx(0.1, rel=0.2)


def test_a_summary_says_what_the_judgement_does(tiny: Path) -> None:
    results = tiny / "results"
    told = json.loads((results / "identifiability" / f"{CASE}.json").read_text())
    assert [item["quantity"] for item in told["quantities"]] == QUANTITIES
    page = (results / "summaries" / f"{CASE}.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    said = [item["in_words"] for item in told["quantities"]]
    assert [words for words in said if words not in page] == []
    assert page.count("data:image/png;base64,") == 2


def test_a_recorded_trace_has_verdicts_and_no_errors(tiny: Path) -> None:
    results = tiny / "results"
    errors = pd.read_csv(results / "tables" / "errors_mine.csv")
    assert errors["parameter"].tolist() == QUANTITIES
    assert errors[["target", "median_error_percent"]].isna().all(axis=None)
    identified = pd.read_csv(results / "identifications" / "mine.csv")
    assert identified["noise_rms"].isna().all()
    verdicts = pd.read_csv(results / "tables" / "verdicts_mine.csv").set_index("quantity")
    total = verdicts.loc["c + c_p"]
    found = identified[["c_Ns_per_m", "c_p_Ns_per_m"]].iloc[-1].sum()
    assert total["low"] < found < total["high"]


@pytest.mark.nightly
def test_snakemakes_report_shows_tables_figures_and_pages(tiny: Path, tmp_path: Path) -> None:
    report = tmp_path / "report.html"
    snakemake(tiny, "--report", report, config=TINY)
    page = report.read_text()
    front = page.partition("workflow_desc = ")[2]
    described, _ = json.JSONDecoder().raw_decode(front)
    told = (tiny / "results" / "answers.html").read_text()
    answers = re.findall("<p>(.*)</p>", told)
    assert len(answers) == 2
    assert '<table class="share">' in described
    assert [each for each in answers if each not in described] == []
    assert len(page) < 8_000_000
    for item in ('"judged fit"', '"summary"', '"answers"', "data:text/html", "data:image/png"):
        assert item in page
