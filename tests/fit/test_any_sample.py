"""Deviations in proportion to what is read, of a trace whose sample has no model yet."""

import numpy as np
import pytest

from biogrip.fit.any_sample import proportional_deviations
from biogrip.physics.whitening import nuisance_basis
from tests.helpers.problems import GRIPPER, TORQUE, clean

CLEAN_S, CLEAN = clean("endothelial_cell", 2.0)
NONE = nuisance_basis(CLEAN_S, offset=False, drift=False)


def test_deviations_follow_the_rotation_without_its_noise() -> None:
    """Each reading has noise of 5 %; the smooth rotation is known far better."""
    rng = np.random.default_rng(0)
    trace = CLEAN * (1 + 0.05 * rng.standard_normal(len(CLEAN_S)))
    found = proportional_deviations(CLEAN_S, trace, GRIPPER, TORQUE, NONE, 0.05)
    large = np.quantile(CLEAN, 0.1) < CLEAN
    errors = np.abs(found[large] / (0.05 * CLEAN[large]) - 1)
    assert np.median(errors) < 0.05 / 3
    assert np.quantile(errors, 0.99) < 0.05


def test_no_reading_is_certain() -> None:
    """Of a trace without noise: the first rotation is zero, and counts as one of the smallest."""
    assert CLEAN[0] == 0
    found = proportional_deviations(CLEAN_S, CLEAN, GRIPPER, TORQUE, NONE, 0.05)
    smallest = np.sort(CLEAN)[: len(CLEAN) // 10]
    assert found.min() == pytest.approx(0.05 * np.median(smallest), rel=0.01)


def test_other_noise_shows_where_the_rotation_is_small() -> None:
    rng = np.random.default_rng(1)
    floor = 0.3 * float(CLEAN.max())
    trace = CLEAN + floor * rng.standard_normal(len(CLEAN_S))
    found = proportional_deviations(CLEAN_S, trace, GRIPPER, TORQUE, NONE, 1e-3)
    # Some eighty readings tell the scatter.
    assert found.min() == pytest.approx(floor, rel=0.3)
    given = proportional_deviations(CLEAN_S, CLEAN, GRIPPER, TORQUE, NONE, 0.05, floor)
    np.testing.assert_allclose(given, np.hypot(0.05 * CLEAN, floor), rtol=1e-3)


def test_an_offset_is_not_rotation() -> None:
    offset = nuisance_basis(CLEAN_S, offset=True, drift=False)
    trace = CLEAN + 3 * CLEAN.max()
    found = proportional_deviations(CLEAN_S, trace, GRIPPER, TORQUE, offset, 0.05)
    large = np.quantile(CLEAN, 0.2) < CLEAN
    np.testing.assert_allclose(found[large], 0.05 * CLEAN[large], rtol=0.1)
