"""Regenerated tables beside the published ones."""

from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.tables.comparison import compare


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """Published tables, and as many made anew, all the same."""
    both = tmp_path / "published", tmp_path / "made"
    for folder in both:
        folder.mkdir()
        (folder / "a.csv").write_text("k,c\n1,2\n3,4\n")
        (folder / "b.md").write_text("text\n")
    return both


def test_the_same_bytes_are_counted(folders: tuple[Path, Path]) -> None:
    published, made = folders
    assert compare(published, sorted(made.iterdir())).startswith("2 files of tables compared with ")


def test_lines_that_differ_and_tables_that_are_new_are_shown(folders: tuple[Path, Path]) -> None:
    published, made = folders
    (made / "a.csv").write_text("k,c\n1,2\n3,5\n")
    (made / "c.csv").write_text("new\n")
    with pytest.raises(BiogripError) as error:
        compare(published, sorted(made.iterdir()))
    said = str(error.value).splitlines()
    assert said[0] == f"the regenerated tables differ from {published}."
    assert said[-3:] == ["-3,4", "+3,5", "c.csv: is not published."]
    assert "text" not in str(error.value)


def test_many_lines_are_shown_in_part(folders: tuple[Path, Path]) -> None:
    published, made = folders
    (made / "a.csv").write_text("".join(f"{n}\n" for n in range(1000)))
    with pytest.raises(BiogripError) as error:
        compare(published, [made / "a.csv"])
    assert len(str(error.value).splitlines()) == 41
