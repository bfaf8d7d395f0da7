"""Flow of a sample, beside a drift of the instrument."""

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.response.lagged_torques import lagged_torques
from biogrip.response.nuisance import nuisance_basis, without

# A lag of so many protocols is an integral of the torque.
_LAG = 1e6
# Share of a drift's variance that must be no flow: below it, lines differ by less than a tenth.
_TELLING = 0.01


def drift_is_flow(torque: TorqueHistory, time_s: Array) -> bool:
    """Return True if a drift looks like the flow of a damper without a spring.

    Under a constant load both are the same line. Under a deformation nothing flows on.

    Parameters
    ----------
    torque
        The protocol.
    time_s : (n_samples,)
        Sampling times.
    """
    if torque.deforms:
        return False
    constant = nuisance_basis(time_s, offset=True, drift=False)
    flows = without(constant, _LAG * lagged_torques(torque, (_LAG,))(time_s))
    drift = without(constant, time_s / torque.end_s)
    basis = np.linalg.qr(flows.T)[0].T
    return bool(np.sum(without(basis, drift) ** 2) < _TELLING * np.sum(drift**2))
