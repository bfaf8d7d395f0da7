"""Condensed least squares: a few rows with the sum of squares of all readings.

First, nodes replace dense readings in sums of products of smooth functions (`DenseSamples`). After
a change of the load, modes of all rates respond; later, only slow ones remain. On a piece of time
twice as far from the last change at its end as at its start, a response is a polynomial of degree
19 to 1e-15 of its peak, whatever the rate: with e^(-rho (3 + s)), |s| <= 1, Chebyshev coefficients
fall like 5.8^-n [1]_. Earlier changes are further away. So a piece with thousands of readings needs
twenty nodes, and sums of products over its readings follow from one small matrix, which is summed
up block by block. If readings are few, they are the nodes.

Second, a few times replace the nodes (`Condensed`). The linear response of any sample is a weighted
sum of the responses of modes to the protocol, g(t; r). Over all rates r these nearly span a space
of some fifty dimensions only, in which a function is determined by its values at as many
well-chosen times [2]_, [3]_. So a response is simulated at those times, and a square matrix turns
its values into rows with the sum of squares, and the gradients, of the residuals at all readings.

A course that changes at nearly every reading, as one that was recorded, leaves no nodes to save.
There a few modes stand for all (`CondensedRecord`): whatever the course, the response of any mode
is a sum of those of some seventy chosen ones (`SpanningModes`). These are computed at all readings,
in parts, and one triangular matrix has all their products.

References
----------
.. [1] L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM, 2013, chapter 8:
   how fast Chebyshev's coefficients of analytic functions fall.
.. [2] P. Businger and G. H. Golub, Linear least squares solutions by Householder
   transformations, Numerische Mathematik 7 (1965), 269-276: QR with column pivoting.
.. [3] Z. Drmač and S. Gugercin, A new selection operator for the discrete empirical
   interpolation method, SIAM Journal on Scientific Computing 38 (2016), A631-A648: points of
   interpolation chosen by it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev, legendre

from biogrip.arrays import Array, IntArray
from biogrip.physics.modes import mode_responses, responses_in_turn
from biogrip.physics.protocol import Course
from biogrip.physics.rate_tables import ModeRows, SpanningModes
from biogrip.physics.whitening import Whitening, without

_NODES = 20
_DEGREE = _NODES - 1
_PLACES = chebyshev.chebpts1(_NODES)
# From values at the nodes to coefficients of Legendre polynomials, which are nearly orthogonal
# over readings that are dense all over a piece.
_TO_SERIES = np.linalg.inv(legendre.legvander(_PLACES, _DEGREE))
# Fewer readings are their own nodes; so are those whose matrix is worse conditioned.
_FEWEST_READINGS, _LARGEST_CONDITION = 256, 100.0
# Readings whose polynomials are formed at once.
_READINGS_AT_ONCE = 16_384
# Most readings whose polynomials are kept for the next trace.
_MOST_READINGS_KEPT = 100_000

# Spacing of rates in log(1 - T r), T the last time: far closer than modes can be resolved.
_SPACING_OF_RATES = 0.25
# Slowest rate times T, and fastest rate times the shortest sampling interval.
_SLOWEST_RATE, _FASTEST_RATE = 1e-6, 1e3
# Directions with a smaller relative singular value are rounding errors.
_LEAST_SINGULAR_VALUE = 1e-14
# Changes of a course from which on nearly all readings would be nodes.
_MANY_CHANGES = 100


@dataclass(frozen=True)
class _Piece:
    """Readings from `first` up to `stop`, and their nodes."""

    first: int
    stop: int
    nodes_s: Array
    """Times of the nodes, (n_nodes,)."""
    triangle: Array | None = None
    """R^T of Legendre polynomials Q R at the readings, Q orthonormal; None if these are nodes."""


class DenseSamples:
    """Rows with the products of all readings, for any smooth functions of time.

    Functions are smooth between changes of the load. Sampling times, (n_samples,), ascend. Only
    if `dense` may nodes replace readings; otherwise each reading is a node.
    """

    def __init__(self, course: Course, time_s: Array, *, dense: bool = True) -> None:
        self._all_s = time_s
        self._kept: dict[tuple[int, int], list[tuple[slice, Array]]] = {}
        starts = course.changes_s
        self._starts_s = np.append(-np.inf, starts)
        bounds = np.unique(np.concatenate(([0], time_s.searchsorted(starts), [len(time_s)])))
        self._pieces = [_Piece(0, len(time_s), time_s)]
        if dense:
            self._pieces = [piece for ends in pairwise(bounds) for piece in self._divided(*ends)]
        self.time_s = np.concatenate([piece.nodes_s for piece in self._pieces])
        """Times of the nodes, (n_nodes,), ascending."""

    def rows_of_values(self, values: Array) -> Array:
        """Return rows with the products of the readings, from node values, (..., n_nodes)."""
        return self._turned(values, lambda own, triangle: own @ (_TO_SERIES.T @ triangle))

    def values_of_rows(self, rows: Array) -> Array:
        """Return values at the nodes from rows: the inverse of `rows_of_values`."""
        to_nodes = legendre.legvander(_PLACES, _DEGREE).T
        return self._turned(
            rows, lambda own, triangle: np.linalg.solve(triangle.T, own.T).T @ to_nodes
        )

    def _turned(self, values: Array, turn: Callable[[Array, Array], Array]) -> Array:
        """Apply a function of node values and triangle to each piece that has a triangle."""
        turned, start = np.copy(values), 0
        for piece in self._pieces:
            here = slice(start, start + len(piece.nodes_s))
            start = here.stop
            if piece.triangle is not None:
                turned[..., here] = turn(values[..., here], piece.triangle)
        return turned

    def rows_of_samples(self, samples: Array) -> tuple[Array, float]:
        """Project readings, (n_samples,), smooth or not, on smooth functions.

        Returns
        -------
        rows : (n_nodes,)
            Rows with the same products with smooth functions.
        rest
            Norm of the part orthogonal to all smooth functions.
        """
        parts: list[Array] = []
        rest = 0.0
        for piece in self._pieces:
            own = samples[piece.first : piece.stop]
            if piece.triangle is None:
                parts.append(own)
                continue
            products = np.zeros(_NODES)
            for block, series in self._blocks(piece.first, piece.stop):
                products += samples[block] @ series
            part = np.asarray(np.linalg.solve(piece.triangle, products), np.float64)
            smooth = np.linalg.solve(piece.triangle.T, part)
            for block, series in self._blocks(piece.first, piece.stop):
                rest += float(np.sum((samples[block] - series @ smooth) ** 2))
            parts.append(part)
        return np.concatenate(parts), float(np.sqrt(rest))

    def _divided(self, first: int, stop: int) -> Iterator[_Piece]:
        """Halve pieces that are not smooth, or not dense all over, down to few readings."""
        if stop - first < _FEWEST_READINGS:
            yield _Piece(first, stop, self._all_s[first:stop])
            return
        start, end = self._all_s[first], self._all_s[stop - 1]
        elapsed = start - self._starts_s[self._starts_s.searchsorted(start, side="right") - 1]
        if end - start <= elapsed:
            gram = np.zeros((_NODES, _NODES))
            for _, series in self._blocks(first, stop):
                gram += series.T @ series
            size = np.sqrt(np.diagonal(gram))
            shares = np.linalg.eigvalsh(gram / (size[:, None] * size))
            if shares[-1] <= _LARGEST_CONDITION * shares[0]:
                nodes_s = 0.5 * (start + end) + 0.5 * (end - start) * _PLACES
                yield _Piece(first, stop, nodes_s, np.asarray(np.linalg.cholesky(gram), float))
                return
        half = first + int(np.searchsorted(self._all_s[first:stop], 0.5 * (start + end)))
        yield from self._divided(first, half)
        yield from self._divided(half, stop)

    def _blocks(self, first: int, stop: int) -> Iterator[tuple[slice, Array]]:
        """Yield Legendre polynomials at a piece's readings, (n_samples, n_nodes), by blocks."""
        if len(self._all_s) > _MOST_READINGS_KEPT:
            return self._formed(first, stop)
        if (first, stop) not in self._kept:
            self._kept[first, stop] = list(self._formed(first, stop))
        return iter(self._kept[first, stop])

    def _formed(self, first: int, stop: int) -> Iterator[tuple[slice, Array]]:
        start, end = self._all_s[first], self._all_s[stop - 1]
        for here in range(first, stop, _READINGS_AT_ONCE):
            block = slice(here, min(here + _READINGS_AT_ONCE, stop))
            place = (2 * self._all_s[block] - start - end) / (end - start)
            yield block, legendre.legvander(place, _DEGREE)


