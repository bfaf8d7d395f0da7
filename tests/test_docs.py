import re
from pathlib import Path

import pytest

from tests.generated_docs import GENERATED, renewed
from tests.helpers.places import ROOT


@pytest.mark.parametrize("document", GENERATED, ids=lambda path: str(path.relative_to(ROOT)))
def test_generated_parts_are_up_to_date(document: Path) -> None:
    """If this fails: make docs."""
    assert renewed(document) == document.read_text(encoding="utf-8")


def test_promises_are_kept_by_tests_that_there_are() -> None:
    promised = re.findall(r"`(test_\w+)`", (ROOT / "docs" / "reliability.md").read_text())
    tests = "".join(file.read_text() for file in (ROOT / "tests").rglob("test_*.py"))
    assert len(promised) > 5
    assert [name for name in promised if f"def {name}(" not in tests] == []


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
