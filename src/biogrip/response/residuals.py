"""Residuals of a model against one trace, with exact derivatives by the log-parameters."""

from copy import copy

import numpy as np

from biogrip.arrays import Array
from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory
from biogrip.response.nuisance import without
from biogrip.response.sensitivity import rotation_and_sensitivity
from biogrip.sample import SampleModel


class Residuals:
    """Simulated minus measured rotation as a function of log-parameters.

    Parameters
    ----------
    gripper, model, torque
        What is simulated, without inertia.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    nonlinear
        Whether to simulate the nonlinear model.
    nuisance : (n_functions, n_samples)
        Orthonormal functions that the instrument may have added, see `nuisance_basis`.
    noise_rad
        Standard deviation of the noise; by default what neighbouring samples suggest.
    """

    def __init__(
        self,
        gripper: Gripper,
        model: SampleModel,
        torque: TorqueHistory,
        time_s: Array,
        rotation_rad: Array,
        *,
        nonlinear: bool,
        nuisance: Array,
        noise_rad: float | None = None,
    ) -> None:
        self._gripper = gripper
        self._model = model
        self._torque = torque
        self._time_s = time_s
        self._nonlinear = nonlinear
        self._nuisance = nuisance
        self._rotation_rad = without(nuisance, rotation_rad)
        self.samples = len(time_s)
        self.duration_s = float(time_s[-1])
        if noise_rad is None:
            noise_rad = noise_of(self._rotation_rad)
        self.noise_scale_rad = noise_rad

    @property
    def free(self) -> int:
        """Degrees of freedom that samples and nuisance leave to parameters and noise."""
        return self.samples - len(self._nuisance)

    def of_model(self, model: SampleModel) -> "Residuals":
        """Return the same trace for another model."""
        other = copy(self)
        other._model = model
        return other

    def __call__(self, log_parameters: Array) -> tuple[Array, Array]:
        """Residuals and their derivatives.

        Parameters
        ----------
        log_parameters : (n_parameters,)
            Natural logarithms of the parameters in SI units.

        Returns
        -------
        residual : (n_samples,)
            In rad.
        sensitivity : (n_parameters, n_samples)
            In rad.
        """
        rotation, sensitivity = rotation_and_sensitivity(
            self._gripper,
            self._model,
            self._torque,
            self._time_s,
            np.exp(log_parameters),
            nonlinear=self._nonlinear,
        )
        residual = without(self._nuisance, rotation) - self._rotation_rad
        return residual, without(self._nuisance, sensitivity)


def noise_of(rotation_rad: Array) -> float:
    """Standard deviation of white noise on a smooth trace, about, without a model of the trace.

    From the median of second differences, in which neither slopes nor the jumps
    of a protocol show. For a trace without noise, next to nothing.
    """
    second = np.abs(np.diff(rotation_rad, 2))
    # Gaussian: the median is 0.6745 standard deviations, and those of second differences sqrt 6.
    noise = float(np.median(second)) / (0.6745 * np.sqrt(6.0)) if len(second) else 0.0
    return max(noise, 1e-9 * float(np.max(np.abs(rotation_rad))))
