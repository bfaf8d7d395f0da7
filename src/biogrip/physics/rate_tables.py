"""Tables of what depends on the rate of a mode alone: sums of exponentials, and rows of responses.

However many terms it has, f(r) = sum_i a_i exp(r t_i) is a smooth function of the rate r alone. So
it is computed once at some hundred rates, and from then on interpolated piece by piece, by
polynomials through Chebyshev nodes in u = log(1 - T r), T the largest t_i: linear where nothing has
decayed yet, logarithmic beyond.

In the strip |Im u| <= pi/2 no exp(r t_i) exceeds e, for there Re(T r) <= 1. It holds the Bernstein
ellipse of a piece of width w with rho - 1/rho = 2 pi/w, so degree d leaves an error of at most 4 e
rho^-d / (rho - 1) sum |a_i| [1]_: 1.7e-16 sum |a_i| for the wide pieces of high degree that need
the fewest rates. Looking up is faster in short pieces of low degree, into which they are divided;
these add 4e-17 sum |a_i| for 32 of them, and for 16, in rows of responses, 3e-15.

References
----------
.. [1] L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM, 2013, chapter 8.
.. [2] H. Cheng et al., SIAM Journal on Scientific Computing 26 (2005), 1389-1404: pivoted QR.
"""

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial, chebyshev
from numpy.typing import NDArray

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.physics.modes import respond
from biogrip.physics.response import Modes

# Width and degree of wide pieces, and number of short pieces in one for sums and for rows.
_PIECE_WIDTH, _WIDE_DEGREE = 0.25, 11
_SHORTER, _SHORTER_OF_ROWS = 32, 16
_ROWS_WIDTH = _PIECE_WIDTH / _SHORTER_OF_ROWS
_ORDERS = np.arange(6)
# exp(-40) is lost in rounding: beyond, only what has not begun to decay is left.
_DECAYED = 40.0

# Spacing in u of the rates to choose modes from, and of times on a logarithmic scale.
_SPACING_OF_RATES, _SPACING_OF_TIMES = 0.05, 0.1
# What is left of a mode beside those chosen, relative to the first.
_LEAST_LEFT = 1e-14

# Chebyshev's nodes on (0, 1).
_WIDE_NODES, _SHORT_NODES = (
    0.5 + 0.5 * chebyshev.chebpts1(count) for count in (_WIDE_DEGREE + 1, len(_ORDERS))
)


def _chebyshev(places: Array, degree: int) -> NDArray[np.floating]:
    """Evaluate Chebyshev polynomials on (0, 1), (n_places, degree + 1)."""
    return chebyshev.chebvander(2 * places - 1, degree)


_TO_CHEBYSHEV = np.linalg.inv(_chebyshev(_SHORT_NODES, len(_ORDERS) - 1)).T
# Power coefficients of Chebyshev polynomials on (0, 1), one in each row.
_CHEBYSHEV_POWERS = (
    Chebyshev.basis(n, domain=(0, 1)).convert(kind=Polynomial).coef for n in _ORDERS
)
_TO_POWERS: Array = np.array(
    [np.pad(powers, (0, len(_ORDERS) - len(powers))) for powers in _CHEBYSHEV_POWERS]
)


def _in_short_pieces(values: Array, shorter: int) -> Array:
    """Turn values at the nodes of wide pieces, (..., 12), into powers, (..., shorter, 6)."""
    places = (np.arange(shorter)[:, None] + _SHORT_NODES).ravel() / shorter
    to_short = np.linalg.solve(
        _chebyshev(_WIDE_NODES, _WIDE_DEGREE).T, _chebyshev(places, _WIDE_DEGREE).T
    )
    short = (values @ to_short).reshape(*values.shape[:-1], shorter, len(_ORDERS))
    # A direct conversion of values to powers would lose digits by cancellation.
    return short @ _TO_CHEBYSHEV @ _TO_POWERS


