from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from biogrip.errors import BiogripError
from biogrip.records.traces import column_names, read_columns, table_of, write_tables

NUMBERS = {"x": np.array([0.1, -np.inf, 3.0]), "n": np.array([1, 2, 3])}


def test_tables_are_read_back_one_below_the_other(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    tables = [table_of({"word": word, **NUMBERS}, 3) for word in ("täglich", "")]
    write_tables(path, tables)
    assert column_names(path) == ["word", "x", "n"]
    for name, values in read_columns(path, ["n", "x"]).items():
        np.testing.assert_array_equal(values, np.tile(NUMBERS[name], 2))
        assert values.dtype == NUMBERS[name].dtype
    # Arrow's own reading is the independent one.
    assert pq.read_table(path)["word"].to_pylist() == 3 * ["täglich"] + 3 * [""]


def test_columns_need_not_be_contiguous(tmp_path: Path) -> None:
    table = table_of({"every other": np.arange(6.0)[::2]}, 3)
    write_tables(tmp_path / "t.parquet", [table])
    found = read_columns(tmp_path / "t.parquet", ["every other"])
    np.testing.assert_array_equal(found["every other"], [0.0, 2.0, 4.0])


@pytest.mark.parametrize("column", [["a", "b"], [1.0, None]], ids=["words", "a gap"])
def test_what_is_no_column_of_numbers_is_refused(tmp_path: Path, column: list[object]) -> None:
    path = tmp_path / "t.parquet"
    pq.write_table(pa.table({"x": column}), path)
    with pytest.raises(BiogripError, match=r"t.parquet: cannot be read"):
        read_columns(path, ["x"])


def test_a_missing_column_and_a_damaged_file_are_named(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    write_tables(path, [table_of(NUMBERS, 3)])
    with pytest.raises(BiogripError, match=r"t.parquet: has no column y"):
        read_columns(path, ["x", "y"])
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(BiogripError, match=r"t.parquet: cannot be read"):
        read_columns(path, ["x"])
    with pytest.raises(BiogripError, match=r"gone.parquet: cannot be read"):
        read_columns(tmp_path / "gone.parquet", ["x"])
