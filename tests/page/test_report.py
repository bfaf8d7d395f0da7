import re
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.digits import legible
from biogrip.files import read_table
from biogrip_study.config.study import load_given_study
from biogrip_study.page import answers
from biogrip_study.page.page import write_report
from biogrip_study.records.identifications import read_verdicts
from tests.helpers.browser import Opened
from tests.helpers.links import links_of
from tests.helpers.places import ROOT
from tests.helpers.problems import MODEL, rotation
from tests.helpers.runs import TINY

PHONE = {"width": 400, "height": 800}


@pytest.fixture(scope="module")
def report(tiny: Path) -> Path:
    return tiny / "results" / "report.html"


@pytest.fixture(scope="module")
def opened(browser: Any, report: Path) -> Iterator[Opened]:
    yield (page := Opened(browser, report))
    page.close()


def test_the_page_needs_nothing_else(opened: Opened, report: Path) -> None:
    assert report.stat().st_size < 8_000_000
    told = "['width', 'height'].map(name => +it.getAttribute(name))"
    of_image = f"all => all.map(it => [[it.naturalWidth, it.naturalHeight], {told}])"
    sizes = opened.page.locator("img").evaluate_all(of_image)
    assert len(sizes) > 10
    assert all(natural == told and min(told) > 0 for natural, told in sizes)


@pytest.mark.parametrize("published", [False, True])
def test_every_link_of_a_page_leads_somewhere(report: Path, published: bool) -> None:
    pages = [*(ROOT / "results" / "published").rglob("*.html")] if published else [report]
    pages += [] if published else [*report.parent.glob("summaries/*.html")]
    assert pages
    for page in pages:
        links, dead = links_of(page)
        assert dead == []
        assert len(links) > 5 or page.parent.name == "summaries"


SMALLEST_LETTERS = """Math.min(...[...document.querySelectorAll('p, li, td, dd, figcaption')]
    .map(e => parseFloat(getComputedStyle(e).fontSize)))"""
CLIPPED = """[...document.querySelectorAll('table.compared, .compared :is(th, td, caption)')]
    .filter(e => e.checkVisibility() && (e.scrollWidth > e.clientWidth + 1
        || e.getBoundingClientRect().right > document.documentElement.clientWidth))
    .map(e => e.textContent)"""


@pytest.mark.parametrize(("medium", "width"), [("screen", 1400), ("screen", 400), ("print", 718)])
def test_the_page_is_legible_and_no_column_of_the_first_table_is_clipped(
    visit: Any, report: Path, medium: Any, width: int
) -> None:
    page = visit(report, viewport={"width": width, "height": 900}).page
    page.emulate_media(media=medium)
    assert page.locator(".compared thead th").count() == 6
    assert page.locator(".compared tbody th").all_inner_texts() == ["Liquid drop, case 2"]
    rows = page.locator(".compared tbody tr:has(td)").all_inner_texts()
    compared = read_table(report.parent / "tables" / "tables_5_to_7.csv")
    told = {row["quantity"] for row in compared if row["verdict"] != "not identifiable"}
    assert len(rows) == sum(row["quantity"] in told for row in compared) > 0
    assert page.evaluate(CLIPPED) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert medium == "print" or page.evaluate(SMALLEST_LETTERS) >= 12


def test_the_page_answers_first_and_from_its_tables(opened: Opened, report: Path) -> None:
    tables = report.parent / "tables"
    compared = read_table(tables / "methods.csv")
    titles, who = {"liquid_drop_2": "Liquid drop, case 2"}, "Run again, the paper's"
    page, own = opened.page, "genetic algorithm"
    assert page.locator("h1 + .split .answers p:not(.soft)").all_text_contents() == [
        legible(answers.say_what_the_study_gives(compared, own, titles, who, 1.0)),
        legible(answers.say_which_method_finds_it(compared, own)),
    ]
    table = page.locator("h1 + .split .answers .share")
    (counted,) = answers.rows_of_determined(read_table(tables / "verdict_counts.csv"), titles)
    cells = [": ".join(it.split(maxsplit=1)) for it in table.locator("td").all_inner_texts()]
    assert cells == [*counted.values()][1:]
    # Wilson's limits of 0 of 1 and 1 of 1.
    said = " ".join(page.locator(".narrow + p.soft").inner_text().split())
    assert "0 of 1 means at most 79 % of all traces, 1 of 1 at least 21 %. Sums hold" in said
    assert table.evaluate("it => it.getBoundingClientRect().bottom") < 900
    told = page.locator("#tables summary").all_text_contents()
    captions = [text.split(". ", 1)[1] for text in map(str.strip, told) if ". " in text]
    assert len(captions) == len(set(captions)) > 5
    shown = page.locator("figure:visible").evaluate_all("all => all.map(f => f.id)")
    assert shown == ["sliders", "figure-fit_liquid_drop_2"]


