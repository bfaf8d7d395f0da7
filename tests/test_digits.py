"""Numbers as they are written."""

import numpy as np
import pytest

from biogrip.digits import rounded
from biogrip.judging.doubts import doubts_about_noise
from biogrip.physics.instruments import GRIPPER
from biogrip.records.traces import Measurements
from biogrip.stages.recording import notes_on_recording


def test_notes_on_one_of_something_are_sentences() -> None:
    times = np.arange(800.0)
    (note,) = notes_on_recording(Measurements(times, None, {0: times}, 1))
    assert note == "Left out for want of a number: 1 row of 801."
    residual = np.random.default_rng(3).standard_normal(60)
    residual[30] = 30.0
    said = " ".join(doubts_about_noise(residual, np.ones(60), instrument=GRIPPER))
    assert "from the samples around: 1 outlier, as of Gaussian noise only once in" in said


@pytest.mark.parametrize(
    ("value", "found"),
    [(1.16499, 1.16499), (1.164996, 1.164996), (1.165, 1.165), (1.2345678, 1.2346), (None, None)],
)
def test_what_is_rounded_again_comes_out_as_if_once(value: float, found: float) -> None:
    assert rounded(value) == found
    assert value is None or f"{rounded(value):.3g}" == f"{value:.3g}"


def test_a_value_on_the_edge_keeps_few_digits() -> None:
    """Where last bits of a processor would decide, digits end somewhere."""
    assert rounded(1.165 - 1e-14) == 1.165
