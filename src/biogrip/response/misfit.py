"""The misfit of populations against traces, in whichever way is fastest."""

from collections.abc import Callable, Sequence

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.misfit_formed import FormedMisfit
from biogrip.response.misfit_series import SeriesMisfit

Misfit = Callable[[Array], Array]
"""Of parameters of shape (n, n_parameters), the RMS misfit in rad, (n,)."""

Misfits = Callable[[Array, IntArray], Array]
"""Of (n_populations, n, n_parameters), and of which trace each is for, (n_populations, n)."""


def misfit_of(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    rotation_rad: Array,
    *,
    nonlinear: bool = False,
    inertia: bool = False,
    nuisance: Array | None = None,
) -> Misfit:
    """Return the RMS misfit as a function of parameters of shape (n, n_parameters).

    Parameters
    ----------
    gripper, model, torque
        What is simulated.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    nonlinear
        Whether to simulate the nonlinear model.
    inertia
        Whether the arms have any.
    nuisance : (n_functions, n_samples)
        Functions that the instrument may have added, see `nuisance_basis`; none by default.
    """
    plain = not (nonlinear or inertia) and (nuisance is None or len(nuisance) == 0)
    uniform = np.arange(len(time_s)) * (time_s[-1] / max(len(time_s) - 1, 1))
    is_uniform = np.allclose(time_s, uniform, rtol=0, atol=1e-9 * time_s[-1])
    if is_uniform and torque.only_steps and plain:
        interval_s = float(time_s[-1]) / (len(time_s) - 1)
        return SeriesMisfit(gripper, model, torque, interval_s, rotation_rad)
    return FormedMisfit(
        gripper,
        model,
        torque,
        time_s,
        rotation_rad,
        nonlinear=nonlinear,
        inertia=inertia,
        nuisance=np.zeros((0, len(time_s))) if nuisance is None else nuisance,
    )


def together(misfits: Sequence[Misfit]) -> Misfits:
    """Return the misfits of one trace each as one function of a population for each trace.

    It has the same bits as the misfits by themselves.
    """
    series = [misfit for misfit in misfits if isinstance(misfit, SeriesMisfit)]
    if len(series) == len(misfits) and all(map(series[0].joins, series)):
        return SeriesMisfit.joined(series).of_each

    def one_by_one(parameters: Array, traces: IntArray) -> Array:
        return np.stack(
            [misfits[trace](own) for own, trace in zip(parameters, traces, strict=True)]
        )

    return one_by_one
