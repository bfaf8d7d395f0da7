"""Tables as files, in four formats, and regenerated ones beside the published."""

import re
from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.records.rows import read_rows
from biogrip.tables.layout import Column, ShownTable, compare, convert, write


def written(table: ShownTable, folder: Path) -> list[str]:
    """Markdown, LaTeX and HTML of a table, which is `t.csv` in a folder."""
    write(table, folder / "t.csv")
    for end in ("md", "tex"):
        (folder / f"t.{end}").write_text(convert(folder / "t.html", f".{end}"))
    return [(folder / f"t.{end}").read_text() for end in ("md", "tex", "html")]


def test_a_table_says_the_same_in_all_its_files(tmp_path: Path) -> None:
    columns = Column("case", "Case"), Column("value", "Value", 3), Column("none", "None")
    rows = [{"case": "a_b", "value": 1234.5678}, {"case": "c & d", "value": -0.0, "none": None}]
    table = ShownTable("Fifty % of a_b.", columns, [*rows, {"none": float("nan")}])
    markdown, latex, page = written(table, tmp_path)
    found = read_rows(tmp_path / "t.csv", ["case", "value", "none"])[1:]
    assert found == [["a_b", "1234.57", ""], ["c & d", "0", ""], ["", "", ""]]
    assert "1.23e+03" in markdown
    assert "None" not in markdown + latex + page
    assert r"Fifty \% of a\_b." in latex
    assert "c &amp; d" in page


@pytest.mark.parametrize(
    ("given", "latex"),
    [
        (r"dose & \input{x} #2", r"dose \& \textbackslash{}input\{x\} \#2"),
        ("5$ a day, 10$ a week\n\n50 %", r"5\$ a day, 10\$ a week 50 \%"),
        ("a|b\nc {y}", r"a|b c \{y\}"),
        ("<img onerror=x> a_b ~ ^", r"<img onerror=x> a\_b \textasciitilde{} \textasciicircum{}"),
    ],
)
def test_markup_is_text_in_every_format(tmp_path: Path, given: str, latex: str) -> None:
    """Of a caption, a heading and a cell."""
    heading = given.replace("\n", " ")
    table = ShownTable(given, (Column("a", heading),), [{"a": given}])
    markdown, tex, page = written(table, tmp_path)
    assert rf"\caption{{{latex}}}" in tex
    assert not re.search(r"(?<!\\)[#$%&_~^]|\\input", tex)
    assert [len(re.findall(r"(?<!\\)\|", row)) for row in markdown.splitlines()[-3:]] == [2] * 3
    assert "<img" not in markdown + page
    assert read_rows(tmp_path / "t.csv", ["a"])[1:] == [[given]]


def test_regenerated_tables_are_the_same_bytes_or_their_lines_are_shown(tmp_path: Path) -> None:
    published, made = tmp_path / "published", tmp_path / "made"
    for folder in (published, made):
        folder.mkdir()
        (folder / "a.csv").write_text("k,c\n1,2\n3,4\n")
    write(ShownTable("Text.", (Column("k", "k"),), [{"k": 1.5}]), made / "b.csv")
    (published / "b.md").write_text("Text.\n\n| k   |\n|:----|\n| 1.5 |\n")
    files = [made / "a.csv", made / "b.html"]
    assert compare(published, files).startswith("2 files of tables compared with ")
    (made / "a.csv").write_text("k,c\n1,2\n3,5\n")
    (made / "c.csv").write_text("new\n")
    with pytest.raises(BiogripError) as error:
        compare(published, [*files, made / "c.csv"])
    said = str(error.value).splitlines()
    assert said[0] == f"the regenerated tables differ from {published}."
    assert said[-3:] == ["-3,4", "+3,5", "c.csv: is not published."]
    with pytest.raises(BiogripError, match="holds no tables to compare with"):
        compare(published, [])
