"""What the experiment does: torque against time, and when the rotation is sampled."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array


@dataclass(frozen=True)
class Phase:
    """A stretch of time in which both comb drives hold their torque.

    Parameters
    ----------
    duration_s
        How long the phase lasts.
    torque_left_Nm, torque_right_Nm
        Closing torques tau_2 and tau_4, as increments on those that close the
        arms onto the sample.
    """

    duration_s: float
    torque_left_Nm: float
    torque_right_Nm: float


@dataclass(frozen=True)
class TorqueSteps:
    """A protocol as the steps it is made of: the linear response superposes them.

    Parameters
    ----------
    time_s : (n_steps,)
        When each step happens, ascending.
    left_Nm, right_Nm : (n_steps,)
        By how much tau_2 and tau_4 jump then.
    """

    time_s: Array
    left_Nm: Array
    right_Nm: Array

    @property
    def symmetric(self) -> bool:
        """Whether both arms are driven alike."""
        return bool(np.array_equal(self.left_Nm, self.right_Nm))


def torque_steps(phases: tuple[Phase, ...]) -> TorqueSteps:
    """Turn phases that follow one another from t = 0 into torque steps."""
    starts = np.concatenate(([0.0], np.cumsum([phase.duration_s for phase in phases])[:-1]))
    left = np.array([phase.torque_left_Nm for phase in phases])
    right = np.array([phase.torque_right_Nm for phase in phases])
    return TorqueSteps(starts, np.diff(left, prepend=0.0), np.diff(right, prepend=0.0))


def torque_at(steps: TorqueSteps, time_s: ArrayLike) -> Array:
    """Torque of the left arm in N m; at the instant of a step, its value after it."""
    passed = np.searchsorted(steps.time_s, np.asarray(time_s, dtype=float), side="right")
    return np.concatenate(([0.0], np.cumsum(steps.left_Nm)))[passed]


def duration_s(phases: tuple[Phase, ...]) -> float:
    """Length of the whole protocol in s."""
    return float(sum(phase.duration_s for phase in phases))


def sample_times(phases: tuple[Phase, ...], rate_Hz: float) -> Array:
    """Uniform sampling instants in s, both ends of the protocol included."""
    count = int(np.floor(duration_s(phases) * rate_Hz * (1 + 1e-12))) + 1
    return np.arange(count) / rate_Hz
