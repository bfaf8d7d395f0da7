"""The page of a study in a real browser: whole, legible, and its explorer right."""

import re
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from axe_playwright_python.sync_playwright import Axe

from biogrip.arrays import Array
from biogrip.experiment.protocol import Harmonic, Load, Phase, TorqueHistory, torque_history
from biogrip.experiment.sample import Network
from biogrip.instrument.gripper import Gripper
from biogrip.products.catalogue import products
from biogrip.products.files.rows import read_table
from biogrip.products.files.traces import read_measurements
from biogrip.products.files.verdicts import read_verdicts
from biogrip.products.report.answers import (
    compare_with_paper,
    say_what_traces_tell,
    say_which_method_finds_it,
)
from biogrip.products.source_files import fingerprint
from biogrip.response.jaw_force import jaw_force
from biogrip.response.linear import rotation, step_response
from biogrip.running.manifest import Manifest
from tests.helpers.places import ROOT

MOST_BYTES = 8_000_000
PHONE = {"width": 400, "height": 800}
CLOSE = 1e-9
CASE = "endothelial_cell"


@pytest.fixture(scope="module")
def report(finished: Path) -> Path:
    return finished / "results" / "report.html"


class Opened:
    """The page, and what went wrong in it."""

    def __init__(
        self,
        browser: Any,
        report: Path,
        viewport: dict[str, int] | None = None,
        *,
        explored: bool = True,
    ) -> None:
        self.problems: list[str] = []
        self.asked: list[str] = []
        self.page = browser.new_page(**({"viewport": viewport} if viewport else {}))
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("console", self._said)
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(report.as_uri())
        if explored:
            self.ready()

    def _said(self, message: Any) -> None:
        if message.type == "error":
            self.problems.append(message.text)

    def ready(self) -> None:
        self.page.wait_for_selector("#plot-profile[data-ready=yes]", timeout=120_000)


@pytest.fixture(scope="module")
def opened(browser: Any, report: Path) -> Opened:
    return Opened(browser, report)


def test_the_page_needs_nothing_else(opened: Opened, report: Path) -> None:
    assert report.stat().st_size < MOST_BYTES
    assert [url for url in opened.asked if not url.startswith(("file:", "data:", "blob:"))] == []
    missing = "[...document.images].filter(i => !(i.loading === 'lazy' && !i.complete))"
    assert opened.page.evaluate(f"{missing}.filter(i => !i.naturalWidth).length") == 0
    assert opened.page.evaluate("document.images.length") > 10
    assert opened.problems == []


def test_the_page_says_how_everything_in_it_was_made(report: Path) -> None:
    """Of the config that is what anybody can type, nothing of the code."""
    made = re.findall(r'<details class="made">(.*?)</details>', report.read_text("utf-8"), re.S)
    assert len(made) > 30
    said = (
        r"<summary>How it was made</summary>\s*Rule <code>\w+</code>, file "
        r'<a href="([\w./-]+)"><code>results/\1</code></a>; again by '
        r"<code>biogrip make [\w -]+</code>\.\s*"
    )
    found = [re.fullmatch(said, text) for text in made]
    assert [text for text, match in zip(made, found, strict=True) if match is None] == []
    files = [report.parent / match[1] for match in found if match is not None]
    assert [file for file in files if not file.is_file()] == []


def test_the_page_says_how_to_cite_it_as_the_citation_file_does(opened: Opened) -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    (paper,) = citation["references"]
    said = " ".join(opened.page.locator("#cite ~ pre").inner_text().split())
    (author,) = citation["authors"]
    names = [f"{author['given-names']} {author['family-names']}" for author in paper["authors"]]
    assert f"{', '.join(names)}: {paper['title']}." in said
    assert f"{author['name']}: {citation['title']}, version {citation['version']}. " in said
    assert f"{citation['abstract']}. Software, {citation['license']} licence." in said


def test_the_page_names_the_documentation_and_the_record(report: Path) -> None:
    said = report.read_text("utf-8").partition('<h2 id="provenance">')[2].partition("<details>")[0]
    named = re.findall(r"<code>([\w/]+\.(?:md|jsonl))</code>", said)
    documents = [name for name in named if name.endswith(".md")]
    assert documents[-1] == "CONTRIBUTING.md"
    assert [name for name in documents if not (ROOT / name).is_file()] == []
    assert "results/manifest.jsonl" in named


