"""Sums of decaying exponentials as functions of the rate, tabulated.

However many terms it has, f(r) = sum_i a_i exp(r t_i) is a smooth function of
the rate r alone. So it is computed once at some hundred rates, and from then on
interpolated piece by piece, by polynomials through Chebyshev nodes in

    u = log(1 - T r),

T the largest t_i: linear where nothing has decayed yet, logarithmic beyond.

In the strip |Im u| <= pi/2 no exp(r t_i) exceeds e, for there Re(T r) <= 1. It
holds the Bernstein ellipse of a piece of width w with rho - 1/rho = 2 pi/w, so
degree d leaves an error of at most 4 e rho^-d / (rho - 1) sum |a_i|. Here that is
1.7e-16 sum |a_i|, no more than rounding.
"""

from collections.abc import Callable

import numpy as np
from numpy.polynomial import chebyshev

from biogrip.arrays import Array

_WIDTH, _DEGREE = 0.25, 11
# exp(-40) is lost in rounding: beyond, only what has not begun to decay is left.
_DECAYED = 40.0


def _chebyshev_to_powers() -> Array:
    """Turn rows of Chebyshev coefficients on (-1, 1) into powers of half the argument."""
    powers = np.zeros((_DEGREE + 1, _DEGREE + 1))
    for order, unit in enumerate(np.eye(_DEGREE + 1)):
        powers[order, : order + 1] = chebyshev.cheb2poly(unit[: order + 1])
    return powers * 2.0 ** np.arange(_DEGREE + 1)


_NODES = chebyshev.chebpts1(_DEGREE + 1)
_TO_CHEBYSHEV = np.linalg.inv(chebyshev.chebvander(_NODES, _DEGREE)).T
_TO_POWERS = _chebyshev_to_powers()


class DecayTable:
    """Sums of decaying exponentials at any rate from 0 to -infinity.

    Parameters
    ----------
    function
        Of rates of shape (n,), returns the sums, shape (n_sums, n). It is asked
        for rates slightly above 0 as well.
    longest, shortest
        Largest t_i, and the smallest above zero.
    """

    def __init__(self, function: Callable[[Array], Array], longest: float, shortest: float) -> None:
        self._longest = longest
        self._last = np.ceil(np.log1p(_DECAYED * longest / shortest) / _WIDTH)
        centres = np.arange(self._last + 1)
        u = _WIDTH * (centres[:, None] + _NODES / 2)
        values = function(-np.expm1(u).ravel() / longest).reshape(-1, *u.shape)
        # Straight to powers would lose digits: they are large and cancel.
        powers = values @ _TO_CHEBYSHEV @ _TO_POWERS
        self._powers = np.ascontiguousarray(np.moveaxis(powers, 2, 0))

    def __call__(self, rates: Array) -> Array:
        """Sums at rates of any shape, shape (n_sums, ...)."""
        place = np.fmin(np.log(1 - self._longest * rates) / _WIDTH, self._last)
        nearest = (place + 0.5).astype(np.intp)
        place -= nearest
        powers = self._powers.take(nearest, axis=2)
        sums: Array = powers[-1]
        for power in powers[-2::-1]:
            sums *= place
            sums += power
        return sums
