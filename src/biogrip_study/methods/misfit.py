"""RMS misfit of whole populations against traces, for the genetic algorithm.

Between two torque steps the inertia-free response of the paper's samples is a constant plus two
exponentials, so at uniform sampling it is a_0 + a_1 z_1^n + a_2 z_2^n. Its squared distance from
the samples y_n expands into geometric series in z_i z_j, and into the projections of the trace on
the response of each mode, which are interpolated in the mode's rate. No response is formed. Other
samples, grippers, protocols, samplings and noise need the condensed rows of
`biogrip.physics.residuals`, which take three to ten times as long.

The misfit of an individual is computed element by element, in a fixed order: it does not depend, to
the last bit, on the rest of the population or on the number of populations.
"""

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.physics.condensed import DECAYED, ORDERS, PIECE_WIDTH, WIDE_NODES, in_short_pieces
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.protocol import Course
from biogrip.physics.residuals import Residuals
from biogrip.physics.roots import zeros_of_one_branch
from biogrip.physics.sample_model import Network, SampleModel

Misfits = Callable[[Array, IntArray], Array]
"""Function from parameters of populations, (n_populations, n, n_parameters), and the index of the
trace of each, (n_populations,), to RMS misfits in the unit of the readings, (n_populations, n)."""


# Short pieces in a wide one, see `biogrip.physics.condensed`.
_SHORTER = 32


class DecayTable:
    """Sums of decaying exponentials at any rate from 0 to -infinity.

    They are given by a function of rates, (n,), to (n_sums, n), with the largest t_i; the smallest
    above zero is one.
    """

    def __init__(self, function: Callable[[Array], Array], longest: float) -> None:
        self._longest = longest
        pieces = np.ceil(np.log1p(DECAYED * longest) / PIECE_WIDTH)
        u = PIECE_WIDTH * (np.arange(pieces)[:, None] + WIDE_NODES)
        values = function(-np.expm1(u).ravel() / longest).reshape(-1, *u.shape)
        powers = in_short_pieces(values, _SHORTER).reshape(len(values), -1, len(ORDERS))
        self._powers = np.ascontiguousarray(np.moveaxis(powers, 2, 0))
        self._end = np.nextafter(powers.shape[1], 0)

    def __call__(self, which: IntArray, rates: Array) -> Array:
        """Return sums of some indices, each at rates of its own; both broadcast."""
        place = np.fmin(np.log(1 - self._longest * rates) / (PIECE_WIDTH / _SHORTER), self._end)
        piece = place.astype(np.intp)
        place -= piece
        piece = piece + which * self._powers.shape[2]
        powers = self._powers.reshape(len(ORDERS), -1)
        sums: Array = powers[-1].take(piece)
        for power in powers[-2::-1]:
            sums *= place
            sums += power.take(piece)
        return sums


def make_misfits(residuals: Sequence[Residuals]) -> Misfits:
    """Return the RMS misfits of populations, each to a trace, to the last bit as if it were alone.

    That of residuals serves any protocol, sampling, noise, sample and gripper. `SeriesMisfit` is
    the paper's: of a sample with one Maxwell branch between equal arms under steps of a torque,
    sampled uniformly from the start on, with a reading at each step, in white noise alone.
    """
    alike = len({of_trace.of_responses for of_trace in residuals}) == 1
    if alike and (series := series_of(residuals)):
        return series.of_each

    def one_by_one(parameters: Array, traces: IntArray) -> Array:
        pairs = zip(parameters, traces, strict=True)
        return np.stack([residuals[trace].misfit(population) for population, trace in pairs])

    return one_by_one


def series_of(every: Sequence[Residuals]) -> "SeriesMisfit | None":
    """Return the misfit to traces of residuals that share responses, if these are series."""
    residuals = every[0]
    course, trace = residuals.course, residuals.trace
    intervals, end_s = max(residuals.samples - 1, 1), residuals.duration_s
    steps = course.time_s * intervals / end_s
    even = np.allclose(trace.time_s * intervals / end_s, np.arange(residuals.samples), rtol=1e-9)
    if (
        (even and np.allclose(steps, np.rint(steps), rtol=0, atol=1e-9))
        and not (np.any(course.changes[:, 1:]) or course.deforms)
        and not (residuals.coloured or len(trace.condensed.nuisance))
        and residuals.gripper.left == residuals.gripper.right
        and residuals.model.network([residuals.model.example]).k.shape[1] == 1
    ):
        given = residuals.gripper, residuals.model, course, end_s / intervals
        return SeriesMisfit(*given, np.stack([of_trace.trace.readings for of_trace in every]))
    return None


