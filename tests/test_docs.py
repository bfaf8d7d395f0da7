import re
from pathlib import Path

import pytest

from tests.generated_docs import GENERATED, ROOT, renewed


@pytest.mark.parametrize("document", GENERATED, ids=lambda path: str(path.relative_to(ROOT)))
def test_generated_parts_are_up_to_date(document: Path) -> None:
    """If this fails: make docs."""
    assert renewed(document) == document.read_text(encoding="utf-8")


@pytest.mark.parametrize("document", ["README.md", "config/README.md", *Path("docs").glob("*.md")])
def test_links_lead_somewhere(document: str | Path) -> None:
    path = ROOT / document
    text = path.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)#]*)(?:#[^)]*)?\)", text):
        assert not link or (path.parent / link).exists(), link
