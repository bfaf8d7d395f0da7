"""Nodes that replace dense readings in sums of products of smooth functions.

After a change of torque, modes of all rates respond; later, only slow ones remain. On a
piece of time twice as far from the last change at its end as at its start, a response
is a polynomial of degree 19 to 1e-15 of its peak, whatever the rate: with
e^(-rho (3 + s)), |s| <= 1, Chebyshev coefficients fall like 5.8^-n. Earlier changes are
further away, and a sinusoid of the torque is a polynomial as well on a piece of a
period. So a piece with thousands of readings needs twenty nodes, and sums of products
over its readings follow from one small matrix, which is summed up block by block. If
readings are few, they are the nodes.

References
----------
.. [1] L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM, 2013, chapter 8:
   how fast Chebyshev's coefficients of analytic functions fall.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev, legendre

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory

_NODES = 20
_DEGREE = _NODES - 1
_PLACES = chebyshev.chebpts1(_NODES)
# From values at the nodes to coefficients of Legendre polynomials, which are nearly orthogonal
# over readings that are dense all over a piece.
_TO_SERIES = np.linalg.inv(legendre.legvander(_PLACES, _DEGREE))
# Fewer readings are their own nodes; so are those whose matrix is worse conditioned.
_FEWEST, _LARGEST_CONDITION = 256, 100.0
# Readings whose polynomials are formed at once.
_AT_ONCE = 16_384
# Most readings whose polynomials are kept for the next trace.
_MOST_KEPT = 100_000


@dataclass(frozen=True)
class _Piece:
    """Readings from `first` up to `stop`, and the matrix that relates them to their nodes.

    With Legendre polynomials at the readings Q R, Q orthonormal, the triangle is R^T; it is
    None where readings are nodes.
    """

    first: int
    stop: int
    triangle: Array | None


class DenseSamples:
    """Rows with the products of all readings, for any smooth functions of time.

    Functions are smooth between changes of the torque, and may be less so at further edges,
    (n_edges,). Sampling times, (n_samples,), ascend. Only if `dense` may nodes replace readings;
    otherwise each reading is a node.
    """

    def __init__(
        self,
        torque: TorqueHistory,
        time_s: Array,
        further_edges_s: Array | None = None,
        *,
        dense: bool = True,
    ) -> None:
        self._all_s = time_s
        self._kept: dict[tuple[int, int], list[tuple[slice, Array]]] = {}
        starts = [start for start, *_ in (*torque.jumps, *torque.swings)]
        self._starts_s = np.unique([-np.inf, *starts])
        omega = torque.omega_rad_per_s
        self._longest_s = 2 * np.pi / omega.max() if len(omega) else np.inf
        edges = starts if further_edges_s is None else [*starts, *further_edges_s]
        bounds = np.unique(np.concatenate(([0], time_s.searchsorted(edges), [len(time_s)])))
        divided = (p for ends in pairwise(bounds) for p in self._divided(*ends))
        self._pieces = _joined(divided) if dense else [_Piece(0, len(time_s), None)]
        self.time_s = np.concatenate([self._nodes(piece) for piece in self._pieces])
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
            here = slice(start, start + self._count(piece))
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
        if stop - first < _FEWEST:
            yield _Piece(first, stop, None)
            return
        start, end = self._all_s[first], self._all_s[stop - 1]
        elapsed = start - self._starts_s[self._starts_s.searchsorted(start, side="right") - 1]
        if end - start <= min(elapsed, self._longest_s):
            gram = np.zeros((_NODES, _NODES))
            for _, series in self._blocks(first, stop):
                gram += series.T @ series
            size = np.sqrt(np.diagonal(gram))
            shares = np.linalg.eigvalsh(gram / (size[:, None] * size))
            if shares[-1] <= _LARGEST_CONDITION * shares[0]:
                triangle = np.asarray(np.linalg.cholesky(gram), np.float64)
                yield _Piece(first, stop, triangle)
                return
        half = first + int(np.searchsorted(self._all_s[first:stop], 0.5 * (start + end)))
        yield from self._divided(first, half)
        yield from self._divided(half, stop)

    def _blocks(self, first: int, stop: int) -> Iterator[tuple[slice, Array]]:
        """Yield Legendre polynomials at a piece's readings, (n_samples, n_nodes), by blocks."""
        if len(self._all_s) > _MOST_KEPT:
            return self._formed(first, stop)
        if (first, stop) not in self._kept:
            self._kept[first, stop] = list(self._formed(first, stop))
        return iter(self._kept[first, stop])

    def _formed(self, first: int, stop: int) -> Iterator[tuple[slice, Array]]:
        start, end = self._all_s[first], self._all_s[stop - 1]
        for here in range(first, stop, _AT_ONCE):
            block = slice(here, min(here + _AT_ONCE, stop))
            place = (2 * self._all_s[block] - start - end) / (end - start)
            yield block, legendre.legvander(place, _DEGREE)

    def _nodes(self, piece: _Piece) -> Array:
        if piece.triangle is None:
            return self._all_s[piece.first : piece.stop]
        start, end = self._all_s[piece.first], self._all_s[piece.stop - 1]
        return 0.5 * (start + end) + 0.5 * (end - start) * _PLACES

    @staticmethod
    def _count(piece: _Piece) -> int:
        return piece.stop - piece.first if piece.triangle is None else _NODES


def _joined(pieces: Iterator[_Piece]) -> list[_Piece]:
    """Join neighbouring pieces whose readings are nodes."""
    joined: list[_Piece] = []
    for piece in pieces:
        if joined and joined[-1].triangle is None and piece.triangle is None:
            joined[-1] = _Piece(joined[-1].first, piece.stop, None)
        else:
            joined.append(piece)
    return joined
