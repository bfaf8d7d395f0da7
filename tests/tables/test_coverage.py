import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from biogrip.errors import BiogripError
from biogrip.files import read_rows, write_object
from biogrip.physics.response import step_response, superpose
from biogrip_study.gripper.calibration import calibration_yaml
from biogrip_study.records.identifications import INTERVALS
from biogrip_study.stages import judgement as stage
from biogrip_study.stages import targets
from biogrip_study.tables.layout import Column, ShownTable, markdown_of, write
from biogrip_study.tables.study import bounds_at_truth, coverage, verdict_counts
from tests.helpers.default import study_of
from tests.helpers.problems import MODEL, TORQUE, rotation

CASE = "liquid_drop_2"
OVERLAY = """
measurement: {rate_Hz: 1.0}
identifiability: {confidence: 0.9}
cases: {endothelial_cell: null, liquid_drop_1: null}
"""


@pytest.fixture
def target(tmp_path: Path) -> Path:
    targets.simulate_target(study_of(OVERLAY).cases[CASE], tmp_path / "target.csv")
    return tmp_path / "target.csv"


def write_intervals(file: Path, rows: list[tuple[Any, ...]], quantities: Sequence[str]) -> Path:
    """With a row of nothing for quantities and seeds that have none."""
    seeds = {row[2] for row in rows}
    given = {row[1:3] for row in rows}
    lacking = [one for one in product(quantities, seeds) if one not in given]
    INTERVALS.write(file, [*rows, *((file.parent.name, *one, *[""] * 6) for one in lacking)])
    return file


QUANTITIES = "k", "k_p", "c", "c_p", "c + c_p"


def test_intervals_and_verdicts_are_counted(tmp_path: Path) -> None:
    rows = [
        # Of k = 1 three intervals, two of which hold it; two seeds judged in full.
        (CASE, "k", 0, 1.01, 0.9, 1.1, "determined", 1.005, 1.2),
        (CASE, "k", 1, 1.02, 0.9, 1.2, "", "", ""),
        (CASE, "k", 2, 1.3, 1.1, 1.5, "bounded below", 0.95, ""),
        # c_p = 1e-3 is only judged in full.
        (CASE, "c_p", 0, "", "", "", "bounded above", "", 0.5),
        (CASE, "c_p", 2, "", "", "", "bounded above", "", 0.5e-3),
        # k_p = 1e-4 is below the range that is searched, and the limit between the two.
        (CASE, "k_p", 0, "", "", "", "bounded above", "", 1.05e-4),
        (CASE, "k_p", 2, "", "", "", "not determined", "", ""),
    ]
    untold = "", "", "", "not determined", "", ""
    rows += [(CASE, quantity, seed, *untold) for seed in (0, 2) for quantity in ("c", "c + c_p")]
    file = write_intervals(tmp_path / CASE / "seeds_0-2.csv", rows, QUANTITIES)
    every_other = study_of(OVERLAY.replace("0.9}", "0.9, verdicts_every: 2}"))
    (k,) = coverage(every_other, [file]).rows
    assert (k["quantity"], k["seeds"], k["confidence_percent"]) == ("k", 3, 90.0)
    assert k["coverage_percent"] == pytest.approx(100 * 2 / 3)
    assert k["bias_percent"] == pytest.approx(100 * np.mean(np.log([1.01, 1.02, 1.3])))
    counted = verdict_counts(every_other, [file]).rows
    found = {(row["quantity"], row["verdict"]): row for row in counted}
    assert {row["seeds"] for row in counted} == {2}
    names = "target", "reached", "true"
    assert [found["k", "determined"][name] for name in names] == [1.0, 1, 0]
    assert [found["k", "bounded below"][name] for name in names] == [1.0, 1, 1]
    assert [found["k_p", "bounded above"][name] for name in names] == [1e-4, 1, 1]
    assert [found["c_p", "bounded above"][name] for name in names] == [1e-3, 2, 1]
    # A batch that lost its end is refused, whatever is left of it.
    lines = file.read_text().splitlines(keepends=True)
    for kept in range(1, len(lines)):
        file.write_text("".join(lines[:kept]))
        with pytest.raises(
            BiogripError, match=r"seeds_0-2.csv: found \d+ rows, wanted .* --forcerun"
        ):
            coverage(every_other, [file])


