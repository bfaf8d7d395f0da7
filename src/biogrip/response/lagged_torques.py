"""Torques of a protocol that lag behind by a relaxation time."""

from collections.abc import Callable, Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.response.linear import StepResponse, rotation
from biogrip.response.mode_decay import compute_decay


def lagged_torques(torque: TorqueHistory, shares: Sequence[float]) -> Callable[[Array], Array]:
    """Return a function of time for lagged torques, of the left arm and the difference of arms.

    Of a deformation, it is for the forces of springs that forget it with these relaxation times.

    Parameters
    ----------
    torque
        The protocol.
    shares
        Relaxation times of the lags over the protocol's duration.
    """
    drives = 1 if torque.symmetric else 2
    rates = -1 / (torque.end_s * np.tile(shares, drives))
    if torque.deforms:
        return lambda time_s: compute_decay(rates[:, None], torque, time_s)[0][:, 0, 0]
    static = np.repeat(np.eye(drives), len(shares), axis=0)[:, None, :]
    lags = StepResponse(static, rates[:, None], -static[..., None])
    return lambda time_s: rotation(lags, torque, time_s)
