"""A frequency sweep: the storage and loss moduli of a sample that is strained by sines.

Both are parts of one complex modulus, of which a response has one axis: the loss modulus stands at
minus the angular frequency in rad/s, the storage modulus at plus it. Both are sums over branches
(`biogrip.physics.modes.moduli_of_modes`). A frequency w tells of times about 1/w.
"""

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.physics.condensed import Condensed
from biogrip.physics.modes import Modes, sum_of_modes
from biogrip.physics.protocol import Course


class Sweep(Course):
    """The course of a sweep of small strains, over all frequencies; moduli are over the strain."""

    sweeps = True

    def spread_s(self, time_s: Array) -> tuple[float, float]:
        """Return the inverse of the highest and of the lowest frequency."""
        omega = np.abs(time_s)
        return float(1 / omega.max()), float(1 / omega.min())

    covered_s = spread_s

    def place(self, time_s: float) -> str:
        """Return modulus and frequency in words."""
        return f"{abs(time_s):.4g} rad/s ({'storage' if is_storage(time_s) else 'loss'})"


SWEEP = Sweep(np.zeros(1), np.zeros((1, 1)), np.zeros((1, 1)), 1.0, deforms=True)
"""Any sweep."""


def is_storage(places: Array | float) -> BoolArray:
    """Return which places are of the storage modulus; the others are of the loss modulus."""
    return np.asarray(places) > 0


def joined(omega: Array, storage: Array, loss: Array) -> tuple[Array, Array]:
    """Return places and readings of a sweep, (2 n_omega,), from ascending frequencies in rad/s."""
    return np.append(-omega[::-1], omega), np.append(loss[::-1], storage)


class SweptRows(Condensed):
    """Rows that are the readings themselves: a sweep has few."""

    def of_trace(self, readings: Array) -> Array:
        """Return readings without nuisance as they are, (n_samples,)."""
        return readings

    def of_modes(self, modes: Modes) -> Array:  # type: ignore[override]
        """Return rows of samples, (n, 1 + n_parameters, n_samples)."""
        return self.cleared(sum_of_modes(modes, self.course, self.all_s))