@dataclass(frozen=True, eq=False)
class Condensed:
    """Condensed rows that replace the readings of any trace of a protocol in least squares."""

    course: Course
    """The protocol."""
    all_s: Array
    """Ascending sampling times, (n_samples,)."""
    functions: Array
    """Functions projected out of trace and responses, (n_functions, n_samples), if noise is white;
    see `nuisance_basis`, `with_uncertain`."""
    whitening: Whitening | None = None
    """Transformation that whitens noise and projects nuisance out; None for white noise."""

    @property
    def nuisance(self) -> Array:
        """Functions that are projected out, (n_functions, n_samples)."""
        return self.functions if self.whitening is None else self.whitening.nuisance

    def later(self, change_s: float) -> "Condensed":
        """Return rows for a protocol that starts later by some s; noise and nuisance stay."""
        return replace(self, all_s=self.course.snapped(self.all_s - change_s))

    def cleared(self, rows: Array) -> Array:
        """Project nuisance out of functions of time, (..., n_samples), and whiten noise."""
        if self.whitening is not None:
            return self.whitening(rows)
        return without(self.nuisance, rows)

    @property
    def coloured(self) -> bool:
        """True if the noise is whitened."""
        return self.whitening is not None

    def of_trace(self, readings: Array) -> Array:
        """Return rows of a trace without nuisance, (n_rows,); no response reaches the last."""
        projected, rest = self.dense.rows_of_samples(readings)
        rows = projected @ self._basis
        return np.append(rows, np.hypot(np.linalg.norm(projected - self._basis @ rows), rest))

    @cached_property
    def time_s(self) -> Array:
        """Times at which responses are simulated, (n_times,)."""
        return self.dense.time_s[self._chosen]

    def rows_of_nodes(self, values: Array) -> Array:
        """Return rows of responses without nuisance, from values at the nodes, (..., n_nodes)."""
        return self._cleared_rows(self.dense.rows_of_values(values))

    @cached_property
    def to_rows(self) -> Array:
        """Matrix that turns values at `time_s`, from its left, into rows, (n_times, n_rows)."""
        values = self.dense.values_of_rows(self._span.T)
        matrix = np.linalg.solve(
            values[:, self._chosen], self._cleared_rows(self._span.T) @ self._basis
        )
        return np.pad(matrix, ((0, 0), (0, 1)))

    @cached_property
    def of_modes(self) -> ModeRows:
        """Function from modes of many samples to rows of their responses."""

        def rows(rates: Array, divisors: Array) -> Array:
            found, _ = mode_responses(rates[None], self.course, self.time_s, slopes=False)
            return (found[0] / divisors[:, None]) @ self.to_rows

        shortest_s = _shortest_after(self.course, self.time_s)
        return ModeRows(rows, float(self.time_s[-1]), shortest_s, deforms=self.course.deforms)

    @cached_property
    def dense(self) -> DenseSamples:
        """Nodes that replace the readings."""
        # Whitened functions are not smooth: each reading is a node.
        dense = self.whitening is None
        return DenseSamples(self.course, self.all_s, dense=dense)

    @cached_property
    def _nuisance_rows(self) -> Array:
        """The nuisance as rows of the nodes, (n_functions, n_nodes)."""
        rows = [self.dense.rows_of_samples(function)[0] for function in self.nuisance]
        return np.reshape(rows, (len(rows), len(self.dense.time_s)))

    @cached_property
    def _span(self) -> Array:
        """Orthonormal rows of the nodes that span all responses, (n_nodes, n_rows)."""
        end_s, time_s = self.all_s[-1], self.dense.time_s
        shortest_s = np.diff(self.all_s).min()
        last = np.log1p(_FASTEST_RATE * end_s / shortest_s)
        rates = (
            -np.expm1(
                np.append(_SLOWEST_RATE, np.arange(_SPACING_OF_RATES, last, _SPACING_OF_RATES))
            )
            / end_s
        )
        growth, slope = (
            self.dense.rows_of_values(of[0])
            for of in mode_responses(rates[None], self.course, time_s)
        )
        size = np.linalg.norm(growth, axis=1, keepdims=True)
        size[size == 0] = 1.0
        family = np.concatenate((growth / size, rates[:, None] * slope / size))
        basis, triangle = np.linalg.qr(family.reshape(-1, len(time_s)).T)
        turned, share, _ = np.linalg.svd(triangle)
        return basis @ turned[:, share > _LEAST_SINGULAR_VALUE * share[0]]

    @cached_property
    def _chosen(self) -> IntArray:
        """Indices of the best interpolation nodes of the span, by QR with column pivoting."""
        # Imported here: the genetic algorithm does not need it, and loading takes long.
        from scipy.linalg import qr

        span = self.dense.values_of_rows(self._span.T)
        _, order = qr(span, mode="r", pivoting=True)
        return np.sort(order[: span.shape[0]])

    @cached_property
    def _basis(self) -> Array:
        """Orthonormal rows that span all responses without nuisance, (n_nodes, n_rows - 1)."""
        return np.linalg.qr(self._cleared_rows(self._span.T).T)[0]

    def _cleared_rows(self, rows: Array) -> Array:
        """Project out nuisance and whiten as `cleared` does, with rows of the nodes."""
        if self.whitening is not None:
            return self.whitening(rows)
        return without(self._nuisance_rows, rows)


