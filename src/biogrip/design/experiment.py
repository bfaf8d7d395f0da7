"""What an experiment may be, and which samples it is for."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.criteria import Criterion
from biogrip.design.waveform import Limits
from biogrip.experiment.protocol import Phase, TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.experiment.sampling import Sampling
from biogrip.instrument.gripper import Gripper
from biogrip.response.ringing import ringing_responses

Experiment = tuple[tuple[Phase, ...], Sampling]
"""Protocol and sampling."""

NO_BOUND = 10.0
"""Of which nobody would say that something is known: a factor of e to the tenth."""

# Information that rounding leaves of none; its bound is a thousand times what none is.
_NOTHING = 1e-6 * NO_BOUND**-2


@dataclass(frozen=True, eq=False)
class Wanted:
    """What is to be designed.

    Parameters
    ----------
    gripper, model
        What is simulated, both arms driven alike.
    parameters : (n, n_parameters)
        Of the plausible samples.
    noise_rad
        Standard deviation of the sensor's noise.
    samples
        How often the rotation is read.
    fastest_Hz
        How often at most in a second.
    limits
        Of the torque's steps, ramps and sinusoids.
    shapes
        Which of `biogrip.design.shapes.SHAPES` the torque may be of.
    largest_Nm
        Torque.
    stroke_rad
        How far the arms may turn.
    criterion
        What is to be small.
    before : (n, n_parameters, n_parameters) or (1, n_parameters, n_parameters)
        Information on the log-parameters that earlier experiments gave; and of those out of reach,
        that they are known within a factor of e to the `NO_BOUND`.
    out_of_reach
        Indices of parameters that no torque tells, see `biogrip.design.within_reach`.
    """

    gripper: Gripper
    model: SampleModel
    parameters: Array
    noise_rad: float
    samples: int
    fastest_Hz: float
    limits: Limits
    shapes: tuple[str, ...]
    largest_Nm: float
    stroke_rad: float
    criterion: Criterion
    before: Array
    out_of_reach: tuple[int, ...] = ()

    def bounds(self, information: Array) -> Array:
        """Return `relative_bounds`, without what is taken to be known of those out of reach.

        Parameters
        ----------
        information : (n, n_parameters, n_parameters)
            With what is in `before`.
        """
        found = relative_bounds(information)
        apart = list(self.out_of_reach)
        told = found[:, apart] ** -2 - NO_BOUND**-2
        found[:, apart] = np.maximum(told, _NOTHING) ** -0.5
        return found


def told_at(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    parameters: Array,
    noise_rad: float,
) -> Array:
    """Sensitivities to the log-parameters, with inertia, in units of the noise.

    Parameters
    ----------
    gripper, model, torque
        Arms, sample model and protocol of the simulation.
    time_s : (n_times,)
        When the rotation is read, ascending.
    parameters : (n, n_parameters)
        Of the samples.
    noise_rad
        Standard deviation of the noise.

    Returns
    -------
    (n, n_parameters, n_times)
    """
    rows = ringing_responses(gripper, model, torque, time_s, parameters)
    return rows[:, 1:] / noise_rad


def information_of(told: Array) -> Array:
    """Fisher information, (n, n_parameters, n_parameters), of readings that tell so much."""
    information: Array = told @ told.swapaxes(1, 2)
    return information


def relative_bounds(information: Array) -> Array:
    """Cramer-Rao bounds of log-parameters, none of them taken as known.

    Parameters
    ----------
    information : (n, n_parameters, n_parameters)
        Fisher information.

    Returns
    -------
    (n, n_parameters)
        Standard deviations; infinite where a parameter, and what it trades against, is lost in
        rounding.
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
