"""The page of a study in a real browser: whole, legible, and its explorer right."""

import re
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from biogrip.digits import legible
from biogrip.figures.fit import Fit
from biogrip.fit.problem import METHODS
from biogrip.page.answers import (
    say_what_claims_are,
    say_what_the_study_gives,
    say_what_traces_tell,
    say_which_method_finds_it,
)
from biogrip.page.explorer import explorer
from biogrip.page.page import entry_of
from biogrip.records.rows import read_table
from biogrip.records.traces import read_measurements
from tests.helpers.browser import Opened

MOST_BYTES = 8_000_000
PHONE = {"width": 400, "height": 800}


@pytest.fixture(scope="module")
def report(tiny: Path) -> Path:
    return tiny / "results" / "report.html"


@pytest.fixture(scope="module")
def opened(browser: Any, report: Path) -> Opened:
    return explored(browser, report)


def explored(browser: Any, report: Path, **context: Any) -> Opened:
    """The page when its explorer is there."""
    found = Opened(browser, report, **context)
    found.page.wait_for_selector("#explorer .main-svg", state="attached")
    return found


def test_the_page_needs_nothing_else(opened: Opened, report: Path) -> None:
    assert report.stat().st_size < MOST_BYTES
    assert opened.asked == []
    said = "['width', 'height'].map(name => +i.getAttribute(name))"
    of_image = f"[[i.naturalWidth, i.naturalHeight], {said}]"
    sizes = opened.page.evaluate(f"[...document.images].map(i => {of_image})")
    assert len(sizes) > 10
    assert all(natural == told and min(told) > 0 for natural, told in sizes)
    assert opened.problems == []


def test_the_page_links_the_files_that_it_shows(report: Path) -> None:
    made = re.findall(r'<p class="made">(.*?)</p>', report.read_text("utf-8"), re.S)
    assert len(made) > 30
    for text in made:
        match = re.fullmatch(r'File <a href="([\w./-]+)"><code>results/\1</code></a>', text)
        assert match, text
        assert (report.parent / match[1]).is_file()


SMALLEST_LETTERS = """Math.min(...[...document.querySelectorAll('p, li, td, dd, figcaption')]
    .map(e => parseFloat(getComputedStyle(e).fontSize)))"""
CLIPPED = """[...document.querySelectorAll('table.compared, .compared :is(th, td, caption)')]
    .filter(e => e.checkVisibility() && (e.scrollWidth > e.clientWidth + 1
        || e.getBoundingClientRect().right > document.documentElement.clientWidth))
    .map(e => e.textContent)"""


@pytest.mark.parametrize(("medium", "width"), [("screen", 1400), ("screen", 400), ("print", 718)])
def test_the_page_is_legible_and_no_column_of_the_first_table_is_clipped(
    browser: Any, report: Path, medium: Any, width: int
) -> None:
    """Also on a phone, and in print on A4 within margins of a centimetre."""
    opened = explored(browser, report, viewport={"width": width, "height": 900})
    page = opened.page
    page.emulate_media(media=medium)
    assert page.locator(".compared thead th").count() == 7
    rows = page.locator(".compared tbody tr").all_inner_texts()
    compared = read_table(report.parent / "tables" / "tables_5_to_7.csv")
    told = {row["quantity"] for row in compared if row["verdict"] != "cannot be told"}
    assert len(rows) == sum(row["quantity"] in told for row in compared) > 0
    assert page.evaluate(CLIPPED) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert medium == "print" or page.evaluate(SMALLEST_LETTERS) >= 12
    opened.context.close()


def test_the_page_answers_first_and_from_its_tables(opened: Opened, report: Path) -> None:
    tables = report.parent / "tables"
    compared = read_table(tables / "methods.csv")
    titles, who = {"liquid_drop_2": "Liquid drop, case 2"}, "Run again, the paper's"
    page, own = opened.page, "genetic algorithm"
    assert page.locator("h1 + .split .answers p:not(.soft)").all_text_contents() == [
        say_what_traces_tell(read_table(tables / "coverage.csv"), titles).replace("_", ""),
        legible(say_what_the_study_gives(compared, own, titles, who, 1.0)),
        legible(say_which_method_finds_it(compared, own)),
        say_what_claims_are(read_table(tables / "claims.csv")),
    ]
    # No caption of a table stands twice.
    told = page.locator("#tables summary").all_text_contents()
    captions = [text.split(". ", 1)[1] for text in map(str.strip, told) if ". " in text]
    assert len(captions) == len(set(captions)) > 5
    # Then the picture's quantities, and figures of the paper, before all that is folded.
    shown = page.locator("figure:visible").evaluate_all("all => all.map(f => f.id)")
    assert shown == ["figure-answer", "figure-fit_liquid_drop_2"]


def test_menu_links_land_where_they_say(browser: Any, report: Path) -> None:
    """On the first click, and in what was folded."""
    opened = explored(browser, report)
    for link in opened.page.locator("nav a").all():
        link.click()
        target = opened.page.locator(str(link.get_attribute("href")))
        opened.page.wait_for_function("document.readyState === 'complete'")
        assert target.is_visible()
        box = target.bounding_box()
        assert box
        assert 0 <= box["y"] < 720
    opened.context.close()


