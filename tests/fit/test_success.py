"""Which run is typical, and what is near the noise."""

import numpy as np
import pandas as pd
import pytest

from biogrip.fit.methods import near_noise, near_noise_words, typical


def found(misfit: list[float], noise: list[float | None]) -> pd.DataFrame:
    return pd.DataFrame({"seed": range(len(misfit)), "misfit": misfit, "noise_rms": noise}).astype(
        {"noise_rms": float}
    )


def test_the_typical_run_is_that_of_median_excess_and_not_of_the_quietest_trace() -> None:
    runs = found([0.90, 1.05, 1.10, 1.20, 1.01], [0.70, 1.04, 1.00, 1.01, 1.00])
    # Misfit over noise: 1.29, 1.01, 1.10, 1.19, 1.01.
    assert typical(runs)["seed"] == 2
    assert typical(runs.iloc[:4])["seed"] == 2
    assert typical(runs.iloc[[0]])["seed"] == 0


@pytest.mark.parametrize("noise", [None, 0.0])
def test_without_known_noise_the_typical_run_is_of_median_misfit(noise: float | None) -> None:
    assert typical(found([3.0, 1.0, 2.0], [noise] * 3))["seed"] == 2


def test_near_the_noise_is_a_share_of_it() -> None:
    runs = found([1.019, 1.021, 2.03, 1.0], [1.0, 1.0, 2.0, None])
    np.testing.assert_array_equal(near_noise(runs, 0.02), [True, False, True, False])
    assert near_noise_words(0.025) == "within 2.5 % of the noise"
