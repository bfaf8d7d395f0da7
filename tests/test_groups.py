import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.optimize import minimize
from scipy.stats import CensoredData, norm, ttest_ind, ttest_rel

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.command.outputs import WRITTEN_BY
from biogrip.figures.cells import ONE_COLUMN_IN, draw_cells
from biogrip.judging.cells import FEWEST_CELLS, Cell, adjusted, cell_weights, compare
from biogrip.judging.censored import censored_mean, pseudo_values
from tests.helpers.identified import identify
from tests.helpers.places import ROOT
from tests.helpers.simulated_groups import DOCUMENTED, Design, in_words

# Log risk ratios of tuberculosis, with and without vaccination, and their variances: Colditz et
# al., JAMA 271 (1994), 698-702, as in Viechtbauer, Journal of Statistical Software 36 (2010), 3.
VACCINE = np.array(
    [
        *((-0.8893, 0.3256), (-1.5854, 0.1946), (-1.3481, 0.4154), (-1.4416, 0.0200)),
        *((-0.2175, 0.0512), (-0.7861, 0.0069), (-1.6209, 0.2230), (0.0120, 0.0040)),
        *((-0.4694, 0.0564), (-1.3713, 0.0730), (-0.3394, 0.0124), (0.4459, 0.5325)),
        (-0.0173, 0.0714),
    ]
).T
Said = Callable[..., str]
Rows = list[dict[str, str]]
HEADER = ["trace", "dish", "cell", "fit", "confidence", "k verdict", "k value (N/m)"]
HEADER += ["k low (N/m)", "k high (N/m)", "failed", WRITTEN_BY]
DAYS = ["trace", "day", *HEADER[1:]]


def test_published_means_and_p_values_are_found() -> None:
    """As metafor has it (``method="DL"``), and the jackknife by its definition."""
    values, errors = VACCINE[0], np.sqrt(VACCINE[1])
    weights = cell_weights(values, errors, np.zeros(13), np.full(13, ""))
    assert weights @ values == pytest.approx(-0.714084, rel=1e-5)
    assert weights.sum() == pytest.approx(1)
    pseudo = pseudo_values(values, np.zeros(13), weights, np.arange(13))
    without = [np.average(np.delete(values, n), weights=np.delete(weights, n)) for n in range(13)]
    error = np.sqrt(12 / 13 * np.sum((np.array(without) - np.mean(without)) ** 2))
    assert np.std([*pseudo.values()], ddof=1) / np.sqrt(13) == pytest.approx(error)
    assert np.mean([*pseudo.values()]) == pytest.approx(-0.714084, rel=1e-5)
    # Holm's p values by Wright, Biometrics 48 (1992), 1005-1013: 0.01 to 0.04 of four.
    assert adjusted([0.04, 0.01, 0.03, 0.02]) == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert (adjusted([0.2]), adjusted([])) == ([0.2], [])


