"""Residuals of a model against one trace, with exact derivatives by the log-parameters."""

from collections.abc import Hashable
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, parts
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import Instrument
from biogrip.physics.modes import mode_responses
from biogrip.physics.noise import estimate_noise, measure_rounding
from biogrip.physics.protocol import Course
from biogrip.physics.response import (
    Grip,
    Ring,
    compute_grip,
    compute_modes,
    elapsed_s,
    linear_responses,
    ring,
    ringing_s,
)
from biogrip.physics.sample_model import Network, SampleModel

# Most numbers in the rows that are formed at once.
_MISFIT_NUMBERS_AT_ONCE = 100_000


@dataclass(frozen=True, eq=False)
class CondensedTrace:
    """A trace, and the condensed rows that stand for it."""

    readings: Array
    """What was read, (n_samples,)."""
    condensed: Condensed
    """Rows for the protocol and the times; specify nuisance functions and noise model."""
    known_noise: float | None = None
    """Standard deviation of the noise; None to estimate it from neighbouring readings."""
    known_scatter: float | None = None
    """That of neighbouring readings, if it is known; None to estimate it."""

    @property
    def time_s(self) -> Array:
        """Ascending sampling times, (n_samples,)."""
        return self.condensed.all_s

    @cached_property
    def cleared(self) -> Array:
        """The trace without nuisance, in white noise, (n_samples,)."""
        return self.condensed.cleared(self.readings)

    @cached_property
    def rounding(self) -> float:
        """Step that the readings are multiples of, or zero."""
        return measure_rounding(self.readings)

    @cached_property
    def scatter(self) -> float:
        """Standard deviation of the noise by neighbouring readings, whatever is known of it."""
        if self.known_scatter is not None:
            return self.known_scatter
        return estimate_noise(self.cleared, self.rounding)

    @cached_property
    def rows(self) -> Array:
        """Condensed rows, (n_rows,)."""
        return self.condensed.of_trace(self.cleared)