class SeriesMisfit:
    """RMS difference between the model's response to steps and uniformly sampled traces.

    The first sample is at t = 0, and one is at every step. Traces are (n_samples,) or (n_traces,
    n_samples).
    """

    def __init__(
        self,
        gripper: Gripper,
        model: SampleModel,
        course: Course,
        interval_s: float,
        readings: Array,
    ) -> None:
        self._simulated = gripper, model, interval_s
        self._traces = np.atleast_2d(readings)
        self._samples = self._traces.shape[1]
        # Change of the torque at the start of each phase, and level after it.
        self._heights = course.changes[:, 0, None, None]
        self._levels = np.cumsum(course.changes[:, 0])[:, None, None]
        starts = np.rint(course.time_s / interval_s).astype(np.int64)
        self._first_samples = np.minimum(starts, self._samples)
        # Numbers of readings: one, and those of each phase.
        lengths = np.concatenate(([1], np.diff(self._first_samples, append=self._samples)))
        self._lengths = lengths[:, None, None].astype(float)
        self._square_sums = np.array([np.dot(trace, trace) for trace in self._traces])

    @cached_property
    def projections(self) -> DecayTable:
        """Table that interpolates `exact_projections`; made when it is first needed."""
        return DecayTable(self.exact_projections, self._samples)

    def __call__(self, parameters: Array) -> Array:
        """Compute misfits, (n,), of parameters, (n, n_parameters), to the first trace."""
        return self.of_each(parameters[None], np.zeros(1, dtype=np.int64))[0]

    def of_each(self, parameters: Array, traces: IntArray) -> Array:
        """Compute the misfits of populations, each to one trace, (n_populations, n).

        Populations are (n_populations, n, n_parameters), in the model's order and SI units; traces
        are given by their indices, (n_populations,).
        """
        gripper, model, interval_s = self._simulated
        network = model.network(parameters.reshape(-1, parameters.shape[2]))
        static, rates, weights = two_modes(gripper.left, gripper.lever_m, network)
        rates *= interval_s
        trace = traces.repeat(parameters.shape[1])
        product = static * self._projections_of_constant.take(trace)
        product += _sum_in_order(weights * self.projections(trace, rates))
        square = self._model_square_sums(static, rates, weights) + self._square_sums.take(trace)
        square = np.maximum(square - 2 * product, 0) / self._samples
        return np.sqrt(square).reshape(parameters.shape[:2])

    @cached_property
    def _projections_of_constant(self) -> Array:
        return self.projections(np.arange(len(self._traces)), np.zeros(1))

    def _model_square_sums(self, static: Array, rates: Array, weights: Array) -> Array:
        """Sum squared responses over readings, (n,), as geometric series without cancellation.

        In each phase the response is a constant a_0 plus a_1 z_1^n + a_2 z_2^n; the series of z^n
        over L readings is (z^L - 1) / (z - 1).
        """
        # z - 1 and z^L - 1 of every mode, of its square, and of the product of both.
        one = np.expm1(self._lengths * rates)
        two = one * (2 + one)
        both = one[:, 0] * one[:, 1] + one[:, 0] + one[:, 1]
        amplitudes = self._amplitudes(weights, 1 + one[1:])
        constants = self._levels * static
        mixed = one[1:] / one[0] * constants
        mixed[:, 1] += both[1:] / both[0] * amplitudes[:, 0]
        terms = amplitudes * (two[1:] / two[0] * amplitudes + 2 * mixed)
        squares = constants * constants * self._lengths[1:]
        return _sum_in_order(_sum_in_order(terms)) + _sum_in_order(squares)[0]

    def _amplitudes(self, weights: Array, decays: Array) -> Array:
        """Compute amplitudes of modes at the start of each phase, (n_phases, n_modes, n)."""
        amplitudes = self._heights * weights
        for phase in range(1, len(amplitudes)):
            amplitudes[phase] += decays[phase - 1] * amplitudes[phase - 1]
        return amplitudes

    def exact_projections(self, rates: Array) -> Array:
        """Project traces, by summation, on modes of rates over the sampling rate, (n_traces, n)."""
        sums = _power_sums(self._traces, self._first_samples, rates)
        decays = np.exp(self._lengths[1:] * rates)
        amplitudes = self._amplitudes(np.ones((1, len(rates))), decays)
        return _sum_in_order(amplitudes * sums.swapaxes(0, 1))


def two_modes(arm: Arm, lever_m: float, network: Network) -> tuple[Array, Array, Array]:
    """Compute the response of either of two equal arms to a unit step of the torque.

    A sample with one Maxwell branch has two modes without inertia. This special case of
    `biogrip.physics.response` is written out for speed: populations are small, and most time goes
    into calls.

    Parameters
    ----------
    arm, lever_m
        Either arm, and its lever on the sample.
    network
        Of n samples.

    Returns
    -------
    tuple of Array
        Final rotation in rad per N m, (n,); exponents in 1/s and their weights in rad per N m,
        (2, n).
    """
    squared_lever = lever_m**2
    rate = network.k[:, 0] / network.c[:, 0]
    spring = squared_lever * network.k_p + 0.5 * arm.stiffness_Nm_per_rad
    branch = squared_lever * network.k[:, 0]
    damper = squared_lever * network.c_p + 0.5 * arm.damping_Nms_per_rad
    zeros = zeros_of_one_branch((spring, branch), rate, damper)
    x = zeros.values
    share = x / zeros.from_pole(rate)
    return 0.5 / spring, -x, -0.5 / (spring + branch * share * share)


def _sum_in_order(terms: Array) -> Array:
    """Sum over the first axis in order, whatever the shape."""
    total: Array = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _power_sums(traces: Array, first_samples: IntArray, rates: Array) -> Array:
    """Compute sum_n exp(rate n) y_n of phases, with n = B a + b, (n_traces, n_phases, n_rates)."""
    longest = int(np.diff(first_samples, append=traces.shape[1]).max())
    block = max(1, int(np.sqrt(longest)))
    within = np.exp(rates[:, None] * np.arange(block))
    across = np.exp(rates[:, None] * (block * np.arange(-(-longest // block))))
    sums = []
    for pieces in np.split(traces, first_samples[1:], axis=1):
        count = -(-pieces.shape[1] // block)
        padded = np.pad(pieces, ((0, 0), (0, block * count - pieces.shape[1])))
        # One product per trace: the order of its sums does not depend on their number.
        rows = padded.reshape(len(traces), count, block) @ within.T
        sums.append(np.sum(rows * across.T[:count], axis=1))
    return np.stack(sums, axis=1)
