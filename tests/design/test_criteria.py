"""Information that is singular up to rounding errors, as of parameters not told apart."""

import numpy as np
import pytest

from biogrip.design.criteria import inverted, whitened

# What rounding may have made of information [[1, 1], [1, 1]], beside which nothing is known.
ROUNDED = 1 + np.array([-2e-13, -1e-13, -5e-14, 0.0, 1e-16, 5e-14, 1e-13, 2e-13, 1e-12])
# Parameters of very different scales, (2, 2).
SCALES = np.outer([1e3, 1e-5], [1e3, 1e-5])


def _alike(rounded: float) -> np.ndarray:
    return np.array([[1.0, rounded], [rounded, 1.0]]) * SCALES


@pytest.mark.parametrize("rounded", ROUNDED)
def test_singular_information_has_an_inverse_of_reciprocal_rounding(rounded: float) -> None:
    # Only the sum is known, to 1/2. Of the difference, the least that is told apart is 1e-13, half
    # of 1e13 for each parameter; rounding here makes it from half of that to thrice.
    diagonal = np.diagonal(inverted(_alike(rounded)[None])[0] * SCALES)
    assert (diagonal > 0.5e13 / 3.1).all()
    assert (diagonal < 2.05 * 0.5e13).all()


def test_singular_information_leaves_the_inverses_beside_it() -> None:
    known = np.array([[2.0, 0.3], [0.3, 1.0]]) * SCALES
    for rounded in ROUNDED:
        beside = inverted(np.array([known, _alike(rounded), known]))
        np.testing.assert_array_equal(beside[[0, 2]], inverted(np.array([known, known])))
    np.testing.assert_allclose(
        inverted(known[None])[0] * SCALES, [[1 / 1.91, -0.3 / 1.91], [-0.3 / 1.91, 2 / 1.91]], 1e-12
    )


@pytest.mark.parametrize("rounded", ROUNDED)
def test_whitened_sensitivities_of_singular_information(rounded: float) -> None:
    rows = np.array([[1.0], [1.0]]) * np.sqrt(np.diagonal(SCALES))[:, None]
    # The reading tells the sum, of information 2, all of it with the two parameters' 1.
    white = whitened(_alike(rounded)[None], rows[None])[0]
    assert np.sum(white**2) == pytest.approx(1.0, abs=1e-2)
