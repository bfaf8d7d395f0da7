"""Tables of two folders, cell by cell."""

from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.running.comparison import compare


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """The same table, published and regenerated."""
    found = tmp_path / "published", tmp_path / "now"
    for folder in found:
        folder.mkdir()
        (folder / "errors.csv").write_text("case,value\ncell,1\ndrop,2\n")
    return found


def test_tables_agree_byte_for_byte(folders: tuple[Path, Path]) -> None:
    published, now = folders
    expected = f"1 file of tables compared with {published}: the same bytes."
    assert compare(published, now) == expected
    (now / "errors.csv").write_bytes(b"case,value\r\ncell,1\r\ndrop,2\r\n")
    with pytest.raises(BiogripError, match=r"errors.csv: differs in its text"):
        compare(published, now)


def test_each_difference_says_which_side_has_what(folders: tuple[Path, Path]) -> None:
    published, now = folders
    (now / "errors.csv").write_text("case,value\ndrop,3\nother,4\n")
    (published / "old.md").write_text("old")
    (now / "new.md").write_text("new")
    with pytest.raises(BiogripError) as raised:
        compare(published, now)
    first, *problems, _, heading, _, cell, drop, other = str(raised.value).splitlines()
    assert first == f"the regenerated tables differ from {published}."
    assert problems == [
        "old.md: published, but not regenerated",
        "new.md: regenerated, but not published",
    ]
    cells = [[word.strip() for word in row.strip("|").split("|")] for row in (cell, drop, other)]
    assert [word.strip() for word in heading.strip("|").split("|")][-2:] == ["published", "now"]
    assert cells == [
        ["errors", "cell", "(row)", "present", "absent"],
        ["errors", "drop", "value", "2", "3"],
        ["errors", "other", "(row)", "absent", "present"],
    ]


def test_only_some_tables_are_compared(folders: tuple[Path, Path]) -> None:
    """An overlay publishes what it is about; its study has more tables."""
    published, now = folders
    (now / "verdicts.csv").write_text("case,value\n")
    assert "1 file" in compare(published, now, "err*")
    (now / "errors_cell.csv").write_text("case,value\n")
    with pytest.raises(BiogripError, match=r"errors_cell.csv: regenerated, but not published"):
        compare(published, now, "err*")
    with pytest.raises(BiogripError, match="holds no tables"):
        compare(published, now, "robust*")
