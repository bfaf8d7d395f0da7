"""Tables of what depends on the rate of a mode alone: sums of exponentials, and rows of responses.

However many terms it has, f(r) = sum_i a_i exp(r t_i) is a smooth function of the rate r alone. So
it is computed once at some hundred rates, and from then on interpolated piece by piece, by
polynomials through Chebyshev nodes in

    u = log(1 - T r),

T the largest t_i: linear where nothing has decayed yet, logarithmic beyond.

In the strip |Im u| <= pi/2 no exp(r t_i) exceeds e, for there Re(T r) <= 1. It holds the Bernstein
ellipse of a piece of width w with rho - 1/rho = 2 pi/w, so degree d leaves an error of at most
4 e rho^-d / (rho - 1) sum |a_i| [1]_. That is 1.7e-16 sum |a_i|, no more than rounding, for the
wide pieces of high degree that need the fewest rates. Looking up is faster in short pieces of low
degree, into which they are divided; these add 4e-17 sum |a_i| for 32 of them, and for 16, in rows
of responses, 3e-15.

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
from biogrip.physics.modes import Modes, mode_responses
from biogrip.physics.protocol import Course

# Width and degree of wide pieces, and number of short pieces in one for sums and for rows.
_WIDTH, _DEGREE = 0.25, 11
_SHORTER, _SHORTER_OF_ROWS = 32, 16
_ORDERS = np.arange(6)
# exp(-40) is lost in rounding: beyond, only what has not begun to decay is left. Under a ramp, a
# term remains that falls with the rate only.
_DECAYED, _DECAYED_UNDER_RAMPS = 40.0, 1e12

# Chebyshev's nodes on (0, 1).
_NODES, _SHORT_NODES = (
    0.5 + 0.5 * chebyshev.chebpts1(count) for count in (_DEGREE + 1, len(_ORDERS))
)


def _series(places: Array, degree: int) -> NDArray[np.floating]:
    """Evaluate Chebyshev polynomials on (0, 1), (n_places, degree + 1)."""
    return chebyshev.chebvander(2 * places - 1, degree)


def _power_rows() -> Array:
    """Return the power coefficients of Chebyshev polynomials on (0, 1), one in each row."""
    polynomials = (Chebyshev.basis(n, domain=(0, 1)).convert(kind=Polynomial) for n in _ORDERS)
    return np.array([np.pad(p.coef, (0, len(_ORDERS) - len(p.coef))) for p in polynomials])


_TO_SERIES = np.linalg.inv(_series(_SHORT_NODES, len(_ORDERS) - 1)).T
_TO_POWERS = _power_rows()


def _in_short_pieces(values: Array, shorter: int) -> Array:
    """Turn values at the nodes of wide pieces, (..., 12), into powers, (..., shorter, 6)."""
    places = (np.arange(shorter)[:, None] + _SHORT_NODES).ravel() / shorter
    to_short = np.linalg.solve(_series(_NODES, _DEGREE).T, _series(places, _DEGREE).T)
    short = (values @ to_short).reshape(*values.shape[:-1], shorter, len(_ORDERS))
    # A direct conversion of values to powers would lose digits by cancellation.
    return short @ _TO_SERIES @ _TO_POWERS


class DecayTable:
    """Sums of decaying exponentials at any rate from 0 to -infinity.

    They are given by a function of rates, (n,), to (n_sums, n), with the largest t_i; the smallest
    above zero is one.
    """

    def __init__(self, function: Callable[[Array], Array], longest: float) -> None:
        self._longest = longest
        pieces = np.ceil(np.log1p(_DECAYED * longest) / _WIDTH)
        u = _WIDTH * (np.arange(pieces)[:, None] + _NODES)
        values = function(-np.expm1(u).ravel() / longest).reshape(-1, *u.shape)
        powers = _in_short_pieces(values, _SHORTER).reshape(len(values), -1, len(_ORDERS))
        self._powers = np.ascontiguousarray(np.moveaxis(powers, 2, 0))
        self._end = np.nextafter(powers.shape[1], 0)

    def __call__(self, rates: Array) -> Array:
        """Return the sums at rates of any shape, shape (n_sums, ...)."""
        every = np.arange(self._powers.shape[1]).reshape(-1, *np.ones(rates.ndim, dtype=int))
        return self.of(every, rates)

    def of(self, which: IntArray, rates: Array) -> Array:
        """Return selected sums, each of which depends on its own rate alone.

        `which` holds indices of the sums, in a shape that broadcasts with that of the rates.
        """
        place = np.fmin(np.log(1 - self._longest * rates) / (_WIDTH / _SHORTER), self._end)
        piece = place.astype(np.intp)
        place -= piece
        piece = piece + which * self._powers.shape[2]
        powers = self._powers.reshape(len(_ORDERS), -1)
        sums: Array = powers[-1].take(piece)
        for power in powers[-2::-1]:
            sums *= place
            sums += power.take(piece)
        return sums


class ModeRows:
    """Condensed rows of the responses of many samples, with their derivatives.

    The rows of a mode are tabulated over T r, T the last time, so that they are as large for slow
    modes as for fast ones; under a deformation, which modes forget the faster the faster they are,
    times 1 - T r. A response with its derivatives is then one small product: weights and powers of
    the places within pieces, times the pieces' coefficients.

    A matrix, (n_times, n_rows), turns values at ascending times, multiplied from their right, into
    rows; `shortest_s` is the shortest of these times after a change of the load.
    """

    def __init__(self, course: Course, time_s: Array, to_rows: Array, shortest_s: float) -> None:
        self._end_s, self._deforms = float(time_s[-1]), course.deforms
        self._rows = to_rows.shape[1]
        decayed = _DECAYED if course.only_steps else _DECAYED_UNDER_RAMPS
        wide = int(np.ceil(np.log1p(decayed * self._end_s / shortest_s) / _WIDTH))
        self._last = wide * _SHORTER_OF_ROWS
        # (n_pieces, degree + 1, n_rows).
        self._table = np.empty((self._last, len(_ORDERS), self._rows))
        for piece in range(wide):
            u = _WIDTH * (piece + _NODES)
            responses, _ = mode_responses(-np.expm1(u)[None] / self._end_s, course, time_s)
            values = (responses[0] / self._scale(np.expm1(u))[:, None]) @ to_rows
            powers = _in_short_pieces(values.T, _SHORTER_OF_ROWS)
            here = slice(piece * _SHORTER_OF_ROWS, (piece + 1) * _SHORTER_OF_ROWS)
            self._table[here] = powers.transpose(1, 2, 0)

    def __call__(self, modes: Modes) -> Array:
        """Return rows of responses with derivatives, (n, 1 + n_parameters, n_rows)."""
        count, parameters, n_modes = modes.rate_slopes.shape
        scaled, width = -self._end_s * modes.rates, _WIDTH / _SHORTER_OF_ROWS
        u = np.log1p(scaled) / width
        decayed = u >= self._last
        u = np.minimum(u, np.nextafter(self._last, 0))
        piece = u.astype(np.intp)
        powers, power_slopes = _powers(u - piece)
        # The divisor, and the place, with their derivatives by the log-parameters.
        known = np.where(decayed, np.expm1(width * self._last), scaled)
        known_slopes = np.where(decayed, 0.0, -self._end_s)[:, None] * modes.rate_slopes
        place_slopes = known_slopes / (width * (1 + scaled))[:, None]
        scale, scale_slopes = self._scale(known), known_slopes
        if self._deforms:
            # What a fast mode has not forgotten falls with its rate.
            scale = self._scale(scaled)
            scale_slopes = (self._end_s * scale * scale)[:, None] * modes.rate_slopes
        amplitudes = modes.weights * scale
        amplitude_slopes = modes.weight_slopes * scale[:, None]
        amplitude_slopes += modes.weights[:, None] * scale_slopes
        moved = amplitudes[:, None] * place_slopes
        mixed = np.empty((count, 1 + parameters, n_modes, len(_ORDERS)))
        np.multiply(amplitudes[..., None], powers, out=mixed[:, 0])
        np.multiply(amplitude_slopes[..., None], powers[:, None], out=mixed[:, 1:])
        mixed[:, 1:] += moved[..., None] * power_slopes[:, None]
        # One product per sample: the order of its sums does not depend on the number of samples.
        pieces = self._table[piece].reshape(count, -1, self._rows)
        return mixed.reshape(count, 1 + parameters, -1) @ pieces

    def _scale(self, scaled: Array) -> Array:
        """Return the divisor of a mode's rows by -T r."""
        return 1 / (1 + scaled) if self._deforms else scaled


def _powers(place: Array) -> tuple[Array, Array]:
    """Return powers, and their derivatives, of shape (..., degree + 1)."""
    powers = np.ones((*place.shape, len(_ORDERS)))
    for order in _ORDERS[1:]:
        powers[..., order] = powers[..., order - 1] * place
    slopes = np.zeros_like(powers)
    slopes[..., 1:] = _ORDERS[1:] * powers[..., :-1]
    return powers, slopes