def test_menu_links_land_where_they_say(visit: Any, report: Path) -> None:
    opened = visit(report)
    for link in opened.page.locator("nav a").all():
        link.click()
        target = opened.page.locator(str(link.get_attribute("href")))
        opened.page.wait_for_function("document.readyState === 'complete'")
        assert target.is_visible()
        assert 0 <= target.evaluate("it => it.getBoundingClientRect().y") < 720


def test_print_shows_what_is_unfolded_on_a_few_sheets(visit: Any, report: Path) -> None:
    opened = visit(report)
    sheets = len(re.findall(rb"/Type /Page\b", opened.page.pdf(format="A4")))
    assert 2 <= sheets <= 20
    opened.page.evaluate("document.querySelectorAll('details').forEach(e => e.open = true)")
    assert len(re.findall(rb"/Type /Page\b", opened.page.pdf(format="A4"))) > sheets + 2
    # Wide tables fit a landscape sheet within margins of a centimetre, no word broken.
    opened.page.emulate_media(media="print")
    opened.page.set_viewport_size({"width": 1047, "height": 718})
    widths = "[...document.querySelectorAll('.wide table')].map(table => table.scrollWidth)"
    assert 0 < max(opened.page.evaluate(widths)) <= 1047
    broken = "[...document.querySelectorAll('th')].map(e => getComputedStyle(e).overflowWrap)"
    assert set(opened.page.evaluate(broken)) == {"normal"}
    assert not opened.page.locator(".config").is_visible()


def test_tables_have_titles_powers_and_right_aligned_numbers(opened: Opened, report: Path) -> None:
    cells = opened.page.locator("#table-errors td, #table-gripper td")
    texts = cells.all_text_contents()
    assert "Liquid drop, case 2" in texts
    assert not [text for text in texts if re.search(r"liquid_drop|\de[+-]\d", text)]
    aligned = "all => all.map(e => getComputedStyle(e).textAlign)"
    assert {*cells.filter(has_text="·10⁻").evaluate_all(aligned)} == {"right"}
    page = opened.page
    assert page.locator("caption").count() == 2
    # Full ones are folded, and can be downloaded.
    assert page.locator("details[open]").count() == 0
    links = page.locator("a[download]").evaluate_all("all => all.map(a => [a.download, a.href])")
    assert len(links) == page.locator("details[id^=table-]").count() > 10
    for name, address in links:
        content = b64decode(address.removeprefix("data:text/csv;base64,"))
        assert content == (report.parent / "tables" / name).read_bytes()


@pytest.mark.parametrize(
    ("scheme", "rules"),
    [("light", []), pytest.param("dark", ["color-contrast"], marks=pytest.mark.nightly)],
)
def test_anybody_can_use_the_page(visit: Any, report: Path, scheme: Any, rules: list[str]) -> None:
    opened = visit(report, color_scheme=scheme)
    opened.page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    assert opened.barriers(*rules) == []
    paper = opened.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(255, 255, 255)") == (scheme == "light")


NAMES = ("k", "k_p", "c", "c_p")
SAMPLES = (20.0, 5.0, 80.0, 1e-3), (1.0, 1e-4, 5.0, 5.0), (1e-3, 50.0, 1e4, 1e-6), (9.0, 9, 1, 90)


@pytest.mark.parametrize("values", SAMPLES)
def test_sliders_show_the_response_of_the_sample(opened: Opened, values: tuple[float, ...]) -> None:
    """That of Python, which has it by other modes; digits are lost where a branch is weak."""
    times = np.linspace(0.0, 400.0, 1601)
    wanted = rotation(MODEL, values, times, inertia=False)
    sample = dict(zip(NAMES, values, strict=True))
    lever = 2 * (1.5e-3 * np.sin(np.radians(75.0))) ** 2
    arm = {"stiffness": 4.4e-7, "damping": 3.3e-12, "lever": lever}
    given = [sample, arm, [[0.0, 1.6e-9], [200.0, -1.28e-9]], times.tolist()]
    drawn = opened.page.evaluate("given => response(...given)", given)
    assert np.allclose(drawn, wanted, rtol=0, atol=1e-9 * float(np.max(wanted)))