def censored(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Values, of which the lowest three tenths and the highest tenth are bounds."""
    values = 1 + 0.4 * rng.standard_normal(count)
    low, high = np.quantile(values, [0.3, 0.9])
    sides = np.select([values < low, values > high], [-1, 1], 0)
    return np.clip(values, low, high), sides


@pytest.mark.parametrize("seed", range(3))
def test_the_censored_mean_is_that_of_the_greatest_likelihood(seed: int) -> None:
    """By SciPy's fit, to its tolerance, and by a search of the likelihood that has weights."""
    rng = np.random.default_rng(seed)
    values, sides = censored(rng, 40)
    mean = censored_mean(values, sides, np.full(40, 0.1))
    parts = values[sides == 0], values[sides < 0], values[sides > 0]
    data = CensoredData(uncensored=parts[0], left=parts[1], right=parts[2])
    assert mean == pytest.approx(norm.fit(data)[0], rel=1e-3)
    weights = rng.uniform(0.5, 2, 40)

    def loss(parameters: Array) -> float:
        of = norm(parameters[0], np.exp(parameters[1]))
        logs = [of.logpdf(values), of.logcdf(values), of.logsf(values)]
        return -float(weights @ np.choose(sides.astype(int) % 3, [logs[0], logs[2], logs[1]]))

    fit = minimize(loss, (1.0, -1.0), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    assert censored_mean(values, sides, weights) == pytest.approx(fit.x[0], abs=1e-6)


def test_a_mean_takes_two_values_that_differ_beside_bounds() -> None:
    bound = np.array([1.0, 1.0, 0.5])
    assert np.isnan(censored_mean(bound, np.array([0, 0, -1]), np.ones(3)))
    assert censored_mean(bound, np.zeros(3), np.ones(3)) == pytest.approx(2.5 / 3)
    assert pseudo_values(bound, np.array([0, 0, -1]), np.ones(3), np.arange(3)) == {}


def test_pseudo_values_are_means_of_units_where_no_cell_is_bounded() -> None:
    values, units = np.array([1.0, 2.0, 4.0, 6.0, 7.0]), np.array([*"aabbb"])
    weights = cell_weights(values, np.full(5, 0.1), np.zeros(5), units)
    means = pseudo_values(values, np.zeros(5), weights, units)
    assert means == pytest.approx({"a": 1.5, "b": 17 / 3})
    wide = np.array([0.1, 3.0, 0.1, 0.1, 0.1])
    nearer = pseudo_values(
        values, np.zeros(5), cell_weights(values, wide, np.zeros(5), units), units
    )
    assert 1 < nearer["a"] < 1.2


@pytest.mark.nightly
@pytest.mark.parametrize(("cells", "error"), [(5, 0.03), (6, 0.1), (12, 0.1), (12, 0.3)])
def test_limits_hold_the_truth_and_equal_dishes_seldom_differ(cells: int, error: float) -> None:
    """In 500 pairs 95 % are known to within 3 % (three errors), in 1000 groups to within 2 %."""
    rng = np.random.default_rng(7)
    medians, ratios, false = [], [], 0
    for _ in range(500):
        for ratio in (1.0, 1.5):
            pair = []
            for group, mean in (("a", 0.0), ("b", np.log(ratio))):
                errors = error * np.exp(0.5 * rng.standard_normal(cells))
                values = mean + np.hypot(0.3, errors) * rng.standard_normal(cells)
                known = zip(values.tolist(), errors.tolist(), strict=True)
                pair += [Cell(f"{group}{n}", group, known={"k": it}) for n, it in enumerate(known)]
            found = compare(pair, ["a", "b"], 0.95)
            row = found["k", "b"]
            if ratio == 1.0:
                false += row["p"] < 0.05
                continue
            ratios.append(row["ratio_low"] <= ratio <= row["ratio_high"])
            for group, median in (("a", 1.0), ("b", ratio)):
                own = found["k", group]
                medians.append(own["low"] <= median <= own["high"])
    assert 0.92 <= np.mean(ratios) <= 0.98
    assert 0.91 <= np.mean(medians) <= 0.97
    assert false <= 0.06 * 500


def rows_of(values: Array, group: str, **more: str) -> Rows:
    """Rows as `identify` writes them, of determined values with errors of 5 %."""
    return [
        {
            **{"trace": f"{group}{number}.csv", "dish": group, "fit": "ok", "confidence": "0.95"},
            **{"k verdict": "determined", "k value (N/m)": f"{value:.5g}"},
            **{"k low (N/m)": f"{value / 1.103:.5g}", "k high (N/m)": f"{value * 1.103:.5g}"},
            **more,
        }
        for number, value in enumerate(values)
    ]


def written(folder: Path, rows: Rows, header: Sequence[str] = HEADER) -> Path:
    pd.DataFrame(rows, columns=header).to_csv(folder / "found.csv", index=False)
    return folder / "found.csv"


@pytest.fixture
def said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Said:
    def say(rows: Rows, *options: str, header: Sequence[str] = (), part: int = 0) -> str:
        found = written(tmp_path, rows, header or (DAYS if "day" in rows[0] else HEADER))
        assert main(["groups", str(found), "--by", "dish", *options]) == 0
        return capsys.readouterr().out.split("\nFor a paper:")[part]

    return say


@pytest.fixture
def rows() -> Rows:
    rng = np.random.default_rng(1)
    return [
        *rows_of(20 * np.exp(0.1 * rng.standard_normal(5)), "left"),
        *rows_of(40 * np.exp(0.1 * rng.standard_normal(5)), "right"),
    ]


def test_what_is_left_out_is_named(said: Said, rows: Rows) -> None:
    plain = said(rows)
    assert "10 cells, 95 % limits" in plain
    assert "Without" not in plain
    more = {
        "the fit is rejected": {"fit": "rejected", "k verdict": "fit rejected"},
        "not identified": {"fit": "failed", "failed": "not there"},
        "nothing under dish": {"dish": ""},
    }
    found = said([*rows, *({**rows[0], "trace": why} | own for why, own in more.items())])
    assert found.startswith(plain.rstrip())
    for why in more:
        assert f"Left out, {why}: {why}." in found


def test_a_rejected_model_leaves_what_any_linear_sample_shows(said: Said, rows: Rows) -> None:
    """Of the model the same numbers as of any sample; a trace that no sample gives has neither."""
    free = {name: name.replace("k ", "G(1 s) ") for name in HEADER[5:9]}
    every = [row | {name: row[own] for own, name in free.items()} for row in rows]
    none = {**dict.fromkeys(HEADER[6:9], ""), "fit": "rejected", "k verdict": "fit rejected"}
    for number, linear in ((0, "yes"), (1, "no")):
        every[number] |= {**none, "linear": linear}
    found = said(every, header=[*HEADER[:-2], *free.values(), "linear", *HEADER[-2:]])
    lines = [line for line in found.splitlines() if "left  " in line]
    assert [line for line in lines if line.startswith("k (N/m)") and "3 of 3" in line]
    assert [line for line in lines if line.startswith("G(1 s) (N/m)") and "4 of 4" in line]
    assert "Left out, the fit is rejected: left1.csv." in found
    assert "Used only whatever the model, as their fits are rejected: left0.csv." in found


NONE = {"k value (N/m)": "", "k low (N/m)": "", "k high (N/m)": ""}


def test_cells_that_are_only_bounded_are_counted_and_said(
    tmp_path: Path, said: Said, rows: Rows
) -> None:
    """The larger p of two readings of a bound: as it is, and as the end of what is determined."""
    table = tmp_path / "compared.csv"
    rows[0] |= NONE | {"k verdict": "bounded below", "k low (N/m)": "30"}
    rows[1] |= NONE | {"k verdict": "not determined"}
    found = said(rows, "--csv", str(table))
    assert "3 of 5, 1 bounded" in found
    assert "k of left: bounded below in 1 (at least 30), which count as bounds." in found
    assert "k of left: nothing is told by left1.csv." in found
    told = pd.read_csv(table).set_index("group")
    assert told["bounded"].tolist() == [1, 0]
    logs = np.log([float(row["k value (N/m)"]) for row in rows[2:5]])
    data = CensoredData(uncensored=logs, right=[logs.max()])
    assert told.loc["left", "median"] == pytest.approx(np.exp(norm.fit(data)[0]), rel=1e-3)
    # All that is determined lies below 30, so that both readings are the same; with 20 they differ.
    rows[0] |= {"k low (N/m)": "20"}
    said(rows, "--csv", str(table))
    assert pd.read_csv(table).set_index("group").loc["right", "p"] >= told.loc["right", "p"]
    rows[2] |= NONE | {"k verdict": "not determined"}
    found = said(rows)
    assert "too few" in found
    assert "No p for k of right: too few cells are determined." in found


def test_a_mean_takes_cells_enough_and_half_of_all() -> None:
    known = [Cell(f"{n}", "a", known={"k": (0.1 * n, 0.1)}) for n in range(4)]
    others = [Cell(f"o{n}", "a", others={"k": ("not determined", None)}) for n in range(5)]
    bounds = [Cell(f"b{n}", "a", others={"k": ("bounded above", 1.2)}) for n in range(9)]
    assert "median" not in compare(known[: FEWEST_CELLS - 1], ["a"], 0.95)["k", "a"]
    assert "median" in compare(known[:FEWEST_CELLS], ["a"], 0.95)["k", "a"]
    assert "median" in compare(known + others[:4], ["a"], 0.95)["k", "a"]
    assert "median" not in compare(known + others, ["a"], 0.95)["k", "a"]
    assert "median" in compare(known + bounds[:8], ["a"], 0.95)["k", "a"]
    assert "median" not in compare(known + bounds, ["a"], 0.95)["k", "a"]


def test_what_doubtful_cells_change_is_said(said: Said, rows: Rows) -> None:
    plain = said(rows).partition("\n")[2]
    odd = rows_of(np.array([90.0]), "right", fit="doubtful", trace="odd.csv")
    found = said([*rows, *odd])
    _, _, without = found.partition("Without the doubtful odd.csv:\n")
    assert without == plain


def test_traces_of_a_cell_are_averaged(said: Said, rows: Rows) -> None:
    """By the inverse squares of their errors; a cell's name may stand in two groups."""
    for number, row in enumerate(rows):
        row["cell"] = f"c{number % 5}"
    twice = rows_of(np.array([30.0]), "left", trace="again.csv", cell="c0")
    twice[0] |= {"k low (N/m)": f"{30 / 1.103**2:.6g}", "k high (N/m)": f"{30 * 1.103**2:.6g}"}
    value = np.exp((4 * np.log(float(rows[0]["k value (N/m)"])) + np.log(30)) / 5)
    error = 1.103 ** np.sqrt(4 / 5)
    one = {**rows[0], "k value (N/m)": f"{value:.6g}"}
    one |= {"k low (N/m)": f"{value / error:.6g}", "k high (N/m)": f"{value * error:.6g}"}
    both = said([*rows, *twice])
    alone = said([one, *rows[1:]])
    assert both.replace("11 traces", "10 traces") == f"{alone}Averages of several traces: c0 (2).\n"


def test_several_groups_are_compared_with_the_first(tmp_path: Path, said: Said, rows: Rows) -> None:
    table, third = tmp_path / "compared.csv", rows_of(np.array([19.0, 21.0, 20.0, 22.0]), "third")
    said(rows, "--csv", str(table))
    two = pd.read_csv(table)
    said(rows + third, "--csv", str(table))
    found = pd.read_csv(table).set_index("group")
    assert found.loc["right", "p"] == pytest.approx(2 * two["p"][1], rel=1e-4)
    assert np.isnan(found.loc["left", "ratio"])
    assert found.loc["third", "unit"] == "N/m"
    assert found["cells"].tolist() == [5, 5, 4]


@pytest.mark.nightly
def test_identify_and_groups_say_the_same_of_a_cell(
    tmp_path: Path, few: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both springs of treated cells are 1.5 times as stiff, and the arms slipped in b5."""
    monkeypatch.chdir(ROOT)
    folder = tmp_path / "dishes"
    shutil.copytree(ROOT / "data" / "dishes", folder)
    options = "--config", few, "--csv", tmp_path / "found.csv", "--no-compare"
    assert identify(folder / "cells.tsv", "--model", "liquid_drop", *options)[0] == 0
    table = str(tmp_path / "compared.csv")
    given = ["--by", "treatment", "--unit", "dish", "--csv", table]
    assert main(["groups", str(tmp_path / "found.csv"), *given]) == 0
    found = capsys.readouterr().out
    documented = (ROOT / "docs" / "groups.md").read_text(encoding="utf-8")
    assert found.partition("\n")[2].partition("Left out")[0] in documented
    assert f"Left out, the fit is rejected: {folder / 'b5.csv'}." in found
    assert "Averages of several traces: a2 (2)." in found
    ratios = pd.read_csv(table).query("group == 'treated'").set_index("quantity")
    assert ratios["cells"].tolist() == [5] * 6
    for quantity, ratio in (("k", 1.5), ("k_p", 1.5), ("c", 1.0)):
        row = ratios.loc[quantity]
        assert row["ratio_low"] < ratio < row["ratio_high"]


@pytest.mark.nightly
@pytest.mark.parametrize("name", DOCUMENTED)
def test_levels_and_powers_are_as_documented(name: str) -> None:
    said = (ROOT / "docs" / "groups.md").read_text(encoding="utf-8")
    assert f"| {name} | {in_words(DOCUMENTED[name])} |" in said


NIGHTLY = pytest.mark.nightly


@pytest.mark.parametrize(
    ("design", "least", "most"),
    [
        (Design(units=(3, 6), scatter=(0.1, 0.1)), 2, 8),
        (Design(units=(3, 3), days=0.35, scatter=(0.1, 0.1)), 2, 8),
        pytest.param(Design(units=(4, 4), bounded=(0, 0.28), bound="own"), 0, 7, marks=NIGHTLY),
        pytest.param(Design(units=(4, 4), bounded=(0, 0.28), bound="noise"), 0, 8, marks=NIGHTLY),
        (Design(units=(3, 3), days=0.35, scatter=(0.05, 0.05), ratio=1.4), 40, 100),
    ],
    ids=str,
)
def test_equal_groups_differ_as_often_as_p_says(design: Design, least: int, most: int) -> None:
    """Of 200 tables: three standard deviations of 5 % are 4.6 %."""
    small, tiny, told = design.shares(200)
    assert least <= small <= most + 2
    assert tiny <= 4 or design.ratio > 1
    assert told > 95


FEW = "p takes 3 units"


@pytest.mark.parametrize(
    ("first", "later", "test"),
    [
        ("1", "2", FEW),
        ("12", "34", FEW),
        ("12", "3456789", FEW),
        ("123", "456", "Welch of 3 and 3"),
        ("123", "456789", "Welch of 3 and 6"),
        ("123", "456789X", FEW),
        ("1234", "56789XYZUV", "Welch of 4 and 10"),
        ("1", "12", FEW),
        ("123", "345", FEW),
        ("123", "234", "2 pairs"),
        ("1234567", "7654321", "7 pairs"),
        ("12", "123456789", "2 pairs"),
        ("1", "1", FEW),
        ("12", "12", "2 pairs"),
        ("123", "123", "3 pairs"),
        ("1234", "123", "3 pairs"),
        ("1234", "1256", "2 pairs"),
        ("1234", "1567", "Welch of 3 and 3"),
        ("12345", "12678", "Welch of 3 and 3"),
        ("123", "145", FEW),
    ],
)
def test_which_units_are_compared(first: str, later: str, test: str) -> None:
    """Each unit has two cells, whose mean is its own number, so that SciPy has the p value."""
    rng = np.random.default_rng(2)
    values = {
        key: rng.normal() for key in [*(f"a{it}" for it in first), *(f"b{it}" for it in later)]
    }
    cells = [
        Cell(f"{key}{sign}", key[0], key[1], known={"k": (value + sign * 0.01, 0.01)})
        for key, value in values.items()
        for sign in (-1, 1)
    ]
    row = compare(cells, ["a", "b"], 0.95, units=True)["k", "b"]
    both = [it for it in later if it in first]
    alone = [
        [values[f"{group}{it}"] for it in of if it not in both]
        for group, of in (("a", first), ("b", later))
    ]
    if test == FEW:
        assert row["no_p"].startswith(FEW)
        assert "p" not in row
    elif "pairs" in test:
        assert f"{row['pairs']} pairs" == test
        pairs = ([values[f"{group}{it}"] for it in both] for group in "ba")
        assert row["p"] == pytest.approx(ttest_rel(*pairs).pvalue)
    else:
        assert test == f"Welch of {len(alone[0])} and {len(alone[1])}"
        assert row["pairs"] == 0
        assert row["p"] == pytest.approx(ttest_ind(*alone, equal_var=False).pvalue)


def test_a_mean_that_hangs_on_one_dish_has_no_p() -> None:
    cells = Design(units=(3, 3)).table(np.random.default_rng(3))
    for cell in cells:
        if cell.unit in ("b1", "b2"):
            cell.known, cell.others = {}, {"k": ("bounded above", 0.5)}
    row = compare(cells, ["a", "b"], 0.95, units=True)["k", "b"]
    assert row["no_p"] == "a mean hangs on one unit, as elsewhere cells are only bounded"
    assert row["ratio"] < 1
    cells[-24].known, cells[-24].others = {}, {"k": ("bounded above", 0.5)}
    row = compare(cells, ["a", "b"], 0.95, units=True)["k", "b"]
    assert row["no_p"] == "too few cells are determined"


def test_of_two_units_in_a_group_there_is_no_p() -> None:
    cells = Design(units=(2, 10)).table(np.random.default_rng(1))
    row = compare(cells, ["a", "b"], 0.95, units=True)["k", "b"]
    assert "p" not in row
    assert "3 units in each group, 4 beside more than 6, or 2 that are in both" in row["no_p"]
    assert "ratio" in row
    assert "ratio_low" not in row
    first = compare(cells, ["a", "b"], 0.95, units=True)["k", "a"]
    reach = 12.7062 * first["scatter_of_units"] / np.sqrt(2)
    assert first["high"] == pytest.approx(first["median"] * np.exp(reach), rel=1e-4)


def in_dishes(
    rng: np.random.Generator, scatter: float, ratio: float = 1.0, dishes: Sequence[int] = (3, 3)
) -> list[Cell]:
    """Ten cells a dish that scatter by 25 %, each known to 5 %."""
    return [
        Cell(f"{number}", "ab"[group], f"{'ab'[group]}{dish}", known={"k": (value + mean, 0.05)})
        for group, count in enumerate(dishes)
        for dish in range(count)
        for mean in [rng.normal(0, scatter) + group * np.log(ratio)]
        for number, value in enumerate(rng.normal(0, np.hypot(0.25, 0.05), 10).tolist())
    ]


def differ(scatter: float, ratio: float, *, units: bool, dishes: Sequence[int] = (3, 3)) -> int:
    rng = np.random.default_rng(4)
    tables = (in_dishes(rng, scatter, ratio, dishes) for _ in range(400))
    found = (compare(cells, ["a", "b"], 0.95, units=units)["k", "b"]["p"] for cells in tables)
    return sum(p < 0.05 for p in found)


@pytest.mark.nightly
def test_equal_cells_of_dishes_often_differ() -> None:
    """Shares of tables that docs/groups.md says; three standard deviations are 7 %."""
    said = (ROOT / "docs" / "groups.md").read_text(encoding="utf-8")
    for scatter in (0.0, 0.1, 0.2):
        shares = (differ(scatter, 1.0, units=units) / 4 for units in (False, True))
        assert f"| 3 | {100 * scatter:g} % | " + " | ".join(f"{it:.0f} %" for it in shares) in said


@pytest.mark.nightly
@pytest.mark.parametrize(("scatter", "ratio", "dishes"), [(0.2, 1.5, 6), (0.2, 1.3, 12)])
def test_enough_dishes_tell_a_ratio(scatter: float, ratio: float, dishes: int) -> None:
    """By the rule of docs/groups.md in eight of ten; three standard deviations of 400 are 6 %."""
    assert dishes == np.ceil(1 + 16 * (scatter**2 + 0.25**2 / 10) / np.log(ratio) ** 2)
    assert 0.74 <= differ(scatter, ratio, units=True, dishes=(dishes, dishes)) / 400 <= 0.9


def of_dishes(rng: np.random.Generator, dishes: Sequence[int], **more: str) -> Rows:
    """Rows of two treatments whose dishes and cells are numbered anew: 1, 2, ... in each."""
    return [
        row | {"trace": f"{group}{dish}{n}", "dish": group, "day": f"{dish}", "cell": f"{n}"} | more
        for group, count in zip(("left", "right"), dishes, strict=True)
        for dish in range(count)
        for n, row in enumerate(rows_of(20 * np.exp(rng.normal(rng.normal(0, 0.2), 0.2, 5)), ""))
    ]


def named_apart(rows: Rows) -> Rows:
    return [row | {"day": f"{row['dish']} {row['day']}"} for row in rows]


def means_of(rows: Rows) -> Any:
    """Errors of all cells are alike, so that a unit's mean is a plain one."""
    frame = pd.DataFrame(rows)
    frame["log"] = np.log(frame["k value (N/m)"].astype(float))
    return frame.groupby(["dish", "day"])["log"].mean()


def test_units_are_compared_by_the_t_test_of_their_means(tmp_path: Path, said: Said) -> None:
    """SciPy has the test."""
    rows = named_apart(of_dishes(np.random.default_rng(5), (3, 4)))
    table = tmp_path / "compared.csv"
    found = said(rows, "--unit", "day", "--csv", str(table))
    assert "35 traces, 35 cells, 7 units (day), 95 % limits" in found
    assert "15 of 15" in found
    assert "These are pairs" not in found
    means = means_of(rows)
    known = ttest_ind(means["right"], means["left"], equal_var=False)
    told = pd.read_csv(table).set_index("group").loc["right"]
    assert told["p"] == pytest.approx(known.pvalue, rel=1e-3)
    limits = np.exp([*known.confidence_interval(0.95)])
    assert told[["ratio_low", "ratio_high"]].to_numpy(float) == pytest.approx(limits, rel=1e-3)
    assert told["median"] == pytest.approx(np.exp(means["right"].mean()), rel=1e-3)
    assert told["scatter_of_units"] == pytest.approx(means["right"].std(), rel=1e-2)
    assert told["pairs"] == 0
    moved = said(rows, "--unit", "day", header=sorted(DAYS))
    assert moved.splitlines()[:5] == found.splitlines()[:5]


@pytest.mark.parametrize("more", [0, 1])
def test_units_in_both_groups_are_pairs(tmp_path: Path, said: Said, more: int) -> None:
    """SciPy has the test; a day of one group alone is left out of it, and of no mean."""
    rows, table = of_dishes(np.random.default_rng(5), (3, 3 + more)), tmp_path / "compared.csv"
    found = said(rows, "--unit", "day", "--csv", str(table))
    means = means_of(rows)
    known = ttest_rel(means["right"].to_numpy()[:3], means["left"])
    told = pd.read_csv(table).set_index("group").loc["right"]
    assert told["p"] == pytest.approx(known.pvalue, rel=1e-3)
    limits = np.exp([*known.confidence_interval(0.95)])
    assert told[["ratio_low", "ratio_high"]].to_numpy(float) == pytest.approx(limits, rel=1e-3)
    assert told["median"] == pytest.approx(np.exp(means["right"].mean()), rel=1e-3)
    assert told["pairs"] == 3
    assert "day in left and right: 0, 1, 2. These are pairs, of which ratio and p are" in found
    assert ("left out of ratio and p: 3" in found) == bool(more)
    paper = " ".join(said(rows, "--unit", "day", part=1).split())
    assert "by the paired t test of each day that is in both groups" in paper
    assert "Welch" not in paper


def test_few_pairs_among_more_other_units_are_left_out(said: Said) -> None:
    rows = of_dishes(np.random.default_rng(5), (4, 4))
    for row in rows:
        row["day"] += row["dish"] * (row["day"] != "0")
    found = said(rows, "--unit", "day")
    assert "day in left and right: 0. These are fewer than those of one group alone" in found
    known = ttest_ind(*(means_of(rows)[it].drop("0") for it in ("right", "left")), equal_var=False)
    assert found.splitlines()[4].endswith(f"{known.pvalue:#.2g}")


def test_a_column_that_nests_tells_cells_apart_and_is_named(said: Said) -> None:
    found = said(named_apart(of_dishes(np.random.default_rng(6), (3, 3))))
    assert "30 traces, 30 cells, 95 % limits" in found
    assert "Averages" not in found
    assert (
        "Column day puts 30 cells into 6 units. If these are what was repeated, cells are not "
        "independent, and p is that of --unit day."
    ) in found


def test_cells_that_are_numbered_anew_are_averaged_and_said(said: Said) -> None:
    found = said(of_dishes(np.random.default_rng(6), (3, 3)))
    assert "30 traces, 10 cells" in found
    assert "Averages of several traces: 10 of them." in found
    assert "Column day puts 30 cells into 6 units." in found


def test_of_one_unit_a_group_nothing_is_told_but_means(said: Said) -> None:
    rows = named_apart(of_dishes(np.random.default_rng(7), (3, 1)))
    lines = said(rows, "--unit", "day").splitlines()
    assert "(" in lines[3].split("15 of 15")[1]
    median = np.exp(means_of(rows)["right"].iloc[0])
    ratio = median / np.exp(means_of(rows)["left"].mean())
    assert lines[4].split()[-3:] == [f"{median:.3g}", f"{ratio:.3g}", "none"]
    assert lines[5] == (
        "No p for k of right: p takes 3 units in each group, 4 beside more than 6, or 2 that are "
        "in both."
    )
    paper = said(rows, "--unit", "day", part=1)
    assert "Logarithms of means" not in paper


def test_a_dish_of_one_cell_counts_as_another(said: Said) -> None:
    rows = named_apart(of_dishes(np.random.default_rng(8), (3, 3)))
    found = said(rows[4:], "--unit", "day")
    means = means_of(rows[4:])
    known = ttest_ind(means["right"], means["left"], equal_var=False)
    assert found.splitlines()[4].endswith(f"{known.pvalue:#.2g}")


def test_a_cell_with_wide_limits_weighs_less(tmp_path: Path, said: Said) -> None:
    rows = named_apart(of_dishes(np.random.default_rng(8), (3, 3)))
    rows[0] |= {"k value (N/m)": "2000", "k low (N/m)": "20", "k high (N/m)": "200000"}
    table = tmp_path / "compared.csv"
    said(rows, "--unit", "day", "--csv", str(table))
    wide = pd.read_csv(table)["median"][0]
    said(rows[1:], "--unit", "day", "--csv", str(table))
    assert wide == pytest.approx(pd.read_csv(table)["median"][0], rel=0.02)


def test_three_groups_on_the_same_days_are_pairs_with_a_family(tmp_path: Path, said: Said) -> None:
    rows, table = of_dishes(np.random.default_rng(9), (4, 4)), tmp_path / "compared.csv"
    third = [row | {"dish": "third", "trace": f"t{row['trace']}"} for row in rows[20:]]
    for number, row in enumerate(third):
        row["k value (N/m)"] = f"{float(row['k value (N/m)']) * (1 + 0.03 * (number % 3)):.5g}"
        row["k high (N/m)"] = f"{float(row['k value (N/m)']) * 1.103:.5g}"
    said([*rows, *third], "--unit", "day", "--csv", str(table))
    means = means_of([*rows, *third])
    ps = [ttest_rel(means[it], means["left"]).pvalue for it in ("right", "third")]
    assert pd.read_csv(table)["p"][1:].tolist() == pytest.approx(adjusted(ps), rel=0.02)


def test_a_quantity_that_no_cell_determines_takes_a_line(said: Said) -> None:
    rows = of_dishes(np.random.default_rng(8), (3, 3))
    of = [name.replace("k ", "c_p ") for name in HEADER[5:9]]
    for number, row in enumerate(rows):
        row |= {of[0]: "bounded above", of[3]: f"{6 + number}"}
    found = said(rows, "--unit", "day", header=[*DAYS[:-2], *of, *DAYS[-2:]])
    lines = [line for line in found.splitlines() if "c_p" in line]
    assert lines == [
        "c_p of left: bounded above in 15 (at most 6 to 20).",
        "c_p of right: bounded above in 15 (at most 21 to 35).",
        "No p for c_p of right: too few cells are determined.",
    ]


def test_limits_of_traces_without_noise_may_be_equal(said: Said) -> None:
    values = np.array([20.0, 22.0, 21.0])
    rows = [*rows_of(values, "left"), *rows_of(values, "right")]
    for number, row in enumerate(rows):
        row |= dict.fromkeys(("k low (N/m)", "k high (N/m)"), row["k value (N/m)"])
        row["day"] = f"{number % 3}"
    assert "1.00 (0.90 to 1.11)  1.0" in said(rows)
    again = said(rows, "--unit", "day")
    assert again.splitlines()[4].split()[-1] == "1.0"


def test_another_table_is_refused_with_its_place(tmp_path: Path, capsys: Any) -> None:
    for by, name, value, said in (
        ("dich", "", "", "Did you mean 'dish'?"),
        ("dish", "trace", None, "found no column 'trace'"),
        ("cell", "", "", "found limits of no trace of a group"),
        ("dish", "confidence", "0.9", "found limits of 0.9 and 0.95; allowed are those of one"),
        ("dish", "k value (N/m)", "10,1", "allowed is a number of at least"),
        ("dish", "k low (N/m)", "nan", "allowed is a number above 0"),
        ("dish", "k low (N/m)", "0", "allowed is a number above 0"),
        ("dish", "k high (N/m)", "inf", "allowed is a number of at least"),
        ("dish", "k verdict", "certain", "allowed is determined, bounded below"),
        ("dish", "fit", "good", "allowed is ok, doubtful, rejected, failed"),
        ("dish", "confidence", "95", "allowed is a number from 0.5 to 0.99"),
    ):
        rows = rows_of(np.array([20.0, 21.0, 22.0]), "left")
        rows[1][name] = str(value)
        header = [column for column in HEADER if value is not None or column != name]
        assert main(["groups", str(written(tmp_path, rows, header)), "--by", by]) == 1
        error = capsys.readouterr().err
        where = f"found.csv, row 3 (left1.csv), {name}: found '{value}'; "
        assert where * said.startswith("allowed") + said in error
        assert error.count("\n") == 1


def test_a_table_that_lost_its_end_is_refused(tmp_path: Path, capsys: Any) -> None:
    """A last row that is whole needs no end of its line."""
    found = written(tmp_path, rows_of(np.array([20.0, 21.0, 22.0]), "left"))
    whole = found.read_text()
    for end, status in ((-1, 0), (whole.rindex(",") - 1, 1), (whole.rindex(",") - 40, 1)):
        found.write_text(whole[:end])
        assert main(["groups", str(found), "--by", "dish"]) == status
        assert ("part of the line is missing" in capsys.readouterr().err) == status


def test_the_methods_say_what_was_compared_with_its_numbers(said: Said) -> None:
    """Every number is one of the table or of the test; none else is there."""
    rows = named_apart(of_dishes(np.random.default_rng(3), (3, 4)))
    set_up = "The strain was recorded under 5 Pa. Limits hold with 95 % confidence."
    more = {"methods": set_up, "reasons": "", "fit": "ok"}
    rows = [row | more for row in rows]
    rows[1] |= {"fit": "rejected", "reasons": "The misfit is 4.5 times the noise: it is none."}
    rows[2] |= {"methods": set_up.replace("5 Pa", "7 Pa")}
    header = [*DAYS[:-2], "methods", "reasons", *DAYS[-2:]]
    found = said(rows, "--unit", "day", header=header, part=1)
    text = " ".join(found.split())
    assert text.startswith(
        "The strain was recorded under 5, 7 Pa. Limits hold with "
        "95 % confidence. 34 of 35 traces were used. Rejected: 1 (left01). "
        "Groups are those of dish: left 14 cells in 3 units; right 20 cells in 4 units."
    )
    assert "The unit is the day" in text
    assert "Logarithms of means are compared by Welch's t test; p is not adjusted" in text
    assert "LaTeX" not in text
    about = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    who = f"{about['authors'][0]['name']}, {about['title']}: how well a MEMS"
    assert f"Computed with biogrip {about['version']} ({who}" in text
    assert text.endswith(f", version {about['version']}, {about['date-released'].year}).")


def test_a_figure_is_the_same_bytes_again(tmp_path: Path, said: Said) -> None:
    rows = of_dishes(np.random.default_rng(9), (3, 3))
    none = {"k value (N/m)": "", "k low (N/m)": ""}
    rows[0] |= {**none, "k verdict": "bounded above", "k high (N/m)": "90"}
    for name in ("cells.png", "cells.pdf"):
        drawn = []
        for _ in range(2):
            said(rows, "--unit", "day", "--plot", str(tmp_path / name))
            drawn.append((tmp_path / name).read_bytes())
        assert drawn[0] == drawn[1]


def drawn_of(cells: Sequence[Cell], *, units: bool) -> Any:
    compared = compare(cells, ["a", "b"], 0.95, units=units)
    drawn = draw_cells(cells, compared, {"k": "N/m"}, ONE_COLUMN_IN, "dish" if units else None)
    return drawn.axes[0], compared


def large_marks(axes: Any) -> list[Any]:
    return [line for line in axes.lines if line.get_markersize() == 6]


def test_points_lie_where_the_numbers_are() -> None:
    cells = in_dishes(np.random.default_rng(1), 0.2, 1.5)
    cells[0].known, cells[0].others = {}, {"k": ("bounded above", 90.0)}
    axes, compared = drawn_of(cells, units=True)
    points = [line for line in axes.lines if line.get_markersize() == 3]
    levels = [float(np.ravel(line.get_ydata())[0]) for line in points]
    assert levels == pytest.approx([90.0, *(np.exp(it.known["k"][0]) for it in cells[1:])])
    assert [line.get_marker() for line in points] == ["v", *["o"] * 59]
    assert len(axes.lines) == 60 + 6
    ((_, low), (_, high)) = axes.collections[0].get_segments()[1]
    ends = [np.exp(cells[1].known["k"][0] + side * 1.96 * 0.05) for side in (-1, 1)]
    assert [low, high] == pytest.approx(ends, rel=1e-4)
    told = [text.get_text() for text in axes.texts]
    assert f"p = {compared['k', 'b']['p']:#.2g}" in told[0]
    assert axes.get_ylabel() == "k (N/m)"
    # Two colours of one unit would be two dishes.
    assert len({line.get_color() for line in points[:30]}) == 3


def test_units_of_one_group_look_like_none_of_another() -> None:
    """By colour and mark; a unit in both groups has one look, and its means are joined."""
    cells = in_dishes(np.random.default_rng(1), 0.2)
    axes, _ = drawn_of(cells, units=True)
    looks = [(line.get_color(), line.get_marker()) for line in large_marks(axes)]
    assert len({*looks}) == len(looks) == 6
    for cell in cells:
        cell.unit = cell.unit.replace("b0", "a0")
    axes, _ = drawn_of(cells, units=True)
    assert [len(line.get_xdata()) for line in large_marks(axes)] == [2, 1, 1, 1, 1]
    looks = [(line.get_color(), line.get_marker()) for line in large_marks(axes)]
    assert len({*looks}) == 5
    said = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert "dish, joined if the same" in said
    assert len(said) == 5


def test_ticks_are_numbers_however_far_values_span() -> None:
    cells = in_dishes(np.random.default_rng(1), 0.2)
    for number, cell in enumerate(cells):
        cell.known["k"] = np.log(4) + number / 30, 0.05
    for last, ticks in ((None, 4), (50.0, 4)):
        if last:
            cells[-1].known["k"] = np.log(last), 0.05
        axes = drawn_of(cells, units=False)[0]
        assert axes.get_yscale() == "log"
        axes.figure.draw_without_rendering()
        low, high = axes.get_ylim()
        labels = zip(axes.get_yticklabels(), axes.get_yticks(), strict=True)
        shown = [label.get_text() for label, place in labels if low <= place <= high]
        assert len(shown) >= ticks
        assert [f"{float(it):g}" for it in shown] == shown
