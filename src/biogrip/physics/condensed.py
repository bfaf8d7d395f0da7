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

References
----------
.. [1] L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM, 2013, chapter 8.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, pairwise
from typing import Protocol

import numpy as np
from numpy.polynomial import chebyshev, legendre

from biogrip.arrays import Array
from biogrip.physics.modes import mode_responses, responses_in_turn
from biogrip.physics.noise import without
from biogrip.physics.protocol import Course
from biogrip.physics.rate_tables import ModeRows, SpanningModes
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
