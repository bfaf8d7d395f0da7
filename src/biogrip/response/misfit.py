"""Misfit of populations to traces, with a fast method for the paper's protocols."""

from collections.abc import Callable, Sequence

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.experiment.protocol import TorqueHistory
from biogrip.instrument.gripper import Gripper
from biogrip.response.misfit_series import SeriesMisfit
from biogrip.response.residuals import Residuals

Misfit = Callable[[Array], Array]
"""Function from parameters, (n, n_parameters), to RMS misfits in rad, (n,)."""

Misfits = Callable[[Array, IntArray], Array]
"""The same from (n_populations, n, n_parameters) and trace indices to (n_populations, n)."""


def make_misfit(
    residuals: Residuals,
    gripper: Gripper,
    torque: TorqueHistory,
    time_s: Array,
    rotation_rad: Array,
) -> Misfit:
    """Return the RMS misfit as a function of parameters of shape (n, n_parameters).

    That of residuals serves any protocol, sampling and noise. `SeriesMisfit` is used for steps of
    a torque, sampled uniformly from the start on, with the linear model, in white noise
    alone.
    """
    uniform = np.arange(len(time_s)) * (time_s[-1] / max(len(time_s) - 1, 1))
    is_uniform = np.allclose(time_s, uniform, rtol=0, atol=1e-9 * time_s[-1])
    if is_uniform and torque.only_steps and not torque.deforms and residuals.plain:
        interval_s = float(time_s[-1]) / (len(time_s) - 1)
        return SeriesMisfit(gripper, residuals.model, torque, interval_s, rotation_rad)
    return residuals.condensed_misfit


def combine_misfits(misfits: Sequence[Misfit]) -> Misfits:
    """Combine the misfit functions of several traces into one of a population for each trace.

    Its results equal those of the single functions to the last bit.
    """
    series = [misfit for misfit in misfits if isinstance(misfit, SeriesMisfit)]
    if len(series) == len(misfits) and all(map(series[0].joins, series)):
        return SeriesMisfit.joined(series).of_each

    def one_by_one(parameters: Array, traces: IntArray) -> Array:
        return np.stack(
            [misfits[trace](own) for own, trace in zip(parameters, traces, strict=True)]
        )

    return one_by_one
