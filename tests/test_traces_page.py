"""The page of identified traces: its numbers, and in a real browser its table and drawings."""

import json
import re
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from biogrip.arrays import Array
from biogrip.figures import style
from biogrip.figures.results import Fit, fit_of
from biogrip.identify.curves import curves_of, normal_quantiles
from biogrip.identify.on_page import for_page
from biogrip.identify.one_trace import Identified, IdentifyOptions, identify_trace
from biogrip.identify.page import write_page
from biogrip.identify.read_as import ReadAs
from biogrip.terminal import visible
from tests.helpers.browser import Opened
from tests.helpers.places import EXAMPLE, ROOT

FEW = """
least_squares: {candidates: 100, starts: 4}
model_selection: {models: [damper, maxwell]}
"""
HOSTILE = "</script><b onclick=x>&amp;"
MOST_BYTES, MOST_SECONDS = 10_240, 0.01
ROWS, MOST_BYTES_OF_MANY, MOST_SECONDS_TO_OPEN = 1000, 15_000_000, 10.0
LEVELS = ("control", "treated")


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Identified:
    folder = tmp_path_factory.mktemp("one")
    config = folder / "few.yaml"
    config.write_text(FEW)
    options = IdentifyOptions(EXAMPLE, "generalized_maxwell", ReadAs(), config)
    return identify_trace(options, folder / "found.json")


def fit_in(found: Identified) -> Fit:
    values = {item["quantity"]: item["value"] for item in found.data["quantities"]}
    parameters = {name: values[name] for name in found.problem.searched.names}
    return fit_of(found.problem, parameters, found.recorded, 0)


@pytest.fixture(scope="module")
def curves(identified: Identified) -> dict[str, Any]:
    return curves_of(identified)


def test_a_trace_takes_few_bytes_and_milliseconds(identified: Identified) -> None:
    spent = []
    for _ in range(5):
        start = time.process_time()
        found = for_page(identified)
        spent.append(time.process_time() - start)
    assert min(spent) < MOST_SECONDS
    assert len(found["curves"]) < MOST_BYTES
    assert max(map(len, re.findall(r"\d+", found["curves"]))) <= 8


def test_few_readings_are_drawn_with_the_extremes_among_them(
    identified: Identified, curves: dict[str, Any]
) -> None:
    fit = fit_in(identified)
    left = (fit.measured_rad - fit.fitted_rad) / np.std(fit.measured_rad - fit.fitted_rad)
    assert curves["samples"] == len(left) > len(curves["time"])
    assert len(curves["time"]) == len(curves["read"]) == len(curves["left"]) <= 300
    np.testing.assert_allclose(np.sort(curves["left"])[:15], np.sort(left)[:15], atol=1e-3)
    np.testing.assert_allclose(np.sort(curves["left"])[-15:], np.sort(left)[-15:], atol=1e-3)
    factor = np.max(curves["read"]) / fit.measured_rad.max()
    assert np.log10(factor) == pytest.approx(round(float(np.log10(factor))), abs=1e-3)
    assert (
        curves["reads"]
        == {3: "closing rotation (mrad)", 6: "closing rotation (µrad)"}[
            round(float(np.log10(factor)))
        ]
    )
    assert np.min(curves["read"]) == pytest.approx(factor * fit.measured_rad.min(), abs=1e-2)
    # What is left times its standard deviation is between reading and fit.
    fitted = np.interp(curves["time"], fit.time_s, factor * fit.fitted_rad)
    between = np.subtract(curves["read"], fitted)
    shown = np.multiply(curves["left"], curves["deviation"])
    np.testing.assert_allclose(shown, between, atol=2e-3 * np.ptp(curves["read"]))


def test_straight_lines_between_few_points_are_the_fit(
    identified: Identified, curves: dict[str, Any]
) -> None:
    fit = fit_in(identified)
    times, values = (np.array(part) for part in curves["fit"])
    assert len(times) <= 200
    factor = values[-1] / fit.fitted_rad[-1]
    drawn = np.interp(fit.time_s, times, values)
    np.testing.assert_allclose(drawn, factor * fit.fitted_rad, atol=1.5e-3 * np.ptp(values))


