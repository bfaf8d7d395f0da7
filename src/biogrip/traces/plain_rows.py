"""Fast reader for two columns of a plain CSV table.

A plain table is ASCII with one row per line, all cells present, no quotes, no comments, and
numbers as programs write them. For other tables None is returned;
`biogrip.traces.recordings` then reads them, or reports what is wrong.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import compute, csv

from biogrip.arrays import Array

_ODD = (b'"', b"#", b"\0")
_GAPS = ("", "-", "na", "NA", "n/a", "N/A", "nan", "NaN", "NAN")
# Longer lines are not tables, see `csv.field_size_limit`.
_LONGEST_LINE = 100_000

# Built from a buffer: conversion of a Python float would import pandas.
_NO_NUMBER = pa.Array.from_buffers(pa.float64(), 1, [None, pa.py_buffer(np.array([np.nan]))])[0]


def plain_rows(
    path: Path, header_lines: int, width: int, needed: Sequence[int], separator: str
) -> Array | None:
    """Read the rows below a header; None if any of them is not plain.

    Parameters
    ----------
    path
        The file.
    header_lines
        Number of lines before the rows.
    width
        Number of columns.
    needed
        Indices of the columns to read, from 0.
    separator
        Cell separator; unless it is a comma, numbers may have a decimal comma.

    Returns
    -------
    (n_rows, n_wanted) or None
        Numbers, NaN for gaps; None if the rows are not plain.
    """
    content = path.read_bytes()
    ends = np.flatnonzero(np.frombuffer(content, np.uint8) == ord("\n")) + 1
    if content.count(b"\r") != content.count(b"\r\n") or len(ends) < header_lines:
        return None
    start = int(ends[header_lines - 1])
    ends = np.append(ends[header_lines - 1 :], [len(content)] * (content[-1:] != b"\n"))
    lengths = np.diff(ends)
    odd = any(content.find(byte, start) >= 0 for byte in _ODD)
    if odd or not len(lengths) or lengths.max() > _LONGEST_LINE:
        return None
    body = pa.py_buffer(content).slice(start)
    if np.frombuffer(body, np.uint8).max() > 0x7F:
        return None
    for decimal in "." if separator == "," else ".,":
        rows = _parsed(body, width, needed, separator, decimal)
        if rows is not None:
            return rows if len(rows) == len(lengths) else None
    return None


def _parsed(
    body: pa.Buffer, width: int, needed: Sequence[int], separator: str, decimal: str
) -> Array | None:
    names = [str(column) for column in range(width)]
    chosen = [names[column] for column in needed]
    try:
        table = csv.read_csv(
            pa.BufferReader(body),
            csv.ReadOptions(use_threads=False, column_names=names),
            csv.ParseOptions(delimiter=separator, quote_char=False),
            csv.ConvertOptions(
                column_types=dict.fromkeys(chosen, pa.float64()),
                include_columns=chosen,
                null_values=_GAPS,
                decimal_point=decimal,
            ),
        )
    except pa.ArrowInvalid:
        return None
    rows = np.empty((len(table), len(chosen)))
    for place, name in enumerate(chosen):
        column = table[name]
        # Arrow's own conversion to NumPy would import pandas.
        filled = compute.fill_null(column, _NO_NUMBER).combine_chunks()
        rows[:, place] = np.frombuffer(filled.buffers()[1])[filled.offset :][: len(filled)]
        # Infinity, or a spelling of NaN other than those of gaps.
        if np.count_nonzero(np.isfinite(rows[:, place])) != len(table) - column.null_count:
            return None
    return rows
