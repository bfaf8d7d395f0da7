"""Array types for signatures, and slicing of long arrays."""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
ComplexArray: TypeAlias = NDArray[np.complex128]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


def parts(count: int, at_once: int) -> Iterator[slice]:
    """Yield slices that divide `count` items into parts of at most `at_once`."""
    return (slice(start, start + at_once) for start in range(0, count, at_once))
