"""Stage 1: the noise-free response of a case."""

from pathlib import Path
from typing import Any

import numpy as np

from biogrip.protocol import sample_times, torque_at, torque_steps
from biogrip.response.linear import rotation, step_response
from biogrip.sample import MODELS
from biogrip.study import build
from biogrip.traces import write_target


def run(settings: dict[str, Any], output: Path) -> None:
    """Simulate a case and write its target.

    Parameters
    ----------
    settings
        ``gripper``, ``protocol``, ``rate_Hz``, ``model``, ``parameters``.
    output
        The target, CSV.
    """
    phases = build.phases(settings["protocol"])
    steps = torque_steps(phases)
    model = MODELS[settings["model"]]
    parameters = [settings["parameters"][name] for name in model.names]
    response = step_response(
        build.gripper(settings["gripper"]),
        model.network(np.array([parameters])),
        symmetric_torque=steps.symmetric,
    )
    time_s = sample_times(phases, settings["rate_Hz"])
    write_target(output, time_s, torque_at(steps, time_s), rotation(response, steps, time_s)[0])
