"""The best torque: a global search over trains of steps, each with its best sampling.

References
----------
.. [1] R. Storn and K. Price, Differential evolution, Journal of Global Optimization 11 (1997),
   341-359.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.design.cells import cells
from biogrip.design.experiment import Wanted
from biogrip.design.sampling import best_sampling
from biogrip.design.steps import SHARES, Steps, train
from biogrip.design.views import View, Views
from biogrip.errors import BiogripError

# Cells of the search are this much longer than those before, and its samplings this far from the
# best; the torque that it finds is sampled more finely.
_GROWTH, _GAP, _FILLINGS = 1.35, 0.03, 8
# Torques that are tried in a round; of Sobol's sequence, a power of two.
_CROWD = 128
# While the search looks at few instants, the force must not come nearer to zero than this.
_MARGIN = 2e-3
_LOST = 1e3
# Of a logarithm, so that the last bits of a processor decide nothing.
_DECIMALS = 8


@dataclass(frozen=True)
class Torque:
    """Steps of torque.

    Parameters
    ----------
    steps
        Durations, and levels as shares of the largest.
    largest_Nm
        The largest.
    """

    steps: Steps
    largest_Nm: float


class TorqueSearch:
    """Torques, and how good they are with their best sampling.

    Parameters
    ----------
    wanted
        What is to be designed.
    """

    def __init__(self, wanted: Wanted) -> None:
        self._wanted = wanted
        self._cells = cells(round(wanted.limits.longest_s * wanted.fastest_Hz), _GROWTH)
        self._elapsed_s = self._cells.middle / wanted.fastest_Hz
        self._views = Views(wanted.gripper, wanted.model, wanted.parameters, self._elapsed_s)

    def torque(self, shares: Array) -> Torque:
        """Return the torque of so many shares, as large as torque and stroke allow."""
        steps = train(shares, self._wanted.limits)
        return self._scaled(steps, self._views.under(steps))

    def _scaled(self, steps: Steps, view: View) -> Torque:
        seen = self._elapsed_s < steps.durations_s[:, None]
        turned = float(np.max(np.abs(view.rotation), where=seen, initial=0.0))
        turned = max(turned, float(np.max(np.abs(view.last_rotation))))
        stroke, highest = self._wanted.stroke_rad, float(steps.levels.max())
        allowed = min(self._wanted.largest_Nm / highest if highest else 0.0, stroke / turned)
        return Torque(Steps(steps.durations_s, steps.levels / highest), allowed * highest)

    def logarithm(self, shares: Array) -> float:
        """Logarithm of the typical relative bound; where contact is lost, more than any of them."""
        wanted = self._wanted
        steps = train(shares, wanted.limits)
        if not steps.levels.any():
            return 2 * _LOST
        view = self._views.under(steps)
        slots = np.round(steps.durations_s * wanted.fastest_Hz)[:, None]
        seen = self._cells.middle < slots
        pull = _pull(view, seen)
        if pull > 0:
            return _LOST * (1 + pull)
        torque = self._scaled(steps, view)
        scale = torque.largest_Nm / float(steps.levels.max()) / wanted.noise_rad
        capacity = np.clip(slots - self._cells.first, 0, self._cells.slots) * seen
        told = scale * view.sensitivity.reshape(*view.sensitivity.shape[:2], -1)
        room = capacity.ravel()
        there = room > 0
        best = best_sampling(
            told[..., there],
            room[there],
            wanted.samples,
            wanted.criterion,
            gap=_GAP,
            most=_FILLINGS,
            before=wanted.before,
        )
        bound = wanted.criterion.typical_bound(best.covariances)
        return round(float(np.log(bound)), _DECIMALS) if bound > 0 else _LOST


def _pull(view: View, seen: BoolArray) -> float:
    """How far the force of a sample comes below its margin, as a share of its largest."""
    largest = np.max(view.force, axis=(1, 2), where=seen, initial=0.0)
    lowest = np.min(view.force, axis=2, where=seen, initial=np.inf)
    lowest = np.minimum(lowest, view.last_force)
    margin = np.where(np.arange(lowest.shape[1]) > 0, _MARGIN, 0.0) * largest[:, None]
    return float(np.max((margin - lowest) / largest[:, None]))


def best_torques(
    wanted: Wanted, tried: int, rng: np.random.Generator, progress: Callable[[int, float], None]
) -> list[Torque]:
    """Search for torques with which plausible samples show best; the best comes first.

    Parameters
    ----------
    wanted
        What is to be designed.
    tried
        How many torques are tried, about.
    rng
        The only source of randomness.
    progress
        Is told how many were tried, and the lowest typical relative bound.

    Raises
    ------
    BiogripError
        If no torque was found that keeps contact.
    """
    from scipy.optimize import differential_evolution

    search = TorqueSearch(wanted)
    count, lowest = 0, np.inf

    def objective(shares: Array) -> float:
        nonlocal count, lowest
        value = search.logarithm(shares)
        count, lowest = count + 1, min(lowest, value)
        if lowest < _LOST:
            progress(count, float(np.exp(lowest)))
        return value

    found = differential_evolution(
        objective,
        [(0.0, 1.0)] * SHARES,
        maxiter=max(0, round(tried / _CROWD) - 1),
        popsize=_CROWD / SHARES,
        init="sobol",
        tol=1e-3,
        polish=False,
        rng=rng,
    )
    order = np.argsort(found.population_energies, kind="stable")
    kept = [row for row in order if found.population_energies[row] < _LOST]
    if not kept:
        raise BiogripError(
            f"design: with none of {count} torques do the jaws press throughout; allowed are more "
            "(`tried`), or samples that are less different."
        )
    return [search.torque(found.population[row]) for row in kept]
