"""Cases with a designed experiment, compared with the experiment of the study."""

import numpy as np

from biogrip.arrays import Array, parts
from biogrip.design.experiment import Experiment, compute_information, relative_bounds
from biogrip.design.noise import WHITE
from biogrip.experiment.protocol import torque_history
from biogrip.response.ringing import ringing_responses
from biogrip.study.study import Case, Study

WELL = 0.1
"""Relative bound below which a parameter counts as determined."""

# Number of samples whose sensitivities are computed at once.
_AT_ONCE = 20


USED = "gripper searched parameters design.noise design.noise_level experiment study.experiment"
"""Settings that the bounds of a case in its own experiment and in that of the study depend on."""


def designed_cases(study: Study) -> list[str]:
    """Return names of simulated cases of a gripper with a `design` block and sampled in bursts."""
    return [
        name
        for name in study.simulated
        if study.cases[name].block.design
        and study.cases[name].block.measurement.bursts
        and study.cases[name].instrument.has_jaws
    ]


def bounds(case: Case, experiment: Experiment, parameters: Array) -> Array:
    """Return relative Cramér-Rao bounds of n samples, (n, n_parameters), with all unknown."""
    phases, sampling = experiment
    torque = torque_history(phases)
    times = sampling.over(torque.end_s)
    noise = case.design.noise or WHITE
    found = []
    for some in parts(len(parameters), _AT_ONCE):
        rows = ringing_responses(case.gripper, case.searched, torque, times, parameters[some])
        read = noise.whiten(times, rows[:, 1:] / case.design.noise_level)
        found.append(relative_bounds(compute_information(read)))
    return np.concatenate(found)
