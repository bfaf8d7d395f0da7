"""Sheets of traces: what is read of them, and what is refused."""

import os
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from biogrip.errors import BiogripError
from biogrip.study.case_blocks import NAMABLE
from biogrip.study.load import load_study
from biogrip.study.named_blocks import NamedBlocks, read_named_blocks
from biogrip.study.sheet import Cell, Row, cells_of, read_sheet
from biogrip.study.sheet_columns import BLOCKS, Setting, setting_of, settings_by_column
from biogrip.study.sheet_text import is_sheet
from biogrip.study.source import read_config
from tests.helpers.places import CONFIG, ROOT

SHORT = {"phases": [{"duration_s": 5.0, "torque_Nm": 1e-9}]}
LONG = {"phases": [{"duration_s": 50.0, "torque_Nm": 1e-9}]}
NAMED = NamedBlocks({"protocol": {"short": SHORT, "long": LONG}})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with files for traces."""
    for name in "abcd":
        (tmp_path / f"{name}.csv").touch()
    return tmp_path


def sheet(folder: Path, text: str) -> Path:
    file = folder / "cells.tsv"
    file.write_bytes(text.encode())
    return file


def refusal(folder: Path, text: str, blocks: NamedBlocks | None = None) -> str:
    with pytest.raises(BiogripError) as caught:
        read_sheet(sheet(folder, text), blocks)
    return str(caught.value).replace(str(folder / "cells.tsv"), "cells.tsv")


def test_a_sheet_is_a_file(folder: Path) -> None:
    """A pipe without a writer would block."""
    os.mkfifo(folder / "pipe.tsv")
    for name, said in (("pipe.tsv", "no regular file"), ("gone.tsv", "a file that exists")):
        with pytest.raises(BiogripError, match=said):
            read_sheet(folder / name)
        assert not is_sheet(folder / name)


def test_cells_of_groups_have_replicates(folder: Path) -> None:
    file = sheet(folder, "file,cell,group\nb.csv,1,x\nc.csv,2,y\na.csv,1,x\n")
    read = read_sheet(file)
    rows = {name: read.rows[number] for number, name in enumerate("bca")}
    assert rows["c"] == Row(file, 3, folder / "c.csv", "2", {"group": "y"}, {})
    assert cells_of(read) == (
        "group",
        [Cell("1", "x", (rows["a"], rows["b"])), Cell("2", "y", (rows["c"],))],
    )


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffgroup;note;cell;file\r\n\r\nx;;1;a.csv\r\n",
        '# my dishes\n"file"\t"cell"\tgroup\n"a.csv"\t 1\tx\t\n',
        "file, cell, group,\n# left out: b.csv,2,x\na.csv, 1, x,\n",
    ],
)
def test_separators_comments_and_quotes(folder: Path, text: str) -> None:
    read = read_sheet(sheet(folder, text))
    assert [(row.file, row.cell, row.factors["group"]) for row in read.rows] == [
        (folder / "a.csv", "1", "x")
    ]
    assert is_sheet(read.path)


def test_without_a_column_each_file_is_a_cell(folder: Path) -> None:
    read = read_sheet(sheet(folder, "file\tdish\na.csv\tx\nb.csv\t\n"))
    assert [row.cell for row in read.rows] == ["a", "b"]
    assert read.factors == ("dish",)
    (folder / "more").mkdir()
    (folder / "more" / "a.csv").touch()
    assert "line 3, column 'file': names the cell 'a' as line 2 does" in refusal(
        folder, "file\na.csv\nmore/a.csv\n"
    )


@pytest.mark.parametrize(
    ("column", "cell", "settings"),
    [
        ("measurement.noise_rad", "1e-4", {"measurement": {"noise_rad": 1e-4}}),
        ("measurement.drift", "true", {"measurement": {"drift": True}}),
        # Text where a key takes text, whatever YAML makes of it.
        ("measurement.time", "0", {"measurement": {"time": "0"}}),
        ("gripper.left.inertia_kgm2", "2e-14", {"gripper": {"left": {"inertia_kgm2": 2e-14}}}),
        ("gripper.arm_length_m", "", {}),
        ("fix.k_p", "0", {"fixed": {"k_p": 0}}),
        ("fixed.k_p", "2.5", {"fixed": {"k_p": 2.5}}),
        ("instrument", "creep", {"instrument": "creep"}),
        ("sample.model", "maxwell", {"sample": {"model": "maxwell"}}),
        ("sample.size_m", "60e-6", {"sample": {"size_m": 60e-6}}),
        ("protocol", "short", {"protocol": SHORT}),
    ],
)
def test_a_column_that_is_a_key_is_a_setting(
    folder: Path, column: str, cell: str, settings: dict[str, Any]
) -> None:
    read = read_sheet(sheet(folder, f"file,dish,{column}\na.csv,x,{cell}\n"), NAMED)
    assert read.rows[0].settings == settings
    assert read.rows[0].factors == {"dish": "x"}
    assert read.named == ({("protocol", "short")} if column == "protocol" else set())


def test_a_key_is_laid_over_the_block_that_its_row_names(folder: Path) -> None:
    blocks = NamedBlocks({"gripper": {"old": {"arm_length_m": 1e-3, "jaw_gap_m": 1e-4}}})
    text = "file,gripper.arm_length_m,gripper\na.csv,2e-3,old\nb.csv,,old\n"
    settings = [dict(row.settings) for row in read_sheet(sheet(folder, text), blocks).rows]
    assert settings[0] == {"gripper": {"arm_length_m": 2e-3, "jaw_gap_m": 1e-4}}
    assert settings[1] == {"gripper": {"arm_length_m": 1e-3, "jaw_gap_m": 1e-4}}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "cells.tsv: found no header, allowed is one with 'file'."),
        ("file,cell,group\n", "cells.tsv: found no traces, allowed is a row for each"),
        (
            "File,cell\na.csv,1\n",
            "cells.tsv, line 1, column 'file': found no such column among File, cell; allowed is a "
            "header with file. Did you mean 'File'?",
        ),
        ("file,cell,cell\n", "line 1, column 'cell': found 2 columns of this name"),
        ("file,cell\n\na.csv\n", "line 3: found 1 cell in the row, allowed are the header's 2."),
        ("file,cell\na.csv,1,y\n", "line 2: found 3 cells in the row, allowed are the header's 2."),
        ("file,cell\na.csv,\n", "line 2, column 'cell': found nothing, allowed is a name"),
        ("file,cell\n,1\n", "line 2, column 'file': found nothing, allowed is a name"),
        ('file,cell\n"a.csv,1\n', "cells.tsv, line 2: cannot be read as a row: "),
        (
            "file,cell,group\na.csv,1,x\nb.csv,2,x\na.csv,3,y\n",
            "a.csv' again, as on line 2; allowed is each trace once.",
        ),
        (
            "file,cell,group\na.csv,1,x\nb.csv,1,y\n",
            "line 3, column 'group': found 'y' for the cell '1', which is of 'x' on line 2; "
            "allowed is one group for a cell, or another name of the cell.",
        ),
        ("file\n.\n", "line 2, column 'file': found the folder "),
        ("file\nA.csv\n", "A.csv', allowed is a file that exists. Did you mean"),
        (
            "file,gripper.arm_lenght_m\na.csv,1\n",
            "line 1, column 'gripper.arm_lenght_m': is no key of a case. Did you mean "
            "'gripper.arm_length_m'? A factor has a name without a dot.",
        ),
        (
            "file,protocl\na.csv,1\n",
            "column 'protocl': is no known column. Did you mean 'protocol'? If it is a factor,",
        ),
        ("file,Cell\na.csv,1\n", "column 'Cell': is no known column. Did you mean 'cell'? If "),
        ("file,noise_rad\na.csv,1\n", "Did you mean 'measurement.noise_rad'? If it is a factor,"),
        ("file,gripper.left\na.csv,1\n", "is a block of keys, allowed is one of its keys."),
        (
            "file,measurement.times_s\na.csv,1\n",
            "allowed is the column 'measurement' with the",
        ),
        ("file,measurement.file\na.csv,1\n", "is said by the column 'file'."),
        ("file,measurement.rate_Hz\na.csv,1\n", "is of simulated traces; leave it out."),
        (
            "file,identifiability.confidence\na.csv,0.9\n",
            "is for all traces; allowed is to say it in the conf",
        ),
        ("file,fix.k,fixed.k\na.csv,1,1\n", "column 'fixed.k': says the same as 'fix.k'"),
        (
            "file,measurement.noise_rad\na.csv,-1\n",
            "line 2, column 'measurement.noise_rad': found -1, allowed is at least 1e-15 and",
        ),
        ("file,measurement.skip\na.csv,2.5\n", "found 2.5, allowed is an integer."),
        ("file,measurement.skip\na.csv,.inf\n", "found inf, allowed is a finite number."),
        ("file,gripper.arm_length_m\na.csv,[[[[\n", "found '[[[[', allowed is a number."),
        ("file,gripper.arm_length_m\na.csv,!!int 3\n", "found '!!int 3', allowed is a number."),
        ("file,gripper.arm_length_m\na.csv,<<\n", "found '<<', allowed is a number."),
        ("file,gripper.arm_length_m\na.csv,1:30\n", "found 1:30, which YAML reads in base 60"),
        ("file,sample.model\na.csv,maxwel\n", "found 'maxwel'. Did you mean 'maxwell'? Allowed: "),
        ("file,fix.k\na.csv,-1\n", "column 'fix.k': found -1, allowed is at least 0 and"),
        ("file,protocol\na.csv,shrot\n", "found 'shrot'. Did you mean 'short'? Allowed: short, lo"),
        ("file,gripper\na.csv,old\n", "allowed are names of blocks under blocks.gripper in the c"),
    ],
)
def test_what_is_no_sheet_is_refused_with_its_place(folder: Path, text: str, said: str) -> None:
    message = refusal(folder, text, NAMED)
    assert said in message
    assert message.startswith("cells.tsv")
    assert "\n" not in message


def test_all_problems_are_said_together_in_the_order_of_lines(folder: Path) -> None:
    text = "file,cell,measurement.skip,grippr.left\na.csv,1,x,\ngone.csv,2,1,\nb.csv,3\nc.csv,,0,\n"
    said = refusal(folder, text).splitlines()
    assert [line.partition(":")[0] for line in said] == [
        "cells.tsv, line 1, column 'grippr.left'",
        "cells.tsv, line 2, column 'measurement.skip'",
        "cells.tsv, line 3, column 'file'",
        "cells.tsv, line 4",
        "cells.tsv, line 5, column 'cell'",
    ]
    many = refusal(folder, "file\n" + "".join(f"{n}.csv\n" for n in range(25))).splitlines()
    assert len(many) == 11
    assert many[-1] == "... and 15 more."


def test_a_trace_is_known_whatever_way_leads_to_it(folder: Path) -> None:
    (folder / "e.csv").symlink_to("a.csv")
    for other in ("e.csv", "./a.csv", f"../{folder.name}/a.csv"):
        assert "again, as on line 2" in refusal(folder, f"file,cell\na.csv,1\n{other},2\n")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"file,cell,group\n\xff\xfe,1,x\n", "cells.tsv: found bytes that are no UTF-8"),
        (b"file,cell,group\na\0.csv,1,x\n", "cells.tsv: found binary data"),
    ],
)
def test_what_is_no_text_is_refused(tmp_path: Path, content: bytes, said: str) -> None:
    file = tmp_path / "cells.tsv"
    file.write_bytes(content)
    with pytest.raises(BiogripError, match=said):
        read_sheet(file)


@pytest.mark.parametrize(
    ("header", "by", "factor", "groups"),
    [
        ("dish", None, "dish", ["x", "y"]),
        ("dish,group", None, "group", ["1", "2"]),
        ("dish,group", "dish", "dish", ["x", "y"]),
        ("dish,day", "day", "day", ["1", "2"]),
    ],
)
def test_groups_are_of_a_factor(
    folder: Path, header: str, by: str | None, factor: str, groups: list[str]
) -> None:
    rows = ["a.csv,x,1", "b.csv,y,2"]
    text = "\n".join([f"file,{header}", *(row[: 7 + 2 * header.count(",")] for row in rows)])
    found, cells = cells_of(read_sheet(sheet(folder, text)), by)
    assert (found, [cell.group for cell in cells]) == (factor, groups)


@pytest.mark.parametrize(
    ("header", "by", "said"),
    [
        ("dish,day", "dsh", "--by: found 'dsh', which is no factor of "),
        ("dish,day", "dsh", "Did you mean 'dish'? Allowed: dish, day."),
        ("dish,day", None, "but the factors dish, day; allowed is to name one with --by."),
        ("measurement.skip,measurement.block", None, "found no column 'group', allowed is one, or"),
        ("dish,day", "day", "line 3, column 'day': found nothing, allowed is a name."),
    ],
)
def test_no_groups_without_a_factor(folder: Path, header: str, by: str | None, said: str) -> None:
    read = read_sheet(sheet(folder, f"file,{header}\na.csv,1,2\nb.csv,2,\n"))
    with pytest.raises(BiogripError) as caught:
        cells_of(read, by)
    assert said in str(caught.value)


def test_a_cell_is_of_one_group_by_any_factor(folder: Path) -> None:
    read = read_sheet(sheet(folder, "file,cell,group,day\na.csv,1,x,mon\nb.csv,1,x,tue\n"))
    assert len(cells_of(read)[1]) == 1
    with pytest.raises(BiogripError, match="line 3, column 'day': found 'tue' for the cell '1'"):
        cells_of(read, "day")


@pytest.mark.parametrize("header", ["time_s,rotation_rad", "profile,x", "# file\ntime,x", ""])
def test_a_trace_is_no_sheet(tmp_path: Path, header: str) -> None:
    (tmp_path / "a.csv").write_text(f"{header}\n0,0\nfile,1\n")
    assert not is_sheet(tmp_path / "a.csv")
    assert not is_sheet(tmp_path)


def test_every_column_may_stand_where_its_key_may() -> None:
    """And sets that key: none leads to another, and none is a factor by name."""
    known = settings_by_column()
    assert len(known) > 50
    for name in known:
        found = setting_of(name)
        assert isinstance(found, Setting)
        assert ".".join(found.path) == name
    assert set(BLOCKS) <= set(known)
    assert {name for name, it in known.items() if it.names_block} == set(NAMABLE)


def config(folder: Path, blocks: Any) -> Path:
    file = folder / "mine.yaml"
    file.write_text(yaml.safe_dump({"blocks": blocks}))
    return file


def test_a_config_defines_blocks_by_name(folder: Path) -> None:
    blocks = read_named_blocks(config(folder, {"protocol": {"short": SHORT, "long": LONG}}))
    assert blocks.of("protocol") == {"short": SHORT, "long": LONG}
    assert blocks.of("gripper") == {}
    blocks.refuse_unused([("protocol", "short"), ("protocol", "long")])
    with pytest.raises(BiogripError, match=r"line \d+: blocks.protocol.long: is named by no row"):
        blocks.refuse_unused([("protocol", "short")])


def test_a_study_has_no_rows_that_name_blocks() -> None:
    with pytest.raises(BiogripError, match="blocks: is for rows of a sheet, which this study has"):
        load_study({**read_config(CONFIG), "blocks": {"protocol": {"short": SHORT}}}, [CONFIG])


@pytest.mark.parametrize(
    ("blocks", "said"),
    [
        ({"protocl": {"a": SHORT}}, "found 'protocl'. Did you mean 'protocol'? Allowed: gripper,"),
        ({"protocol": {"a b": SHORT}}, "blocks.protocol.a b: "),
        ({"protocol": {"a": {"phasez": []}}}, "blocks.protocol.a.phasez: unknown key. Did you mea"),
        ({"gripper": {"a": {"jaw_gap_m": -1}}}, "blocks.gripper.a.jaw_gap_m: found -1, allowed is"),
        ({"gripper": {"a": 3}}, "blocks.gripper.a: found 3, allowed is a block of keys."),
        ({"measurement": {"a": {"file": "b.csv"}}}, "blocks.measurement.a.file: is said by the co"),
        (3, "blocks: found 3, allowed is a block of keys."),
    ],
)
def test_a_wrong_block_is_refused_where_it_is_defined(folder: Path, blocks: Any, said: str) -> None:
    with pytest.raises(BiogripError) as caught:
        read_named_blocks(config(folder, blocks))
    assert said in str(caught.value)
    assert "mine.yaml, line " in str(caught.value)


def test_the_documented_sheet_can_be_read(tmp_path: Path) -> None:
    page = (ROOT / "config" / "README.md").read_text(encoding="utf-8")
    text, config_text = re.findall(
        r"```(?:text|yaml)\n(.*?)```", page.partition("## A sheet of traces\n")[2], re.DOTALL
    )[:2]
    starts = [match.start() for match in re.finditer(r"\S+", text.splitlines()[0])]
    ends = [*starts[1:], None]
    rows = [
        [line[start:end].strip() for start, end in zip(starts, ends, strict=True)]
        for line in text.splitlines()
    ]
    for row in rows[1:]:
        (tmp_path / row[0]).parent.mkdir(exist_ok=True)
        (tmp_path / row[0]).touch()
    (tmp_path / "mine.yaml").write_text(config_text)
    blocks = read_named_blocks(tmp_path / "mine.yaml")
    read = read_sheet(sheet(tmp_path, "\n".join(map("\t".join, rows))), blocks)
    blocks.refuse_unused(read.named)
    assert [row.settings.get("fixed") for row in read.rows] == [None, None, {"c_p": 0}]
    assert read.rows[1].settings["measurement"] == {"noise_rad": 2e-6}
    assert read.rows[2].settings["gripper"] == {"arm_length_m": 1.6e-3}
    assert [cell.name for cell in cells_of(read)[1]] == ["a1", "b1"]
