"""Array types for signatures, slicing of long arrays, and columns of numbers."""

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from biogrip.errors import BiogripError

Array: TypeAlias = NDArray[np.float64]
ComplexArray: TypeAlias = NDArray[np.complex128]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


def parts(count: int, at_once: int) -> Iterator[slice]:
    """Yield slices that divide `count` items into parts of at most `at_once`."""
    return (slice(start, start + at_once) for start in range(0, count, at_once))


def as_column(values: ArrayLike, name: str) -> Array:
    """Return an array, list or column of pandas as numbers, (n,); the name is for messages.

    Time differences are in seconds, and what is masked is NaN. A `BiogripError` says that these are
    no numbers, or more than one column.
    """
    try:
        given: Any = np.ma.asanyarray(values)
        if given.dtype.kind == "m":
            given = given / np.timedelta64(1, "s")
        elif given.dtype.kind in "cM":
            raise TypeError(f"found {given.dtype}")
        found = np.ma.filled(given.astype(float), np.nan)
    except (TypeError, ValueError) as error:
        raise BiogripError(
            f"{name}: {error}; allowed are numbers, or times since the start."
        ) from error
    if found.ndim != 1 and found.shape != (len(found), 1):
        raise BiogripError(f"{name}: found the shape {found.shape}, allowed is one column.")
    return found.ravel()
