"""Condensed least squares: a few rows with the sum of squares of all readings.

The linear rotation of any sample is a weighted sum of the responses of modes to the
protocol, g(t; r). Over all rates r these nearly span a space of some fifty dimensions
only, in which a function is determined by its values at as many well-chosen times. So
a response is simulated at those times, and a square matrix turns its values into rows
with the sum of squares, and the gradients, of the residuals at all readings. Dense
readings are first replaced by nodes (`biogrip.response.dense_samples`). If nodes are too
many, every node has a row of its own.

References
----------
.. [1] P. Businger and G. H. Golub, Linear least squares solutions by Householder
   transformations, Numerische Mathematik 7 (1965), 269-276: QR with column pivoting.
.. [2] Z. Drmač and S. Gugercin, A new selection operator for the discrete empirical
   interpolation method, SIAM Journal on Scientific Computing 38 (2016), A631-A648: points of
   interpolation chosen by it.
"""

from functools import cached_property

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.experiment.protocol import TorqueHistory
from biogrip.response.dense_samples import DenseSamples
from biogrip.response.mode_growth import compute_growth
from biogrip.response.mode_rows import ModeRows
from biogrip.response.nonlinear import COARSE, STAGES, mesh, mesh_functions
from biogrip.response.nuisance import without
from biogrip.response.whitening import Whitening

MOST_NODES = 50_000
"""Most nodes that are condensed further: with more, it would take gigabytes."""

# Spacing of rates in log(1 - T r), T the last time: far closer than modes can be resolved.
_SPACING = 0.25
# Slowest rate times T, and fastest rate times the shortest sampling interval.
_SLOWEST, _FASTEST = 1e-6, 1e3
# Most values of a correction: a mesh that follows a sinusoid of the torque may have thousands.
_MOST_FUNCTIONS = 1000
# Directions with a smaller relative singular value are rounding errors.
_RANK = 1e-14


