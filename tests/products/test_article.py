"""The article of the published study: whole, accessible, and without a number that was typed."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import yaml

from biogrip.errors import BiogripError
from biogrip.products.catalogue import products
from biogrip.products.report import article
from biogrip.products.report.article import (
    ARTICLE,
    Content,
    collect_data,
    compile_article,
    content,
    fill,
    published_file,
    read_frames,
)
from biogrip.running.rules import ProductRule, files_of, make_rules
from tests.helpers.default import STUDY, plan_of
from tests.helpers.places import ROOT

PUBLISHED = ROOT / "results" / "published"
TABLES = sorted((PUBLISHED / "tables").glob("*.csv"))
BODY = Path(article.__file__).with_name("article.typ").read_text(encoding="utf-8")
# Places in the paper, in the article and in the notation; years and pages are in references.yaml.
PLACES = re.compile(
    r"\b(?:case|drop) \d"
    r"|\b(?:Tables?|Figures?|[Ss]ections?|eqs?\.) \(?\d+\)?(?:(?: and| to|,) \(?\d+\)?)*"
)


@pytest.fixture(scope="module")
def shown() -> Content:
    return content(STUDY, {})


@pytest.fixture(scope="module")
def figures() -> list[Path]:
    names = [Path(file).name for file in ARTICLE.inputs(plan_of(), {})["figures"]]
    return [PUBLISHED / "figures" / name for name in names]


@pytest.fixture(scope="module")
def written(shown: Content, figures: list[Path], tmp_path_factory: pytest.TempPathFactory) -> bytes:
    pdf = tmp_path_factory.mktemp("article") / "article.pdf"
    article.write(shown, figures, TABLES, pdf)
    return pdf.read_bytes()


@pytest.fixture
def frames(shown: Content) -> dict[str, pd.DataFrame]:
    return read_frames(shown, TABLES)


def prose(text: str) -> str:
    """A template without marks, mathematics, names of files and columns, labels and comments."""
    text = re.sub(r"^//.*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"«.*?»", "", text, flags=re.DOTALL)
    text = re.sub(r"(?<!\\)\$.*?\$", "", text, flags=re.DOTALL)
    # A text in quotes that is no name is read.
    text = re.sub(r'"[a-z_]+[a-z_0-9]*"|\b[a-z_]+_[a-z_0-9]+:', "", text)
    return re.sub(r"\bp\d\d_\w+|<\w+>|@\w+", "", text)


def test_no_number_of_a_result_is_typed() -> None:
    left = PLACES.sub("", prose(BODY))
    assert [line.strip() for line in left.splitlines() if re.search(r"\d", line)] == []


def test_equations_have_no_numbers_but_those_of_the_notation() -> None:
    """Indices, powers, and the two jaws of u = 2 l^2 sin^2."""
    formulas = re.findall(r"\$(.*?)\$", re.sub(r"«.*?»", "", BODY, flags=re.DOTALL))
    assert len(formulas) > 40
    left = [re.sub(r"[_^](\d|\(.*?\))|= 2 l\^2", "", formula) for formula in formulas]
    assert [formula for formula in left if re.search(r"\d", formula)] == []


@pytest.mark.parametrize(
    "typed", ["fits 46 % of the traces", "k is 32.8 N/m", "in 9 of 12", "of «errors.k | d» 5 %"]
)
def test_a_number_that_is_typed_would_be_found(typed: str) -> None:
    assert re.search(r"\d", PLACES.sub("", prose(typed)))


def test_every_mark_names_what_the_published_study_has(frames: dict[str, pd.DataFrame]) -> None:
    assert len(re.findall("«", BODY)) > 60
    filled = fill(BODY, frames)
    assert "(not in this study)" not in filled
    assert "«" not in filled


def test_a_mark_takes_its_number_from_the_tables() -> None:
    runs = pd.DataFrame({"case": ["a", "b"], "share": ["0.46", "1"], "force": ["-0.7", "0.2"]})
    text = "«runs[case=a].share | .0%», «runs.force | .1f», «runs[case=b].count | d»"
    assert fill(text, {"runs": runs}) == "46~%, −0.7 to 0.2, 1"
    assert fill("«runs[case=c].share | .0%»", {"runs": runs}) == "(not in this study)"
    assert fill("«runs[case=c].count | d» «walks.share | d»", {"runs": runs}).startswith("0 (not")
    with pytest.raises(BiogripError, match="allowed columns are case, share, force"):
        fill("«runs.speed | d»", {"runs": runs})


def test_it_is_of_eight_to_twelve_pages_with_tags_language_and_fonts(written: bytes) -> None:
    assert 8 <= len(re.findall(rb"/Type\s*/Page\b(?!s)", written)) <= 12
    for part in (b"/StructTreeRoot", b"/Lang(en-GB)", b"/MarkInfo", b"/FontFile"):
        assert part in written
    assert b"CreationDate" not in written


def test_every_figure_and_equation_says_what_it_shows(written: bytes) -> None:
    drawn = re.findall(r'#drawn\(((?:\s*"\w+",)+)', BODY)
    pictures = sum(names.count('"') // 2 for names in drawn)
    assert pictures >= 9
    assert written.count(b"/Alt") >= pictures + BODY.count("#equation(") - len(drawn)


def test_the_same_results_give_the_same_bytes(
    written: bytes, shown: Content, figures: list[Path], tmp_path: Path
) -> None:
    article.write(shown, figures, TABLES, tmp_path / "again.pdf")
    assert (tmp_path / "again.pdf").read_bytes() == written


def test_other_results_give_another_article(
    written: bytes, shown: Content, figures: list[Path], tmp_path: Path
) -> None:
    changed = []
    for table in TABLES:
        text = table.read_text(encoding="utf-8").replace("32.8", "32.9")
        (tmp_path / table.name).write_text(text, encoding="utf-8")
        changed.append(tmp_path / table.name)
    article.write(shown, figures, changed, tmp_path / "other.pdf")
    assert (tmp_path / "other.pdf").read_bytes() != written


def test_typst_has_nothing_to_warn_of(
    shown: Content, figures: list[Path], frames: dict[str, pd.DataFrame]
) -> None:
    sources = dict(shown.sources)
    sources["article.typ"] = fill(BODY, frames)
    sources["data.json"] = json.dumps(collect_data(shown, frames))
    _, warnings = compile_article(sources, [*figures, *map(published_file, shown.pictures)])
    assert warnings == []


def test_a_figure_that_is_no_pdf_is_named(shown: Content, tmp_path: Path) -> None:
    (tmp_path / "torque.pdf").write_text("empty")
    sources = dict(shown.sources) | {"article.typ": '#image("torque.pdf")'}
    with pytest.raises(BiogripError, match="cannot be set: failed to load PDF"):
        compile_article(sources, [tmp_path / "torque.pdf"])
    with pytest.raises(BiogripError, match=r"lost\.pdf: cannot be read"):
        compile_article(sources, [tmp_path / "lost.pdf"])


def test_title_and_authors_are_those_of_the_citation_file(
    shown: Content, frames: dict[str, pd.DataFrame]
) -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    (paper,) = citation["references"]
    data = collect_data(shown, frames)
    assert data["authors"] == [author["name"] for author in citation["authors"]]
    assert f'title: "[Re] {paper["title"]}"' in BODY
    cited = yaml.safe_load(shown.sources["references.yaml"])["verotti"]
    names = [f"{author['family-names']}, {author['given-names']}" for author in paper["authors"]]
    assert (cited["title"], cited["author"]) == (paper["title"], names)


def test_authors_may_be_persons(shown: Content, frames: dict[str, pd.DataFrame]) -> None:
    citation = yaml.safe_load(shown.citation)
    citation["authors"] = [{"given-names": "Ada", "family-names": "Byron"}, {"name": "Others"}]
    signed = replace(shown, citation=yaml.safe_dump(citation))
    assert collect_data(signed, frames)["authors"] == ["Ada Byron", "Others"]


def test_each_table_and_figure_names_a_rule_that_makes_its_file(
    shown: Content, frames: dict[str, pd.DataFrame]
) -> None:
    made = collect_data(shown, frames)["made"]
    rules = {rule.name: files_of([rule]) for rule in make_rules_of_default()}
    own = [made[name] for name in made if not made[name]["file"].startswith(("results/pub", "ben"))]
    assert len(own) > 20
    for each in own:
        if "*" not in each["file"]:
            assert each["file"] in rules[each["rule"]]
    snakefile = (ROOT / "workflow" / "rules" / "check.smk").read_text(encoding="utf-8")
    for each in made.values():
        if each["rule"].startswith("publish_"):
            assert f'"{each["rule"].removeprefix("publish_")}": (' in snakefile
            assert (ROOT / each["file"]).is_file()


def make_rules_of_default() -> list[ProductRule]:
    return make_rules(products().values(), plan_of())


def test_a_run_makes_it_of_studies_with_all_samples_of_the_paper() -> None:
    assert "results/article.pdf" in files_of(make_rules_of_default())
    pulled = "{instrument: creep, protocol: {phases: [{duration_s: 200.0, force_N: 1.0e-6}]}}"
    for other in ("cases: {liquid_drop_1: null}", pulled):
        assert ARTICLE.jobs(plan_of(other)) == []
    made = {file for rule in make_rules_of_default() for file in files_of([rule])}
    assert {f for files in ARTICLE.inputs(plan_of(), {}).values() for f in files} <= made
