"""Stage 1: noise-free rotation of a case, and the force of the jaws on its sample."""

from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import TorqueHistory, torque_at, torque_history
from biogrip.experiment.sample import Network
from biogrip.progress import warn
from biogrip.records.traces import write_target, write_target_without_jaws
from biogrip.response.grip import compute_grip
from biogrip.response.jaw_force import jaw_force
from biogrip.response.simulation import simulated_rotation
from biogrip.response.unilateral import unilateral_response
from biogrip.study.study import Case


def simulate(case: Case, target: Path) -> None:
    """Simulate a case, and write its target, CSV.

    Raises
    ------
    BiogripError
        If the rotation is not finite, or exceeds the stroke of the comb drives.
    """
    torque = torque_history(case.phases, deforms=case.instrument.deforms)
    network = case.sample.model.sample(case.parameters)
    time_s = case.sampling.over(torque.end_s)
    if not case.instrument.has_jaws:
        read = simulated_rotation(case.gripper, network, torque, time_s, nonlinear=False)[0]
        _check_finite(case, time_s, read)
        controlled = torque_at(torque, time_s)
        write_target_without_jaws(target, time_s, controlled, read, case.instrument)
        return
    rotation, force = _response(case, network, torque, time_s)
    _check(case, time_s, rotation)
    _say_if_contact_is_lost(case, network, torque)
    write_target(target, time_s, torque_at(torque, time_s), rotation, force)


def _response(
    case: Case, network: Network, torque: TorqueHistory, time_s: Array
) -> tuple[Array, Array]:
    """Return the rotation of the left arm and the jaw force."""
    gripper, nonlinear = case.gripper, case.nonlinear_target
    if case.unilateral:
        found = unilateral_response(gripper, network, torque, time_s)
        return found.rotation_rad[0], found.jaw_force_N
    rotation = simulated_rotation(gripper, network, torque, time_s, nonlinear=nonlinear)
    return rotation[0], jaw_force(gripper, network, torque, time_s, nonlinear=nonlinear)[0]


def _say_if_contact_is_lost(case: Case, network: Network, torque: TorqueHistory) -> None:
    grip = compute_grip(case.gripper, network, torque, nonlinear=case.nonlinear_target)
    words = grip.words()
    if words is None:
        return
    then = (
        "contact is lost there, which its identification ignores"
        if case.unilateral
        else "without adhesion contact is lost there (contact: unilateral simulates that)"
    )
    warn(f"{case.name}: under this protocol {words}; {then}.")


def _check_finite(case: Case, time_s: Array, simulated: Array) -> None:
    model = case.sample.model
    for sample in np.flatnonzero(~np.isfinite(simulated))[:1]:
        values = ", ".join(f"{name} = {case.parameters[name]:g}" for name in model.names)
        read = case.instrument.read.name
        raise BiogripError(
            f"the simulated {read} of {model.title} with {values} is {simulated[sample]} "
            f"at {time_s[sample]:g} s; allowed are parameters, a gripper and a protocol for which "
            "it is finite."
        )


def _check(case: Case, time_s: Array, simulated: Array) -> None:
    _check_finite(case, time_s, simulated)
    largest = float(np.max(np.abs(simulated)))
    if largest > case.stroke_rad:
        raise BiogripError(
            f"the protocol turns the arms by {1e3 * largest:.4g} mrad, allowed is what the comb "
            f"drive's stroke leaves, {1e3 * case.stroke_rad:.4g} mrad."
        )
