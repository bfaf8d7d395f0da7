"""The rotation that a sample gives, by whichever model is asked for."""

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import Network
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import rotation, step_response
from biogrip.response.nonlinear import nonlinear_rotation


def simulated_rotation(
    gripper: Gripper, network: Network, torque: TorqueHistory, time_s: Array, *, nonlinear: bool
) -> Array:
    """Closing rotation of the left arm in rad, inertia included, shape (n, n_times).

    Parameters
    ----------
    gripper, network, torque
        What is simulated.
    time_s : (n_times,)
        Ascending times.
    nonlinear
        Whether to solve corrected eqs. (1)-(3), or the linear (4)-(6).

    Raises
    ------
    BiogripError
        If the torque closes the arms beyond what the nonlinear model describes.
    """
    if nonlinear:
        return nonlinear_rotation(gripper, network, torque, time_s)
    return rotation(step_response(gripper, network, symmetric=torque.symmetric), torque, time_s)
