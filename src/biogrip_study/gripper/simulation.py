"""Force of the gripper on the sample by either model, linear or nonlinear.

In the nonlinear model F - F_linear = g - (c u' + k u)/b_0^2, with g the load and u the correction
of `biogrip_study.gripper.nonlinear`, all of second order: no large terms cancel.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.protocol import Course
from biogrip.physics.response import linear_jaw_force
from biogrip.physics.sample_model import Network
from biogrip.physics.simulation import Grip, extreme_forces
from biogrip_study.gripper.nonlinear import correction


def jaw_force(
    gripper: Gripper,
    network: Network,
    course: Course,
    time_s: Array,
    *,
    nonlinear: bool,
    inertia: bool = True,
) -> Array:
    """Compute the jaws' force on the sample in N, positive while they press, (n, n_times).

    By either model; at the instant of a step: what follows it. Without inertia, it may jump.
    """
    force = linear_jaw_force(gripper, network, course, time_s, inertia=inertia)
    if nonlinear:
        # Arms with inertia have not moved yet at the instant of a step.
        instants = np.nextafter(time_s, -np.inf) if inertia else time_s
        force += correction(gripper, network, course).checked().force_at(instants)
    return force


def target_grip(gripper: Gripper, network: Network, course: Course, *, nonlinear: bool) -> Grip:
    """Compute the extreme forces of the jaws on the first sample, without inertia."""
    given = gripper, network, course
    return extreme_forces(
        lambda time_s: jaw_force(*given, time_s, nonlinear=nonlinear, inertia=False)[0], course
    )
