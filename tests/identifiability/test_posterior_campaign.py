"""The campaign that tests whether posteriors are calibrated, and a few of its draws."""

import numpy as np
import pytest

from biogrip.identifiability.posterior_settings import PosteriorSettings
from tests.helpers.posterior_campaign import NAMES, Draw, counted, drawn


def test_ranks_that_are_uniform_pass_and_others_do_not() -> None:
    """Intervals twice too narrow push ranks outwards, others shift them."""
    uniform = (np.arange(200) + 0.5) / 200
    rng = np.random.default_rng(0)
    good = [rng.permutation(uniform) for _ in NAMES]
    assert counted(Draw(own, True) for own in np.transpose(good))["p_value"].min() > 0.01
    narrow = np.where(uniform < 0.5, 0.5 * (2 * uniform) ** 3, 1 - 0.5 * (2 - 2 * uniform) ** 3)
    shifted = uniform**1.6
    for bad in (narrow, shifted):
        found = counted(Draw(own, True) for own in np.transpose([bad] * len(NAMES)))
        assert found["p_value"].max() < 0.01
    outside = counted(Draw(np.full(len(NAMES), 0.99), False) for _ in range(20))
    assert outside["coverage_95_percent"].max() == 0
    assert set(outside["part"]) == {"all", "not converged"}


def test_draws_that_have_not_converged_are_counted_apart() -> None:
    """Those that have are uniform, and the others always too high."""
    good = [Draw(np.full(len(NAMES), rank), True) for rank in (np.arange(40) + 0.5) / 40]
    found = counted([*good, *[Draw(np.full(len(NAMES), 0.99), False)] * 10])
    by_part = found.groupby("part")
    assert by_part["draws"].first().to_dict() == {"all": 50, "converged": 40, "not converged": 10}
    assert by_part["coverage_95_percent"].first().to_dict() == pytest.approx(
        {"all": 76.0, "converged": 95.0, "not converged": 0.0}
    )
    assert by_part["p_value"].max()["converged"] > 0.5 > by_part["p_value"].max()["not converged"]


def test_a_few_draws_are_not_all_on_one_side() -> None:
    """Five: by chance, all of one quantity are in the same tenth once in thousands.

    Ranks differ by a few hundredths from those of the campaign, which samples until it converges.
    """
    short = PosteriorSettings(walkers=40, most_steps=1000)
    found = counted([drawn(number, short) for number in range(5)]).query("part == 'all'")
    assert list(found["quantity"]) == list(NAMES)
    assert found["p_value"].min() > 1e-3