def test_verdicts_of_every_seed_are_counted(tmp_path: Path) -> None:
    empty = ("", "", "")
    rows = [
        # Of k = 1 two intervals within a factor of 3, one of which holds it, and one that is wider.
        (CASE, "k", 0, *empty, "determined", 0.9, 1.1),
        (CASE, "k", 1, *empty, "determined", 1.1, 1.2),
        (CASE, "k", 2, *empty, "determined", 0.2, 2.0),
        (CASE, "k", 3, *empty, "bounded above", "", 0.99),
        (CASE, "k", 4, *empty, "not determined", "", ""),
    ]
    file = tmp_path / CASE / "seeds_0-4.csv"
    INTERVALS.write(file, rows)
    overlay = OVERLAY.replace("0.9}", "0.9, verdicts_every: 1}")
    alone = f"liquid_drop_1: null, {CASE}: {{fixed: {{k_p: 0, c: 1, c_p: 0}}}}"
    made = verdict_counts(study_of(overlay.replace("liquid_drop_1: null", alone)), [file])
    found = {row["verdict"]: row for row in made.rows}
    assert list(found) == ["bounded above", "determined", "not determined"]
    assert [row["reached"] for row in found.values()] == [1, 3, 1]
    assert {row["seeds"] for row in found.values()} == {5}
    assert [row.get("true") for row in found.values()] == [0, 2, None]
    assert [row.get("narrow") for row in found.values()] == [None, 2, None]
    for count, tried, name in ((3, 5, "reached"), (2, 3, "true")):
        ends = [found["determined"][f"{name}_{end}_percent"] / 100 for end in ("from", "to")]
        assert ends == pytest.approx(binomtest(count, tried).proportion_ci(method="exact"))
    assert "at 90 %" in made.caption


CELL = [35.0, 12.3, 299.9, 1e-3]
TWINS = """
measurement: {rate_Hz: 1.0}
identifiability: {verdicts_every: 100}
cases:
  liquid_drop_1: null
  liquid_drop_2: null
  endothelial_cell: {fixed: {c_p: 1e-3}}
  twin: {sample: {model: generalized_maxwell, k: 35, k_p: 12.3, c: 299.9, c_p: 1e-3},
         fixed: {c_p: 1e-3}}
"""


def test_the_bound_of_a_case_is_that_of_its_calibration(tmp_path: Path) -> None:
    """The twin's arms are thought a hundred times as stiff; bounds by central differences."""
    study, stiffness = study_of(TWINS), {"endothelial_cell": 4.4e-7, "twin": 4.4e-5}
    logs = np.log(CELL[:3]) + 1e-5 * np.vstack((np.eye(3), -np.eye(3)))
    network = MODEL.network(np.column_stack((np.exp(logs), np.full(6, CELL[3]))))
    bounds = {}
    for name, case in study.cases.items():
        arm = replace(study.gripper.left, stiffness_Nm_per_rad=stiffness[name])
        arms = {"left": arm, "right": arm}
        (tmp_path / f"{name}.yaml").write_text(calibration_yaml(arms, arms))
        rows = [(name, "k", seed, 35.1, 34, 36, "", "", "") for seed in (1, 2)]
        write_intervals(tmp_path / name / "seeds_1-2.csv", rows, ("k", "k_p", "c"))
        thought = step_response(replace(study.gripper, left=arm, right=arm), network)
        above, below = np.split(superpose(thought, TORQUE, case.times_s), 2)
        slopes = (above - below) / 2e-5
        sigma = 0.1 * rotation(MODEL, CELL, case.times_s).max()
        bounds[name] = 100 * sigma * np.sqrt(np.linalg.inv(slopes @ slopes.T)[0, 0])
    batches = [tmp_path / name / "seeds_1-2.csv" for name in study.cases]
    calibrations = {name: tmp_path / f"{name}.yaml" for name in study.cases}
    table = coverage(replace(study, calibrations=calibrations), batches)
    assert {row["case"]: row["bound_percent"] for row in table.rows} == pytest.approx(
        bounds, rel=1e-4
    )
    assert bounds["twin"] > 1.1 * bounds["endothelial_cell"]


