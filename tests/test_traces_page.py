import base64
import re
from dataclasses import replace
from html import unescape
from io import BytesIO
from pathlib import Path
from typing import Any

import PIL.Image
import pytest

from biogrip.command import files as command
from biogrip.command.files import identify_batch
from biogrip.command.options import Setting
from biogrip.command.outputs import Outcome
from biogrip.command.page import common, draw_every_trace, write_page
from biogrip.command.settings import Asked
from biogrip.command.words import columns_of
from tests.helpers.identified import write_drop
from tests.helpers.places import EXAMPLE

HOSTILE = "</script><b onclick=x>&amp;"


@pytest.fixture(scope="module")
def example(few: Path) -> Outcome:
    return identify_batch([Asked(EXAMPLE, few)], None, drawn=True)


def made_up(of: dict[str, Any], number: int) -> dict[str, Any]:
    factor, none = 1 + 0.1 * (number * 7 % 12), {"low": None, "high": None}
    fit = {3: "doubtful", 8: "rejected"}.get(number, "ok")
    of_k: dict[int, Any] = {5: {"high": None, "verdict": "bounded below"}}
    of_k |= {6: none | {"verdict": "not determined"}}
    quantities = []
    for item in of["quantities"]:
        own = item | {name: item[name] and factor * item[name] for name in ("value", *none)}
        own |= of_k.get(number, {}) if item["quantity"] == "k" else {}
        quantities.append(own | (none | {"verdict": "fit rejected"} if number == 8 else {}))
    reasons = ["Something is odd."] * (fit != "ok")
    said = {"fit": fit, "quantities": quantities, "reasons": reasons}
    return {**of, "trace": f"dish/{number}.csv", **said}


@pytest.fixture(scope="module")
def dish(example: Outcome) -> Outcome:
    (of,), (pictures,) = example.found, example.pictures.values()
    traces = [made_up(of, number) for number in range(12)]
    traces[-1]["trace"] = HOSTILE
    refused = {"bad.csv": "bad.csv, line 2: found 'high'."}
    return Outcome(traces, refused, {each["trace"]: pictures for each in traces})


