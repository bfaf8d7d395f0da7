"""The page of a study in a real browser: whole, legible, and its explorer right."""

import re
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.figures.results import Fit
from biogrip.fit.methods import METHODS
from biogrip.page.answers import (
    compare_with_paper,
    say_what_traces_tell,
    say_which_method_finds_it,
)
from biogrip.page.explorer import explorer
from biogrip.page.page import entry_of
from biogrip.records.identifications import read_identifications
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
    found.page.wait_for_selector("#explorer .main-svg")
    return found


def test_the_page_needs_nothing_else(opened: Opened, report: Path) -> None:
    assert report.stat().st_size < MOST_BYTES
    assert opened.asked == []
    missing = "[...document.images].filter(i => !(i.loading === 'lazy' && !i.complete))"
    assert opened.page.evaluate(f"{missing}.filter(i => !i.naturalWidth).length") == 0
    assert opened.page.evaluate("document.images.length") > 10
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
    errors = read_table(report.parent / "tables" / "errors.csv")
    assert len(rows) == sum(row["parameter"] != "c_p" for row in errors)
    assert page.evaluate(CLIPPED) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert medium == "print" or page.evaluate(SMALLEST_LETTERS) >= 12
    opened.context.close()


def test_the_page_answers_first_and_from_its_tables(opened: Opened, report: Path) -> None:
    tables = report.parent / "tables"
    errors, compared = (read_table(tables / f"{name}.csv") for name in ("errors", "methods"))
    verdicts = [row for file in tables.glob("verdicts_*.csv") for row in read_table(file)]
    assert opened.page.locator("h1 + .answers p").all_inner_texts() == [
        compare_with_paper(errors, verdicts, {}),
        say_what_traces_tell(sorted(verdicts, key=lambda row: row["case"])),
        say_which_method_finds_it(compared, "genetic algorithm"),
    ]


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


def test_four_figures_are_shown_and_the_others_open_by_sample(opened: Opened) -> None:
    page = opened.page
    assert page.locator("figure").count() == 4
    first = page.locator("details.sample").first
    first.locator("> summary").press("Enter")
    thumbnail = first.locator(".thumbnail").first
    widths = [thumbnail.bounding_box()]
    thumbnail.locator("> summary").press("Enter")
    widths.append(thumbnail.bounding_box())
    small, large = (box["width"] for box in widths if box)
    assert large > 2 * small
    # Alt texts are sentences, not names of files.
    texts = page.locator("main img").evaluate_all("all => all.map(i => i.alt)")
    assert min(len(text.split()) for text in texts) > 4
    for summary in (thumbnail, first):
        summary.locator("> summary").press("Enter")


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
    page.locator("#explorer .updatemenu-header").click()
    page.locator("#explorer .updatemenu-dropdown-button", has_text=title).click()
    label = f"closing rotation ({prefix}rad)"
    page.locator("#explorer .ytitle", has_text=label).wait_for()
    scale = {"m": 1e3, "µ": 1e6}[prefix]
    drawn = {line["name"]: np.array(line["y"]) / scale for line in page.evaluate(DRAWN)}
    (batch,) = (results / "measurements" / case).glob("seeds_0-*.parquet")
    measured = read_measurements(batch, [0])
    noisy = drawn.pop("noisy trace" if case != "mine" else "recorded trace")
    assert np.allclose(noisy, measured.rotation_rad[0], rtol=1e-5, atol=0)
    if case != "mine":
        assert measured.target_rad is not None
        assert np.allclose(drawn.pop("target"), measured.target_rad, rtol=1e-5, atol=0)
    assert set(drawn) == {"genetic algorithm", "multi-start least squares"}
    found = read_identifications(results / "identifications" / f"{case}.csv").set_index("seed")
    for misfit, method in found.loc[0, ["misfit", "method"]].itertuples(index=False):
        residual = measured.rotation_rad[0] - drawn[METHODS[method].title]
        assert np.sqrt(np.mean(residual**2)) == pytest.approx(misfit, rel=1e-4)
    assert page.locator("canvas").count() == 0
    assert opened.problems == []


def test_a_table_is_of_the_case_that_its_name_ends_with() -> None:
    captions = {("tables", known): known for known in ("errors", "contact_loss", "contact")}
    for name, whose in (("errors", "cell"), ("errors", "soft_cell"), ("contact_loss", "")):
        file = Path(f"results/tables/{name}{'_' * bool(whose)}{whose}.csv")
        entry = entry_of(file, ["cell", "soft_cell", "loss"], captions)
        assert (entry.name, entry.whose, entry.caption) == (name, whose, name)


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
