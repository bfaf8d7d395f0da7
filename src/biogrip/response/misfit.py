"""The misfit of populations against traces: the paper's search has a fast way of its own."""

from collections.abc import Callable, Sequence

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.experiment.protocol import TorqueHistory
from biogrip.instrument.gripper import Gripper
from biogrip.response.misfit_series import SeriesMisfit
from biogrip.response.residuals import Residuals

Misfit = Callable[[Array], Array]
"""Of parameters of shape (n, n_parameters), the RMS misfit in rad, (n,)."""

Misfits = Callable[[Array, IntArray], Array]
"""Of (n_populations, n, n_parameters), and of which trace each is for, (n_populations, n)."""


def misfit_of(
    residuals: Residuals,
    gripper: Gripper,
    torque: TorqueHistory,
    time_s: Array,
    rotation_rad: Array,
) -> Misfit:
    """Return the RMS misfit as a function of parameters of shape (n, n_parameters).

    Parameters
    ----------
    residuals
        Of the trace; their misfit serves any protocol, sampling and noise.
    gripper, torque, time_s, rotation_rad
        What they were made of. Torque steps, sampled uniformly from the start on, of the linear
        model without inertia, in white noise alone, need no response at all.
    """
    uniform = np.arange(len(time_s)) * (time_s[-1] / max(len(time_s) - 1, 1))
    is_uniform = np.allclose(time_s, uniform, rtol=0, atol=1e-9 * time_s[-1])
    if is_uniform and torque.only_steps and residuals.plain:
        interval_s = float(time_s[-1]) / (len(time_s) - 1)
        return SeriesMisfit(gripper, residuals.model, torque, interval_s, rotation_rad)
    return residuals.condensed_misfit


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
