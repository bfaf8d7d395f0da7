"""Tables of methods, models, coverage and verdicts, recomputed by hand."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from biogrip.errors import BiogripError
from biogrip.fit.methods import METHODS
from biogrip.physics.models import MODELS, UNPUBLISHED, Sample, Truth
from biogrip.records.identifications import columns
from biogrip.tables.layout import Table
from biogrip.tables.methods import methods, models, timings
from biogrip.tables.verdicts import verdicts
from tests.helpers.default import seen, study_of


def rows(table: Table) -> list[dict[str, Any]]:
    names = [column.name for column in table.columns]
    return [dict(zip(names, row, strict=True)) for row in table.rows]


def study(parameters: dict[str, float], samples: int) -> Any:
    """Of one case, a drop."""
    truth = Truth("A drop", Sample("generalized_maxwell"), parameters, UNPUBLISHED)
    cases = {"drop": seen(truth=truth, samples=samples)}
    return seen(cases=cases, identifiers=METHODS, optimum_tolerance=1.0, near_noise_tolerance=0.02)


def test_methods_are_counted_against_the_lowest_known(tmp_path: Path) -> None:
    path = tmp_path / "drop.csv"
    head = list(columns(MODELS["generalized_maxwell"]))
    lines = []
    for seed, genetic, polished in ((0, 1.2, 1.0), (1, 1.0004, 1.0), (2, 1.05, 0.9)):
        for method, misfit, n in (
            ("genetic", genetic, 100),
            ("least_squares", polished, 10 + seed),
        ):
            lines.append(["drop", method, seed, 8.0, 1.0, 3.0, 2.0, misfit, 1.02, 5, n, "stalled"])
    pd.DataFrame(lines, columns=head).to_csv(path, index=False)
    parameters = {"k": 10.0, "k_p": 1.0, "c": 4.0, "c_p": 1.0}
    first, second = rows(methods(study(parameters, 1000), [path]))
    # 1000 (1.0004^2 - 1) = 0.80: at the optimum; the others are far above.
    assert (first["seeds"], first["optimum_share"]) == (3, pytest.approx(1 / 3))
    assert second["optimum_share"] == 1.0
    assert first["near_noise_share"] == pytest.approx(1 / 3)
    assert second["median_evaluations"] == 11
    assert first["error_percent k"] == pytest.approx(20.0)
    assert first["error_percent c + c_p"] == pytest.approx(0.0)


def test_the_lowest_known_may_be_the_truth(tmp_path: Path) -> None:
    path = tmp_path / "drop.csv"
    line = ["drop", "genetic", 0, 8.0, 1.0, 3.0, 2.0, 1.1, 1.0, 5, 100, "stalled"]
    pd.DataFrame([line], columns=list(columns(MODELS["generalized_maxwell"]))).to_csv(path)
    parameters = dict.fromkeys(["k", "k_p", "c", "c_p"], 1.0)
    (made,) = rows(methods(study(parameters, 100), [path]))
    assert made["median_rise"] == pytest.approx(100 * (1.1**2 - 1))


def test_models_are_chosen_by_their_criteria(tmp_path: Path) -> None:
    path = tmp_path / "fits.csv"
    n = 1000
    fits = []
    # Half the chi^2 gained by the second model: 1, 4 and 20 over three seeds.
    for seed, gain in enumerate((1.0, 4.0, 20.0)):
        for model, count, misfit in (
            ("damper", 1, 1.0),
            ("maxwell", 2, float(np.exp(-gain / (2 * n)))),
        ):
            fits.append(["drop", model, seed, count, n, misfit])
    names = ["case", "model", "seed", "parameters", "samples", "misfit"]
    pd.DataFrame(fits, columns=names).to_csv(path, index=False)
    tried = {name: Sample(name) for name in ("damper", "maxwell")}
    drop = seen(recorded=False, sample=Sample("maxwell"), models=tried)
    damper, maxwell = rows(models(seen(cases={"drop": drop}), [path]))
    # A parameter costs 2 by AIC, ln 1000 = 6.9 by BIC.
    assert (damper["chosen_by_aic"], maxwell["chosen_by_aic"]) == (1, 2)
    assert (damper["chosen_by_bic"], maxwell["chosen_by_bic"]) == (2, 1)
    assert damper["median_delta_aic"] == pytest.approx(4.0 - 2.0)
    assert maxwell["median_delta_bic"] == pytest.approx(np.log(n) - 4.0)
    assert maxwell["model"] == "Maxwell liquid (made the traces)"


def test_what_made_the_traces_is_tried_and_marked(tmp_path: Path) -> None:
    two = study_of("""
