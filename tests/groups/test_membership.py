"""The table of traces, cells and groups: what is read of it, and what is refused."""

from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.groups.cell_table import Cell, read_cells


def table(folder: Path, text: str) -> Path:
    file = folder / "groups.csv"
    file.write_bytes(text.encode())
    return file


def test_a_cell_on_several_lines_has_replicates(tmp_path: Path) -> None:
    read = read_cells(
        table(tmp_path, "file,cell,group\nb.csv,1,x\nc.csv,2,y\na.csv,1,x\n/elsewhere/d.csv,3,x\n")
    )
    assert read == [
        Cell("1", "x", (tmp_path / "a.csv", tmp_path / "b.csv")),
        Cell("2", "y", (tmp_path / "c.csv",)),
        Cell("3", "x", (Path("/elsewhere/d.csv"),)),
    ]


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffgroup;note;cell;file\r\n\r\nx;;1;a.csv\r\n",
        '# my dishes\n"file"\t"cell"\tgroup\n"a.csv"\t 1\tx\t\n',
        "file, cell, group\n# left out: b.csv,2,x\na.csv, 1, x\n",
    ],
)
def test_separators_comments_quotes_and_other_columns(tmp_path: Path, text: str) -> None:
    assert read_cells(table(tmp_path, text)) == [Cell("1", "x", (tmp_path / "a.csv",))]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "groups.csv: found no header, allowed is file,cell,group."),
        ("file,cell,group\n", "groups.csv: found no traces, allowed is a row for each"),
        (
            "file,cell,grup\na.csv,1,x\n",
            "groups.csv, line 1, column 'group': found no such column among file, cell, grup; "
            "allowed is a header with file, cell, group. Did you mean 'grup'?",
        ),
        ("file,cell,cell,group\n", "line 1, column 'cell': found 2 columns of this name"),
        ("file,cell,group\n\na.csv,1\n", "line 3: found 2 cells in the row, allowed are the hea"),
        ("file,cell,group\na.csv,1,x,y\n", "line 2: found 4 cells in the row, allowed are the he"),
        ("file,cell,group\na.csv,,x\n", "line 2, column 'cell': found nothing, allowed is a name"),
        ('file,cell,group\n"a.csv,1,x\n', "groups.csv, line 2: cannot be read as a row: "),
        (
            "file,cell,group\na.csv,1,x\nb.csv,2,x\na.csv,3,y\n",
            "a.csv' again, as on line 2; allowed is each trace once.",
        ),
        (
            "file,cell,group\na.csv,1,x\nb.csv,1,y\n",
            "line 3, column 'group': found 'y' for the cell '1', which is of 'x' on line 2; "
            "allowed is one group for a cell, or another name of the cell.",
        ),
    ],
)
def test_what_is_no_table_is_refused_with_its_place(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(BiogripError) as caught:
        read_cells(table(tmp_path, text))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_trace_is_known_whatever_way_leads_to_it(tmp_path: Path) -> None:
    (tmp_path / "a.csv").touch()
    (tmp_path / "b.csv").symlink_to("a.csv")
    for other in ("b.csv", "./a.csv", f"../{tmp_path.name}/a.csv"):
        with pytest.raises(BiogripError, match="again, as on line 2"):
            read_cells(table(tmp_path, f"file,cell,group\na.csv,1,x\n{other},2,x\n"))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"file,cell,group\n\xff\xfe,1,x\n", "groups.csv: found bytes that are no UTF-8"),
        (b"file,cell,group\na\0.csv,1,x\n", "groups.csv: found binary data"),
    ],
)
def test_what_is_no_text_is_refused(tmp_path: Path, content: bytes, said: str) -> None:
    file = tmp_path / "groups.csv"
    file.write_bytes(content)
    with pytest.raises(BiogripError, match=said):
        read_cells(file)
