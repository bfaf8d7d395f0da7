"""Simulated rotation and shortening of samples, with the linear or the nonlinear model."""

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import Network
from biogrip.instrument.gripper import Gripper
from biogrip.instrument.linkage import displacement_of_tip
from biogrip.response.linear import LEFT, RIGHT, rotation, step_response
from biogrip.response.nonlinear import nonlinear_rotation
from biogrip.response.protocol_modes import relaxation


def simulated_rotation(
    gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array, *, nonlinear: bool
) -> Array:
    """Simulate the closing rotation of the left arm in rad, with inertia, (n, n_times).

    By the nonlinear model, corrected eqs. (1)-(3), which has the errors of `computed_correction`,
    or the linear one, (4)-(6), at ascending times.
    """
    if nonlinear:
        return nonlinear_rotation(gripper, network, torque, time_s)
    if torque.deforms:
        return relaxation(network, torque, time_s)
    response = step_response(
        gripper, network, symmetric=torque.symmetric, inertia=gripper.has_inertia
    )
    return rotation(response, torque, time_s)


def simulated_shortening(
    gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array, *, nonlinear: bool
) -> Array:
    """Simulate the shortening of samples in m, (n, n_times); see `simulated_rotation`."""
    if nonlinear:
        turns = (nonlinear_rotation(gripper, network, torque, time_s, a) for a in (LEFT, RIGHT))
        left, right = (displacement_of_tip(gripper, turn) for turn in turns)
        return left + right
    response = step_response(gripper, network, symmetric=torque.symmetric, both_arms=True)
    both = rotation(response, torque, time_s, LEFT) + rotation(response, torque, time_s, RIGHT)
    return gripper.lever_m * both