class CondensedRecord(Condensed):
    """Condensed rows for a course that changes at nearly every reading."""

    def of_trace(self, readings: Array) -> Array:
        """Return rows of a trace without nuisance, (n_rows,); no response reaches the last."""
        rows: Array = self._triangle(readings)[:, -1]
        return rows

    @cached_property
    def of_modes(self) -> ModeRows:
        """Function from modes of many samples to rows of their responses."""
        triangle, first = self._triangle(np.zeros_like(self.all_s)), len(self._projected)
        spanned = without(triangle[:, :first].T, triangle[:, first:-1].T)
        family = self._family

        def rows(rates: Array, divisors: Array) -> Array:
            shares = family.shares(rates) / (family.scale(rates) * divisors)
            return shares.T @ spanned

        deforms = self.course.deforms
        return ModeRows(rows, family.end_s, family.shortest_s, deforms=deforms)

    @cached_property
    def _family(self) -> SpanningModes:
        """The modes that stand for all."""
        shortest_s = _shortest_after(self.course, self.all_s)
        return SpanningModes(float(self.all_s[-1]), shortest_s, deforms=self.course.deforms)

    @property
    def _projected(self) -> Array:
        """Functions that whitening does not project out, (n_functions, n_samples)."""
        return self.functions if self.whitening is None else self.functions[:0]

    def _triangle(self, readings: Array) -> Array:
        """Return R of functions, modes and readings in a column each, (n_rows, n_rows).

        Products of its columns are those of functions, of responses of the modes, and of readings.
        """
        columns = len(self._projected) + len(self._family.rates) + 1
        triangle = np.zeros((columns, columns))
        for here, responses in self._responses():
            more = np.vstack((self._projected[:, here], responses, readings[here])).T
            found = np.asarray(np.linalg.qr(np.concatenate((triangle, more)), mode="r"))
            triangle = np.where(np.diagonal(found) < 0, -1.0, 1.0)[:, None] * found
        return triangle

    def _responses(self) -> Iterator[tuple[slice, Array]]:
        """Yield parts of the readings and of the responses of the modes, (n_modes, n_samples)."""
        rates, scale = self._family.rates[None], self._family.scale(self._family.rates)[:, None]
        if self.whitening is not None:
            responses, _ = mode_responses(rates, self.course, self.all_s, slopes=False)
            yield slice(None), self.whitening(scale * responses[0])
            return
        before = int(self.all_s.searchsorted(self.course.time_s[0], side="right"))
        yield slice(before), np.zeros((len(scale), before))
        for here, found in responses_in_turn(rates, self.course, self.all_s, slopes=False):
            yield here, scale * found[0, 0]


def condense(
    course: Course, time_s: Array, functions: Array, whitening: Whitening | None = None
) -> Condensed:
    """Return condensed rows for the readings of a protocol, see `Condensed` for the arguments."""
    kind = CondensedRecord if len(course.changes_s) > _MANY_CHANGES else Condensed
    return kind(course, course.snapped(time_s), functions, whitening)


def _shortest_after(course: Course, time_s: Array) -> float:
    """Return the shortest time of a reading after a change, for ascending times, (n_times,)."""
    starts = np.append(-np.inf, course.changes_s)
    elapsed = time_s - starts[starts.searchsorted(time_s) - 1]
    return float(np.min(elapsed, initial=time_s[-1]))
