"""What genes can encode, beside every point of a small encoding."""

from itertools import product

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.encodable import lowest_encodable
from biogrip.fit.genome import GeneRange


@pytest.mark.parametrize("digit", [0, 1])
def test_no_encodable_point_is_lower_where_the_optimum_is_not_encodable(digit: int) -> None:
    """In a valley across both parameters, whose bottom no digits can hold; and at an end."""
    ranges = [GeneRange((0, 2), (digit, 9), 2), GeneRange((-1, 1), (digit, 9), 2)]

    def valley(parameters: Array) -> Array:
        first, second = np.log(parameters / [33.73, 0.2843]).T
        found: Array = np.sqrt(1 + 100 * (first + second) ** 2 + first**2)
        return found

    def beyond(parameters: Array) -> Array:
        found: Array = np.log(1e5 / parameters).sum(axis=1)
        return found

    every = np.array(list(product(*(genes.values for genes in ranges))))
    found = [
        lowest_encodable(each, ranges, np.array([[33.73, 0.2843]])) for each in (valley, beyond)
    ]
    assert found == [valley(every).min(), beyond(every).min()]
    assert found[0] > 1 + 1e-6


@pytest.mark.parametrize("digit", [0, 1])
def test_the_first_digit_is_searched_with_the_second_kept(digit: int) -> None:
    """From 24 to 74, where every other second digit is worse."""

    def rungs(parameters: Array) -> Array:
        first, second = np.divmod(np.rint(parameters[:, 0]), 10)
        found: Array = 1.0 + abs(first - 7) + 10 * (second != 4)
        return found

    assert lowest_encodable(rungs, [GeneRange((2, 2), (digit, 9), 2)], np.array([[24.0]])) == 1
