from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binomtest

from biogrip.files import write_object
from biogrip.physics.models import MODELS, Sample
from biogrip_study.config.study_blocks import Published
from biogrip_study.methods.registry import METHODS
from biogrip_study.records.identifications import (
    ALL,
    ENCODABLE,
    MODEL_FITS,
    basins,
    chi_square_increase,
    identification_columns,
    near_noise,
    share_with_limits,
)
from biogrip_study.tables import cases
from biogrip_study.tables.study import methods, models
from tests.helpers.default import STUDY, seen, study_of

WITHIN_2_PERCENT: Any = seen(near_noise_tolerance=0.02)
FOUND = {"k": 9.0, "k_p": 1.0, "c": 3.0, "c_p": 2.0}
ERRORS = dict(zip(FOUND, ("10", "-", "25", ">100"), strict=True))
PAPER = Published(table=9, identified=FOUND, error_percent=ERRORS)
TRUE = {"k": 8.0, "k_p": 0.0, "c": 4.0, "c_p": 1.0}


def identified(path: Path, rows: list[list[Any]], **more: float) -> Path:
    """Write identifications of a drop: method, seed, parameters, misfit, noise, evaluations."""
    rows = [["drop", *row[:-1], 60, row[-1], "stalled"] for row in rows]
    frame = pd.DataFrame(rows, columns=identification_columns(MODELS["generalized_maxwell"]))
    frame.assign(**more).to_csv(path, index=False)
    return path


@pytest.fixture
def eleven_seeds(tmp_path: Path) -> Path:
    """Of k = 5, 6, ... 15; c + c_p = 5 always; the trace of seed 3 is the quietest."""
    rows = []
    for seed in range(11):
        noise = 0.5 if seed == 3 else 1.0
        values = [5 + seed, 0.1, 5 - 0.1 * seed, 0.1 * seed]
        rows.append(["genetic", seed, *values, noise * (1.001 + 0.0036 * seed), noise, 15500])
    return identified(tmp_path / "drop.csv", rows)


def case_of(near_noise_tolerance: float = 0.02) -> Any:
    config = seen(methods=["genetic"])
    study = seen(
        shown_method=METHODS["genetic"], near_noise_tolerance=near_noise_tolerance, config=config
    )
    known = {"sample": Sample("generalized_maxwell"), "parameters": TRUE, "published": PAPER}
    return seen(name="drop", title="A drop", seeds=11, study=study, **known)


def test_error_table_is_the_arithmetic_it_says(eleven_seeds: Path) -> None:
    made = cases.errors_of_case(case_of(), eleven_seeds)
    rows = {row["parameter"]: row for row in made.rows if row["basin"] == "all"}
    assert list(rows) == ["k", "k_p", "c", "c_p", "c + c_p"]
    k, total = rows["k"], rows["c + c_p"]
    assert (k["median_identified"], k["p05_identified"], k["p95_identified"]) == (10.0, 5.5, 14.5)
    # (8 - 10) / 8, as the paper has it: too stiff is negative.
    assert (k["p25_identified"], k["p75_identified"], k["median_error_percent"]) == (7.5, 12.5, -25)
    # |8 - k| over k = 5 .. 15: 0 once, 1, 2 and 3 twice, 4, 5, 6 and 7.
    assert k["median_absolute_error_percent"] == pytest.approx(37.5)
    # 1.001 + 0.0036 seed is at most 1.02 up to seed 5.
    assert k["near_noise_share"] == pytest.approx(6 / 11)
    assert total["target"] == 5
    assert total["median_absolute_error_percent"] == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(rows["k_p"]["median_error_percent"])
    # k = 5 to 10 come near the noise, and 11 to 15 end above it.
    shown = ("basin", "seeds", "median_identified", "p25_identified")
    two = [tuple(row[n] for n in shown) for row in made.rows if row["parameter"] == "k"][1:]
    assert two == [("near the noise", 6, 7.5, 6.25), ("above the noise", 5, 13.0, 12.0)]


def test_joined_errors_are_within_the_tolerance_their_heading_names(eleven_seeds: Path) -> None:
    study = seen(near_noise_tolerance=0.005, cases={"drop": case_of(0.005)})
    made = cases.errors(study, [eleven_seeds])
    assert made.rows[0]["near_noise_share"] == pytest.approx(2 / 11)
    assert made.columns[-3].heading == "Share within 0.5 % of the noise"


def study(parameters: dict[str, float], samples: int, *methods: str, seeds: int = 1) -> Any:
    known = {"sample": Sample("generalized_maxwell"), "parameters": parameters, "seeds": seeds}
    own = seen(config=seen(methods=methods), near_noise_tolerance=0.02, optimum_tolerance=1.0)
    own.cases = {"drop": seen(name="drop", times_s=range(samples), study=own, **known)}
    return own


