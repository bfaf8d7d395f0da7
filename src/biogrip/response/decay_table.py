"""Tables of sums of decaying exponentials as functions of the rate.

However many terms it has, f(r) = sum_i a_i exp(r t_i) is a smooth function of
the rate r alone. So it is computed once at some hundred rates, and from then on
interpolated piece by piece, by polynomials through Chebyshev nodes in

    u = log(1 - T r),

T the largest t_i: linear where nothing has decayed yet, logarithmic beyond.

In the strip |Im u| <= pi/2 no exp(r t_i) exceeds e, for there Re(T r) <= 1. It
holds the Bernstein ellipse of a piece of width w with rho - 1/rho = 2 pi/w, so
degree d leaves an error of at most 4 e rho^-d / (rho - 1) sum |a_i|. That is
1.7e-16 sum |a_i|, no more than rounding, for the wide pieces of high degree that
need the fewest rates. Looking up is faster in short pieces of low degree, into
which they are divided; these add 4e-17 sum |a_i|.

References
----------
.. [1] L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM, 2013, chapter 8:
   convergence of Chebyshev interpolants within a Bernstein ellipse.
"""

from collections.abc import Callable

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial, chebyshev
from numpy.typing import NDArray

from biogrip.arrays import Array, IntArray

WIDTH, DEGREE = 0.25, 11
SHORTER, SHORT_DEGREE = 32, 5
# exp(-40) is lost in rounding: beyond, only what has not begun to decay is left.
_DECAYED = 40.0


class DecayTable:
    """Sums of decaying exponentials at any rate from 0 to -infinity.

    They are given by a function of rates, (n,), to (n_sums, n), with the largest t_i and the
    smallest above zero.
    """

    def __init__(self, function: Callable[[Array], Array], longest: float, shortest: float) -> None:
        self._longest = longest
        pieces = np.ceil(np.log1p(_DECAYED * longest / shortest) / WIDTH)
        u = WIDTH * (np.arange(pieces)[:, None] + NODES)
        values = function(-np.expm1(u).ravel() / longest).reshape(-1, *u.shape)
        short = (values @ _TO_SHORT).reshape(len(values), -1, SHORT_DEGREE + 1)
        # A direct conversion of values to powers would lose digits by cancellation.
        powers = short @ _TO_SERIES @ _TO_POWERS
        self._powers = np.ascontiguousarray(np.moveaxis(powers, 2, 0))
        self._end = np.nextafter(short.shape[1], 0)

    def __call__(self, rates: Array) -> Array:
        """Return the sums at rates of any shape, shape (n_sums, ...)."""
        every = np.arange(self._powers.shape[1]).reshape(-1, *np.ones(rates.ndim, dtype=int))
        return self.of(every, rates)

    def of(self, which: IntArray, rates: Array) -> Array:
        """Return selected sums, each of which depends on its own rate alone.

        `which` holds indices of the sums, in a shape that broadcasts with that of the rates.
        """
        place = np.fmin(np.log(1 - self._longest * rates) / (WIDTH / SHORTER), self._end)
        piece = place.astype(np.intp)
        place -= piece
        piece = piece + which * self._powers.shape[2]
        powers = self._powers.reshape(SHORT_DEGREE + 1, -1)
        sums: Array = powers[-1].take(piece)
        for power in powers[-2::-1]:
            sums *= place
            sums += power.take(piece)
        return sums


def series(places: Array, degree: int) -> NDArray[np.floating]:
    """Evaluate Chebyshev polynomials on (0, 1), shape (n_places, degree + 1)."""
    return chebyshev.chebvander(2 * places - 1, degree)


def _powers(degree: int) -> Array:
    """Return the power coefficients of Chebyshev polynomials on (0, 1), one in each row."""
    rows = np.zeros((degree + 1, degree + 1))
    for order in range(degree + 1):
        polynomial = Chebyshev.basis(order, domain=(0, 1)).convert(kind=Polynomial)
        rows[order, : order + 1] = polynomial.coef
    return rows


# Chebyshev's on (0, 1).
NODES, _SHORT_NODES = (0.5 + 0.5 * chebyshev.chebpts1(d + 1) for d in (DEGREE, SHORT_DEGREE))
_DIVIDED = (np.arange(SHORTER)[:, None] + _SHORT_NODES).ravel() / SHORTER
_TO_SHORT = np.linalg.solve(series(NODES, DEGREE).T, series(_DIVIDED, DEGREE).T)
_TO_SERIES = np.linalg.inv(series(_SHORT_NODES, SHORT_DEGREE)).T
_TO_POWERS = _powers(SHORT_DEGREE)
