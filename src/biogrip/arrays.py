"""The array types that the library's signatures speak of, and the parts of long arrays."""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
ComplexArray: TypeAlias = NDArray[np.complex128]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


def parts(count: int, at_once: int) -> Iterator[slice]:
    """Divide so many items into parts of no more than can be looked at at once."""
    return (slice(start, start + at_once) for start in range(0, count, at_once))
