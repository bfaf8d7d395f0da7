"""Condensed least squares: a few rows with the sum of squares of all readings.

First, nodes replace dense readings in sums of products of smooth functions (`DenseSamples`). On a
piece of time twice as far from the last change of the load at its end as at its start, a response
is a polynomial of degree 19 to 1e-15 of its peak, whatever the rates of its modes: with e^(-rho (3
+ s)), |s| <= 1, Chebyshev coefficients fall like 5.8^-n [1]_. So a piece with thousands of readings
needs twenty nodes, and sums of products over its readings follow from one small matrix. If readings
are few, they are the nodes; so they are where the course changes at nearly every one of them, as
one that was recorded.

Second, some seventy modes stand for all (`SpanningModes`): whatever the course, the response of any
mode is a sum of theirs. A triangular matrix has all products of these at the nodes (`Condensed`),
and with it the rows of all responses, and of their gradients. A trace's rows are its projections on
the same orthonormal functions, and the norm of what they do not reach.

Third, rows of a mode are tabulated over its rate (`ModeRows`). However many terms it has, f(r) =
sum_i a_i exp(r t_i) is a smooth function of the rate r alone. So it is computed once at some
hundred rates, and from then on interpolated piece by piece, by polynomials through Chebyshev nodes
in u = log(1 - T r), T the largest t_i: linear where nothing has decayed yet, logarithmic beyond.

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

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from itertools import chain, pairwise
from typing import Protocol

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial, chebyshev, legendre
from numpy.typing import NDArray

from biogrip.arrays import Array, BoolArray
from biogrip.physics.modes import mode_responses, respond, responses_in_turn
from biogrip.physics.noise import without
from biogrip.physics.protocol import Course
from biogrip.physics.response import Modes, sum_of_modes

_NODES_A_PIECE = 20
# Square of a norm that may be rounding.
_ROUNDING_OF_NORM = 1e-9
_DEGREE_OF_PIECE = _NODES_A_PIECE - 1
_NODES_OF_PIECE = chebyshev.chebpts1(_NODES_A_PIECE)
# From values at the nodes to coefficients of Legendre polynomials, which are nearly orthogonal
# over readings that are dense all over a piece.
_TO_LEGENDRE = np.linalg.inv(legendre.legvander(_NODES_OF_PIECE, _DEGREE_OF_PIECE))
# Fewer readings are their own nodes; so are those whose polynomials are worse conditioned.
_FEWEST_READINGS, _LARGEST_CONDITION = 256, 10.0
# Most nodes of which orthonormal functions are kept for the next trace.
_MOST_NODES_KEPT = 20_000


class Whitens(Protocol):
    """What turns noise white, and projects nuisance out (`biogrip.fit.trace_noise`)."""

    nuisance: Array
    """Functions that are projected out, (n_functions, n_samples)."""

    def __call__(self, rows: Array) -> Array:
        """Whiten functions of time, (..., n_samples)."""


@dataclass(frozen=True)
class _Piece:
    """A stretch of the readings, and its nodes."""

    readings: slice
    nodes_s: Array
    """Times of the nodes, (n_nodes,)."""
    basis: Array | None = None
    """Orthonormal polynomials at the readings, (n_readings, n_nodes); None if these are nodes."""
    to_rows: Array | None = None
    """From values at the nodes to rows, (n_nodes, n_nodes)."""


class DenseSamples:
    """Rows with the products of all readings, for any smooth functions of time.

    Functions are smooth between changes of the load. Sampling times, (n_samples,), ascend. Only
    if `dense` may nodes replace readings; otherwise each reading is a node.
    """

    def __init__(self, course: Course, time_s: Array, *, dense: bool) -> None:
        self._all_s = time_s
        starts = course.changes_s
        self._starts_s = np.append(-np.inf, starts)
        bounds = np.unique(np.concatenate(([0], time_s.searchsorted(starts), [len(time_s)])))
        self._pieces = [_Piece(slice(len(time_s)), time_s)]
        if dense:
            self._pieces = [piece for ends in pairwise(bounds) for piece in self._divided(*ends)]
        self.time_s = np.concatenate([piece.nodes_s for piece in self._pieces])
        """Times of the nodes, (n_nodes,), ascending."""

    def rows_of_values(self, values: Array) -> Array:
        """Return rows with the products of the readings, from node values, (..., n_nodes)."""
        rows, start = np.copy(values), 0
        for piece in self._pieces:
            here = slice(start, start + len(piece.nodes_s))
            start = here.stop
            if piece.to_rows is not None:
                rows[..., here] = values[..., here] @ piece.to_rows
        return rows

    def rows_of_samples(self, samples: Array) -> tuple[Array, float]:
        """Project readings, (n_samples,), on the nodes' rows; return the norm of the rest, too."""
        rows: list[Array] = []
        rest = 0.0
        for piece in self._pieces:
            of_piece = samples[piece.readings]
            if piece.basis is None:
                rows.append(of_piece)
            else:
                rows.append(of_piece @ piece.basis)
                rest += float(np.sum((of_piece - piece.basis @ rows[-1]) ** 2))
        return np.concatenate(rows), float(np.sqrt(rest))

    def _divided(self, first: int, stop: int) -> Iterator[_Piece]:
        """Halve pieces that are not smooth, or not dense all over, down to few readings."""
        here = slice(first, stop)
        if stop - first < _FEWEST_READINGS:
            yield _Piece(here, self._all_s[here])
            return
        start, end = self._all_s[first], self._all_s[stop - 1]
        elapsed = start - self._starts_s[self._starts_s.searchsorted(start, side="right") - 1]
        if end - start <= elapsed:
            place = (2 * self._all_s[here] - start - end) / (end - start)
            basis, triangle = np.linalg.qr(legendre.legvander(place, _DEGREE_OF_PIECE))
            if np.linalg.cond(triangle / np.linalg.norm(triangle, axis=0)) <= _LARGEST_CONDITION:
                nodes_s = 0.5 * (start + end) + 0.5 * (end - start) * _NODES_OF_PIECE
                yield _Piece(here, nodes_s, basis, _TO_LEGENDRE.T @ triangle.T)
                return
        half = first + int(np.searchsorted(self._all_s[here], 0.5 * (start + end)))
        yield from self._divided(first, half)
        yield from self._divided(half, stop)