def test_c_moves_against_c_p_and_nothing_is_seen(opened: Opened) -> None:
    page = opened.page

    def seen() -> tuple[dict[str, float], float, str]:
        told = page.locator("#sliders input[type=range] + output").all_text_contents()
        values = dict(zip(NAMES, [float(text.split()[0]) for text in told], strict=True))
        curve = str(page.locator("#sliders .curve").get_attribute("d"))
        return values, float(str(page.locator("#sliders p > output").text_content())), curve

    def moved(name: str, value: float) -> tuple[dict[str, float], float, float]:
        page.get_by_role("button", name="True values").click()
        _, before, curve = seen()
        slide = "(e, at) => { e.value = at; e.dispatchEvent(new Event('input')); }"
        page.locator(f"#sliders input[name={name}]").evaluate(slide, float(np.log10(value)))
        values, after, now = seen()
        heights = (np.array(re.findall(r",(-?[\d.]+)", it), float) for it in (curve, now))
        return values, after / before, float(np.median(np.abs(np.subtract(*heights))))

    true, misfit, _ = seen()
    assert true == {"k": 1.0, "k_p": 1e-4, "c": 10.0, "c_p": 1e-3}
    noise = re.findall(r"the noise alone is ([\d.]+)", page.locator("#sliders").inner_text())
    assert [*map(float, noise)] == [pytest.approx(misfit, rel=1e-3)]
    values, ratio, pixels = moved("c_p", 1.0)
    assert (values["c"], values["c_p"]) == (9.0, 1.0)
    assert ratio == pytest.approx(1, abs=0.02)
    assert pixels < 1
    assert moved("c", 100.0)[0]["c"] == pytest.approx(10.0)
    page.locator("#sliders input[type=checkbox]").uncheck()
    for name, value in (("c_p", 10.0), ("k", 0.05)):
        values, ratio, pixels = moved(name, value)
        assert values == true | {name: value}
        assert ratio > 1.2
        assert pixels > 5
    page.locator("#sliders input[type=checkbox]").check()


def test_summaries_are_whole_and_legible(visit: Any, tiny: Path) -> None:
    for name in ("liquid_drop_2", "mine"):
        opened = visit(tiny / f"results/summaries/{name}.html", viewport=PHONE)
        images = "[...document.images].filter(image => image.naturalWidth > 0).length"
        assert opened.page.evaluate(images) >= 2
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]


def test_a_study_of_one_s_own_has_a_page_without_the_paper(
    visit: Any, tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tiny)
    study, results = load_given_study(TINY, []).of(["mine"]), tiny / "results"
    items = [("errors", "mine"), ("verdicts", "mine"), ("models", ""), ("left_out", "")]
    tables = [results / "tables" / f"{'_'.join(filter(None, item))}.html" for item in items]
    figures = sorted(results.glob("figures/*_mine.png"))
    shown = [*((path.stem.removesuffix("_mine"), "mine") for path in figures), ("comb", "")]
    files = {
        "figures": [*figures, results / "figures" / "comb.png"],
        "tables": tables,
        "downloads": [path.with_suffix(".csv") for path in tables],
        "captions": sorted((ROOT / "workflow" / "report").glob("*/*.rst")),
        "verdicts": [results / "identifiability" / "mine.json"],
        "measurements": [results / "measurements" / "mine" / "seeds_0-0.npz"],
    }
    listed = {"figures": shown, "tables": items}
    page_file, front = tmp_path / "page.html", tmp_path / "front.html"
    write_report(study, shown=listed, **files, page=page_file, front=front)
    assert not re.search("of the paper|[Pp]aper's", (tmp_path / "page.html").read_text("utf-8"))
    page = visit(tmp_path / "page.html", viewport=PHONE).page
    assert page.locator("h1").inner_text() == page.title() == "A trace of mine"
    end = "it => it.getBoundingClientRect().bottom"
    assert page.locator("dl").evaluate(end) < PHONE["height"]
    told = read_verdicts(files["verdicts"][0])
    said = page.locator("dd:visible").all_inner_texts()
    assert [legible(item["in_words"]) for item in told["quantities"]] == said
    shown_figures = page.locator("figure:visible").evaluate_all("all => all.map(f => f.id)")
    assert shown_figures == ["figure-judged_fit_mine", "figure-profiles_mine"]
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
