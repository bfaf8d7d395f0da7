import re
from pathlib import Path

import pytest

from tests.generated_docs import GENERATED, renewed
from tests.helpers.places import ROOT
from tests.published_numbers import renewed_numbers


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


TABLE = """case,method,share,evaluations
drop,genetic,0.46,18000
drop,"other, polished",1.0,1340
cell,genetic,0.964,5278.5
"""


@pytest.fixture
def published(tmp_path: Path) -> Path:
    folder = tmp_path / "tables"
    folder.mkdir()
    (folder / "methods.csv").write_text(TABLE, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("what", "shown"),
    [
        ("methods[case=drop, method=genetic].share | .0%", "46 %"),
        ("methods[case=drop].share | .0%", "46 to 100 %"),
        ("methods[case=drop|cell, method!=other, polished].share | .1% | each", "46.0 and 96.4 %"),
        ("methods.share | .0% | each", "46, 100 and 96 %"),
        ("methods[case=cell|drop].evaluations | .3g", "1,340 to 18,000"),
        ("methods[case=cell].evaluations | .2f", "5278.50"),
        ("methods[method=genetic].count | d", "2"),
        (r"methods[case=drop\|cell, method=genetic].share \| .0% \| each", "46 and 96 %"),
    ],
)
def test_numbers_come_from_the_published_tables(what: str, shown: str, published: Path) -> None:
    text = f"It is <!--= {what} -->typed by hand<!--/--> here."
    found = renewed_numbers(text, published)
    assert found == f"It is <!--= {what} -->{shown}<!--/--> here."
    assert renewed_numbers(found, published) == found


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("methods", "wanted TABLE"),
        ("nothing.share | .0%", "nothing: no such table"),
        ("methods[case=cat].share | .0%", "no such row"),
        ("methods.shares | .0%", "allowed columns are case, method, share, evaluations"),
        ("methods[kind=cat].share | .0%", "allowed columns are case"),
    ],
)
def test_a_mark_that_names_nothing_is_refused(what: str, message: str, published: Path) -> None:
    with pytest.raises(ValueError, match=message):
        renewed_numbers(f"<!--= {what} -->1<!--/-->", published)
