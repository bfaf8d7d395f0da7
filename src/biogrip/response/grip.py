"""Largest and lowest force of the jaws on a sample, which is negative if they have to pull."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import Network
from biogrip.instrument.gripper import Gripper
from biogrip.response.jaw_force import jaw_force

# Forces below this share of the largest one are rounding errors.
_NOTHING = 1e-9
_A_PHASE, _A_PERIOD, _MOST = 200, 32, 200_000


@dataclass(frozen=True)
class Grip:
    """The force of the jaws on a sample that they hold throughout a protocol."""

    largest_N: float
    """Largest force with which the jaws press."""
    lowest_N: float
    """Lowest force, negative if the jaws pull, else after the largest one."""
    lowest_at_s: float
    """Time of the lowest force."""
    pulls_from_s: float | None
    """Time from which the jaws would have to pull; None if they press throughout."""

    def words(self) -> str | None:
        """Describe from when and how hard the jaws would have to pull, if they would."""
        if self.pulls_from_s is None:
            return None
        return (
            f"the jaws would have to pull the sample from {self.pulls_from_s:.4g} s on "
            f"(with {-1e6 * self.lowest_N:.2g} µN at {self.lowest_at_s:.4g} s, where they press "
            f"with {1e6 * self.largest_N:.2g} µN at most)"
        )


def compute_grip(
    gripper: Gripper, network: Network, torque: TorqueHistory, *, nonlinear: bool
) -> Grip:
    """Compute the extreme forces of the jaws on the first sample, without inertia.

    By either model, as in `simulated_rotation`.
    """
    time_s = _instants(torque)
    force = jaw_force(gripper, network, torque, time_s, nonlinear=nonlinear, inertia=False)[0]
    least_shown = _NOTHING * float(np.abs(force).max()) or 1.0
    shown = np.round(force / least_shown)
    most, negative = int(np.argmax(shown)), np.flatnonzero(shown < 0)
    first = 0 if len(negative) else most
    least = first + int(np.argmin(shown[first:]))
    return Grip(
        float(shown[most] * least_shown),
        float(shown[least] * least_shown),
        float(time_s[least]),
        float(time_s[negative[0]]) if len(negative) else None,
    )


def _instants(torque: TorqueHistory) -> Array:
    """Return times that are dense after every change of torque and within every period."""
    starts = np.unique(np.concatenate((torque.time_s, torque.harmonic_time_s)))
    starts = starts[starts < torque.end_s]
    lengths = np.diff(np.append(starts, torque.end_s))
    share = np.geomspace(1e-9, 1.0, _A_PHASE)[:-1]
    pieces = [start + length * share for start, length in zip(starts, lengths, strict=True)]
    if len(torque.omega_rad_per_s):
        periods = torque.end_s * float(torque.omega_rad_per_s.max()) / (2 * np.pi)
        count = int(min(_MOST, _A_PERIOD * np.ceil(periods)))
        pieces.append(np.linspace(0, torque.end_s, count))
    return np.unique(np.append(np.concatenate(pieces), torque.end_s))