# Width and degree of wide pieces of a table, and number of short pieces in one.
PIECE_WIDTH, _WIDE_DEGREE = 0.25, 11
_SHORTER_OF_ROWS = 16
_ROWS_WIDTH = PIECE_WIDTH / _SHORTER_OF_ROWS
ORDERS = np.arange(6)
# exp(-40) is lost in rounding: beyond, only what has not begun to decay is left.
DECAYED = 40.0

# Spacing in u of the rates to choose modes from, and of times on a logarithmic scale.
_SPACING_OF_RATES, _SPACING_OF_TIMES = 0.05, 0.1
# What is left of a mode beside those chosen, relative to the first.
_LEAST_LEFT = 1e-14

# Chebyshev's nodes on (0, 1).
WIDE_NODES, _SHORT_NODES = (
    0.5 + 0.5 * chebyshev.chebpts1(count) for count in (_WIDE_DEGREE + 1, len(ORDERS))
)


def _chebyshev(places: Array, degree: int) -> NDArray[np.floating]:
    """Evaluate Chebyshev polynomials on (0, 1), (n_places, degree + 1)."""
    return chebyshev.chebvander(2 * places - 1, degree)


_TO_CHEBYSHEV = np.linalg.inv(_chebyshev(_SHORT_NODES, len(ORDERS) - 1)).T
# Power coefficients of Chebyshev polynomials on (0, 1), one in each row.
_CHEBYSHEV_POWERS = (
    Chebyshev.basis(n, domain=(0, 1)).convert(kind=Polynomial).coef for n in ORDERS
)
_TO_POWERS: Array = np.array(
    [np.pad(powers, (0, len(ORDERS) - len(powers))) for powers in _CHEBYSHEV_POWERS]
)


