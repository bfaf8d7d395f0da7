"""RMS misfit of a whole population against one trace, without forming a response.

Between two torque steps the inertia-free response is a constant plus
exponentials, so at uniform sampling it is a_0 + sum_j a_j z_j^n. Its squared
distance from the samples y_n expands into geometric series in z_i z_j, and
into sums over z_j^n y_n. Those long sums split in two levels, n = B a + b: one
matrix product with the trace folded to (B, N/B), one weighted sum over rows.
"""

from functools import cache

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory
from biogrip.response.linear import LEFT, drives, step_response
from biogrip.sample import SampleModel


class SeriesMisfit:
    """RMS difference between the model's rotation and a uniformly sampled trace.

    Parameters
    ----------
    gripper, model, torque
        What is simulated: the linear model without inertia, under torque steps.
    interval_s
        Sampling interval; the first sample is at t = 0.
    rotation_rad : (n_samples,)
        The measured closing rotation of the left arm.
    """

    def __init__(
        self,
        gripper: Gripper,
        model: SampleModel,
        torque: TorqueHistory,
        interval_s: float,
        rotation_rad: Array,
    ) -> None:
        self._gripper = gripper
        self._model = model
        self._start_s = torque.time_s
        self._symmetric = torque.symmetric
        self._interval_s = interval_s
        self._samples = len(rotation_rad)
        self._heights = drives(torque.left[:, 0], torque.right[:, 0], torque.symmetric)
        # A little slack keeps a sample that falls on a step in the phase it opens.
        starts = np.ceil(torque.time_s / interval_s * (1 - 1e-12)).astype(np.int64)
        self._starts = np.minimum(starts, self._samples)
        self._counts = np.diff(self._starts, append=self._samples).astype(float)
        pieces = np.split(rotation_rad, self._starts[1:])
        self._block = max(1, int(np.sqrt(self._counts.max(initial=1))))
        self._folded, self._columns = _fold(pieces, self._block)
        rows = max(stop - start for start, stop in self._columns)
        self._within = np.arange(self._block, dtype=float)
        self._across = self._block * np.arange(rows, dtype=float)
        self._square_sum = float(sum(np.dot(piece, piece) for piece in pieces))
        self._sums = np.array([piece.sum() for piece in pieces])

    def __call__(self, parameters: Array) -> Array:
        """Misfit in rad of each individual.

        Parameters
        ----------
        parameters : (n_individuals, n_parameters)
            Sample parameters in the model's order, SI units.

        Returns
        -------
        (n_individuals,)
        """
        response = step_response(
            self._gripper,
            self._model.network(parameters),
            symmetric=self._symmetric,
            inertia=False,
        )
        static, weights = response.static[:, LEFT], response.weights[:, LEFT]
        rates = response.rates * self._interval_s
        projections = self._projections(rates)
        # Each pair of modes once; those of two different modes count twice.
        first, second, times = _pairs(rates.shape[1])
        pair_rates = rates[:, first] + rates[:, second]
        square = np.full(len(parameters), self._square_sum)
        for phase, count in enumerate(self._counts):
            if count == 0:
                continue
            constant, amplitudes = self._phase(static, weights, rates, phase)
            square += constant * (count * constant - 2 * self._sums[phase])
            linear = constant[:, None] * _geometric(rates, count) - projections[:, :, phase]
            square += 2 * np.einsum("nj,nj->n", amplitudes, linear)
            products = times * amplitudes[:, first] * amplitudes[:, second]
            square += np.einsum("np,np->n", products, _geometric(pair_rates, count))
        misfit: Array = np.sqrt(np.maximum(square, 0) / self._samples)
        return misfit

    def _phase(
        self, static: Array, weights: Array, rates: Array, phase: int
    ) -> tuple[Array, Array]:
        """Constant and amplitudes of a phase, counted from its first sample."""
        constant = np.zeros(len(static))
        amplitudes = np.zeros_like(rates)
        for step in range(phase + 1):
            height = self._heights[:, step]
            elapsed = self._starts[phase] - self._start_s[step] / self._interval_s
            constant += static @ height
            amplitudes += np.einsum("ndj,d->nj", weights, height) * np.exp(rates * max(elapsed, 0))
        return constant, amplitudes

    def _projections(self, rates: Array) -> Array:
        """sum_n z_j^n y_n of every mode and phase, shape (n, n_modes, n_phases)."""
        flat = rates.reshape(-1, 1)
        within = np.exp(flat * self._within) @ self._folded
        across = np.exp(flat * self._across)
        sums = [
            np.einsum("mr,mr->m", within[:, start:stop], across[:, : stop - start])
            for start, stop in self._columns
        ]
        return np.stack(sums, axis=1).reshape(*rates.shape, len(sums))


def _fold(pieces: list[Array], block: int) -> tuple[Array, list[tuple[int, int]]]:
    """Fold each piece to (block, rows), side by side; also the columns of each piece."""
    folded, columns, start = [], [], 0
    for piece in pieces:
        rows = -(-len(piece) // block)
        padded = np.zeros(block * rows)
        padded[: len(piece)] = piece
        folded.append(padded.reshape(rows, block).T)
        columns.append((start, start + rows))
        start += rows
    return np.ascontiguousarray(np.concatenate(folded, axis=1)), columns


@cache
def _pairs(modes: int) -> tuple[IntArray, IntArray, Array]:
    """Indices of all pairs of modes, i <= j, and how often each counts in a square."""
    first, second = np.triu_indices(modes)
    return first, second, np.where(first == second, 1.0, 2.0)


def _geometric(rates: Array, count: float) -> Array:
    """sum_{n=0}^{count-1} exp(rates n), for negative rates."""
    series: Array = np.expm1(count * rates) / np.expm1(rates)
    return series
