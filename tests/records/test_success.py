"""Which runs of a method succeeded, by hand."""

import numpy as np
import pandas as pd

from biogrip.records.identifications import ALL, basins, near_noise, near_noise_words


def found(misfit: list[float], noise: list[float | None]) -> pd.DataFrame:
    runs = pd.DataFrame({"seed": range(len(misfit)), "misfit": misfit, "noise_rms": noise})
    return runs.astype({"noise_rms": float})


def test_two_basins_have_a_tenth_of_the_runs_each() -> None:
    """And none is told where the noise is unknown, or absent."""
    one = basins(found([1.05, 1.01, *[1.2] * 18], [1.0, 1.0, *[1.19] * 18]), 0.02)
    assert {name: len(runs) for name, runs in one.items()} == {ALL: 20}
    two = basins(found([1.05, 1.06, *[1.2] * 18], [1.0, 1.0, *[1.19] * 18]), 0.02)
    assert two["above the noise"]["seed"].tolist() == [0, 1]
    assert two["near the noise"]["seed"].tolist() == list(range(2, 20))
    for noise in (None, 0.0):
        assert list(basins(found([3.0, 1.0], [noise, noise]), 0.02)) == [ALL]


def test_near_the_noise_is_a_share_of_it() -> None:
    runs = found([1.019, 1.021, 2.03, 1.0], [1.0, 1.0, 2.0, None])
    np.testing.assert_array_equal(near_noise(runs, 0.02), [True, False, True, False])
    assert near_noise_words(0.025) == "within 2.5 % of the noise"