model_selection: {models: [damper, generalized_maxwell]}
cases:
  two: {sample: {model: generalized_maxwell, branches: 2,
                 k_1: 30, k_2: 10, k_p: 12.3, c_1: 150, c_2: 600, c_p: 0}}
""").cases["two"]
    tried = tuple(two.models)
    assert tried == ("damper", "generalized_maxwell", "generalized_maxwell_2")
    path = tmp_path / "fits.csv"
    fits = [["two", name, 0, 4, 1000, 1.0] for name in tried]
    names = ["case", "model", "seed", "parameters", "samples", "misfit"]
    pd.DataFrame(fits, columns=names).to_csv(path, index=False)
    found = rows(models(seen(cases={"two": two}), [path]))
    marked = [row["model"] for row in found if "made the traces" in row["model"]]
    assert marked == ["generalized Maxwell-Wiechert model, 2 branches (made the traces)"]
    assert [row["parameters"] for row in found] == [1, 4, 6]


def test_verdicts_are_listed_beside_what_was_expected(tmp_path: Path) -> None:
    item = {"unit": "N/m", "value": 2.0, "low": 1.0, "high": 3.0, "excluded": [[1.5, 1.8]]}
    measured: dict[str, Any] = {
        "fit": "ok",
        "confidence": 0.9,
        "quantities": [
            {**item, "quantity": "k", "verdict": "determined"},
            {**item, "quantity": "c + c_p", "verdict": "bounded above", "low": None},
        ],
        "trades": [{"members": ["c", "c_p"], "quantity": "c + c_p"}],
        "notes": [],
    }
    expected = {**measured, "quantities": [{**measured["quantities"][0], "high": 4.0}]}
    files = [tmp_path / "a.json", tmp_path / "b.json"]
    for file, content in zip(files, (measured, expected), strict=True):
        file.write_text(json.dumps(content))
    known = seen(name="x", title="X", parameters={"k": 2.5, "c": 1.0, "c_p": 0.5})
    table = verdicts(known, files[0], files[1:])
    k, total = rows(table)
    assert k["excluded"] == "1.5 to 1.8"
    headings = {column.name: column.heading for column in table.columns}
    assert (headings["low"], headings["high"]) == ("90 % from", "90 % to")
    assert "One-sided limits hold with 95 % confidence." in table.caption
    assert (k["target"], k["value"], k["low"], k["expected_high"]) == (2.5, 2.0, 1.0, 4.0)
    assert (total["target"], total["value"], total["high"]) == (1.5, None, 3.0)
    assert total["expected_verdict"] is None
    assert "c and c_p trade against each other: determined is c + c_p." in table.caption
    recorded = seen(**vars(known) | {"parameters": {}})
    assert rows(verdicts(recorded, files[0], []))[0]["target"] is None
    files[0].write_text("{}")
    with pytest.raises(BiogripError, match=r"a\.json: holds no verdicts"):
        verdicts(known, files[0], files[1:])


def test_timings_are_summed(tmp_path: Path) -> None:
    path = tmp_path / "times.csv"
    path.write_text("case,method,seed,cpu_s\nx,genetic,0,0.1\nx,genetic,1,0.3\nx,genetic,2,0.2\n")
    (row,) = rows(timings(seen(identifiers=METHODS), [path]))
    assert (row["median_cpu_s"], row["total_cpu_s"]) == (pytest.approx(0.2), pytest.approx(0.6))
