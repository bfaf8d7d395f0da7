"""Cases with a designed experiment, compared with the experiment of the study."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.experiment import Experiment, compute_information, relative_bounds
from biogrip.experiment.protocol import torque_history
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.ringing import ringing_responses
from biogrip.study.study import Study

WELL = 0.1
"""Relative bound below which a parameter counts as determined."""

# Number of samples whose sensitivities are computed at once.
_AT_ONCE = 20


@dataclass(frozen=True)
class CaseSettings:
    """A case with its own experiment and that of the study.

    Parameters
    ----------
    gripper, model
        Simulated gripper and sample model, with inertia; the model is without fixed parameters.
    parameters
        True values by name, SI units.
    noise_rad
        Standard deviation of the sensor's noise.
    before, after
        Protocol and sampling of the study (before) and of the case (after).
    title
        Title.
    """

    gripper: Gripper
    model: SampleModel
    parameters: Mapping[str, float]
    noise_rad: float
    before: Experiment
    after: Experiment
    title: str


def settings(study: Study) -> dict[str, CaseSettings]:
    """Return the experiments of the simulated cases that have a `design` block and bursts."""
    shared = study.config
    before = (
        shared.protocol.torques(shared.actuator),
        shared.measurement.sampling,
    )
    found = {}
    for name in designed_cases(study):
        case = study.cases[name]
        block = case.block.design
        assert block is not None
        found[name] = CaseSettings(
            case.gripper,
            case.problem.searched,
            case.parameters,
            block.noise_rad,
            before,
            (case.phases, case.sampling),
            case.title,
        )
    return found


def designed_cases(study: Study) -> list[str]:
    """Return names of simulated cases that have a `design` block and are sampled in bursts."""
    return [
        name
        for name in study.simulated
        if study.cases[name].block.design and study.cases[name].block.measurement.bursts
    ]


def bounds(case: CaseSettings, experiment: Experiment, parameters: Array) -> Array:
    """Return relative Cramér-Rao bounds of parameters in an experiment, with all of them unknown.

    Parameters
    ----------
    case
        Gripper, model and noise.
    experiment
        Protocol and sampling.
    parameters : (n, n_parameters)
        Parameters of n samples, SI units.

    Returns
    -------
    (n, n_parameters)
    """
    phases, sampling = experiment
    torque = torque_history(phases)
    times = sampling.over(torque.end_s)
    found = []
    for start in range(0, len(parameters), _AT_ONCE):
        some = parameters[start : start + _AT_ONCE]
        sensitivity = ringing_responses(case.gripper, case.model, torque, times, some)[:, 1:]
        found.append(relative_bounds(compute_information(sensitivity) / case.noise_rad**2))
    return np.concatenate(found)
