"""Effect of the gripper's calibration uncertainty on a rotation."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from biogrip.arrays import Array
from biogrip.identify.case_problem import CaseProblem
from biogrip.instrument.gripper import Gripper
from biogrip.response.simulation import simulated_rotation

_WITHOUT_RING = ("stiffness_Nm_per_rad", "damping_Nms_per_rad")


def gripper_functions(
    case_problem: CaseProblem, time_s: Array, parameters: Array, *, inertia: bool
) -> Array:
    """Compute the change of a rotation by one standard uncertainty of each arm property.

    The change is half the difference between rotations with the property a standard
    uncertainty above and below its value, as is recommended for nonlinear models [1]_.

    Parameters
    ----------
    case_problem
        Assumptions of the identification.
    time_s : (n_times,)
        Ascending times.
    parameters : (n_parameters,)
        Searched parameters, SI units.
    inertia
        True if the trace shows the arms ringing.

    Returns
    -------
    (n_properties, n_times)
        Changes in rad, one row for each uncertain property.

    References
    ----------
    .. [1] JCGM 100:2008, Evaluation of measurement data: guide to the expression of uncertainty
       in measurement, section 5.1.3, note 2.
    """
    network = case_problem.searched.network(parameters)

    def simulated(gripper: Gripper) -> Array:
        rows = simulated_rotation(
            gripper, network, case_problem.torque, time_s, nonlinear=case_problem.nonlinear
        )
        return rows[0]

    properties = (*_WITHOUT_RING, "inertia_kgm2") if inertia else _WITHOUT_RING
    pairs = _pairs(case_problem.gripper, case_problem.uncertainty, properties)
    found = [0.5 * (simulated(above) - simulated(below)) for above, below in pairs]
    return np.reshape(found, (len(found), len(time_s)))


def _pairs(
    gripper: Gripper, uncertainty: Mapping[str, Mapping[str, float]], properties: Sequence[str]
) -> Iterator[tuple[Gripper, Gripper]]:
    """Yield two grippers for each uncertain property, one above and one below its value."""
    for name, known in uncertainty.items():
        arm = getattr(gripper, name)
        for key in properties:
            if known.get(key):
                above, below = (
                    replace(arm, **{key: getattr(arm, key) + sign * known[key]}) for sign in (1, -1)
                )
                yield replace(gripper, **{name: above}), replace(gripper, **{name: below})
