"""RMS misfit of whole populations against traces, without forming a response.

Between two torque steps the inertia-free response is a constant plus
exponentials, so at uniform sampling it is sum_j a_j z_j^n. Its squared distance
from the samples y_n expands into geometric series in z_i z_j, and into the
projections of the trace on the response of each mode. Those are long sums, but
functions of the mode's rate alone: computed once at some hundred rates, they are
interpolated for all others.

What concerns one individual is arithmetic element by element, in an order that is
written out, and no reduction of an array: the same to the last bit whoever else is
in the population, and however many populations are looked at together.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory, drives
from biogrip.response.decay_table import DecayTable
from biogrip.response.linear import LEFT, StepResponse, step_response
from biogrip.sample import SampleModel

# Modes of a closed form; the rates of more are iterated for, until those of all have settled.
_CLOSED_FORM = 2


class SeriesMisfit:
    """RMS difference between the model's rotation and uniformly sampled traces.

    Parameters
    ----------
    gripper, model, torque
        What is simulated: the linear model without inertia, under torque steps.
    interval_s
        Sampling interval; the first sample is at t = 0.
    rotation_rad : (n_samples,) or (n_traces, n_samples)
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
        self._simulated = (gripper, model, torque, interval_s)
        self._traces = np.atleast_2d(rotation_rad)
        self._samples = self._traces.shape[1]
        self._heights = drives(torque.left[:, 0], torque.right[:, 0], torque.symmetric)
        # Times in samples; rounding must not keep a sample from the step that it falls on.
        steps, nearest = torque.time_s / interval_s, np.rint(torque.time_s / interval_s)
        steps = np.where(np.isclose(steps, nearest, rtol=1e-12, atol=0), nearest, steps)
        starts = np.minimum(np.ceil(steps), self._samples)
        self._first_samples = starts.astype(np.int64)
        # From a step to the first sample of its phase.
        self._late = np.maximum(starts - steps, 0)
        self._counts = np.diff(starts, append=self._samples)
        self._square_sums = np.array([np.dot(trace, trace) for trace in self._traces])

    @classmethod
    def joined(cls, misfits: Sequence["SeriesMisfit"]) -> "SeriesMisfit":
        """Take the traces of several that agree in all else, see `joins`, together."""
        return cls(*misfits[0]._simulated, np.concatenate([one._traces for one in misfits]))

    def joins(self, other: "SeriesMisfit") -> bool:
        """Whether populations against traces of both give the same bits together as apart."""
        (gripper, *same, interval_s), (others_gripper, *others, others_interval_s) = (
            self._simulated,
            other._simulated,
        )
        return (
            all(one is another for one, another in zip(same, others, strict=True))
            and (gripper, interval_s) == (others_gripper, others_interval_s)
            and self._samples == other._samples
            and self._closed_form
        )

    @cached_property
    def _closed_form(self) -> bool:
        model = self._simulated[1]
        return self._response(np.ones((1, len(model.parameters)))).rates.shape[1] <= _CLOSED_FORM

    @cached_property
    def projections(self) -> DecayTable:
        """What `exact_projections` has, interpolated; made when it is first needed."""
        shortest = float(np.min(self._late, where=self._late > 0, initial=1.0))
        return DecayTable(self.exact_projections, self._samples, shortest)

    def __call__(self, parameters: Array) -> Array:
        """Misfit in rad of each individual against the only trace, or the first.

        Parameters
        ----------
        parameters : (n_individuals, n_parameters)
            Sample parameters in the model's order, SI units.

        Returns
        -------
        (n_individuals,)
        """
        misfit: Array = self.of_each(parameters[None], np.zeros(1, dtype=np.int64))[0]
        return misfit

    def of_each(self, parameters: Array, traces: IntArray) -> Array:
        """Misfit in rad of populations, each against a trace.

        Parameters
        ----------
        parameters : (n_populations, n_individuals, n_parameters)
            Sample parameters in the model's order, SI units.
        traces : (n_populations,)
            Indices of the traces.

        Returns
        -------
        (n_populations, n_individuals)
        """
        shape = parameters.shape[:2]
        response = self._response(parameters.reshape(-1, parameters.shape[2]))
        static = np.ascontiguousarray(response.static[:, LEFT].T)
        weights = np.ascontiguousarray(response.weights[:, LEFT].transpose(1, 2, 0))
        rates = np.ascontiguousarray(response.rates.T) * self._simulated[3]
        trace = np.repeat(traces, shape[1])
        square = self._square_sums[trace] + self._model_square_sums(rates, static, weights)
        square -= 2 * self._products(trace, rates, static, weights)
        misfit: Array = np.sqrt(np.maximum(square, 0) / self._samples).reshape(shape)
        return misfit

    def _response(self, parameters: Array) -> StepResponse:
        gripper, model, torque, _ = self._simulated
        network = model.network(parameters)
        return step_response(gripper, network, symmetric=torque.symmetric, inertia=False)

    def _products(self, trace: IntArray, rates: Array, static: Array, weights: Array) -> Array:
        """Products of responses with their traces, shape (n,)."""
        products = np.zeros(len(trace))
        of_constant = self._projections_of_constant
        for drive, (at_rest, decaying) in enumerate(zip(static, weights, strict=True)):
            which = trace * len(self._heights) + drive
            products += at_rest * of_constant[which]
            for mode in decaying * self.projections.of(which, rates):
                products += mode
        return products

    @cached_property
    def _projections_of_constant(self) -> Array:
        return self.projections(np.zeros(1))[:, 0]

    def _model_square_sums(self, rates: Array, static: Array, weights: Array) -> Array:
        """Sums over all samples of squared responses, shape (n,).

        A phase of N samples contributes ((z_i z_j)^N - 1) / (z_i z_j - 1) for each
        pair of modes. Those of products follow from z^N - 1 and z - 1 without
        cancellation.
        """
        step = np.expm1(rates)
        phase = [np.expm1(count * rates) for count in self._counts]
        amplitudes = self._amplitudes(rates, weights, [1 + decay for decay in phase])
        modes = range(len(rates))
        squares = [step[j] * (2 + step[j]) for j in modes]
        products = {(i, j): _of_product(step[i], step[j]) for j in modes for i in range(j)}
        sums = np.zeros(rates.shape[1])
        constant = np.zeros(rates.shape[1])
        for p, (count, decay) in enumerate(zip(self._counts, phase, strict=True)):
            for height, at_rest in zip(self._heights[:, p], static, strict=True):
                constant += height * at_rest
            sums += count * constant * constant
            for j, amplitude in enumerate(amplitudes[p]):
                own = amplitude * decay[j] * (2 + decay[j]) / squares[j]
                own += 2 * constant * (decay[j] / step[j])
                sums += amplitude * own
                for i in range(j):
                    series = _of_product(decay[i], decay[j]) / products[i, j]
                    sums += 2 * amplitude * amplitudes[p][i] * series
        return sums

    def _amplitudes(self, rates: Array, weights: Array, decays: Sequence[Array]) -> list[Array]:
        """Amplitudes of modes at the first sample of each phase.

        Parameters
        ----------
        rates : (n_modes, n)
            Over the sampling rate.
        weights : (n_drives, n_modes, n)
            Of unit steps.
        decays : n_phases of (n_modes, n)
            To what share a mode decays within each phase.

        Returns
        -------
        n_phases of (n_modes, n)
        """
        amplitudes: list[Array] = []
        for phase, late in enumerate(self._late):
            amplitude = np.zeros_like(rates)
            for height, of_unit in zip(self._heights[:, phase], weights, strict=True):
                amplitude += height * of_unit
            if late > 0:
                amplitude *= np.exp(late * rates)
            if phase > 0:
                amplitude += decays[phase - 1] * amplitudes[-1]
            amplitudes.append(amplitude)
        return amplitudes

    def exact_projections(self, rates: Array) -> Array:
        """Projections of each trace on the response of a mode to each drive, summed up.

        Parameters
        ----------
        rates : (n,)
            Rates of modes, over the sampling rate.

        Returns
        -------
        (n_traces * n_drives, n)
        """
        sums = _power_sums(self._traces, self._first_samples, rates)
        decays = [np.exp(count * rates)[None] for count in self._counts]
        projections = []
        for unit in np.eye(len(self._heights)):
            weights = np.broadcast_to(unit[:, None, None], (len(unit), 1, len(rates)))
            amplitudes = self._amplitudes(rates[None], weights, decays)
            projections.append(
                sum(amplitude * sums[:, p] for p, (amplitude,) in enumerate(amplitudes))
            )
        return np.stack(projections, axis=1).reshape(-1, len(rates))


def _of_product(first: Array, second: Array) -> Array:
    """z_1 z_2 - 1 of z_1 - 1 and z_2 - 1, both between -1 and 0."""
    product: Array = first * (1 + second) + second
    return product


def _power_sums(traces: Array, first_samples: IntArray, rates: Array) -> Array:
    """sum_n exp(rate n) y_n of each phase of each trace, shape (n_traces, n_phases, n_rates).

    In two levels, n = B a + b: one matrix product with the phases folded to
    (B, N/B), one weighted sum over rows. Traces go through it one by one, so that none
    depends on the others.
    """
    longest = int(np.diff(first_samples, append=traces.shape[1]).max())
    block = max(1, int(np.sqrt(longest)))
    within = np.exp(rates[:, None] * np.arange(block))
    across = np.exp(rates[:, None] * (block * np.arange(-(-longest // block))))
    sums = []
    for trace in traces:
        folded, columns = _fold(np.split(trace, first_samples[1:]), block)
        rows = within @ folded
        sums.append(
            [
                np.einsum("mr,mr->m", rows[:, start:stop], across[:, : stop - start])
                for start, stop in columns
            ]
        )
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
