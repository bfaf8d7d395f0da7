"""Advice of another model leads to one that is adequate, or says that there is none."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from biogrip.library import identify_trace

TIMES = np.logspace(-1, 6, 46)
# Four processes and an equilibrium.
STRENGTHS_PA, RELAXATION_S = (3e8, 8e7, 2e7, 3e6), (0.3, 30.0, 3e3, 1e5)


def told(model: str, models: Sequence[str] | None = None) -> dict[str, Any]:
    """Of a master curve of four processes, of which the models that are compared have three."""
    pairs = zip(STRENGTHS_PA, RELAXATION_S, strict=True)
    curve = 5e5 + sum((k * np.exp(-TIMES / tau) for k, tau in pairs), 0 * TIMES)
    curve *= 1 + 0.02 * np.random.default_rng(4).standard_normal(len(TIMES))
    config: dict[str, Any] = {"measurement": {"noise_share": 0.02}}
    config |= {"model_selection": {"models": [*models]}} if models else {}
    return identify_trace(TIMES, curve, reads="modulus", model=model, config=config).data


@pytest.mark.nightly
def test_branches_are_added_until_a_further_one_does_not_help() -> None:
    found = told("generalized_maxwell")
    assert found["fit"] == "rejected"
    assert found["preferred_model"] == "generalized_maxwell_4"
    assert "generalized_maxwell_5" in [row["model"] for row in found["models"]]
    again = told("generalized_maxwell_4")
    assert (again["fit"], again["preferred_model"]) == ("ok", None)


@pytest.mark.nightly
def test_branches_are_added_where_a_power_law_fits_better_than_three() -> None:
    """Of five processes over eight decades two springpots in series leave 5 noises."""
    times = np.geomspace(1e-3, 1e5, 110)
    pairs = zip((4e8, 1e8, 6e7, 3e7, 8e6), (1e-2, 0.3, 10.0, 300.0, 1e4), strict=True)
    clean = 1e6 + sum((k * np.exp(-times / tau) for k, tau in pairs), 0 * times)
    noise = 1 + 0.02 * np.random.default_rng(5).normal(size=110)
    told = identify_trace(times, clean * noise, reads="modulus", noise_share=0.02).data
    assert (told["fit"], told["preferred_model"]) == ("rejected", "generalized_maxwell_5")


def test_that_none_is_adequate_is_said() -> None:
    found = told("zener_maxwell", ["zener_maxwell", "generalized_maxwell_2"])
    assert (found["fit"], found["preferred_model"]) == ("rejected", None)
    assert found["advice"].startswith("None of the 2 models tried is adequate: the best of them, ")
