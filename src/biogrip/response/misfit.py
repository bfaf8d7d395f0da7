"""The misfit of a population against a trace, in whichever way is fastest."""

from collections.abc import Callable

import numpy as np

from biogrip.arrays import Array
from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory
from biogrip.response.misfit_formed import FormedMisfit
from biogrip.response.misfit_series import SeriesMisfit
from biogrip.sample import SampleModel


def misfit_of(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    rotation_rad: Array,
    *,
    nonlinear: bool = False,
    nuisance: Array | None = None,
) -> Callable[[Array], Array]:
    """Return the RMS misfit as a function of parameters of shape (n, n_parameters).

    Parameters
    ----------
    gripper, model, torque
        What is simulated, without inertia.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    nonlinear
        Whether to simulate the nonlinear model.
    nuisance : (n_functions, n_samples)
        Functions that the instrument may have added, see `nuisance_basis`; none by default.
    """
    plain = nuisance is None or len(nuisance) == 0
    uniform = np.arange(len(time_s)) * (time_s[-1] / max(len(time_s) - 1, 1))
    is_uniform = np.allclose(time_s, uniform, rtol=0, atol=1e-9 * time_s[-1])
    if is_uniform and torque.only_steps and not nonlinear and plain:
        interval_s = float(time_s[-1]) / (len(time_s) - 1)
        return SeriesMisfit(gripper, model, torque, interval_s, rotation_rad)
    return FormedMisfit(
        gripper,
        model,
        torque,
        time_s,
        rotation_rad,
        nonlinear=nonlinear,
        nuisance=np.zeros((0, len(time_s))) if nuisance is None else nuisance,
    )
