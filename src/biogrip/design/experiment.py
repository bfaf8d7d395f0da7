"""The design problem: limits of an experiment, and the plausible samples it is designed for."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.criteria import Criterion, inverted
from biogrip.design.noise import WHITE, DesignNoise
from biogrip.design.waveform import Limits
from biogrip.experiment.exposure import average
from biogrip.experiment.protocol import Phase, TorqueHistory, torque_history
from biogrip.experiment.sample import SampleModel
from biogrip.experiment.sampling import Sampling
from biogrip.instrument.gripper import Gripper
from biogrip.instrument.instrument import Instrument
from biogrip.response.sensitivity import linear_responses

Experiment = tuple[tuple[Phase, ...], Sampling]
"""Protocol and sampling."""

NO_BOUND = 10.0
"""Standard deviation of a logarithm that counts as no bound: a factor of e to the tenth."""

# Least information on a parameter above rounding; its bound is a thousand times `NO_BOUND`.
_NOTHING = 1e-6 * NO_BOUND**-2


@dataclass(frozen=True, eq=False)
class DesignInputs:
    """The design problem: simulated system, limits of the experiment, and criterion."""

    gripper: Gripper
    """Both arms are driven alike."""
    model: SampleModel
    """Sample model."""
    parameters: Array
    """Parameters of the plausible samples, (n, n_parameters)."""
    noise_rad: float
    """Standard deviation of the sensor's noise, in the unit of what is read."""
    samples: int
    """Number of readings."""
    fastest_Hz: float
    """Largest number of readings per second."""
    limits: Limits
    """Limits of the torque's steps, ramps and sinusoids."""
    shapes: tuple[str, ...]
    """Names in `biogrip.design.shapes.SHAPES` of the torque's allowed families."""
    largest_Nm: float
    """Largest torque, or what else is held."""
    stroke_rad: float
    """Largest rotation of the arms, infinite without them."""
    criterion: Criterion
    """Criterion to be minimized."""
    before: Array
    """Information on the log-parameters from earlier experiments, (n, n_parameters, n_parameters)
    or (1, n_parameters, n_parameters); for those out of reach, also a prior standard deviation of
    `NO_BOUND`."""
    instrument: Instrument
    """What is held and read."""
    out_of_reach: tuple[int, ...] = ()
    """Indices of parameters that no torque determines, see `biogrip.design.within_reach`."""
    noise: DesignNoise = WHITE
    """What of the noise is not white, what is fitted along, and what readings average over."""

    def history(self, phases: tuple[Phase, ...]) -> TorqueHistory:
        """Return what phases hold against time."""
        return torque_history(phases, deforms=self.instrument.deforms)

    def averaged(self, phases: tuple[Phase, ...]) -> TorqueHistory:
        """Return the mean of what phases hold over the exposure of each reading."""
        return self.history(average(phases, self.noise.exposure_s))

    def sensitivities(self, torque: TorqueHistory, time_s: Array) -> Array:
        """Compute sensitivities over the noise, arms with inertia: (n, n_parameters, n_times).

        Those of readings are under a torque that is `averaged`.
        """
        rows = linear_responses(
            self.gripper,
            self.model,
            torque,
            time_s,
            self.parameters,
            inertia=self.instrument.has_jaws,
        )
        return rows[:, 1:] / self.noise_rad

    def along(self, time_s: Array) -> Array:
        """Return what is fitted along at some times, (n_functions, n_times)."""
        return self.noise.along(time_s, self.limits.longest_s)

    @property
    def processes(self) -> tuple[Array, Array]:
        """Shares and rates in 1/s of the noise's parts with memory, (n_parts,)."""
        return self.noise.processes(1 / self.fastest_Hz, self.limits.longest_s)

    @property
    def before_along(self) -> Array:
        """Information from earlier experiments, and none on what is fitted along."""
        more = self.noise.fits_offset + self.noise.fits_drift
        return np.pad(self.before, [(0, 0)] * (self.before.ndim - 2) + [(0, more)] * 2)

    def information(self, torque: TorqueHistory, time_s: Array) -> Array:
        """Compute the Fisher information of readings, including `before`, with the noise's memory.

        Of the log-parameters, (n, n_parameters, n_parameters).
        """
        read = self.noise.whiten(time_s, self.sensitivities(torque, time_s))
        return compute_information(read) + self.before

    def typical_bound(self, information: Array) -> float:
        """Return the criterion of information, including `before`, as a relative bound."""
        targets = list(self.criterion.targets)
        covariances = inverted(information)[:, targets][:, :, targets]
        return self.criterion.typical_bound(covariances)

    def bounds(self, information: Array) -> Array:
        """Return `relative_bounds` without the prior on parameters that are out of reach.

        The information includes `before`.
        """
        found = relative_bounds(information)
        apart = list(self.out_of_reach)
        sensitivity = found[:, apart] ** -2 - NO_BOUND**-2
        found[:, apart] = np.maximum(sensitivity, _NOTHING) ** -0.5
        return found


def compute_information(sensitivity: Array) -> Array:
    """Return the Fisher information, (n, n_parameters, n_parameters), of sensitivities."""
    return sensitivity @ sensitivity.swapaxes(1, 2)


def relative_bounds(information: Array) -> Array:
    """Compute the Cramer-Rao bounds of log-parameters, (n, n_parameters), none of them fixed.

    Standard deviations; infinite where the information on a parameter, or on a combination with it,
    is lost in rounding.
    """
    length = np.sqrt(np.diagonal(information, axis1=1, axis2=2))
    bounds = np.full(length.shape, np.inf)
    for row, (one, size) in enumerate(zip(information, length, strict=True)):
        if np.any(size == 0):
            continue
        eigenvalues, vectors = np.linalg.eigh(one / np.outer(size, size))
        lost = eigenvalues <= len(size) * np.finfo(float).eps * eigenvalues[-1]
        shares = vectors**2 / np.where(lost, np.inf, eigenvalues)
        known = ~np.any(lost & (vectors**2 > 1e-6), axis=1)
        bounds[row, known] = np.sqrt(shares.sum(axis=1))[known] / size[known]
    return bounds