def in_short_pieces(values: Array, shorter: int) -> Array:
    """Turn values at the nodes of wide pieces, (..., 12), into powers, (..., shorter, 6)."""
    places = (np.arange(shorter)[:, None] + _SHORT_NODES).ravel() / shorter
    to_short = np.linalg.solve(
        _chebyshev(WIDE_NODES, _WIDE_DEGREE).T, _chebyshev(places, _WIDE_DEGREE).T
    )
    short = (values @ to_short).reshape(*values.shape[:-1], shorter, len(ORDERS))
    # A direct conversion of values to powers would lose digits by cancellation.
    return short @ _TO_CHEBYSHEV @ _TO_POWERS


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
        self._table = powers.reshape(-1, len(ORDERS), rows.shape[1])
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
        mixed = np.empty((count, 1 + parameters, n_modes, len(ORDERS)))
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
        power_slopes = ORDERS[1:] * powers[..., :-1]
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
    # Imported here, for only fits need it.
    from scipy.linalg import qr

    elapsed = np.exp(-np.arange(0.0, halvings * np.log(2) + _SPACING_OF_TIMES, _SPACING_OF_TIMES))
    jumps = partial(_scaled_jumps, elapsed[:, None], orders, deforms)
    wide = int(np.ceil(np.log1p(DECAYED * 2.0**halvings) / PIECE_WIDTH))
    decayed = float(np.expm1(PIECE_WIDTH * wide))
    last = np.log1p(decayed / _SHORT_NODES[0])
    candidates = -np.expm1(np.arange(_SPACING_OF_RATES, last, _SPACING_OF_RATES))
    responses = jumps(candidates)
    sizes = np.max(np.abs(responses), axis=1, keepdims=True)
    columns = responses / sizes
    triangle, order = qr(columns, mode="r", pivoting=True)
    left = np.abs(np.diagonal(triangle))
    chosen = order[: np.count_nonzero(left > _LEAST_LEFT * left[0])]
    basis, triangle = np.linalg.qr(columns[:, chosen])
    basis /= sizes

    def shares(scaled: Array) -> Array:
        """Return shares of the chosen modes in tabulated rows, by -T r, (n_modes, n)."""
        of_modes = np.linalg.solve(triangle, basis.T @ jumps(-scaled))
        return of_modes / (_scale_of_modes(-scaled, deforms) * _divisor(scaled, decayed, deforms))

    pieces = [
        in_short_pieces(shares(np.expm1(PIECE_WIDTH * (piece + WIDE_NODES))), _SHORTER_OF_ROWS)
        for piece in range(wide)
    ]
    beyond = shares(decayed / _SHORT_NODES) @ _TO_CHEBYSHEV @ _TO_POWERS
    return candidates[chosen], decayed, np.concatenate([*pieces, beyond[:, None]], axis=1)


def _scaled_jumps(elapsed: Array, orders: int, deforms: bool, rates: Array) -> Array:
    """Return scaled responses to jumps of all orders after all times, (n_jumps, n_rates)."""
    responses = respond(range(orders), rates, elapsed, deforms=deforms)
    return np.concatenate([of_order[0] for of_order in responses]) * _scale_of_modes(rates, deforms)


def _scale_of_modes(rates: Array, deforms: bool) -> Array:
    """Return factors with which responses of modes are as large for all rates over T."""
    return 1 - rates if deforms else 1 - 1 / rates


def _divisor(scaled: Array, decayed: float, deforms: bool) -> Array:
    """Return the divisor of a mode's rows by -T r."""
    return 1 / (1 + scaled) if deforms else np.minimum(scaled, decayed)


def _powers(place: Array) -> Array:
    """Return powers, of shape (..., degree + 1)."""
    powers = np.ones((*place.shape, len(ORDERS)))
    for order in ORDERS[1:]:
        np.multiply(powers[..., order - 1], place, out=powers[..., order])
    return powers