def test_residuals_are_told_as_textbooks_have_them(
    identified: Identified, curves: dict[str, Any]
) -> None:
    fit = fit_in(identified)
    left = fit.measured_rad - fit.fitted_rad
    left = left / np.std(left)
    from_mean = left - left.mean()
    plain = [np.sum(from_mean[lag:] * from_mean[:-lag]) for lag in range(1, 41)]
    expected = np.array(plain) / np.sum(from_mean**2)
    np.testing.assert_allclose(curves["correlation"], expected, atol=1e-3)
    assert curves["white"] == pytest.approx(1.96 / np.sqrt(len(left)), rel=1e-3)
    middles, means = curves["blocks"]
    size = len(left) / len(means)
    assert np.sum(np.multiply(means, size)) == pytest.approx(np.sum(left), abs=0.02 * len(left))
    first = slice(0, int(np.ceil(size)))
    assert means[0] == pytest.approx(np.mean(left[first]), abs=2e-3)
    assert middles[0] == pytest.approx(np.mean(fit.time_s[first]), abs=0.1)
    assert curves["quantiles"][50] == pytest.approx(np.quantile(left, 0.505), abs=1e-3)
    assert normal_quantiles(1000)[97] == pytest.approx(1.96, abs=3e-3)


def test_a_narrow_profile_keeps_its_shape(identified: Identified, curves: dict[str, Any]) -> None:
    """Four digits of the width, not of the value."""
    for item, drawn in zip(identified.data["quantities"], curves["profiles"], strict=True):
        values, rises = drawn["values"], drawn["increases"]
        assert len(values) <= 150
        width = (item["high"] or values[-1]) - (item["low"] or values[0])
        at = np.array(item["profile"]["values"])
        for value in values[1:-1]:
            assert np.min(np.abs(at - value)) < 1e-3 * width
        assert min(rises) < 0.1
        assert drawn["closed"] == [item["low"] is not None, item["high"] is not None]


def test_over_decades_the_axes_are_logarithmic(identified: Identified) -> None:
    times = np.geomspace(0.01, 400.0, 200)
    problem = identified.problem
    values = {q["quantity"]: q["value"] for q in identified.data["quantities"]}
    names = problem.searched.names
    rotation = fit_of(
        problem,
        {name: values[name] for name in names},
        replace(identified.recorded, time_s=times, rotation_rad={0: np.ones(200)}),
        0,
    ).fitted_rad
    noisy = rotation * (1 + 0.01 * np.random.default_rng(0).standard_normal(200))
    recorded = replace(identified.recorded, time_s=times, rotation_rad={0: noisy})
    found = curves_of(replace(identified, recorded=recorded))
    assert found["log"] == [True, True]
    # In proportion: the shortest times have as many digits as the longest.
    away = np.abs(np.log(np.divide.outer(found["time"], times))).min(axis=1)
    np.testing.assert_allclose(away, 0.0, atol=1e-3)


def test_colours_are_those_of_the_figures() -> None:
    css = (ROOT / "src/biogrip/identify/traces.css").read_text()
    colours = {"measured": style.MEASURED, "fitted": style.FITTED, "green": style.GREEN}
    colours |= {"shade": style.SHADE, "grey": style.GREY, "amber": style.COLORS["amber"]}
    for name, colour in colours.items():
        assert f"--{name}: {colour};" in css


# In a browser.


def made_up(of: dict[str, Any], number: int) -> dict[str, Any]:
    """A trace of a dish: the same one with values of its own, some doubtful or rejected."""
    factor = 1 + 0.1 * (number * 7 % 12)
    fit = {3: "doubtful", 8: "rejected"}.get(number % 12, "ok")
    quantities = []
    for item in of["quantities"]:
        own = {name: item[name] and factor * item[name] for name in ("value", "low", "high")}
        own = {**item, **own}
        if fit == "rejected":
            own |= {"low": None, "high": None, "verdict": "fit rejected"}
        elif item["quantity"] == "k" and number % 12 == 5:
            own |= {"high": None, "verdict": "bounded below"}
        elif item["quantity"] == "k" and number % 12 == 6:
            own |= {"low": None, "high": None, "verdict": "not determined"}
        quantities.append(own)
    return {
        **of,
        "trace": f"dish/{number}.csv",
        "fit": fit,
        "quantities": quantities,
        "reasons": ["Something is odd."] if fit != "ok" else [],
    }


