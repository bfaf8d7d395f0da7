"""Steps of a descent, of a sum of squares that is known."""

import numpy as np
import pytest

from biogrip.arrays import Array, IntArray
from biogrip.fit import levenberg_marquardt
from biogrip.fit.levenberg_marquardt import Normal, minimize

SLOPES = np.array([[3.0, 1.0], [1.0, 2.0], [0.0, 1.0]])


def linear(x: Array, _: IntArray) -> Normal:
    """Of three residuals that are linear in two parameters, zero at 0.5 and -0.25."""
    residuals = (x - [0.5, -0.25]) @ SLOPES.T
    square_sum = np.sum(residuals**2, axis=1)
    information = np.repeat((SLOPES.T @ SLOPES)[None], len(x), axis=0)
    return Normal(square_sum, residuals @ SLOPES, information, np.sqrt(square_sum / 3))


def test_of_linear_residuals_the_decrease_is_as_predicted(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the grid on which points lie, a thousandth of a standard deviation."""
    told: list[tuple[float, float]] = []
    damp = levenberg_marquardt._damp

    def damped(state: object, gained: Array, predicted: Array) -> None:
        told.append((gained[0], predicted[0]))
        damp(state, gained, predicted)  # type: ignore[arg-type]

    monkeypatch.setattr(levenberg_marquardt, "_damp", damped)
    bounds = np.full((1, 2), -2.0), np.full((1, 2), 2.0)
    found = minimize(linear, np.array([[-1.0, 1.0]]), *bounds, 1e-8)
    assert found.x[0] == pytest.approx([0.5, -0.25], abs=1e-3)
    assert told[0][0] == pytest.approx(told[0][1], rel=1e-2)
    assert told[0][0] > 10
