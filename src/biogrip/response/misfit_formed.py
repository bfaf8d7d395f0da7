"""RMS misfit of a whole population by forming every response: any protocol, sampling and model.

Slower than `biogrip.response.misfit_series.SeriesMisfit`, which needs torque steps,
uniform sampling and the linear model.
"""

from copy import copy

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import rotation, step_response
from biogrip.response.nonlinear import COARSE, correction
from biogrip.response.nuisance import without
from biogrip.response.ringing import ringing_responses

# Numbers formed at once: what fits a processor's cache is faster than all at once.
_AT_ONCE = 400_000


class FormedMisfit:
    """RMS difference between the model's rotation and a trace sampled at any times.

    Parameters
    ----------
    gripper, model, torque
        What is simulated.
    time_s : (n_samples,)
        Ascending sampling times.
    rotation_rad : (n_samples,)
        The measured closing rotation of the left arm.
    nonlinear
        Whether to simulate the nonlinear model.
    inertia
        Whether the arms have any.
    nuisance : (n_functions, n_samples)
        Orthonormal functions that the instrument may have added, see `nuisance_basis`.
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
        inertia: bool = False,
    ) -> None:
        self._gripper = gripper
        self._model = model
        self._torque = torque
        self._time_s = time_s
        self._rotation_rad = rotation_rad
        self._nonlinear = nonlinear
        self._inertia = inertia
        self._nuisance = nuisance
        # As many modes at once, about.
        self._chunk = max(1, _AT_ONCE // len(time_s) // (10 if model.power_law else 1))

    def of_model(self, model: SampleModel) -> "FormedMisfit":
        """Return the same trace for another model."""
        other = copy(self)
        other._model = model
        return other

    def __call__(self, parameters: Array) -> Array:
        """Misfit in rad of each individual; infinite where the nonlinear model has no answer.

        Parameters
        ----------
        parameters : (n_individuals, n_parameters)
            Sample parameters in the model's order, SI units.

        Returns
        -------
        (n_individuals,)
        """
        chunks = np.array_split(parameters, -(-len(parameters) // self._chunk))
        return np.concatenate([self._of(chunk) for chunk in chunks])

    def _of(self, parameters: Array) -> Array:
        difference = self._linear(parameters)
        difference -= self._rotation_rad
        if not self._nonlinear:
            return self._rms(difference)
        found = correction(self._gripper, self._model.network(parameters), self._torque, COARSE)
        difference += found.at(self._time_s)
        return np.where(found.converged, self._rms(difference), np.inf)

    def _linear(self, parameters: Array) -> Array:
        torque, time_s = self._torque, self._time_s
        if self._inertia:
            rows = ringing_responses(
                self._gripper, self._model, torque, time_s, parameters, slopes=False
            )
            return rows[:, 0]
        network = self._model.network(parameters)
        response = step_response(self._gripper, network, symmetric=torque.symmetric, inertia=False)
        return rotation(response, torque, time_s)

    def _rms(self, difference: Array) -> Array:
        if len(self._nuisance):
            difference = without(self._nuisance, difference)
        rms: Array = np.sqrt(np.einsum("nt,nt->n", difference, difference) / difference.shape[1])
        return rms