@pytest.fixture(scope="module")
def of_example(identified: Identified) -> dict[str, Any]:
    return for_page(identified)


@pytest.fixture(scope="module")
def dish(of_example: dict[str, Any]) -> list[dict[str, Any]]:
    return [made_up(of_example, number) for number in range(12)]


def copied(traces: Sequence[dict[str, Any]]) -> dict[str, dict[str, str]]:
    """Words of a table about each trace."""
    return {
        each["trace"]: {
            "cell": f"cell {number}",
            "dish": LEVELS[number % 2],
            "passage": f"P{number % 3}",
        }
        for number, each in enumerate(traces)
    }


@pytest.fixture(scope="module")
def page(dish: list[dict[str, Any]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dish") / "page.html"
    traces = [*dish[:-1], {**dish[-1], "trace": visible(HOSTILE)}]
    words = copied(traces)
    words[traces[-1]["trace"]]["cell"] = HOSTILE
    write_page(traces, {"bad.csv": "bad.csv, line 2: found 'high'."}, path, words)
    return path


def rows(opened: Opened) -> list[str]:
    shown = "[...document.querySelectorAll('table.traces > tbody')].filter(b => !b.hidden)"
    texts: list[str] = opened.page.evaluate(f"{shown}.map(b => b.rows[0].cells[0].textContent)")
    return texts


@pytest.fixture
def opened(browser: Any, page: Path) -> Any:
    found = Opened(browser, page)
    yield found
    assert found.problems == []
    assert found.asked == []
    found.context.close()


def ticks(page: Any, axis: str) -> tuple[Array, Array]:
    """Numbers and places, in the drawing, of the ticks of the first profile."""
    script = f"""[...document.querySelectorAll('#detail-1 [data-draw=profiles] svg[role=img]')][0]
        .querySelectorAll('.tick-{axis}')"""
    found = page.evaluate(
        f"[...{script}].map(t => [Number(t.textContent), +t.getAttribute('{axis}')])"
    )
    numbers, places = np.array(found).T
    return numbers, places


def test_a_row_opens_its_drawings(opened: Opened, dish: list[dict[str, Any]]) -> None:
    page = opened.page
    assert page.locator("tr.detail figure svg").count() == 0
    button = page.locator("#trace-1 button.open")
    assert button.get_attribute("aria-expanded") == "false"
    button.press("Enter")
    assert button.get_attribute("aria-expanded") == "true"
    data = json.loads(dish[0]["curves"])
    for path in page.locator("#detail-1 [data-draw=trace] .dots.measured").all()[:2]:
        assert path.get_attribute("d").count("M") == len(data["time"])
    assert page.locator("#detail-1 [data-draw=trace] text").filter(has_text="rad)").count() == 2
    assert page.locator("#detail-1 [data-draw=residuals] svg[role=img]").count() == 3
    assert page.locator("#detail-1 [data-draw=profiles] svg[role=img]").count() == 5
    assert page.locator("#detail-2 svg").count() == 0
    words = page.locator("#detail-1").inner_text()
    for item in dish[0]["quantities"]:
        assert item["in_words"] in words
    button.click()
    assert not page.locator("#detail-1").is_visible()


def test_a_profile_crosses_its_threshold_at_the_limits(
    opened: Opened, identified: Identified
) -> None:
    """Read from the drawing by its ticks, as a reader does; by the interpolation of the figures."""
    opened.page.locator("#trace-1 button.open").click()
    item = identified.data["quantities"][0]
    assert item["verdict"] == "determined"
    line = opened.page.locator("#detail-1 [data-draw=profiles] .fitted:not(.key *)").first
    places = np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", line.get_attribute("d")), dtype=float)
    (numbers, at), (rises, heights) = ticks(opened.page, "x"), ticks(opened.page, "y")
    assert len(numbers) >= 2
    assert 0.0 in rises
    values = np.interp(places[:, 0], at, numbers)
    slope, start = np.polyfit(at, numbers, 1)
    values = start + slope * places[:, 0]
    slope, start = np.polyfit(heights - 3.8, rises, 1)
    found = start + slope * places[:, 1]
    profile = item["profile"]
    exact = PchipInterpolator(np.log(profile["values"]), np.sqrt(profile["increases"]))
    inside = found < 12
    drawn = np.sqrt(np.maximum(found[inside], 0))
    np.testing.assert_allclose(drawn, exact(np.log(values[inside])), atol=0.15)
    lowest = int(np.argmin(found))
    limits = [
        np.interp(identified.data["threshold"], found[:lowest][::-1], values[:lowest][::-1]),
        np.interp(identified.data["threshold"], found[lowest:], values[lowest:]),
    ]
    width = item["high"] - item["low"]
    np.testing.assert_allclose(limits, [item["low"], item["high"]], atol=0.02 * width)


def test_the_table_sorts_by_a_heading(opened: Opened) -> None:
    page = opened.page
    heads = page.locator("table.traces > thead th")
    names = heads.all_inner_texts()
    column = next(i for i, name in enumerate(names) if name.startswith("k (N/m)"))
    assert heads.nth(column).get_attribute("aria-sort") is None
    given = rows(opened)
    heads.nth(column).locator("button").press("Enter")
    assert heads.nth(column).get_attribute("aria-sort") == "ascending"
    shown = "[...document.querySelectorAll('table.traces > tbody')]"
    keys = page.evaluate(f"{shown}.map(b => Number(b.rows[0].cells[{column}]?.dataset.sort))")
    numbers = [key for key in keys if not np.isnan(key)]
    # One is not determined, one rejected, one not identified.
    assert len(numbers) == 10
    assert keys[:10] == sorted(numbers)
    heads.nth(column).locator("button").click()
    assert heads.nth(column).get_attribute("aria-sort") == "descending"
    keys = page.evaluate(f"{shown}.map(b => Number(b.rows[0].cells[{column}]?.dataset.sort))")
    assert keys[:10] == sorted(numbers, reverse=True)
    heads.first.locator("button").click()
    assert page.locator("th[aria-sort]").count() == 1
    # By number, not by letter.
    assert [text for text in rows(opened) if text.startswith("dish/")] == [
        f"dish/{number}.csv" for number in range(11)
    ]
    assert sorted(rows(opened)) == sorted(given)


def test_the_table_is_filtered_by_text_and_status(opened: Opened) -> None:
    page = opened.page
    assert page.locator("#shown").inner_text() == "13 of 13 shown"
    assert "13 traces: 10 ok, 1 doubtful, 1 rejected, 1 not identified." in page.inner_text("body")
    page.get_by_label("contains").fill("TREATED")
    assert len(rows(opened)) == 6
    assert page.locator("#shown").inner_text() == "6 of 13 shown"
    page.get_by_label("contains").fill("")
    for name in ("ok", "not identified"):
        page.get_by_label(name, exact=True).uncheck()
    assert rows(opened) == ["dish/3.csv", "dish/8.csv"]
    marks = page.locator("tbody:not([hidden]) td.status").all_inner_texts()
    assert marks == ["!doubtful", "✕rejected"]


def test_the_address_opens_a_trace(browser: Any, page: Path) -> None:
    opened = Opened(browser, page, "#trace-3")
    assert opened.page.locator("#trace-3 button.open").get_attribute("aria-expanded") == "true"
    assert opened.page.locator("button.open[aria-expanded=true]").count() == 1
    opened.page.evaluate("location.hash = 'trace-5'")
    opened.page.wait_for_selector("#trace-5 button.open[aria-expanded=true]")
    assert opened.page.locator("#detail-5 [data-draw=trace] svg[role=img]").is_visible()
    opened.context.close()


def test_names_are_text(opened: Opened) -> None:
    row = opened.page.locator("#trace-12")
    assert row.locator("button.open").inner_text() == HOSTILE
    row.locator("button.open").click()
    assert row.locator("b").count() == 0
    label = row.locator("[data-draw=trace] svg[role=img]").get_attribute("aria-label")
    assert HOSTILE in label


def test_distributions_show_each_cell_by_column(opened: Opened) -> None:
    page = opened.page
    strip = page.locator("#strips figure").first
    words = "k: 9 determined, 1 bounded below, 1 not determined (not drawn), 1 with rejected fits"
    assert words in strip.inner_text()
    assert strip.locator("path.cell.dots").count() == 8
    assert strip.locator("circle.hollow").count() == 1
    assert strip.locator("path.arrow").count() == 1
    select = page.get_by_label("By column")
    assert select.locator("option").all_inner_texts() == ["cell", "dish", "passage"]
    select.select_option(label="dish")
    strip = page.locator("#strips figure").first
    assert strip.locator(".tick-x").all_text_contents() == list(LEVELS)
    select.select_option(label="passage")
    strip = page.locator("#strips figure").first
    assert strip.locator(".tick-x").all_text_contents() == ["P0", "P1", "P2"]
    assert strip.locator("path.cell.dots").count() == 8


@pytest.mark.parametrize(
    ("scheme", "rules"),
    [("light", []), pytest.param("dark", ["color-contrast"], marks=pytest.mark.nightly)],
)
def test_anybody_can_use_it(browser: Any, page: Path, scheme: Any, rules: list[str]) -> None:
    opened = Opened(browser, page, color_scheme=scheme, viewport={"width": 400, "height": 800})
    for number in (1, 4, 9):
        opened.page.locator(f"#trace-{number} button.open").click()
    assert opened.barriers(*rules) == []
    # A phone's reader moves tables sideways, never the page.
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= 400
    assert opened.page.locator("#detail-1 .inner").bounding_box()["width"] <= 400
    opened.context.close()


def test_opened_details_are_printed(browser: Any, page: Path) -> None:
    opened = Opened(browser, page, viewport={"width": 718, "height": 1000}, color_scheme="dark")
    page_ = opened.page
    page_.locator("#trace-2 button.open").click()
    page_.emulate_media(media="print")
    assert page_.locator("#detail-2 [data-draw=trace] svg[role=img]").is_visible()
    assert not page_.locator("#detail-1").is_visible()
    assert not page_.locator("#filter").is_visible()
    assert page_.evaluate("document.documentElement.scrollWidth") <= 718
    paper = page_.evaluate("getComputedStyle(document.body).backgroundColor")
    assert paper == "rgb(255, 255, 255)"
    page_.emulate_media(media="screen")
    page_.get_by_role("button", name="Open all").click()
    page_.wait_for_selector("#trace-12 button.open[aria-expanded=true]")
    page_.emulate_media(media="print")
    assert page_.locator("tr.detail:visible").count() == 12
    opened.context.close()


def test_without_scripts_all_is_said_but_nothing_drawn(
    browser: Any, page: Path, dish: list[dict[str, Any]]
) -> None:
    opened = Opened(browser, page, java_script_enabled=False)
    text = opened.page.locator("body").inner_text()
    assert "need JavaScript" in text
    for item in dish[0]["quantities"]:
        assert text.count(item["in_words"]) == 12
    assert "Something is odd." in text
    assert not opened.page.get_by_role("button", name="Open all").is_visible()
    assert "Profile likelihoods" not in text
    opened.context.close()


def test_one_trace_is_drawn_at_once(
    browser: Any, of_example: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "one.html"
    write_page([of_example], {}, path)
    opened = Opened(browser, path)
    assert opened.page.locator("[data-draw=profiles] svg[role=img]").count() == 5
    assert opened.page.locator("table.traces").count() == 0
    assert opened.problems == []
    opened.context.close()


def test_a_thousand_rows(browser: Any, of_example: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "many.html"
    traces = [made_up(of_example, number) for number in range(ROWS)]
    write_page(traces, {}, path, copied(traces))
    assert path.stat().st_size < MOST_BYTES_OF_MANY
    start = time.monotonic()
    opened = Opened(browser, path)
    assert opened.page.locator("#shown").inner_text() == f"{ROWS} of {ROWS} shown"
    assert time.monotonic() - start < MOST_SECONDS_TO_OPEN
    took = opened.page.evaluate(
        """() => {
            const start = performance.now(), field = document.getElementById("filter");
            field.value = "cell 99";
            field.dispatchEvent(new Event("input"));
            document.querySelectorAll("table.traces > thead button")[5].click();
            document.querySelector("#trace-991 button.open").click();
            document.body.getBoundingClientRect();
            return performance.now() - start;
        }"""
    )
    assert took < 2000
    assert len(rows(opened)) == 11
    assert opened.problems == []
    opened.context.close()
