"""Parquet files with columns of numbers and text.

Arrays share memory with Arrow: Arrow's own conversions import pandas first, which takes longer
than everything else in a short job.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from biogrip.errors import BiogripError
from biogrip.files import atomic_write

Table: TypeAlias = pa.Table


def table_of(columns: Mapping[str, NDArray[Any] | str], rows: int) -> Table:
    """Return a table of numbers, (rows,) each, and of text that is the same in every row."""
    return pa.table(
        {
            name: _words(values, rows) if isinstance(values, str) else _numbers(values)
            for name, values in columns.items()
        }
    )


def write_tables(path: Path, tables: Sequence[Table], *, dictionary: bool = True) -> None:
    """Write tables of `table_of` with equal columns to one file, one after another.

    Dictionary encoding pays for repeated values, not for noise.
    """
    with atomic_write(path) as scratch:
        pq.write_table(pa.concat_tables(tables), scratch, use_dictionary=dictionary)


def column_names(path: Path) -> list[str]:
    """Return the column names of a file."""
    try:
        return list(pq.read_schema(path).names)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read: {error}.") from error


def read_columns(path: Path, names: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Read columns of numbers."""
    try:
        with pq.ParquetFile(path) as file:
            missing = set(names) - set(file.schema_arrow.names)
            if missing:
                raise BiogripError(f"{path}: has no column {min(missing)}.")
            table = file.read(columns=list(names))
        return {
            name: np.concatenate([_values(chunk) for chunk in table[name].chunks]) for name in names
        }
    except (OSError, TypeError, ValueError) as error:
        # Arrow's exceptions are subclasses of these.
        raise BiogripError(f"{path}: cannot be read: {error}.") from error


def _numbers(values: NDArray[Any]) -> pa.Array:
    kept = np.ascontiguousarray(values)
    buffers = [None, pa.py_buffer(kept)]
    return pa.Array.from_buffers(pa.from_numpy_dtype(kept.dtype), len(kept), buffers)


def _values(chunk: pa.Array) -> NDArray[Any]:
    if chunk.null_count:
        raise ValueError(f"{chunk.null_count} values are missing")
    whole = np.frombuffer(chunk.buffers()[1], dtype=chunk.type.to_pandas_dtype())
    return whole[chunk.offset : chunk.offset + len(chunk)]


def _words(text: str, rows: int) -> pa.Array:
    encoded = text.encode()
    ends = np.arange(rows + 1, dtype=np.int32) * np.int32(len(encoded))
    return pa.StringArray.from_buffers(rows, pa.py_buffer(ends), pa.py_buffer(encoded * rows))