def test_the_manifest_has_the_code_that_the_page_was_made_by(tiny: Path) -> None:
    code = fingerprint(products()["report"].module)
    assert Manifest(tiny / "results").last("report.html").settings.endswith(f"-{code}")


def test_it_is_legible_on_a_phone(browser: Any, report: Path) -> None:
    opened = Opened(browser, report, PHONE)
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    smallest = """Math.min(...[...document.querySelectorAll('p, li, td, dd, figcaption')]
        .map(e => parseFloat(getComputedStyle(e).fontSize)))"""
    assert opened.page.evaluate(smallest) >= 12
    opened.page.close()


CLIPPED = """[...document.querySelectorAll('table.compared, .compared :is(th, td, caption)')]
    .filter(e => e.checkVisibility() && (e.scrollWidth > e.clientWidth + 1
        || e.getBoundingClientRect().right > document.documentElement.clientWidth))
    .map(e => e.textContent)"""


@pytest.mark.parametrize(("medium", "width"), [("screen", 1400), ("screen", 400), ("print", 718)])
def test_no_column_of_the_first_table_is_clipped(
    browser: Any, report: Path, medium: Any, width: int
) -> None:
    """In print on A4 within margins of a centimetre."""
    opened = Opened(browser, report, {"width": width, "height": 900})
    page = opened.page
    page.emulate_media(media=medium)
    assert page.locator(".compared thead th").count() == 7
    rows = page.locator(".compared tbody tr").all_inner_texts()
    errors = read_table(report.parent / "tables" / "errors.csv")
    assert len(rows) == sum(row["parameter"] != "c_p" for row in errors)
    assert page.evaluate(CLIPPED) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.close()


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


def test_cards_have_the_true_values(opened: Opened) -> None:
    card = opened.page.locator(".card").first.inner_text()
    assert "(true: 35 N/m)" in card
    assert "(true: 299.9 N s/m)" in card


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_anybody_can_use_the_page(browser: Any, report: Path, scheme: Any) -> None:
    """Axe finds nothing serious, all unfolded, in either scheme of colours."""
    context = browser.new_context(color_scheme=scheme)
    opened = Opened(context, report)
    opened.page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    found = Axe().run(opened.page).response
    assert len(found["passes"]) > 20
    serious = [v for v in found["violations"] if v["impact"] in ("serious", "critical")]
    assert [(v["id"], [node["html"] for node in v["nodes"]]) for v in serious] == []
    paper = opened.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(255, 255, 255)") == (scheme == "light")
    context.close()


def test_four_figures_are_shown_and_the_others_open_by_sample(opened: Opened) -> None:
    page = opened.page
    assert page.locator("figure").count() == 4
    titles = page.evaluate("biogrip.cases.map(c => c.title)")
    folded = page.locator("details.sample > summary strong").all_inner_texts()
    assert set(titles) <= set(folded)
    first = page.locator("details.sample").first
    first.locator("> summary").press("Enter")
    thumbnail = first.locator(".thumbnail").first
    small = thumbnail.bounding_box()
    thumbnail.locator("> summary").press("Enter")
    large = thumbnail.bounding_box()
    assert small is not None
    assert large is not None
    assert large["width"] > 2 * small["width"]
    # Alt texts are sentences, not names of files.
    texts = page.locator("main img").evaluate_all("all => all.map(i => i.alt)")
    assert min(len(text.split()) for text in texts) > 4
    for summary in (thumbnail, first):
        summary.locator("> summary").press("Enter")


def test_plots_need_no_graphics_processor(opened: Opened) -> None:
    """Dots as SVG, of which a trace has no more than a screen shows."""
    page = opened.page
    kinds = page.locator(".plot").evaluate_all("all => all.flatMap(p => p.data.map(d => d.type))")
    # Lines have no type of their own.
    assert set(kinds) == {"scatter", None}
    assert page.locator("canvas").count() == 0
    lengths = page.evaluate(
        """[999, 1000, 1001, 4001, 100000].map(n => Array(n).fill(0))
            .map(values => biogrip.dots(values, values, '').x.length)"""
    )
    assert lengths == [999, 1000, 501, 801, 1000]