def test_some_seeds_are_judged_in_full(tmp_path: Path, target: Path) -> None:
    expected = tmp_path / "expected.json"
    write_object(expected, {"quantities": [{"quantity": "k", "verdict": "determined"}]})
    case = study_of(OVERLAY.replace("0.9}", "0.9, verdicts_every: 3}")).case(CASE)
    stage.estimate_intervals(case, range(2, 5), target, expected, tmp_path / "i.csv")
    found = INTERVALS.read(tmp_path / "i.csv")
    assert set(found["seed"]) == {2, 3, 4}
    assert len(found) == 15
    whole = found[found["verdict"].notna()]
    assert whole["seed"].tolist() == [3] * 5
    assert whole["quantity"].tolist() == ["k", "k_p", "c", "c_p", "c + c_p"]
    assert whole["low"].notna().tolist() == [True, False, False, False, False]
    k = whole.iloc[0]
    assert k[["shown_low", "shown_high"]].tolist() == pytest.approx([k["low"], k["high"]], rel=1e-3)


def written(table: ShownTable, folder: Path) -> list[str]:
    write(table, folder / "t.csv")
    return [markdown_of(folder / "t.html"), (folder / "t.html").read_text()]


def test_a_table_says_the_same_in_all_its_files(tmp_path: Path) -> None:
    columns = Column("case", "Case"), Column("value", "Value", 3), Column("none", "None")
    rows = [{"case": "a_b", "value": 1234.5678}, {"case": "c & d", "value": -0.0, "none": None}]
    table = ShownTable("Fifty % of a_b.", columns, [*rows, {"none": float("nan")}])
    markdown, page = written(table, tmp_path)
    found = read_rows(tmp_path / "t.csv")
    assert found == [
        ["case", "value", "none"],
        ["a_b", "1234.57", ""],
        ["c & d", "0", ""],
        ["", "", ""],
    ]
    assert "1.23e+03" in markdown
    assert "None" not in markdown + page
    assert "Fifty % of a_b." in markdown
    assert "c &amp; d" in page


def test_markup_is_text_in_every_format(tmp_path: Path) -> None:
    for given in (
        *(r"dose & \input{x} #2", "5$ a day, 10$ a week\n\n50 %"),
        *("a|b\nc {y}", "<img onerror=x> a_b ~ ^"),
    ):
        heading = given.replace("\n", " ")
        table = ShownTable(given, (Column("a", heading),), [{"a": given}])
        markdown, page = written(table, tmp_path)
        assert [len(re.findall(r"(?<!\\)\|", row)) for row in markdown.splitlines()[-3:]] == [2] * 3
        assert "<img" not in markdown + page
        assert read_rows(tmp_path / "t.csv") == [["a"], [given]]


def test_the_bound_of_a_case_is_of_its_own_calibration(tmp_path: Path) -> None:
    """An arm a thousand times stiffer leaves less of a cell to be seen."""
    study = study_of("{measurement: {rate_Hz: 1.0}, cases: {endothelial_cell: null}}")
    arm = study.cases[CASE].gripper.left
    files, batches = {}, []
    for name, times in (("liquid_drop_1", 1.0), (CASE, 1000.0)):
        stiff = replace(arm, stiffness_Nm_per_rad=times * arm.stiffness_Nm_per_rad)
        files[name] = tmp_path / f"{name}.yaml"
        arms, known = ({"left": both, "right": both} for both in (stiff, arm))
        files[name].write_text(calibration_yaml(arms, known))
        batches.append(tmp_path / name / "seeds_0-1.csv")
        rest = 1.0, 0.9, 1.1, "determined", 0.9, 1.1
        seeds = [(name, q, seed, *rest) for seed in range(2) for q in QUANTITIES]
        INTERVALS.write(batches[-1], seeds)
    study = replace(study, calibrations=files)
    rows = coverage(study, batches).rows
    for name, case in study.cases.items():
        (shown,) = (row for row in rows if (row["case"], row["quantity"]) == (name, "c + c_p"))
        alone = {quantity.label: percent for quantity, percent in bounds_at_truth(case)}
        assert shown["bound_percent"] == pytest.approx(alone["c + c_p"])
    ends = [row["bound_percent"] for row in rows if row["quantity"] == "c + c_p"]
    assert ends[1] > 10 * ends[0]