@pytest.fixture(scope="module")
def page(dish: Outcome, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dish") / "page.html"
    names = [*(each["trace"] for each in dish.found), *dish.refused]
    copied = {name: {"cell": name, "dish": "treated"} for name in names}
    write_page(replace(dish, copied=copied), path)
    return path


def test_a_page_begins_with_status_value_and_interval(example: Outcome, tmp_path: Path) -> None:
    write_page(example, tmp_path / "page.html")
    text = unescape((tmp_path / "page.html").read_text())
    parts = (
        "its best fit",
        "Fit ok",
        "What the trace tells",
        "Profile likelihoods",
        "Methods, for a paper",
    )
    places = [text.index(part) for part in parts]
    assert places == sorted(places)
    assert "Each trace" not in text
    unfolded = re.sub("<details>.*?</details>", "", text, flags=re.DOTALL)
    assert "search_range:" in text
    assert "search_range:" not in unfolded


def test_pictures_are_small_and_in_the_page(page: Path) -> None:
    text = page.read_text()
    pictures = re.findall('src="data:image/png;base64,([^"]+)"', text)
    # Two a trace, a level where there is one, and one of all.
    assert len(pictures) == 3 * 12 + 1 == len(re.findall("<img", text))
    for encoded in pictures:
        content = base64.b64decode(encoded)
        assert len(content) < 60_000
        with PIL.Image.open(BytesIO(content)) as image:
            assert image.width >= 600
    assert not re.search("(src|href)=.(?!data:|#)", text)


def test_the_figure_is_by_the_words_of_the_table(dish: Outcome) -> None:
    """Groups are of the column with the fewest words, units of one that puts cells together."""
    words = {
        each["trace"]: {"day": f"{number % 4}", "drug": "ab"[number % 2], "size": f"{number}"}
        for number, each in enumerate(dish.found)
    }
    drawn, said = draw_every_trace(replace(dish, copied=words), columns_of(dish.found))
    assert said == "Groups: drug. Large marks: means of each day."
    axes = drawn.axes[0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["a", "b"]
    points = [line for line in axes.lines if line.get_markersize() == 3]
    # Not the rejected one, and not the one that is not determined.
    assert len(points) == 12 - 2
    assert sum(line.get_marker() == "^" for line in points) == 1
    assert sum(line.get_markerfacecolor() == "white" for line in points) == 1
    # By units the chance is another one than by cells.
    by_cell = {name: {"drug": own["drug"]} for name, own in words.items()}
    others = (
        draw_every_trace(replace(dish, copied=by_cell), columns_of(dish.found))[0].axes[0].texts
    )
    assert [it.get_text() for it in axes.texts] != [it.get_text() for it in others]
    words[dish.found[0]["trace"]] = {"other": "of another table"}
    assert draw_every_trace(replace(dish, copied=words), columns_of(dish.found))[0].axes
    drawn, said = draw_every_trace(dish, columns_of(dish.found))
    assert said == "Cells are taken for independent."
    assert [label.get_text() for label in drawn.axes[0].get_xticklabels()] == ["all traces"]


def test_what_all_share_is_said_once() -> None:
    one = {"noise": {"kind": "white", "level": 0.1}, "rate": 2.0, "range": {"k": 1}}
    other = {"noise": {"kind": "white", "level": 0.2}, "rate": 2.0, "range": {"k": 1}}
    assert common([one, other]) == {"rate": 2.0, "range": {"k": 1}}
    assert common([other]) == other


def test_the_methods_have_the_numbers_of_the_study(page: Path) -> None:
    text = unescape(page.read_text()).partition("Methods, for a paper</h2>\n<p>")[2]
    said = text.partition("</p>")[0].replace("\u00a0", " ")
    for words in (
        "a torque of 1.6·10⁻⁹ N m for 200 s, then of 3.2·10⁻¹⁰ N m for 200 s. Its arms of 0.0015 m "
        "have a stiffness of 4.4·10⁻⁷ N m/rad, and stand at 75 degrees. The model (generalized "
        "Maxwell-Wiechert) was fitted by least squares; the noise was taken from the scatter",
        "One-sided limits hold with 97.5 % confidence. 11 of 13",
        "11 of 13 traces were used, 1 of them with a doubtful fit. Rejected: 1 (dish/8.csv). "
        "Not identified: 1 (bad.csv). Computed with biogrip 1.0.0",
    ):
        assert words in said


def test_of_very_many_traces_there_is_the_table_and_the_page_says_so(
    few: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    traces = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for trace in traces:
        write_drop(trace, 0)
    monkeypatch.setattr(command, "MOST_DRAWN", 1)
    alone = {("sample", "model"): "maxwell", ("model_selection", "models"): []}
    given = [Setting("--set", *own) for own in alone.items()]
    assert command.identify_files(traces, few, given, report=tmp_path / "page.html") == 0
    text = (tmp_path / "page.html").read_text()
    assert text.count("<img") == 1
    assert "Too many traces for pictures" in text
    assert 'href="#trace-' not in text


def test_the_table_sorts_by_a_heading_and_its_names_are_text(visit: Any, page: Path) -> None:
    opened = visit(page).page
    heads = opened.locator("table.traces > thead th")
    column = heads.all_inner_texts().index("k (N/m)")

    def cells(index: int) -> Any:
        texts = f"rows => rows.map(row => row.cells[{index}]?.innerText)"
        return opened.locator(".traces tbody tr").evaluate_all(texts)

    def numbers() -> list[float]:
        """Of those that have one: not the rejected one, and two more."""
        return [float(re.sub("^≥ ", "", text).split()[0]) for text in cells(column)[:10]]

    given = cells(1)
    assert heads.nth(column).get_attribute("aria-sort") is None
    heads.nth(column).locator("button").press("Enter")
    assert heads.nth(column).get_attribute("aria-sort") == "ascending"
    ascending = numbers()
    assert ascending == sorted(ascending)
    heads.nth(column).locator("button").click()
    assert heads.nth(column).get_attribute("aria-sort") == "descending"
    assert numbers() == ascending[::-1]
    heads.nth(1).locator("button").click()
    assert opened.locator("th[aria-sort]").count() == 1
    names = [text for text in cells(1) if text.startswith("dish/")]
    assert names == [f"dish/{number}.csv" for number in range(11)]
    assert sorted(cells(1)) == sorted(given)
    body = opened.inner_text("body")
    assert "13 traces: 10 ok, 1 doubtful, 1 rejected, 1 not identified." in body
    opened.locator(".traces tbody a", has_text=HOSTILE).click()
    assert opened.locator("#trace-12 h2").inner_text() == HOSTILE
    assert opened.locator("b").count() == 0
    assert HOSTILE in str(opened.locator("#trace-12 img").first.get_attribute("alt"))


@pytest.mark.nightly
def test_sixty_traces_are_two_screens_and_six_sheets(
    visit: Any, dish: Outcome, tmp_path: Path
) -> None:
    (pictures,) = {tuple(own) for own in dish.pictures.values()}
    traces = [made_up(dish.found[0], 20 + number) for number in range(60)]
    words = {each["trace"]: {"dish": f"d{n % 6}"} for n, each in enumerate(traces)}
    every = Outcome(traces, {}, {name: [*pictures] for name in words}, words)
    write_page(every, tmp_path / "page.html")
    opened = visit(tmp_path / "page.html", viewport={"width": 1400, "height": 900})
    assert opened.page.evaluate("document.documentElement.scrollHeight") <= 2 * 900
    assert opened.page.locator(".screen").evaluate("it => it.scrollWidth <= it.clientWidth")
    assert 1 <= len(re.findall(rb"/Type /Page\b", opened.page.pdf(format="A4"))) <= 6


@pytest.mark.parametrize(
    ("scheme", "rules"),
    [("light", []), pytest.param("dark", ["color-contrast"], marks=pytest.mark.nightly)],
)
def test_anybody_can_use_it(
    visit: Any, dish: Outcome, tmp_path: Path, scheme: Any, rules: list[str]
) -> None:
    page = tmp_path / "page.html"
    write_page(replace(dish, found=[dish.found[number] for number in (0, 3, 8)]), page)
    opened = visit(page, color_scheme=scheme, viewport={"width": 400, "height": 800})
    assert opened.barriers(*rules) == []
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= 400
    table = opened.page.locator(".screen")
    assert table.evaluate("it => it.scrollHeight <= it.clientHeight")
    assert "gradient" in table.evaluate("it => getComputedStyle(it).backgroundImage")
    whole = "every => every.every(it => it.getClientRects().length < 2)"
    assert opened.page.locator(".wide td:not([colspan], .prose) code").evaluate_all(whole)
    picture = opened.page.locator(".profiles").first
    assert picture.evaluate("it => it.naturalHeight > 2 * it.naturalWidth")
    opened.page.emulate_media(media="print")
    opened.page.set_viewport_size({"width": 718, "height": 1000})
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= 718
    paper = opened.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert paper == "rgb(255, 255, 255)"