def test_summaries_are_whole_and_legible(browser: Any, finished: Path) -> None:
    summaries = sorted((finished / "results" / "summaries").glob("*.html"))
    assert summaries
    for summary in summaries:
        opened = Opened(browser, summary, PHONE, explored=False)
        assert opened.page.evaluate("document.images.length") >= 2
        assert opened.page.evaluate("[...document.images].every(i => i.naturalWidth > 0)")
        assert opened.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        assert opened.problems == []
        assert all(url.startswith("data:") for url in opened.asked[1:])
        opened.page.close()


def phases() -> tuple[Phase, ...]:
    """Steps, ramps, parabolas and sinusoids, one after the other, both arms alike."""
    swing = Harmonic(3e-10, 0.7, 0.4)
    loads = (
        Load(1.6e-9),
        Load(1.6e-9, -2e-11),
        Load(3e-10, 4e-12, 1e-13),
        Load(8e-10, harmonics=(swing,)),
    )
    lengths = (5.0, 50.0, 20.0, 60.0)
    return tuple(Phase(t, load, load) for t, load in zip(lengths, loads, strict=True))


def samples() -> Iterator[Network]:
    """None to three branches over the search range, alike ones and none at all among them."""
    rng = np.random.default_rng(14)
    for branches in (0, 1, 1, 1, 2, 3):
        for _ in range(6):
            k, c = np.exp(rng.uniform(-6, 9, branches)), np.exp(rng.uniform(-6, 9, branches))
            k_p, c_p = np.exp(rng.uniform(-9, 7, 2))
            yield Network(np.array([k_p]), np.array([c_p]), k[None], c[None])
    yield Network(np.array([0.0]), np.array([0.0]), np.array([[9.5]]), np.array([[10.0]]))


def as_in_the_page(torque: TorqueHistory) -> dict[str, Any]:
    return {
        "jumps": [[start, order, float(h[0])] for start, order, h in torque.jumps],
        "swings": [[t, omega, a[0].real, a[0].imag] for t, omega, a in torque.swings],
    }


def test_the_closed_form_is_the_library_s(opened: Opened, gripper: Gripper) -> None:
    torque = torque_history(phases())
    time_s = np.concatenate((np.geomspace(1e-6, 1, 30), np.linspace(1.003, torque.end_s, 200)))
    arm = gripper.left
    given = {
        "gripper": {
            "k": arm.stiffness_Nm_per_rad,
            "c": arm.damping_Nms_per_rad,
            "lever": gripper.lever_m,
        },
        "torque": as_in_the_page(torque),
        "times": time_s.tolist(),
    }
    for network in samples():
        sample = {
            "k_p": float(network.k_p[0]),
            "c_p": float(network.c_p[0]),
            "k": network.k[0].tolist(),
            "c": network.c[0].tolist(),
        }
        computed = opened.page.evaluate(
            """({gripper, torque, times, sample}) => ["rotation", "jawForce"].map(
                name => Array.from(biogrip.mechanics[name](gripper, sample, torque, times)))""",
            {**given, "sample": sample},
        )
        response = step_response(gripper, network, inertia=False)
        expected = (
            rotation(response, torque, time_s)[0],
            jaw_force(gripper, network, torque, time_s, nonlinear=False, inertia=False)[0],
        )
        for found, value in zip(computed, expected, strict=True):
            assert np.max(np.abs(np.array(found) - value)) < CLOSE * np.max(np.abs(value)), sample


