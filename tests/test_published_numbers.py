from pathlib import Path

import pytest

from tests.published_numbers import renewed_numbers

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