class Condensed:
    """Condensed rows that replace the readings of any trace of a protocol in least squares.

    Parameters
    ----------
    torque
        The protocol.
    time_s : (n_samples,)
        Ascending sampling times.
    nuisance : (n_functions, n_samples)
        Functions projected out of trace and responses, see `nuisance_basis`, `with_uncertain`.
    nonlinear
        True if rows must also represent corrections by the nonlinear model.
    whitening
        Transformation that whitens noise and projects nuisance out; None for white noise.
    """

    def __init__(
        self,
        torque: TorqueHistory,
        time_s: Array,
        nuisance: Array,
        *,
        nonlinear: bool = False,
        whitening: Whitening | None = None,
    ) -> None:
        self.nuisance = nuisance if whitening is None else whitening.nuisance
        self.nonlinear = nonlinear
        self._whitening = whitening
        self._torque = torque
        self._all_s = time_s

    def later(self, change_s: float) -> "Condensed":
        """Return rows for a protocol that starts later by some s; noise and nuisance stay."""
        return Condensed(
            self._torque,
            self._all_s - change_s,
            self.nuisance,
            nonlinear=self.nonlinear,
            whitening=self._whitening,
        )

    def cleared(self, rows: Array) -> Array:
        """Project nuisance out of functions of time, (..., n_samples), and whiten noise."""
        if self._whitening is not None:
            return self._whitening(rows)
        return without(self.nuisance, rows)

    @property
    def coloured(self) -> bool:
        """True if the noise is whitened."""
        return self._whitening is not None

    @cached_property
    def reduced(self) -> bool:
        """True if rows are fewer than nodes."""
        functions = len(self._edges_s) * (STAGES + 1)
        return len(self.dense.time_s) <= MOST_NODES and functions <= _MOST_FUNCTIONS

    def of_trace(self, rotation_rad: Array) -> Array:
        """Return rows of a trace without nuisance, (n_rows,); no response reaches the last."""
        projected, rest = self.dense.rows_of_samples(rotation_rad)
        if not self.reduced:
            return np.append(projected, rest)
        rows = projected @ self._basis
        return np.append(rows, np.hypot(np.linalg.norm(projected - self._basis @ rows), rest))

    @cached_property
    def time_s(self) -> Array:
        """Times at which responses are simulated, (n_times,)."""
        return self.dense.time_s[self._chosen] if self.reduced else self.dense.time_s

    def rows_of_nodes(self, values: Array) -> Array:
        """Return rows of responses without nuisance, from values at the nodes, (..., n_nodes)."""
        return self._cleared_rows(self.dense.rows_of_values(values))

    def rows(self, values: Array) -> Array:
        """Return rows of responses, (..., n_rows), from values at `time_s`, (..., n_times)."""
        if self.reduced:
            return values @ self.to_rows
        rows = self.rows_of_nodes(values)
        return np.pad(rows, ((0, 0),) * (rows.ndim - 1) + ((0, 1),))

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
        events_s = [start for start, *_ in (*self._torque.jumps, *self._torque.swings)]
        elapsed = np.subtract.outer(self.time_s, events_s)
        shortest_s = float(np.min(elapsed, where=elapsed > 0, initial=self.time_s[-1]))
        return ModeRows(self._torque, self.time_s, self.to_rows, shortest_s)

    @cached_property
    def dense(self) -> DenseSamples:
        """Nodes that replace the readings."""
        # Whitened functions are not smooth: each reading is a node.
        dense = self._whitening is None
        return DenseSamples(self._torque, self._all_s, self._edges_s, dense=dense)

    @cached_property
    def _edges_s(self) -> Array:
        """Edges of the mesh of a correction, if there is one."""
        return mesh(self._torque, COARSE) if self.nonlinear else np.zeros(0)

    @cached_property
    def _corrections(self) -> Array:
        """Rows of the nodes of a basis of corrections, (n_functions, n_nodes)."""
        if not self.nonlinear:
            return np.zeros((0, len(self.dense.time_s)))
        functions = mesh_functions(self._edges_s, self.dense.time_s)
        return self.dense.rows_of_values(functions)

    @cached_property
    def of_corrections(self) -> Array:
        """Matrix that turns values of a `Correction`, from its left, into rows."""
        rows = self._cleared_rows(self._corrections) @ self._basis
        return np.pad(rows, ((0, 0), (0, 1)))

    @cached_property
    def _nuisance_rows(self) -> Array:
        """The nuisance as rows of the nodes, (n_functions, n_nodes)."""
        rows = [self.dense.rows_of_samples(function)[0] for function in self.nuisance]
        return np.reshape(rows, (len(rows), len(self.dense.time_s)))

    @cached_property
    def _span(self) -> Array:
        """Orthonormal rows of the nodes that span all responses, (n_nodes, n_rows)."""
        end_s, time_s = self._all_s[-1], self.dense.time_s
        shortest_s = np.diff(self._all_s).min()
        last = np.log1p(_FASTEST * end_s / shortest_s)
        rates = -np.expm1(np.append(_SLOWEST, np.arange(_SPACING, last, _SPACING))) / end_s
        growth, slope = (
            self.dense.rows_of_values(of[0])
            for of in compute_growth(rates[None], self._torque, time_s)
        )
        size = np.linalg.norm(growth, axis=2, keepdims=True)
        size[size == 0] = 1.0
        family = np.concatenate((growth / size, rates[:, None] * slope / size))
        weights = np.linalg.norm(self._corrections, axis=1)
        projected = self._corrections[weights > 0] / weights[weights > 0, None]
        family = np.concatenate((family.reshape(-1, len(time_s)), projected))
        basis, triangle = np.linalg.qr(family.T)
        turned, share, _ = np.linalg.svd(triangle)
        return basis @ turned[:, share > _RANK * share[0]]

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
        if self._whitening is not None:
            return self._whitening(rows)
        return without(self._nuisance_rows, rows)
