"""Numbers as they are written."""

import numpy as np
import pytest

from biogrip.digits import counted
from biogrip.identifiability.whiteness import doubts_about_noise
from biogrip.products.files.traces import Measurements
from biogrip.products.stages.recording import notes_on_gaps


@pytest.mark.parametrize(
    ("count", "said"), [(0, "0 rows"), (1, "1 row"), (2, "2 rows"), ("1.5", "1.5 rows")]
)
def test_one_is_no_plural(count: object, said: str) -> None:
    assert counted(count, "row") == said


def test_notes_on_one_of_something_are_sentences() -> None:
    times = np.arange(800.0)
    (note,) = notes_on_gaps(Measurements(times, None, {0: times}, 1))
    assert note == "Left out for want of a number: 1 row of 801."
    residual = np.random.default_rng(3).standard_normal(60)
    residual[30] = 30.0
    said = " ".join(doubts_about_noise(residual))
    assert "from the samples around: 1 outlier, as of Gaussian noise once in" in said