class DecayTable:
    """Sums of decaying exponentials at any rate from 0 to -infinity.

    They are given by a function of rates, (n,), to (n_sums, n), with the largest t_i; the smallest
    above zero is one.
    """

    def __init__(self, function: Callable[[Array], Array], longest: float) -> None:
        self._longest = longest
        pieces = np.ceil(np.log1p(_DECAYED * longest) / _PIECE_WIDTH)
        u = _PIECE_WIDTH * (np.arange(pieces)[:, None] + _WIDE_NODES)
        values = function(-np.expm1(u).ravel() / longest).reshape(-1, *u.shape)
        powers = _in_short_pieces(values, _SHORTER).reshape(len(values), -1, len(_ORDERS))
        self._powers = np.ascontiguousarray(np.moveaxis(powers, 2, 0))
        self._end = np.nextafter(powers.shape[1], 0)

    def __call__(self, which: IntArray, rates: Array) -> Array:
        """Return sums of some indices, each at rates of its own; both broadcast."""
        place = np.fmin(np.log(1 - self._longest * rates) / (_PIECE_WIDTH / _SHORTER), self._end)
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
    modes as for fast ones; under a deformation, times 1 - T r. A response with its derivatives is
    then one small product: weights and powers of the places within pieces, times the pieces'
    coefficients. Of a mode so fast that nothing lasts until the next reading, the last piece is a
    polynomial in 1/r. Given are modes that stand for all, and rows of their responses, (n_modes,
    n_rows).
    """

    def __init__(self, modes: "SpanningModes", rows: Array) -> None:
        self._modes = modes
        powers = modes.powers.reshape(len(rows), -1).T @ rows
        # (n_pieces + 1, degree + 1, n_rows).
        self._table = powers.reshape(-1, len(_ORDERS), rows.shape[1])
        self._last = len(self._table) - 1

    def __call__(self, modes: Modes) -> Array:
        """Return rows of responses with derivatives, (n, 1 + n_parameters, n_rows).

        1. The place of each rate: a piece of the table, and powers of the place within it.
        2. Amplitudes: weights times what rows are tabulated over.
        3. Amplitudes times powers, and their derivatives by the log-parameters.
        4. One product of these with the coefficients of the pieces.
        """
        count, parameters, n_modes = modes.rate_slopes.shape
        scaled = -self._modes.end_s * modes.rates
        u = np.log1p(scaled) / _ROWS_WIDTH
        lasts = u < self._last
        piece = np.where(lasts, u, self._last).astype(np.intp)
        beyond = self._modes.decayed / np.maximum(scaled, self._modes.decayed)
        powers = _powers(np.where(lasts, u - piece, beyond))
        scale = _divisor(scaled, self._modes.decayed, self._modes.deforms)
        mixed = np.empty((count, 1 + parameters, n_modes, len(_ORDERS)))
        np.multiply((modes.weights * scale)[..., None], powers, out=mixed[:, 0])
        if parameters:
            by_rate = np.where(
                lasts,
                1 / (_ROWS_WIDTH * (1 + scaled)),
                -beyond / np.maximum(scaled, self._modes.decayed),
            )
            self._mix_slopes(modes, scale, lasts, by_rate, powers, mixed[:, 1:])
        # One product per sample: the order of its sums does not depend on the number of samples.
        pieces = self._table[piece].reshape(count, -1, self._table.shape[2])
        return mixed.reshape(count, 1 + parameters, -1) @ pieces

    def _mix_slopes(
        self,
        modes: Modes,
        scale: Array,
        lasts: BoolArray,
        by_rate: Array,
        powers: Array,
        out: Array,
    ) -> None:
        """Put derivatives of amplitudes times powers in `out`, (n, n_parameters, n_modes, 6).

        Given are amplitudes over weights, whether places are in a piece rather than in the last,
        the derivatives of places by -T r, (n, n_modes), and powers, (n, n_modes, degree + 1).
        """
        scaled_slopes = -self._modes.end_s * modes.rate_slopes
        place_slopes = by_rate[:, None] * scaled_slopes
        scale_slopes = np.where(lasts, 1.0, 0.0)[:, None] * scaled_slopes
        if self._modes.deforms:
            # What a fast mode has not forgotten falls with its rate.
            scale_slopes = -(scale * scale)[:, None] * scaled_slopes
        amplitude_slopes = modes.weight_slopes * scale[:, None]
        amplitude_slopes += modes.weights[:, None] * scale_slopes
        moved = (modes.weights * scale)[:, None] * place_slopes
        np.multiply(amplitude_slopes[..., None], powers[:, None], out=out)
        # The power of order 0 stays.
        power_slopes = _ORDERS[1:] * powers[..., :-1]
        out[..., 1:] += moved[..., None] * power_slopes[:, None]


class SpanningModes:
    """Modes whose responses to any course span those of all modes, slow and fast.

    A course is a sum of jumps of its level, its rate, and so on: of some orders. So columns are
    taken that stand for all [2]_ from a matrix with a column a rate, of responses to any such jump
    after any time from the shortest of a reading to the last, T.
    """

    def __init__(self, end_s: float, shortest_s: float, orders: int, *, deforms: bool) -> None:
        self.end_s, self.deforms = end_s, deforms
        # Rounded up, so that many traces have the same.
        halvings = int(np.ceil(np.log2(end_s / shortest_s)))
        rates, self.decayed, self.powers = _spanning(halvings, orders, deforms)
        self.rates: Array = rates / end_s
        """Rates of the modes, (n_modes,)."""
        self.scale = _scale_of_modes(rates, deforms)
        """Factors, (n_modes,), with which responses of modes are as large for all rates."""


@lru_cache(maxsize=16)
def _spanning(halvings: int, orders: int, deforms: bool) -> tuple[Array, float, Array]:
    """Return rates over T, one beyond which nothing lasts, and the table of `ModeRows`.

    1. Responses of modes of many rates, to jumps of all orders, after all times.
    2. Those of which the others are sums: their rates.
    3. In wide pieces of rates, and beyond, shares of these in a mode of any rate: the table.
    """
    elapsed = np.exp(-np.arange(0.0, halvings * np.log(2) + _SPACING_OF_TIMES, _SPACING_OF_TIMES))
    jumps = partial(_scaled_jumps, elapsed[:, None], orders, deforms)
    wide = int(np.ceil(np.log1p(_DECAYED * 2.0**halvings) / _PIECE_WIDTH))
    decayed = float(np.expm1(_PIECE_WIDTH * wide))
    last = np.log1p(decayed / _SHORT_NODES[0])
    candidates = -np.expm1(np.arange(_SPACING_OF_RATES, last, _SPACING_OF_RATES))
    responses = jumps(candidates)
    sizes = np.max(np.abs(responses), axis=1, keepdims=True)
    columns = responses / sizes
    chosen = _independent(columns)
    basis, triangle = np.linalg.qr(columns[:, chosen])
    basis /= sizes

    def shares(scaled: Array) -> Array:
        """Return shares of the chosen modes in tabulated rows, by -T r, (n_modes, n)."""
        of_modes = np.linalg.solve(triangle, basis.T @ jumps(-scaled))
        return of_modes / (_scale_of_modes(-scaled, deforms) * _divisor(scaled, decayed, deforms))

    pieces = [
        _in_short_pieces(shares(np.expm1(_PIECE_WIDTH * (piece + _WIDE_NODES))), _SHORTER_OF_ROWS)
        for piece in range(wide)
    ]
    beyond = shares(decayed / _SHORT_NODES) @ _TO_CHEBYSHEV @ _TO_POWERS
    return candidates[chosen], decayed, np.concatenate([*pieces, beyond[:, None]], axis=1)


def _scaled_jumps(elapsed: Array, orders: int, deforms: bool, rates: Array) -> Array:
    """Return scaled responses to jumps of all orders after all times, (n_jumps, n_rates)."""
    responses = respond(range(orders), rates, elapsed, deforms=deforms)
    return np.concatenate([of_order[0] for of_order in responses]) * _scale_of_modes(rates, deforms)


def _independent(columns: Array) -> list[int]:
    """Return the columns that a pivoted QR takes: importing SciPy's is slow."""
    left, chosen = columns.copy(), list[int]()
    sizes = np.linalg.norm(left, axis=0)
    least = _LEAST_LEFT * sizes.max()
    while np.any(sizes > least):
        chosen.append(int(np.argmax(sizes)))
        direction = left[:, chosen[-1]] / sizes[chosen[-1]]
        left -= np.outer(direction, direction @ left)
        sizes = np.linalg.norm(left, axis=0)
    return chosen


def _scale_of_modes(rates: Array, deforms: bool) -> Array:
    """Return factors with which responses of modes are as large for all rates over T."""
    return 1 - rates if deforms else 1 - 1 / rates


def _divisor(scaled: Array, decayed: float, deforms: bool) -> Array:
    """Return the divisor of a mode's rows by -T r."""
    return 1 / (1 + scaled) if deforms else np.minimum(scaled, decayed)


def _powers(place: Array) -> Array:
    """Return powers, of shape (..., degree + 1)."""
    powers = np.ones((*place.shape, len(_ORDERS)))
    for order in _ORDERS[1:]:
        np.multiply(powers[..., order - 1], place, out=powers[..., order])
    return powers
