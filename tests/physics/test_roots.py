"""Roots that coincide; all others show in responses, against 50 digits in test_linear.py."""

import numpy as np
import pytest

from biogrip.physics.roots import SMALLEST_GAP, separate


def test_coinciding_roots_are_moved_apart_about_their_mean() -> None:
    found = separate(np.array([[-3.0, -3.0, -1.0]]))[0]
    assert abs(found[0] - found[1]) == pytest.approx(3 * SMALLEST_GAP, rel=1e-6)
    assert found[:2].mean() == pytest.approx(-3.0, rel=1e-12)
    assert found[2] == -1.0
