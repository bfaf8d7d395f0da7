"""Effect of the gripper's calibration uncertainty on a rotation."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.fit.case_problem import NOT_FITTED, CaseProblem
from biogrip.instrument.gripper import Gripper
from biogrip.response.simulation import simulated_rotation

# Square of three standard uncertainties.
_SECOND_ORDER = 9.0


def gripper_functions(case_problem: CaseProblem, time_s: Array, parameters: Array) -> Array:
    """Compute the changes of a rotation by the uncertainties of the gripper's properties.

    To the first order it is half the difference between rotations with the property a standard
    uncertainty above and below its value, as is recommended for nonlinear models [1]_. The mean
    of both, less the rotation itself, is its second order: it grows with the square of the error,
    and has the amplitude of an error of three standard uncertainties. Without it limits would be
    too narrow where the noise is far below the square.

    Parameters
    ----------
    case_problem
        Assumptions of the identification.
    time_s : (n_times,)
        Ascending times.
    parameters : (n_parameters,)
        Searched parameters, SI units.

    Returns
    -------
    (2 n_properties, n_times)
        Changes in rad of first order, a row for each uncertain property, then those of second.

    References
    ----------
    .. [1] JCGM 100:2008, Evaluation of measurement data: guide to the expression of uncertainty
       in measurement, section 5.1.3, note 2.
    """
    network = case_problem.searched.network(parameters)

    def simulated(gripper: Gripper, torque: TorqueHistory) -> Array:
        nonlinear = case_problem.nonlinear
        return simulated_rotation(gripper, network, torque, time_s, nonlinear=nonlinear)[0]

    pairs = [(simulated(*above), simulated(*below)) for above, below in _pairs(case_problem)]
    if not pairs:
        return np.zeros((0, len(time_s)))
    above, below = np.stack(pairs, axis=1)
    second = 0.5 * (above + below) - simulated(case_problem.gripper, case_problem.torque)
    return np.vstack((0.5 * (above - below), _SECOND_ORDER * second))


_Instrument = tuple[Gripper, TorqueHistory]


def _pairs(case_problem: CaseProblem) -> Iterator[tuple[_Instrument, ...]]:
    """Yield two instruments for each uncertain property, one above and one below its value."""
    gripper, torque = case_problem.gripper, case_problem.torque
    for name, known in case_problem.uncertainty.items():
        for key, uncertainty in known.items():
            if not uncertainty or key == NOT_FITTED:
                continue
            errors = (uncertainty, -uncertainty)
            if name == "torque":
                yield tuple((gripper, torque.times(1 + error)) for error in errors)
            else:
                yield tuple((_changed(gripper, name, key, error), torque) for error in errors)


def _changed(gripper: Gripper, name: str, key: str, error: float) -> Gripper:
    """Return a gripper with a property of its own or of an arm changed."""
    if name == "gripper":
        return replace(gripper, **{key: getattr(gripper, key) + error})
    arm = getattr(gripper, name)
    return replace(gripper, **{name: replace(arm, **{key: getattr(arm, key) + error})})
