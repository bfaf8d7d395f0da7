"""Residuals of a model against one trace, with exact derivatives by the log-parameters."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np

from biogrip.arrays import Array, parts
from biogrip.physics.condensed import Condensed
from biogrip.physics.drift import taken_out
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import Instrument
from biogrip.physics.jaw_force import Grip, compute_grip
from biogrip.physics.modes import compute_protocol_modes
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.sample_model import Network, SampleModel
from biogrip.physics.sensitivity import linear_responses
from biogrip.physics.simulation import Ring, elapsed_s, find_ring, ring, ringing_s, while_ringing
from biogrip.physics.whitening import estimate_noise, measure_rounding

# Most numbers in the rows that are formed at once.
_AT_ONCE = 100_000
# Most readings whose derivatives are formed: more would double the memory.
_SAMPLES_AT_ONCE = 100_000


class Residuals:
    """Simulated minus measured rotation as a function of log-parameters.

    Parameters
    ----------
    gripper, model, torque
        Arms, sample model and protocol of the simulation.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    condensed
        Rows for the protocol and the sampling times; specify nuisance functions
        and noise model. Residuals are white.
    noise_rad
        Standard deviation of the noise; by default estimated from neighbouring readings.
    instrument
        The instrument, for its words.
    """

    def __init__(
        self,
        gripper: Gripper,
        model: SampleModel,
        torque: TorqueHistory,
        time_s: Array,
        rotation_rad: Array,
        condensed: Condensed,
        *,
        noise_rad: float | None = None,
        instrument: Instrument,
    ) -> None:
        self.instrument = instrument
        self._gripper = gripper
        self.model = model
        self._torque = torque
        self._time_s = time_s
        self._condensed = condensed
        self._rotation_rad = condensed.cleared(rotation_rad)
        self.rounding_rad = measure_rounding(rotation_rad)
        self.samples = len(time_s)
        self.peak_rad = float(np.max(np.abs(self._rotation_rad)))
        self.duration_s = float(time_s[-1])
        if noise_rad is None:
            noise_rad = estimate_noise(self._rotation_rad, self.rounding_rad)
        self.noise_scale_rad = noise_rad
        self._freedom = np.inf

    @property
    def free(self) -> int:
        """Number of readings minus that of nuisance functions of free amplitude."""
        return self.samples - taken_out(self._condensed.nuisance)

    @property
    def sampling_s(self) -> Array:
        """Ascending sampling times, (n_samples,)."""
        return self._time_s

    def grip(self, log_parameters: Array) -> Grip | None:
        """Return the force with which the jaws press a sample or would have to pull it, if any."""
        if not self.instrument.has_jaws:
            return None
        network = self.model.network(np.exp(log_parameters))
        return compute_grip(self._gripper, network, self._torque, nonlinear=False)

    def ring(self, network: Network, noise_rad: float) -> Ring | None:
        """Return what noise of this size lets be seen of the arms' ringing on a sample, if any.

        A parallel damper ends a ring. It only counts if it is seen when the ring is over, too:
        what readings of a ring tell of it, without inertia, is the ring's.
        """
        gripper, torque = self._gripper, self._torque
        if not gripper.has_inertia:
            return None
        springs = network.k_p + network.k.sum(axis=1) + gripper.jaw_stiffness_N_per_m
        is_seen = network.c_p > ringing_s(gripper) * springs
        network = replace(network, c_p=np.where(is_seen, network.c_p, 0.0))
        ringing = while_ringing(gripper, torque, self._time_s)
        change = np.zeros(self.samples)
        change[ringing] = ring(gripper, network, torque, self._time_s[ringing])[0]
        elapsed = elapsed_s(torque, self._time_s)
        return find_ring(self._condensed.cleared(change) / noise_rad, elapsed)

    def of_model(self, model: SampleModel) -> "Residuals":
        """Return the residuals of another model against the same trace, whose rows they share."""
        _ = self.condensed_trace
        other = copy(self)
        other.model = model
        return other

    def later(self, change_s: float) -> "Residuals":
        """Return the residuals of the same trace for a protocol that starts later by some s."""
        other = copy(self)
        other._time_s = self._time_s - change_s
        other._condensed = self._condensed.later(change_s)
        for of_trace in ("condensed_trace", "_trace_at_nodes"):
            other.__dict__.pop(of_trace, None)
        return other

    def with_freedom(self, freedom: float) -> "Residuals":
        """Return a copy whose noise model is known with so many degrees of freedom."""
        other = copy(self)
        other._freedom = freedom
        return other

    def __call__(self, log_parameters: Array) -> tuple[Array, Array]:
        """Return residuals, (n_samples,), and derivatives, (n_parameters, n_samples), in rad.

        Parameters
        ----------
        log_parameters : (n_parameters,)
            Natural logarithms of the parameters in SI units.
        """
        rows = self._simulated(log_parameters[None], self._time_s)[0]
        residual = self._condensed.cleared(rows[0]) - self._rotation_rad
        return residual, self._condensed.cleared(rows[1:])

    def gradients(
        self, log_parameters: Array, others: Sequence["Residuals"]
    ) -> tuple[Array, Array]:
        """Compute gradients of half the sums of squares, and misfits, to all digits.

        Parameters
        ----------
        log_parameters : (n, n_parameters)
            Natural logarithms of the parameters in SI units.
        others
            For each of these, residuals that share the responses, of the trace to compare with.

        Returns
        -------
        gradients : (n, n_parameters)
            Of half the sums of squares, in rad^2.
        misfits_rad : (n,)
            Root mean squares.
        """
        n, parameters = log_parameters.shape
        sums, numbers = np.empty((n, 1 + parameters)), self.samples * (1 + parameters)
        for some in parts(n, max(1, _AT_ONCE // numbers)):
            rows, rest = self._complete_rows(log_parameters[some], others[some])
            # One product per sample: the order of its sums does not depend on their number.
            sums[some] = (rows @ np.ascontiguousarray(rows[:, 0])[:, :, None])[:, :, 0]
            sums[some, 0] += rest**2
        return sums[:, 1:], np.sqrt(sums[:, 0] / self.samples)

    def _complete_rows(
        self, log_parameters: Array, others: Sequence["Residuals"]
    ) -> tuple[Array, Array]:
        """Return rows of residuals and derivatives, and norms of what no response reaches."""
        condensed = self._condensed
        if self.samples <= _SAMPLES_AT_ONCE:
            rows = condensed.cleared(self._simulated(log_parameters, self._time_s))
            rows[:, 0] -= [other._rotation_rad for other in others]
            return rows, np.zeros(len(rows))
        # So many readings are dense: their sums equal those of nodes up to rounding.
        rows = condensed.rows_of_nodes(self._simulated(log_parameters, condensed.dense.time_s))
        traces = [other._trace_at_nodes for other in others]
        rows[:, 0] -= [projected for projected, _ in traces]
        return rows, np.array([rest for _, rest in traces])

    @cached_property
    def _trace_at_nodes(self) -> tuple[Array, float]:
        return self._condensed.dense.rows_of_samples(self._rotation_rad)

    def left(self, log_parameters: Array) -> Array:
        """Return the residuals alone, (n_samples,) in rad."""
        return self._condensed.cleared(self.rotation(log_parameters)) - self._rotation_rad

    def rotation(self, log_parameters: Array) -> Array:
        """Return the simulated rotation, neither cleared nor whitened, (n_samples,) in rad."""
        simulated = (
            self._simulated(log_parameters[None], self._time_s[some])[0, 0]
            for some in parts(self.samples, _SAMPLES_AT_ONCE)
        )
        return np.concatenate(list(simulated))

    @property
    def freedom(self) -> float:
        """Degrees of freedom with which the noise model is known."""
        return self._freedom

    @property
    def coloured(self) -> bool:
        """True if residuals are whitened, as the noise is autocorrelated."""
        return self._condensed.coloured

    @cached_property
    def condensed_trace(self) -> Array:
        """Condensed rows of the trace, (n_rows,) in rad."""
        return self._condensed.of_trace(self._rotation_rad)

    def condensed_responses(self, log_parameters: Array, *, slopes: bool = True) -> Array:
        """Compute condensed rows of the responses of many samples.

        Parameters
        ----------
        log_parameters : (n, n_parameters)
            Natural logarithms of the parameters in SI units.
        slopes
            True to compute derivatives.

        Returns
        -------
        (n, 1 + n_parameters, n_rows)
            In rad; first the response, then its derivatives by the log-parameters. Without
            `slopes`, (n, 1, n_rows).
        """
        gripper, model, torque = self._gripper, self.model, self._torque
        parameters, condensed = np.exp(log_parameters), self._condensed
        if not condensed.reduced:
            rotations = linear_responses(
                gripper, model, torque, condensed.time_s, parameters, slopes=slopes
            )
            return condensed.rows(rotations)
        modes = compute_protocol_modes(gripper, model, torque, parameters, slopes=slopes)
        return condensed.of_modes(modes)

    def condensed_misfit(self, parameters: Array) -> Array:
        """Compute RMS misfits of a population, (n,) in rad, each independent of the others.

        Parameters
        ----------
        parameters : (n, n_parameters)
            Sample parameters in the model's order, SI units.
        """
        misfit = np.empty(len(parameters))
        at_once = max(1, _AT_ONCE // len(self.condensed_trace))
        for some in parts(len(parameters), at_once):
            responses = self.condensed_responses(np.log(parameters[some]), slopes=False)[:, 0]
            rows = responses - self.condensed_trace
            misfit[some] = np.sqrt(np.einsum("nr,nr->n", rows, rows) / self.samples)
        return misfit

    @property
    def plain(self) -> bool:
        """True without nuisance functions and whitening."""
        return not (self._condensed.coloured or len(self._condensed.nuisance))

    def shares_responses(self, other: "Residuals") -> bool:
        """Return True if `other` differs in its trace and noise only, so that responses agree."""
        alike = type(self) is type(other) and self._condensed is other._condensed
        return alike and (self._gripper, self.model) == (other._gripper, other.model)

    def _simulated(self, log_parameters: Array, time_s: Array) -> Array:
        parameters = np.exp(log_parameters)
        return linear_responses(self._gripper, self.model, self._torque, time_s, parameters)