def test_methods_are_counted_against_what_genes_can_encode(tmp_path: Path) -> None:
    """1.03 has a chi-squared that is 61 above the optimum, and is all that the genes can hold."""
    rows = []
    for seed, genetic, polished in ((0, 1.2, 1.0), (1, 1.0304, 1.0), (2, 1.0306, 0.9)):
        at = seed, 8.0, 1.0, 3.0, 2.0
        rows.append(["genetic", *at, genetic, 1.02, 9])
        rows.append(["least_squares", *at, polished, 1.02, 10 + seed])
    path = identified(tmp_path / "drop.csv", rows, encodable_misfit=1.03)
    parameters = {"k": 10.0, "k_p": 1.0, "c": 4.0, "c_p": 1.0}
    first, second = methods(
        study(parameters, 1000, "genetic", "least_squares", seeds=3), [path]
    ).rows
    # 1000 ((1.0304 / 1.03)^2 - 1) = 0.78, the only one of at most 1; 1.0306 has 1.17.
    assert (first["seeds"], first["reached_share"]) == (3, pytest.approx(1 / 3))
    assert second["reached_share"] == 1.0
    assert first["encodable_rise"] == second["encodable_rise"] == pytest.approx(60.9)
    ends = binomtest(1, 3).proportion_ci(method="wilson")
    np.testing.assert_allclose([first["reached_low"], first["reached_high"]], ends, rtol=1e-6)
    # What is never reached has 0 for its lower end, and no rounding error.
    for count, end in ((0, 0), (500, 1)):
        ends = share_with_limits(count, 500)[1:]
        assert ends == pytest.approx(binomtest(count, 500).proportion_ci(method="wilson"))
        assert ends[end] == end
    assert second["median_evaluations"] == 11
    assert first["error_percent k"] == pytest.approx(20.0)
    assert first["error_percent c + c_p"] == pytest.approx(0.0)
    # The lowest known may be the truth.
    row = ["genetic", 0, 8.0, 1.0, 3.0, 2.0, 1.1, 1.0, 100]
    path = identified(tmp_path / "d.csv", [row], encodable_misfit=1.1)
    (made,) = methods(study(TRUE, 100, "genetic"), [path]).rows
    assert made["median_rise"] == pytest.approx(100 * (1.1**2 - 1))


def test_models_are_chosen_by_their_criteria(tmp_path: Path) -> None:
    n, rows = 1000, []
    # Half the chi^2 gained by the second model: 1, 4 and 20 over three seeds.
    for seed, gain in enumerate((1.0, 4.0, 20.0)):
        rows.append(("drop", "damper", seed, 1, n, 1.0))
        rows.append(("drop", "maxwell", seed, 2, n, float(np.exp(-gain / (2 * n)))))
    fits = tmp_path / "drop" / "seeds_0-2.csv"
    MODEL_FITS.write(fits, rows)
    tried = {name: Sample(name) for name in ("damper", "maxwell")}
    drop = seen(name="drop", recorded=False, sample=Sample("maxwell"), models=tried)
    damper, maxwell = models(seen(cases={"drop": drop}), [fits]).rows
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
    fits = tmp_path / "two" / "seeds_0-0.csv"
    MODEL_FITS.write(fits, [("two", name, 0, 4, 1000, 1.0) for name in two.models])
    found = models(seen(cases={"two": two}), [fits]).rows
    assert ["made the traces" in row["model"] for row in found] == [False, False, True]
    assert [row["parameters"] for row in found] == [1, 4, 6]


def test_verdicts_are_listed_beside_what_was_expected(tmp_path: Path) -> None:
    item = {"unit": "N/m", "value": 2.0, "low": 1.0, "high": 3.0, "excluded": [[1.5, 1.8]]}
    first = {**item, "quantity": "k", "verdict": "determined"}
    second = {**item, "quantity": "c + c_p", "verdict": "bounded above", "low": None}
    told: dict[str, Any] = {"fit": "ok", "confidence": 0.9, "notes": []}
    told["trades"] = [{"members": ["c", "c_p"], "quantity": "c + c_p"}]
    write_object(tmp_path / "a.json", {**told, "quantities": [first, second]})
    write_object(tmp_path / "b.json", {**told, "quantities": [{**first, "high": 4.0}]})
    known = seen(name="x", title="X", parameters={"k": 2.5, "c": 1.0, "c_p": 0.5})
    table = cases.verdicts_of_case(known, tmp_path / "a.json", [tmp_path / "b.json"])
    k, total = table.rows
    assert k["excluded"] == "1.5 to 1.8"
    headings = {column.name: column.heading for column in table.columns}
    assert (headings["low"], headings["high"]) == ("90 % from", "90 % to")
    assert "One-sided limits hold with 95 % confidence." in table.caption
    assert (k["target"], k["value"], k["low"], k["expected_high"]) == (2.5, 2.0, 1.0, 4.0)
    assert (total["target"], total["value"], total["high"]) == (1.5, None, 3.0)
    assert total["expected_verdict"] is None
    assert "c and c_p trade against each other: determined is c + c_p." in table.caption


