"""Stage 1: the noise-free response of a case."""

from pathlib import Path
from typing import Any

import numpy as np

from biogrip.errors import BiogripError
from biogrip.protocol import torque_at
from biogrip.response.simulation import simulated_rotation
from biogrip.study import build
from biogrip.traces import write_target


def run(settings: dict[str, Any], output: Path) -> None:
    """Simulate a case and write its target.

    Parameters
    ----------
    settings
        ``gripper``, ``protocol`` (and ``actuator``, if that is in volts),
        ``sampling``, ``model``, ``branches``, ``parameters``, ``nonlinear``,
        ``stroke_rad``.
    output
        The target, CSV.

    Raises
    ------
    BiogripError
        If the rotation is not finite, or the arms turn further than the comb drives can.
    """
    gripper, torque = build.gripper(settings["gripper"]), build.torque(settings)
    model = build.sample_model(settings)
    parameters = [settings["parameters"][name] for name in model.names]
    network = model.network(np.array([parameters]))
    time_s = build.sampling(settings["sampling"], torque.end_s)
    simulated = simulated_rotation(
        gripper, network, torque, time_s, nonlinear=settings["nonlinear"]
    )
    for sample in np.flatnonzero(~np.isfinite(simulated[0]))[:1]:
        with_values = ", ".join(
            f"{name} = {settings['parameters'][name]:g}" for name in model.names
        )
        raise BiogripError(
            f"the simulated rotation of {model.title} with {with_values} is {simulated[0, sample]} "
            f"at {time_s[sample]:g} s; allowed are parameters, a gripper and a protocol for which "
            "it is finite."
        )
    largest = float(np.max(np.abs(simulated)))
    if largest > settings["stroke_rad"]:
        raise BiogripError(
            f"the protocol turns the arms by {1e3 * largest:.4g} mrad, allowed is what the comb "
            f"drive's stroke leaves, {1e3 * settings['stroke_rad']:.4g} mrad."
        )
    write_target(output, time_s, torque_at(torque, time_s), simulated[0])