@dataclass(frozen=True, eq=False)
class Condensed:
    """Condensed rows that replace the readings of any trace of a protocol in least squares."""

    course: Course
    """The protocol."""
    all_s: Array
    """Ascending sampling times, (n_samples,)."""
    functions: Array
    """Functions projected out, (n_functions, n_samples), but by whitening (`with_uncertain`)."""
    whitening: Whitens | None = None
    """Transformation that whitens noise and projects nuisance out; None for white noise."""

    @property
    def nuisance(self) -> Array:
        """Functions that are projected out, (n_functions, n_samples)."""
        return self.functions if self.whitening is None else self.whitening.nuisance

    @property
    def taken(self) -> Array:
        """Those of free amplitude, (n_taken, n_samples): what they reach is gone.

        Others, of random amplitude, are shorter, and leave noise as large as elsewhere.
        """
        norms = np.sum(np.square(self.nuisance), axis=1)
        return self.nuisance[norms > 1 - _ROUNDING_OF_NORM]

    def cleared(self, rows: Array) -> Array:
        """Project nuisance out of functions of time, (..., n_samples), and whiten noise."""
        if self.whitening is not None:
            return self.whitening(rows)
        return without(self.nuisance, rows)

    def of_trace(self, readings: Array) -> Array:
        """Return rows of a trace without nuisance, (n_rows,); no response reaches the last."""
        if self._in_parts:
            triangle = self._triangle(readings)
            # The rest of it is what modes need.
            self.__dict__.setdefault("_factors", (np.empty(0), triangle[:, :-1]))
            return np.array(triangle[:, -1])
        (orthonormal, _), (projected, rest) = self._factors, self._dense.rows_of_samples(readings)
        rows = projected @ orthonormal
        return np.append(rows, np.hypot(np.linalg.norm(projected - orthonormal @ rows), rest))

    @cached_property
    def of_modes(self) -> ModeRows:
        """Function from modes of many samples to rows of their responses."""
        (_, triangle), first = self._factors, len(self.functions)
        return ModeRows(self._modes, without(triangle[:, :first].T, triangle[:, first:].T))

    @cached_property
    def _dense(self) -> DenseSamples:
        """Nodes that replace the readings."""
        # Whitened functions are not smooth, nor are those of a load that was smoothed: each reading
        # is a node then.
        dense = DenseSamples(self.course, self.all_s, dense=self.whitening is None)
        if all(dense.rows_of_samples(of)[1] < _ROUNDING_OF_NORM for of in self.functions):
            return dense
        return DenseSamples(self.course, self.all_s, dense=False)

    @cached_property
    def _modes(self) -> SpanningModes:
        """The modes that stand for all."""
        starts, nodes_s = np.append(-np.inf, self.course.changes_s), self._dense.time_s
        elapsed, end_s = nodes_s - starts[starts.searchsorted(nodes_s) - 1], float(self.all_s[-1])
        orders = 1 + int(np.max(np.flatnonzero(np.any(self.course.changes, axis=0))))
        shortest_s = float(np.min(elapsed, initial=end_s))
        return SpanningModes(end_s, shortest_s, orders, deforms=self.course.deforms)

    @property
    def _in_parts(self) -> bool:
        """True if there are too many nodes to keep functions of them."""
        return self.whitening is None and len(self._dense.time_s) > _MOST_NODES_KEPT

    @cached_property
    def _factors(self) -> tuple[Array, Array]:
        """Q and R of functions and responses of the modes in columns; of too many nodes no Q."""
        if self._in_parts:
            return np.empty(0), self._triangle(np.zeros_like(self.all_s))[:, :-1]
        dense, modes = self._dense, self._modes
        given = modes.rates[None], self.course, dense.time_s
        responses = modes.scale[:, None] * mode_responses(*given)[0]
        responses = dense.rows_of_values(responses)
        if self.whitening is not None:
            responses = self.whitening(responses)
        others = [dense.rows_of_samples(function)[0] for function in self.functions]
        orthonormal, triangle = np.linalg.qr(np.vstack((*others, responses)).T)
        return orthonormal, np.pad(triangle, ((0, 1), (0, 0)))

    def _triangle(self, readings: Array) -> Array:
        """Return R of functions, modes and readings in columns, part by part, (n_rows, n_rows)."""
        rates, scale = self._modes.rates[None], self._modes.scale[:, None]
        triangle = np.zeros((len(self.functions) + len(scale) + 1,) * 2)
        before = slice(int(self.all_s.searchsorted(self.course.time_s[0], side="right")))
        later = responses_in_turn(rates, self.course, self.all_s, slopes=False)
        for here, responses in chain([(before, np.zeros((1, 1, len(scale), before.stop)))], later):
            more = np.vstack((self.functions[:, here], scale * responses[0, 0], readings[here])).T
            triangle = np.asarray(np.linalg.qr(np.concatenate((triangle, more)), mode="r"))
            triangle *= np.where(np.diagonal(triangle) < 0, -1.0, 1.0)[:, None]
        return triangle


class SweptRows(Condensed):
    """Rows that are the readings themselves: a sweep has few."""

    def of_trace(self, readings: Array) -> Array:
        """Return readings without nuisance as they are, (n_samples,)."""
        return readings

    def of_modes(self, modes: Modes) -> Array:  # type: ignore[override]
        """Return rows of samples, (n, 1 + n_parameters, n_samples)."""
        return self.cleared(sum_of_modes(modes, self.course, self.all_s))
