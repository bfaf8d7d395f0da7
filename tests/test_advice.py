"""Advice of another model leads to one that is adequate, or says that there is none."""

from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.library import identify_trace

TIMES = np.logspace(-1, 6, 46)
# Four processes and an equilibrium.
STRENGTHS_PA, RELAXATION_S = (3e8, 8e7, 2e7, 3e6), (0.3, 30.0, 3e3, 1e5)


def noisy(readings: Array) -> Array:
    noise: Array = 1 + 0.02 * np.random.default_rng(4).standard_normal(len(TIMES))
    return readings * noise


def curve() -> Array:
    """A master curve of four processes, of which the models that are compared have three."""
    pairs = zip(STRENGTHS_PA, RELAXATION_S, strict=True)
    return noisy(5e5 + sum((k * np.exp(-TIMES / tau) for k, tau in pairs), 0 * TIMES))


def told(model: str, **compared: list[str]) -> dict[str, Any]:
    config: dict[str, Any] = {"measurement": {"noise_share": 0.02}, "model_selection": compared}
    return identify_trace(TIMES, curve(), reads="modulus", model=model, config=config).data


@pytest.mark.nightly
def test_branches_are_added_until_a_further_one_does_not_help() -> None:
    found = told("generalized_maxwell")
    assert found["fit"] == "rejected"
    assert found["preferred_model"] == "generalized_maxwell_4"
    assert "generalized_maxwell_5" in [row["model"] for row in found["models"]]
    again = told("generalized_maxwell_4")
    assert (again["fit"], again["preferred_model"]) == ("ok", None)


def test_that_none_is_adequate_is_said() -> None:
    found = told("zener_maxwell", models=["zener_maxwell", "generalized_maxwell_2"])
    assert (found["fit"], found["preferred_model"]) == ("rejected", None)
    assert found["advice"].startswith("None of the 2 models tried is adequate: the best of them, ")
