from pathlib import Path

import numpy as np
import pytest

from biogrip.study.damage import remove_damaged
from biogrip.traces import Measurements, write_measurements

ROWS = "case,method,seed\nx,genetic,0\nx,genetic,1\n"


def written(results: Path, name: str, content: bytes) -> Path:
    path = results / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("identifications/x/genetic/seeds_0-1.csv", ROWS.encode()),
        ("selection/x/seeds_0-1.csv", ROWS.encode()),
        ("coverage/x/seeds_0-1.csv", b"case,quantity\n"),
        ("identifications/x.csv", ROWS.encode()),
        ("identifiability/x.json", b'{"a": 1}\n'),
        ("logs/x.log", b"no line end"),
        ("tables/x.html", b"<html></html>\n"),
        ("summaries/x.html", b"<html></html>"),
    ],
)
def test_what_is_whole_stays(tmp_path: Path, name: str, content: bytes) -> None:
    path = written(tmp_path, name, content)
    assert remove_damaged(tmp_path) == {}
    assert path.read_bytes() == content


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("identifications/x/genetic/seeds_0-1.csv", ROWS[:-3].encode()),
        ("identifications/x/genetic/seeds_0-1.csv", ROWS[: ROWS.rindex("x")].encode()),
        ("identifications/x/genetic/seeds_0-1.csv", ROWS[: ROWS.index("x")].encode()),
        ("identifications/x.csv", b""),
        ("identifiability/x.json", b'{"a": '),
        ("figures/x.png", b"\x89PNG"),
        ("figures/x.pdf", b"%PDF-1.4\n"),
        ("tables/x.html", b"<html></h"),
    ],
)
def test_what_was_cut_short_is_removed(tmp_path: Path, name: str, content: bytes) -> None:
    path = written(tmp_path, name, content)
    assert list(remove_damaged(tmp_path)) == [path]
    assert not path.exists()


def test_a_parquet_file_is_whole_or_not(tmp_path: Path) -> None:
    path = tmp_path / "measurements" / "x" / "seeds_0-0.parquet"
    ramp = np.linspace(0, 1, 1000)
    write_measurements(path, Measurements(ramp, ramp, {0: ramp}))
    assert remove_damaged(tmp_path) == {}
    path.write_bytes(path.read_bytes()[:-20])
    assert remove_damaged(tmp_path) == {path: "was cut short"}


THREE_SEEDS = "case,method,seed\n" + "".join(f"x,{m},{s}\n" for m in "ab" for s in range(3))


@pytest.mark.parametrize("stage", ["identifications", "timings", "selection", "coverage"])
@pytest.mark.parametrize("name", ["x.csv", "x/seeds_0-2.csv"])
def test_a_file_cut_between_two_rows_is_removed(tmp_path: Path, stage: str, name: str) -> None:
    """Every method, model or quantity has as many seeds."""
    path = written(tmp_path, f"{stage}/{name}", THREE_SEEDS.encode())
    assert remove_damaged(tmp_path) == {}
    path.write_text("".join(THREE_SEEDS.splitlines(keepends=True)[:-1]))
    assert remove_damaged(tmp_path) == {path: "lacks rows"}


def test_a_case_may_be_named_like_a_batch(tmp_path: Path) -> None:
    written(tmp_path, "identifications/seeds_0-9.csv", THREE_SEEDS.encode())
    assert remove_damaged(tmp_path) == {}


def test_a_table_has_as_many_rows_in_every_format(tmp_path: Path) -> None:
    path = written(tmp_path, "tables/x.csv", b"a,b\n1,2\n3,4\n")
    table = "Title\n\n| a | b |\n|:--|:--|\n| 1 | 2 |\n| 3 | 4 |\n"
    written(tmp_path, "tables/x.md", table.encode())
    assert remove_damaged(tmp_path) == {}
    path.write_bytes(b"a,b\n1,2\n")
    assert remove_damaged(tmp_path) == {path: "lacks rows"}
    written(tmp_path, "tables/x.csv", b"a,b\n1,2\n3,4\n")
    cut = written(tmp_path, "tables/x.md", table[: table.rindex("| 3")].encode())
    assert remove_damaged(tmp_path) == {cut: "lacks rows"}
