"""RMS misfit of a whole population against one trace, without forming a response.

Between two torque steps the inertia-free response is a constant plus
exponentials, so at uniform sampling it is sum_j a_j z_j^n, the constant a mode
that does not decay. Its squared distance from the samples y_n expands into
geometric series in z_i z_j, and into the projections of the trace on the
response of each mode. Those are long sums, but functions of the mode's rate
alone: computed once at some hundred rates, they are interpolated for all others.
"""

from functools import cache

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory, drives
from biogrip.response.decay_table import DecayTable
from biogrip.response.linear import LEFT, StepResponse, step_response
from biogrip.sample import SampleModel

# Rate of a constant, over the sampling rate: z^n is 1 for any n.
_NO_DECAY = -1e-100


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
        self._symmetric = torque.symmetric
        self._interval_s = interval_s
        self._samples = len(rotation_rad)
        self._heights = drives(torque.left[:, 0], torque.right[:, 0], torque.symmetric)
        # Times in samples; rounding must not keep a sample from the step that it falls on.
        steps, nearest = torque.time_s / interval_s, np.rint(torque.time_s / interval_s)
        steps = np.where(np.isclose(steps, nearest, rtol=1e-12, atol=0), nearest, steps)
        starts = np.minimum(np.ceil(steps), self._samples)
        # Until a phase's first sample: from its step, and from the first sample of the last phase.
        self._late = np.maximum(starts - steps, 0)
        self._gaps = np.diff(starts, prepend=0)
        self._counts = np.diff(starts, append=self._samples)
        self._phases = np.split(rotation_rad, starts[1:].astype(np.int64))
        self._square_sum = float(np.dot(rotation_rad, rotation_rad))
        shortest = float(np.min(self._late, where=self._late > 0, initial=1.0))
        self.projections = DecayTable(self.exact_projections, self._samples, shortest)

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
        rates, weights = self._modes(response)
        square = self._square_sum + self._square_sums(rates, self._amplitudes(rates, weights))
        square -= 2 * np.einsum("djn,djn->n", weights, self.projections(rates))
        misfit: Array = np.sqrt(np.maximum(square, 0) / self._samples)
        return misfit

    def _modes(self, response: StepResponse) -> tuple[Array, Array]:
        """Rates per sample (n_modes, n), weights (n_drives, n_modes, n); the constant first."""
        static, weights = response.static[:, LEFT].T, response.weights[:, LEFT]
        rates = response.rates.T * self._interval_s
        return (
            np.concatenate((np.full_like(rates[:1], _NO_DECAY), rates)),
            np.concatenate((static[:, None], weights.transpose(1, 2, 0)), axis=1),
        )

    def _amplitudes(self, rates: Array, weights: Array) -> Array:
        """Amplitudes at the first sample of each phase, shape (n_phases, n_modes, n)."""
        amplitudes = np.einsum("dp,djn->pjn", self._heights, weights)
        for phase, (late, gap) in enumerate(zip(self._late, self._gaps, strict=True)):
            if late > 0:
                amplitudes[phase] *= np.exp(late * rates)
            if phase > 0:
                amplitudes[phase] += np.exp(gap * rates) * amplitudes[phase - 1]
        return amplitudes

    def _square_sums(self, rates: Array, amplitudes: Array) -> Array:
        """Sum over all samples of the squared response, shape (n,)."""
        first, second, times = _pairs(len(rates))
        pair_rates = rates.take(first, axis=0) + rates.take(second, axis=0)
        # (z_i z_j)^N - 1 over z_i z_j - 1, the sum over a phase of N samples.
        series = np.expm1(self._counts[:, None, None] * pair_rates)
        series *= amplitudes.take(first, axis=1)
        series *= amplitudes.take(second, axis=1)
        sums: Array = times @ (series.sum(axis=0) / np.expm1(pair_rates))
        return sums

    def exact_projections(self, rates: Array) -> Array:
        """Projections of the trace on the response of a mode to each drive, summed up.

        `projections` has them interpolated.

        Parameters
        ----------
        rates : (n,)
            Rates of modes, over the sampling rate.

        Returns
        -------
        (n_drives, n)
        """
        unit = np.repeat(np.eye(len(self._heights))[:, :, None], len(rates), axis=2)
        amplitudes = self._amplitudes(rates[None], unit)
        return np.einsum("pdn,pn->dn", amplitudes, _power_sums(self._phases, rates))


def _power_sums(pieces: list[Array], rates: Array) -> Array:
    """sum_n exp(rate n) y_n of each piece y, shape (n_pieces, n_rates).

    In two levels, n = B a + b: one matrix product with the pieces folded to
    (B, N/B), one weighted sum over rows.
    """
    block = max(1, int(np.sqrt(max(len(piece) for piece in pieces))))
    folded, columns = _fold(pieces, block)
    rows = max(stop - start for start, stop in columns)
    within = np.exp(rates[:, None] * np.arange(block)) @ folded
    across = np.exp(rates[:, None] * (block * np.arange(rows)))
    sums = [
        np.einsum("mr,mr->m", within[:, start:stop], across[:, : stop - start])
        for start, stop in columns
    ]
    return np.array(sums)


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
