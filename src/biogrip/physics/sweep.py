"""A frequency sweep: the storage and loss moduli of a sample that is strained by sines.

Both are parts of one complex modulus, of which a response has one axis: the loss modulus stands at
minus the angular frequency in rad/s, the storage modulus at plus it. A spring that forgets its
deformation at the rate r, as a Maxwell branch does, shows of its stiffness

    i w / (i w + r):    w^2 / (w^2 + r^2)  at w,    w r / (w^2 + r^2)  at -w

and a sample the sum over its branches [1]_. A frequency w tells of times about 1/w.

References
----------
.. [1] J. D. Ferry, Viscoelastic Properties of Polymers, Wiley, 1980, chapter 3: moduli of a
   generalized Maxwell model.
"""

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.physics.condensed import Condensed
from biogrip.physics.modes import Modes, sum_of_modes
from biogrip.physics.protocol import Course


class Sweep(Course):
    """The course of a sweep of small strains, over all frequencies; moduli are over the strain."""

    sweeps = True

    def responses_at(self, rates: Array, places: Array, *, slopes: bool) -> Array:
        """Return moduli of springs that forget at negative rates, (1 + slopes, ..., n_places).

        Slopes are derivatives by the rate.
        """
        omega, stores, forgets = np.abs(places), is_storage(places), -rates[..., None]
        size = omega**2 + forgets**2
        found = np.where(stores, omega**2, omega * forgets) / size
        if not slopes:
            return found[None]
        of_loss = omega * (forgets**2 - omega**2)
        return np.stack((found, np.where(stores, 2 * forgets * omega**2, of_loss) / size**2))

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
