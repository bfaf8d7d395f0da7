import itertools

import numpy as np

from biogrip.physics.noise import stream


def first(*key: object) -> float:
    return float(stream(*key).random())  # type: ignore[arg-type]


def test_a_stream_depends_on_all_that_names_it() -> None:
    keys = list(itertools.product([1, 2], ["a", "b", "ab"], [0, 1, 2**31], ["noise", "genetic"]))
    assert len({first(*key) for key in keys}) == len(keys)


def test_a_stream_is_the_same_every_time() -> None:
    """The very numbers, so that a change of the derivation cannot go unnoticed."""
    assert first(1, "endothelial_cell", 0, "noise") == first(1, "endothelial_cell", 0, "noise")
    key = (1, "endothelial_cell", 0, "noise")
    assert stream(*key).integers(0, 1000, 5).tolist() == EXPECTED


EXPECTED = [755, 598, 652, 576, 539]


def test_streams_of_neighbouring_seeds_are_uncorrelated() -> None:
    traces = np.array(
        [stream(1, "case", seed, "noise").standard_normal(4000) for seed in range(40)]
    )
    correlation = np.corrcoef(traces)[np.triu_indices(40, 1)]
    # 780 correlations of 4000 samples: five of their standard deviations.
    assert np.abs(correlation).max() < 5 / np.sqrt(4000)
