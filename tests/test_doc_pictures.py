import pytest

from tests.helpers.doc_pictures import DOCS, PICTURES


@pytest.mark.parametrize("name", ["flow", "groups", "heights", "noise"])
def test_pictures_can_be_drawn_again(name: str) -> None:
    """Those that take no fit."""
    assert PICTURES[name]().axes


def test_every_picture_is_there_and_shown() -> None:
    pages = [*DOCS.rglob("*.md"), DOCS.parent / "README.md"]
    text = " ".join(page.read_text(encoding="utf-8") for page in pages)
    assert {file.stem for file in DOCS.glob("*.png")} == {*PICTURES, "page"}
    assert [name for name in (*PICTURES, "page") if f"{name}.png)" not in text] == []