def test_print_shows_what_is_unfolded_on_a_few_sheets(browser: Any, report: Path) -> None:
    opened = explored(browser, report)
    sheets = len(re.findall(rb"/Type /Page\b", opened.page.pdf(format="A4")))
    assert 2 <= sheets <= 20
    opened.page.evaluate("document.querySelectorAll('details').forEach(e => e.open = true)")
    assert len(re.findall(rb"/Type /Page\b", opened.page.pdf(format="A4"))) > sheets + 2
    opened.context.close()


def test_tables_have_titles_powers_and_right_aligned_numbers(opened: Opened) -> None:
    cells = opened.page.locator("#table-errors td, #table-gripper td")
    texts = cells.all_text_contents()
    assert "Liquid drop, case 2" in texts
    assert not [text for text in texts if re.search(r"liquid_drop|\de[+-]\d", text)]
    powers = cells.filter(has_text="·10⁻")
    assert powers.count() > 0
    aligned = powers.evaluate_all("all => all.map(e => getComputedStyle(e).textAlign)")
    assert set(aligned) == {"right"}
    assert opened.page.locator("caption").count() == 1


def test_full_tables_are_folded_and_can_be_downloaded(opened: Opened, report: Path) -> None:
    page = opened.page
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
def test_anybody_can_use_the_page(
    browser: Any, report: Path, scheme: Any, rules: list[str]
) -> None:
    """Axe finds nothing serious, all unfolded; in dark colours none that is too faint."""
    opened = explored(browser, report, color_scheme=scheme)
    opened.page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    assert opened.barriers(*rules) == []
    paper = opened.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(255, 255, 255)") == (scheme == "light")
    opened.context.close()


DRAWN = """document.getElementById('explorer')._fullData.filter(line => line.visible === true)
    .map(line => ({name: line.name, y: Array.from(line.y)}))"""


@pytest.mark.parametrize(
    ("case", "title", "prefix"),
    [("liquid_drop_2", "Liquid drop, case 2", "m"), ("mine", "A trace of mine", "µ")],
)
def test_the_explorer_shows_the_judged_trace_and_its_fits(
    opened: Opened, tiny: Path, case: str, title: str, prefix: str
) -> None:
    """Of the case that is chosen, as SVG, which needs no graphics processor."""
    page, results = opened.page, tiny / "results"
    page.locator("details.explorer").evaluate("e => { e.open = true; }")
    page.locator("#explorer .updatemenu-header").click()
    page.locator("#explorer .updatemenu-dropdown-button", has_text=title).click()
    label = f"closing rotation ({prefix}rad)"
    page.locator("#explorer .ytitle", has_text=label).wait_for()
    scale = {"m": 1e3, "µ": 1e6}[prefix]
    drawn = {line["name"]: np.array(line["y"]) / scale for line in page.evaluate(DRAWN)}
    (batch,) = (results / "measurements" / case).glob("seeds_0-*.npz")
    measured = read_measurements(batch, [0])
    noisy = drawn.pop("noisy trace" if case != "mine" else "recorded trace")
    assert np.allclose(noisy, measured.readings[0], rtol=1e-5, atol=0)
    if case != "mine":
        assert measured.target is not None
        assert np.allclose(drawn.pop("target"), measured.target, rtol=1e-5, atol=0)
    assert set(drawn) == {"genetic algorithm", "multi-start least squares"}
    found = pd.read_csv(results / "identifications" / f"{case}.csv").set_index("seed")
    for misfit, method in found.loc[0, ["misfit", "method"]].itertuples(index=False):
        residual = measured.readings[0] - drawn[METHODS[method].title]
        assert np.sqrt(np.mean(residual**2)) == pytest.approx(misfit, rel=1e-4)
    assert page.locator("canvas").count() == 0
    assert opened.problems == []


def test_a_table_is_of_the_case_that_its_name_ends_with() -> None:
    captions = {("tables", known): known for known in ("errors", "contact_loss", "contact")}
    for name, whose in (("errors", "cell"), ("errors", "soft_cell"), ("contact_loss", "")):
        file = Path(f"results/tables/{name}{'_' * bool(whose)}{whose}.csv")
        titles = {"cell": "A cell", "soft_cell": "A soft cell", "loss": "A loss"}
        entry = entry_of(file, titles, captions)
        assert (entry.name, entry.whose, entry.caption) == (name, whose, name)
        assert entry.title == name.capitalize().replace("_", " ") + (whose and f": {titles[whose]}")


def test_a_title_cannot_end_the_script() -> None:
    time_s = np.linspace(0.0, 9.0, 10)
    fits = [(METHODS["genetic"], Fit(time_s, None, time_s, time_s))]
    assert "<b>mine" not in explorer([("</script><b>mine</b>", fits)])


def test_summaries_are_whole_and_legible(browser: Any, tiny: Path) -> None:
    for name in ("liquid_drop_2", "mine"):
        opened = Opened(browser, tiny / f"results/summaries/{name}.html", viewport=PHONE)
        images = "[...document.images].filter(image => image.naturalWidth > 0).length"
        assert opened.page.evaluate(images) >= 2
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        assert opened.problems == []
        assert opened.asked == []
        opened.context.close()