def test_a_profile_is_the_library_s(opened: Opened, finished: Path) -> None:
    """From the trace in single precision, by other fits; as exactly as one can see."""
    verdicts = read_verdicts(finished / "results" / "identifiability" / f"{CASE}.json")
    compared = 0
    for index, quantity in enumerate(("k", "k_p", "c", "c_p", "c + c_p")):
        (found,) = (q for q in verdicts["quantities"] if q["quantity"] == quantity)
        values = np.array(found["profile"]["values"])
        expected = np.array(found["profile"]["increases"])
        # Further out another basin may begin, for which the page does not look.
        shown = np.flatnonzero(expected < 3 * verdicts["threshold"])
        # The page's elements in their order: branch and parallel ones of each kind.
        names = opened.page.evaluate("biogrip.cases[0].elements.map(e => e.name)")
        chosen = "sum" if index == 4 else names.index(quantity)
        increases = opened.page.evaluate(
            """([chosen, values]) => {
                const item = biogrip.cases[0], fit = item.methods[0].fits[0];
                return biogrip.profileOf(item, item.trace(0), fit.sample, chosen, values).rises;
            }""",
            [chosen, np.log(values[shown]).tolist()],
        )
        assert np.allclose(increases, expected[shown], rtol=0.01, atol=0.01), quantity
        compared += len(shown)
    assert compared > 50


def test_choices_are_followed(opened: Opened, finished: Path) -> None:
    page = opened.page
    assert page.evaluate("biogrip.cases[0].name") == CASE
    page.select_option("#case", "1")
    page.select_option("#method", "1")
    page.select_option("#seed", "2")
    opened.ready()
    name = page.evaluate("biogrip.cases[1].name")
    batches = sorted((finished / "results").glob(f"measurements/{name}/*.parquet"))
    traces = [read_measurements(batch).rotation_rad for batch in batches]
    (trace,) = (part[2] for part in traces if 2 in part)
    drawn = page.evaluate("document.getElementById('plot-trace').data.map(d => Array.from(d.y))")
    # The page has them as whole numbers of two bytes.
    assert np.allclose(drawn[0], trace, rtol=0, atol=np.max(np.abs(trace)) / 2**16)
    left = page.evaluate("Array.from(document.getElementById('plot-residual').data[0].y)")
    assert np.allclose(np.array(drawn[0]) - np.array(drawn[2]), left, rtol=0, atol=1e-9)
    misfit = page.evaluate("biogrip.cases[1].methods[1].fits.find(f => f.seed === 2).misfit")
    assert np.sqrt(np.mean(np.square(left))) == pytest.approx(misfit, rel=1e-3)
    assert opened.problems == []


def test_a_sample_of_one_s_own_is_judged_at_once(opened: Opened) -> None:
    """More noise tells less; jaws that pull are said."""
    page = opened.page

    def deviations() -> Array:
        return np.array(
            page.evaluate(
                """(() => { const item = biogrip.cases[0];
                const logs = biogrip.inference.logsOf(item.layout, item.truth);
                const respond = x => Array.from(biogrip.mechanics.rotation(item.gripper,
                    biogrip.inference.sampleOf(item.layout, x), item.torque, item.times));
                return biogrip.inference.deviations(item.layout, logs, respond, item.noise);
                })()"""
            )
        )

    def told() -> str:
        return str(page.inner_text("#determined"))

    page.select_option("#try-case", "0")
    before = told()
    assert "determined" in before
    # As the card above, where the first order does not say the same.
    profile = page.locator("#determined td:last-child").all_inner_texts()
    verdicts = page.evaluate("Object.values(biogrip.cases[0].verdicts)")
    assert [said.partition(":")[0] for said in profile] == verdicts
    first_order = page.locator("#determined td:nth-child(4)").all_inner_texts()
    for said, near, verdict in zip(profile, first_order, verdicts, strict=True):
        differ = {near, verdict} != {"determined"} and "determined" in (near, verdict)
        assert ("the profile disagrees" in said) == (differ and near != "roughly")
    assert "press all the time" in page.inner_text("#force-words")
    page.eval_on_selector(
        "#try-noise", "e => { e.value = Math.log(1e-2); e.dispatchEvent(new Event('input')); }"
    )
    assert told() != before
    assert told().count("not determined") == 5
    # No profile is computed for other samples.
    assert set(page.locator("#determined td:last-child").all_inner_texts()) == {"–"}
    page.select_option("#try-case", "1")
    assert "would have to pull" in page.inner_text("#force-words")
    found = deviations()
    # k_p of the cell shows in every sample, c_p in none.
    assert found[1] < 0.05 < 1 < found[3]
    assert opened.problems == []
