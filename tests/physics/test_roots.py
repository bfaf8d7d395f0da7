import numpy as np
import pytest
from mpmath import mp, mpf

from biogrip.physics.roots import SMALLEST_GAP, real_quadratic_roots, roots, separate


def coefficients_of(known: list[float]) -> np.ndarray:
    """Coefficients of prod (s - root), from 60 digits."""
    with mp.workdps(60):
        poly = [mpf(1)]
        for root in known:
            shifted = [mpf(0), *poly]
            poly = [a - mpf(root) * b for a, b in zip(shifted, [*poly, mpf(0)], strict=True)]
        return np.array([[float(value) for value in poly]])


@pytest.mark.parametrize(
    "known",
    [
        [-1e-3, -2.0, -7e12],
        [-1e-9, -1e-4, -3.0, -5e6, -8e12],
        [-1.0, -1.1, -1.2],
        [-2.0],
    ],
)
def test_known_roots(known: list[float]) -> None:
    found = np.sort(roots(coefficients_of(known))[0].real)
    # A root is as uncertain as its neighbours are close: eps over the relative gap.
    np.testing.assert_allclose(found, np.sort(known), rtol=1e-12)


def test_complex_pair_beside_a_slow_root() -> None:
    pair = complex(-165.0, 6.5e7)
    quadratic = np.array([abs(pair) ** 2, -2 * pair.real, 1.0])
    found = roots(np.convolve(quadratic, [1e-4, 1.0])[None, :])[0]
    assert min(abs(found - pair)) < 1e-9 * abs(pair)
    assert min(abs(found + 1e-4)) < 1e-15


def test_quadratic_keeps_its_small_root() -> None:
    """Naively, 1 - sqrt(1 - 1e-20) is zero."""
    found = real_quadratic_roots(np.array([[1e-20, 1.0, 1.0]]))
    np.testing.assert_allclose(found, [[-1.0, -1e-20]], rtol=1e-15)


def test_coinciding_roots_are_moved_apart_about_their_mean() -> None:
    found = separate(np.array([[-3.0, -3.0, -1.0]]))[0]
    assert abs(found[0] - found[1]) == pytest.approx(3 * SMALLEST_GAP, rel=1e-6)
    assert found[:2].mean() == pytest.approx(-3.0, rel=1e-12)
    assert found[2] == -1.0