def test_a_value_and_its_error_leave_an_interval() -> None:
    for printed, target, error, ends in (
        # 10 (1 - 0.027) to 10 (1 - 0.0255): two digits are too few, for 9.7 errs by 3 %.
        (9.7, 10.0, "2.6", (9.73, 9.745)),
        (0.97, 1.0, "2.6", (0.973, 0.9745)),
        # 35 (1 - 0.062) to 35 (1 - 0.0605).
        (32.8, 35.0, "6.1", (32.83, 32.8825)),
        # The error is cut off: rounded, it would be 0.9. 299.9 * 1.009 = 302.5991.
        (302.5, 299.9, "-0.8", (302.45, 302.5991)),
        # A sign that belies its value tells no side.
        (6.7, 9.5, "-29", (6.65, 6.7925)),
        # No number, or one that the value belies, leaves the value alone.
        (1e-4, 1e-3, ">100", (5e-5, 2e-4)),
        (5.5, 10.0, "3", (5.45, 5.6)),
        (5.5, None, None, (5.45, 5.6)),
        (5.5, 0.0, "3", (5.45, 5.6)),
    ):
        assert cases.interval_of(printed, target, error) == pytest.approx(ends, rel=1e-12)


def test_of_dampers_that_trade_the_sum_is_ten() -> None:
    """9.7375 + 0.23, and 9.7375 + 0.25: c has the printed error, c_p none."""
    for name, value in (("liquid_drop_1", 9.9675), ("liquid_drop_2", 9.9875)):
        told = cases.value_in_case(STUDY.cases[name], ["c", "c_p"])
        assert told
        assert told[0] == pytest.approx(value)
        assert told[1] < told[0] < told[2]
    assert cases.value_in_case(STUDY.cases["liquid_drop_1"], ["alpha"]) is None
    assert cases.interval_of(0.23, None, None) == pytest.approx((0.225, 0.24))


def found(misfit: list[float], noise: list[float | None]) -> pd.DataFrame:
    runs = pd.DataFrame({"seed": range(len(misfit)), "misfit": misfit, "noise_rms": noise})
    return runs.astype({"noise_rms": float})


def test_two_basins_have_a_tenth_of_the_runs_each() -> None:
    """And none is told where the noise is unknown, or absent."""
    one = basins(found([1.05, 1.01, *[1.2] * 18], [1.0, 1.0, *[1.19] * 18]), WITHIN_2_PERCENT)
    assert {name: len(runs) for name, runs in one.items()} == {ALL: 20}
    two = basins(found([1.05, 1.06, *[1.2] * 18], [1.0, 1.0, *[1.19] * 18]), WITHIN_2_PERCENT)
    assert two["above the noise"]["seed"].tolist() == [0, 1]
    assert two["near the noise"]["seed"].tolist() == list(range(2, 20))
    for noise in (None, 0.0):
        assert list(basins(found([3.0, 1.0], [noise, noise]), WITHIN_2_PERCENT)) == [ALL]
    runs = found([1.019, 1.021, 2.03, 1.0], [1.0, 1.0, 2.0, None])
    np.testing.assert_array_equal(near_noise(runs, WITHIN_2_PERCENT), [True, False, True, False])


def test_chi_squared_increases_over_the_lowest_of_its_trace() -> None:
    """Of any method or, where it is lower, of the true parameters."""
    found = pd.DataFrame(
        {"seed": [0, 0, 1], "misfit": [2, 3, 5], "noise_rms": 4.0, ENCODABLE: [4, 4, 8]}
    )
    case = seen(times_s=np.arange(10.0))
    assert chi_square_increase(found, case).tolist() == [0, 12.5, 5.625]
    assert chi_square_increase(found, case, ENCODABLE).tolist() == [30, 30, 30]


def test_what_is_printed_is_rounded_or_cut_off() -> None:
    ways = [tuple(map(float, ends)) for ends in cases._ways(Decimal("1.2"))]
    assert ways == [(1.15, 1.25), (1.2, 1.3)]
    assert [tuple(map(float, ends)) for ends in cases._ways(Decimal("0"))][1] == (-1, 1)
