"""RMS misfit of a whole population by forming every response: any protocol, sampling and model.

Slower than `biogrip.response.misfit_series.SeriesMisfit`, which needs torque steps,
uniform sampling and the linear model.
"""

from copy import copy

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import Network, SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import rotation, step_response
from biogrip.response.nonlinear import COARSE, correction
from biogrip.response.nuisance import without

# Numbers formed at once: what fits a processor's cache is faster than all at once.
_AT_ONCE = 400_000


class FormedMisfit:
    """RMS difference between the model's rotation and a trace sampled at any times.

    Parameters
    ----------
    gripper, model, torque
        What is simulated, without inertia.
    time_s : (n_samples,)
        Ascending sampling times.
    rotation_rad : (n_samples,)
        The measured closing rotation of the left arm.
    nonlinear
        Whether to simulate the nonlinear model.
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
    ) -> None:
        self._gripper = gripper
        self._model = model
        self._torque = torque
        self._time_s = time_s
        self._rotation_rad = rotation_rad
        self._nonlinear = nonlinear
        self._nuisance = nuisance
        self._chunk = max(1, _AT_ONCE // len(time_s))

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
        return np.concatenate([self._of(self._model.network(chunk)) for chunk in chunks])

    def _of(self, network: Network) -> Array:
        response = step_response(
            self._gripper, network, symmetric=self._torque.symmetric, inertia=False
        )
        difference = rotation(response, self._torque, self._time_s)
        difference -= self._rotation_rad
        if not self._nonlinear:
            return self._rms(difference)
        found = correction(self._gripper, network, self._torque, COARSE)
        difference += found.at(self._time_s)
        return np.where(found.converged, self._rms(difference), np.inf)

    def _rms(self, difference: Array) -> Array:
        if len(self._nuisance):
            difference = without(self._nuisance, difference)
        rms: Array = np.sqrt(np.einsum("nt,nt->n", difference, difference) / difference.shape[1])
        return rms
