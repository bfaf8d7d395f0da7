"""What genes can encode, beside every point of a small encoding."""

from itertools import product

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.encodable import lowest_encodable
from biogrip.fit.genome import GeneRange

RANGES = [GeneRange((0, 2), (0, 9), 2), GeneRange((-1, 1), (0, 9), 2)]


def test_no_encodable_point_is_lower_where_the_optimum_is_not_encodable() -> None:
    """In a valley across both parameters, whose bottom no digits can hold; and at an end."""

    def valley(parameters: Array) -> Array:
        first, second = np.log(parameters / [33.73, 0.2843]).T
        found: Array = np.sqrt(1 + 100 * (first + second) ** 2 + first**2)
        return found

    def beyond(parameters: Array) -> Array:
        found: Array = np.log(1e5 / parameters).sum(axis=1)
        return found

    every = np.array(list(product(*(genes.values for genes in RANGES))))
    found = [
        lowest_encodable(each, RANGES, np.array([[33.73, 0.2843]])) for each in (valley, beyond)
    ]
    assert found == [valley(every).min(), beyond(every).min()]
    assert found[0] > 1 + 1e-6
