"""Cases whose experiment was designed: what is simulated, beside the study's own experiment."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.experiment import Experiment, information_of, relative_bounds
from biogrip.experiment.protocol import torque_history
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.ringing import ringing_responses
from biogrip.study.study import Study

WELL = 0.1
"""A parameter that is known to this share of itself counts as determined."""

# Samples whose sensitivities are formed at once.
_AT_ONCE = 20


@dataclass(frozen=True)
class CaseSettings:
    """A case's experiment, and the study's.

    Parameters
    ----------
    gripper, model
        What is simulated, with inertia; the model without what is known.
    parameters
        True values by name, SI units.
    noise_rad
        Of the sensor.
    before, after
        Protocol and sampling of the study, and of the case.
    title
        In print.
    """

    gripper: Gripper
    model: SampleModel
    parameters: Mapping[str, float]
    noise_rad: float
    before: Experiment
    after: Experiment
    title: str


def settings(study: Study) -> dict[str, CaseSettings]:
    """Choose the experiments of cases that ask for a design."""
    shared = study.config
    before = (
        shared.protocol.torques(shared.actuator),
        shared.measurement.sampling,
    )
    found = {}
    for name in designed_cases(study):
        case = study.cases[name]
        asked = case.block.design
        assert asked is not None
        found[name] = CaseSettings(
            case.gripper,
            case.problem.searched,
            case.parameters,
            asked.noise_rad,
            before,
            (case.phases, case.sampling),
            case.title,
        )
    return found


def designed_cases(study: Study) -> list[str]:
    """Name the simulated cases that ask for a design, and are sampled as one has it, in bursts."""
    return [
        name
        for name in study.simulated
        if study.cases[name].block.design and study.cases[name].block.measurement.bursts
    ]


def bounds(case: CaseSettings, experiment: Experiment, parameters: Array) -> Array:
    """Return relative bounds of samples' parameters in an experiment, none taken as known.

    Parameters
    ----------
    case
        Gripper, model and noise.
    experiment
        Which one.
    parameters : (n, n_parameters)
        Samples, SI units.

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
        told = ringing_responses(case.gripper, case.model, torque, times, some)[:, 1:]
        found.append(relative_bounds(information_of(told) / case.noise_rad**2))
    return np.concatenate(found)
