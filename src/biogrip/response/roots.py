"""Root finding for polynomials with positive coefficients, many at once.

The coefficients of a gripper-sample polynomial span dozens of decades. An
eigenvalue solver loses the small roots there; iterating on the polynomial
itself, from starting radii read off its Newton polygon, keeps every root to
full relative accuracy.

References
----------
.. [1] L. W. Ehrlich, A modified Newton method for polynomials, Communications of the ACM 10
   (1967), 107-108.
.. [2] O. Aberth, Iteration methods for finding all zeros of a polynomial simultaneously,
   Mathematics of Computation 27 (1973), 339-344.
.. [3] D. A. Bini, Numerical computation of polynomial zeros by means of Aberth's method,
   Numerical Algorithms 13 (1996), 179-200: starting radii from the Newton polygon.
"""

from collections.abc import Callable
from functools import cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray, IntArray

SMALLEST_GAP = 1e-6
"""Relative distance below which two roots are moved apart.

The partial fractions of two roots a relative gap g apart lose eps/g; moving a
double root symmetrically apart by g changes the response by g^2. Both stay
below 1e-9 here.
"""

AnyRoot = TypeVar("AnyRoot", np.float64, np.complex128)

_SWEEPS = 80


def real_quadratic_roots(coefficients: Array) -> Array:
    """Compute the roots, (n, 2), of a + b s + c s^2 that are known to be real and negative.

    Coefficients are positive, (n, 3). The fast root comes first; the two are never closer together
    than `SMALLEST_GAP`.

    References
    ----------
    .. [1] N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM, 2002,
       section 1.8: the quadratic formula without cancellation.
    """
    a, b, c = coefficients.T
    discriminant = np.maximum(b * b - 4 * a * c, (SMALLEST_GAP * b) ** 2)
    q = -0.5 * (b + np.sqrt(discriminant))
    return np.array((q / c, a / q)).T


def roots(coefficients: Array) -> ComplexArray:
    """Compute the roots of polynomials with positive coefficients (Ehrlich-Aberth iteration).

    Coefficients are in ascending powers, (n, degree + 1); roots, (n, degree), are pairwise at least
    `SMALLEST_GAP` apart.
    """
    degree = coefficients.shape[1] - 1
    radii = _newton_polygon_radii(coefficients)
    # No symmetry, so that no two starting points can move in step.
    angles = np.pi + np.array([0.4, -0.9, 1.1, -0.25, 0.7, -1.3, 0.15])[np.arange(degree) % 7]
    z = radii * np.exp(1j * (angles + 0.05 * np.arange(degree)))
    return separate(find_zeros(z, lambda z: _newton_step(coefficients, z)))


def find_zeros(
    z: ComplexArray,
    newton_step: Callable[[ComplexArray], ComplexArray],
    between: Array | None = None,
) -> ComplexArray:
    """Move points onto the zeros of functions, all zeros of each at once (Ehrlich-Aberth).

    Starts are (n, n_points), for each function as many as it has zeros; a Newton step is the
    function divided by its derivative. If each point is counted from an origin of its own, the
    differences of origins, (n, n_points, n_points), are added to differences of points.
    """
    off_diagonal = ~np.eye(z.shape[1], dtype=bool)
    with np.errstate(divide="ignore", invalid="ignore"):
        converged = resting = np.zeros((len(z), 1), dtype=bool)
        for _ in range(_SWEEPS):
            newton = newton_step(z)
            distance = z[:, :, None] - z[:, None, :]
            if between is not None:
                distance = between + distance
            repulsion = np.where(off_diagonal, 1 / distance, 0).sum(axis=2)
            step = newton / (1 - newton * repulsion)
            # Converged points rest, so that their last bits do not depend on other functions.
            step = np.where(np.isfinite(step) & ~resting, step, 0)
            z = z - step
            if np.all(converged):
                break
            # The error is cubed in a sweep, so one more takes it below rounding.
            resting = converged
            converged = np.all(np.abs(step) <= 1e-8 * np.abs(z), axis=1, keepdims=True)
    return z


def separate(z: NDArray[AnyRoot]) -> NDArray[AnyRoot]:
    """Move roots that (nearly) coincide symmetrically apart to `SMALLEST_GAP`."""
    z = z.copy()
    first, second = _pairs(z.shape[1])
    if not np.any(np.abs(z[:, first] - z[:, second]) < SMALLEST_GAP * np.abs(z[:, first])):
        return z
    for i, j in zip(first, second, strict=True):
        close = np.abs(z[:, i] - z[:, j]) < SMALLEST_GAP * np.abs(z[:, i])
        middle = 0.5 * (z[:, i] + z[:, j])
        z[:, i] = np.where(close, middle * (1 + SMALLEST_GAP / 2), z[:, i])
        z[:, j] = np.where(close, middle * (1 - SMALLEST_GAP / 2), z[:, j])
    return z


@cache
def _pairs(count: int) -> tuple[IntArray, IntArray]:
    return np.triu_indices(count, 1)


def _newton_step(coefficients: Array, z: ComplexArray) -> ComplexArray:
    highest, *others = coefficients.T[::-1, :, None]
    slope = highest + np.zeros_like(z)
    value = slope * z + others[0]
    for coefficient in others[1:]:
        slope = slope * z + value
        value = value * z + coefficient
    return value / slope


def _newton_polygon_radii(coefficients: Array) -> Array:
    """Return moduli of the roots: slopes of the concave hull of log(coefficient) over power."""
    degree = coefficients.shape[1] - 1
    log = np.log(coefficients)
    hull = log.copy()
    for k in range(1, degree):
        for i in range(k):
            for j in range(k + 1, degree + 1):
                chord = log[:, i] + (log[:, j] - log[:, i]) * (k - i) / (j - i)
                hull[:, k] = np.maximum(hull[:, k], chord)
    return np.exp(hull[:, :-1] - hull[:, 1:])