@dataclass(frozen=True, eq=False)
class Residuals:
    """Simulated minus measured response as a function of log-parameters, in white noise."""

    gripper: Gripper
    """Arms."""
    model: SampleModel
    """Sample model."""
    course: Course
    """Protocol."""
    trace: CondensedTrace
    """The trace."""
    _: KW_ONLY
    instrument: Instrument
    """The instrument, for its words."""
    freedom: float = np.inf
    """Degrees of freedom with which the noise model is known."""
    parts: tuple["Residuals", ...] = ()
    """Those of each of several traces of one sample (`biogrip.fit.joint`), if it is of several."""

    @property
    def samples(self) -> int:
        """Number of readings."""
        return len(self.trace.time_s)

    @property
    def free(self) -> int:
        """Number of readings minus that of nuisance functions of free amplitude."""
        return self.samples - len(self.trace.condensed.taken)

    @property
    def duration_s(self) -> float:
        """Time of the last reading, or the longest that a sweep tells of."""
        time_s = self.trace.time_s
        return self.course.spread_s(time_s)[1] if self.course.sweeps else float(time_s[-1])

    @property
    def covered_s(self) -> tuple[float, float]:
        """From when to when after a change of what is controlled there are readings."""
        return self.course.covered_s(self.trace.time_s)

    @property
    def noise_scale(self) -> float:
        """Standard deviation of the noise, known or estimated."""
        trace = self.trace
        return trace.scatter if trace.known_noise is None else trace.known_noise

    @cached_property
    def peak(self) -> float:
        """Largest reading without nuisance, in magnitude."""
        return float(np.max(np.abs(self.trace.cleared)))

    @property
    def coloured(self) -> bool:
        """True if residuals are whitened, as the noise is autocorrelated."""
        return self.trace.condensed.whitening is not None

    def later(self, change_s: float) -> "Residuals":
        """Return the residuals of the same trace for a protocol that starts later by some s.

        Noise and nuisance stay.
        """
        trace, earlier_s = self.trace, self.course.snapped(self.trace.time_s - change_s)
        condensed = replace(trace.condensed, all_s=earlier_s)
        return replace(self, trace=replace(trace, condensed=condensed, known_scatter=trace.scatter))

    def under(self, course: Course) -> "Residuals":
        """Return the residuals of a trace under another protocol; noise and nuisance stay."""
        condensed = replace(self.trace.condensed, course=course)
        trace = replace(self.trace, condensed=condensed, known_scatter=self.trace.scatter)
        return replace(self, course=course, trace=trace)

    @property
    def of_responses(self) -> Hashable:
        """What responses depend on: with equal ones, residuals differ in trace and noise alone."""
        return self.trace.condensed, self.gripper, self.model

    def __call__(self, log_parameters: Array) -> tuple[Array, Array]:
        """Return residuals, (n_samples,), and derivatives, (n_parameters, n_samples)."""
        rows = self.simulated(log_parameters)
        cleared = self.trace.condensed.cleared
        return cleared(rows[0]) - self.trace.cleared, cleared(rows[1:])

    def left(self, log_parameters: Array) -> Array:
        """Return the residuals alone, (n_samples,) in the unit of the readings."""
        response = self.trace.condensed.cleared(self.response(log_parameters))
        return response - self.trace.cleared

    def response(self, log_parameters: Array) -> Array:
        """Return the simulated response, neither cleared nor whitened, (n_samples,)."""
        return self.simulated(log_parameters)[0]

    def of_lags(self, rates: Array) -> Array:
        """Return what lags of rates in 1/s, (n_rates,), show by unit, (n_rates, n_samples)."""
        shown = mode_responses(-rates[None], self.course, self.trace.time_s)[0]
        return (1.0 if self.course.deforms else -1.0) * shown

    def condensed_responses(self, log_parameters: Array, *, slopes: bool = True) -> Array:
        """Compute rows of responses and, if wanted, their slopes, (n, 1 + n_parameters, n_rows)."""
        given = self.gripper, self.model, self.course
        parameters, condensed = np.exp(log_parameters), self.trace.condensed
        return condensed.of_modes(compute_modes(*given, parameters, slopes=slopes))

    def misfit(self, parameters: Array) -> Array:
        """Compute RMS misfits, (n,), of parameters, (n, n_parameters), each by itself."""
        misfit = np.empty(len(parameters))
        for some in parts(len(parameters), max(1, _MISFIT_NUMBERS_AT_ONCE // len(self.trace.rows))):
            responses = self.condensed_responses(np.log(parameters[some]), slopes=False)[:, 0]
            rows = responses - self.trace.rows
            misfit[some] = np.sqrt(np.einsum("nr,nr->n", rows, rows) / self.samples)
        return misfit

    def grip(self, log_parameters: Array) -> Grip | None:
        """Return the force with which the jaws press a sample or would have to pull it, if any."""
        if not self.instrument.has_jaws:
            return None
        network = self.model.network(np.exp(log_parameters))
        return compute_grip(self.gripper, network, self.course)

    def ring(self, network: Network, noise_sd: float) -> Ring | None:
        """Return what noise of this size lets be seen of the arms' ringing on a sample, if any.

        A parallel damper ends a ring. It only counts if it is seen when the ring is over, too: what
        readings of a ring tell of it, without inertia, is the ring's.
        """
        gripper, time_s = self.gripper, self.trace.time_s
        if not gripper.has_inertia:
            return None
        springs = network.k_p + network.k.sum(axis=1) + gripper.jaw_stiffness_N_per_m
        is_seen = network.c_p > ringing_s(gripper) * springs
        network = replace(network, c_p=np.where(is_seen, network.c_p, 0.0))
        elapsed = elapsed_s(self.course, time_s)
        ringing = elapsed <= ringing_s(gripper)
        change = np.zeros(len(time_s))
        change[ringing] = ring(gripper, network, self.course, time_s[ringing])[0]
        shown = self.trace.condensed.cleared(change) / noise_sd
        latest_first = np.argsort(-elapsed, kind="stable")
        norms = np.sqrt(np.cumsum(shown[latest_first] ** 2))
        visible = np.flatnonzero(norms > levels.VISIBLE)
        if not len(visible):
            return None
        return Ring(float(np.max(np.abs(shown))), float(elapsed[latest_first[visible[0]]]))

    def simulated(self, log_parameters: Array) -> Array:
        """Return response and derivatives, not cleared, (1 + n_parameters, n_samples)."""
        given = self.gripper, self.model, self.course, self.trace.time_s
        return linear_responses(*given, np.exp(log_parameters[None]))[0]
