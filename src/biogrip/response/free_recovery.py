"""Motion of first-order systems of springs and dampers from an initial state, mode by mode.

A system M z' + K z = f with M = L L^T and K = G^T G, one row of G a spring, has the
modes q = V^T L^T z of the singular value decomposition G L^-T = U S V^T, and the
rates S^2. Taking the decomposition of the factor rather than the eigenvalues of its
square keeps twice as many digits of the slow rates.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray
from biogrip.experiment.protocol import TorqueHistory
from biogrip.response.linear import phi_function


@dataclass(frozen=True)
class Forcing:
    """Loads from an instant on, while the torque is smooth."""

    powers: Array
    """Value, slope and curvature at that instant, (n_loads, 3)."""
    omega_rad_per_s: Array
    """Angular frequencies of sinusoids on top, (n_harmonics,)."""
    amplitudes: ComplexArray
    """Their complex amplitudes at that instant, (n_loads, n_harmonics)."""

    def at(self, elapsed_s: Array) -> Array:
        """Return the loads at times since the instant, (n_loads, n_times)."""
        powers = np.stack((np.ones_like(elapsed_s), elapsed_s, elapsed_s**2 / 2))
        turning = np.exp(1j * self.omega_rad_per_s[:, None] * elapsed_s)
        return self.powers @ powers + (self.amplitudes @ turning).real

    def later(self, elapsed_s: float) -> "Forcing":
        """Return the same loads, counted from a later instant on."""
        t = elapsed_s
        shift = np.array([[1, 0, 0], [t, 1, 0], [t**2 / 2, t, 1]])
        turned = self.amplitudes * np.exp(1j * self.omega_rad_per_s * t)
        return Forcing(self.powers @ shift, self.omega_rad_per_s, turned)


def smooth_pieces(torque: TorqueHistory) -> list[tuple[float, float, Forcing]]:
    """Divide a protocol at changes of torque into start, length and torques of both arms."""
    instants = np.concatenate((torque.time_s, torque.harmonic_time_s))
    starts = np.unique(instants[instants < torque.end_s])
    lengths = np.diff(np.append(starts, torque.end_s))
    pieces = []
    for start, length in zip(starts, lengths, strict=True):
        begun = torque.time_s <= start
        powers = np.zeros((2, 3))
        for at, left, right in zip(
            torque.time_s[begun], torque.left[begun], torque.right[begun], strict=True
        ):
            jumps = Forcing(np.stack((left, right)), np.zeros(0), np.zeros((2, 0), complex))
            powers += jumps.later(start - at).powers
        swinging = torque.harmonic_time_s <= start
        both = np.stack((torque.harmonic_left, torque.harmonic_right))[:, swinging]
        omega = torque.omega_rad_per_s[swinging]
        turned = both * np.exp(1j * omega * (start - torque.harmonic_time_s[swinging]))
        pieces.append((float(start), float(length), Forcing(powers, omega, turned)))
    return pieces


class Modes:
    """Modes of a system of springs and dampers.

    Of the springs G is given, (n_springs, n_states): the extension of each, times the root of its
    stiffness, by the states; of the dampers L, (n_states, n_states), lower triangular.
    """

    def __init__(self, springs: Array, dampers: Array) -> None:
        inverse = np.linalg.inv(dampers)
        _, sizes, turns = np.linalg.svd(springs @ inverse.T, full_matrices=False)
        self.rates = sizes**2
        self._into = turns @ dampers.T
        self._out = inverse.T @ turns.T
        self._drive = turns @ inverse

    def follow(self, state: Array, forcing: Forcing) -> "Motion":
        """Return the motion from a state, (n_states,), under loads on the first states."""
        drive = self._drive[:, : len(forcing.powers)]
        return Motion(
            self.rates[:, None],
            self._out,
            self._into @ state,
            Forcing(drive @ forcing.powers, forcing.omega_rad_per_s, drive @ forcing.amplitudes),
        )


@dataclass(frozen=True)
class Motion:
    """Motion of a system from an initial state."""

    rates: Array
    """Rates of decay, (n_modes, 1)."""
    shapes: Array
    """States by modes, (n_states, n_modes)."""
    start: Array
    """Initial values of the modes, (n_modes,)."""
    forcing: Forcing
    """Loads on the modes."""

    def at(self, elapsed_s: Array) -> Array:
        """Return the states at times since the beginning, (n_states, n_times)."""
        return self.shapes @ self._modes(elapsed_s)

    def rate(self, elapsed_s: Array) -> Array:
        """Return the states' rates of change at times since the beginning."""
        loads = self.forcing.at(elapsed_s)
        return self.shapes @ (loads - self.rates * self._modes(elapsed_s))

    def _modes(self, elapsed_s: Array) -> Array:
        z = -self.rates * elapsed_s
        modes: NDArray[Any] = np.exp(z) * self.start[:, None]
        for order in range(3):
            load = self.forcing.powers[:, order, None]
            if np.any(load):
                modes = modes + load * elapsed_s ** (order + 1) * phi_function(order + 1, z)
        for omega, a in zip(self.forcing.omega_rad_per_s, self.forcing.amplitudes.T, strict=True):
            swing = np.exp(1j * omega * elapsed_s) - np.exp(z)
            modes = modes + (a[:, None] / (1j * omega + self.rates) * swing).real
        return modes
