import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.generated_docs import GENERATED, ROOT, renewed


@pytest.mark.parametrize("document", GENERATED, ids=lambda path: str(path.relative_to(ROOT)))
def test_generated_parts_are_up_to_date(document: Path) -> None:
    """If this fails: make docs."""
    assert renewed(document) == document.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "document",
    [
        "README.md",
        "CONTRIBUTING.md",
        "config/README.md",
        *sorted(path.relative_to(ROOT) for path in (ROOT / "docs").rglob("*.md")),
    ],
)
def test_links_lead_somewhere(document: str | Path) -> None:
    """To a file: the site has no page of a folder, and is not built where one is linked."""
    path = ROOT / document
    text = path.read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)#]*)(?:#[^)]*)?\)", text)
    # What is above the first # of a link is empty where it leads to another part of the text.
    own = [link for link in links if link and "://" not in link]
    assert [link for link in own if not (path.parent / link).is_file()] == []


@pytest.mark.parametrize("document", GENERATED, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_mark_cuts_a_cell(document: Path) -> None:
    """GitHub cuts rows of tables at every unescaped bar, in comments as well."""
    rows = [line for line in document.read_text(encoding="utf-8").splitlines() if line[:1] == "|"]
    marks = [mark for row in rows for mark in re.findall(r"<!--=.*?-->", row)]
    assert [mark for mark in marks if re.search(r"(?<!\\)\|", mark)] == []


@pytest.mark.parametrize("document", GENERATED, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_mark_ends_a_paragraph(document: Path) -> None:
    """As a comment does that begins a line, on GitHub."""
    lines = document.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line.lstrip().startswith("<!--=")] == []


def test_the_readme_leads_to_every_document() -> None:
    """Directly or by another: else nobody would find it, nor the test above its links."""
    found, left = set(), ["README.md"]
    while left:
        path = left.pop()
        if path in found or not path.endswith(".md"):
            continue
        found.add(path)
        for link in re.findall(r"\]\(([^)#]+)", (ROOT / path).read_text(encoding="utf-8")):
            there = (ROOT / path).parent / link
            if there.is_file():
                left.append(str(there.resolve().relative_to(ROOT)))
    assert {str(file.relative_to(ROOT)) for file in (ROOT / "docs").rglob("*.md")} <= found


def test_every_note_that_is_explained_is_said() -> None:
    """The page on doubts quotes notes and messages as the code has them."""
    page = (ROOT / "docs" / "howto" / "doubts.md").read_text(encoding="utf-8")
    quoted = re.findall(r'^\| "([^"]+)"', page, re.MULTILINE)
    said = " ".join(
        text
        for file in (ROOT / "src" / "biogrip").rglob("*.py")
        for text in _texts(ast.parse(file.read_text(encoding="utf-8")))
    )
    assert len(quoted) > 15
    assert [note for note in quoted if note not in said] == []


def _texts(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


PICTURED = ["README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "howto").glob("*.md")]


@pytest.mark.parametrize("document", PICTURED, ids=lambda path: Path(path).stem)
def test_every_page_has_a_picture_and_says_what_it_shows(document: str | Path) -> None:
    pictures = re.findall(r"!\[(.*?)\]\((.*?)\)", (ROOT / document).read_text(encoding="utf-8"))
    assert pictures
    assert all(len(shown) > 10 for shown, _ in pictures)
    assert all((ROOT / document).parent.joinpath(path).is_file() for _, path in pictures)


def test_the_documentation_stays_short() -> None:
    """In words; comments, and marks of tables, are none."""
    docs = ROOT / "docs"
    pages = [file for file in docs.rglob("*.md") if docs / "reference" not in file.parents]
    assert _words(ROOT / "README.md") <= 900
    assert sum(map(_words, pages)) <= 18_000


def _words(document: Path) -> int:
    text = re.sub(r"<!--.*?-->", "", document.read_text(encoding="utf-8"), flags=re.DOTALL)
    return sum(bool(re.search(r"\w", word)) for word in text.split())
