"""What is said of a sample model beside others."""

import numpy as np
import pytest

from biogrip.fit.nested_fits import advice, ranked

SAMPLES = 1000


@pytest.mark.parametrize(
    ("gained", "said"),
    [
        # chi-squared by which four parameters, and the others, fit better than a spring's one.
        ({"generalized_maxwell": 103.0, "liquid_drop": 102.0}, "is richer than the trace asks for"),
        ({"generalized_maxwell": 50.0, "fractional_maxwell": 400.0}, "is not adequate: fractional"),
        ({"generalized_maxwell": 50.0, "generalized_maxwell_2": 90.0}, "is not adequate: "),
        ({"generalized_maxwell": 50.0, "burgers": 90.0}, "suits the trace less well: Burgers"),
        ({"generalized_maxwell": 90.0, "burgers": 89.0}, "none of the 2 models tried suits"),
    ],
)
def test_the_sentence_is_that_of_the_numbers(gained: dict[str, float], said: str) -> None:
    misfits = [float(np.exp(-gain / (2 * SAMPLES))) for gain in gained.values()]
    tried = ranked(list(gained), misfits, SAMPLES)
    assert said in advice(tried, "generalized_maxwell")
