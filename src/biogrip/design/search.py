"""Global search for the best torque over families of torques, each with its best sampling.

References
----------
.. [1] R. Storn and K. Price, Differential evolution, Journal of Global Optimization 11 (1997),
   341-359.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.cells import cells
from biogrip.design.experiment import Wanted
from biogrip.design.looked import Looked, looked
from biogrip.design.sampling import best_sampling
from biogrip.design.shapes import SHAPES, Shape
from biogrip.design.views import Views
from biogrip.design.waveform import Waveform
from biogrip.errors import BiogripError

# Growth of cells, gap and fillings of samplings during the search; the final torque is sampled
# more finely.
_GROWTH, _GAP, _FILLINGS = 1.35, 0.03, 8
# Torques in a round; a power of two, for the first are from a Sobol sequence.
_CROWD = 128
_LOST = 1e3
# Decimals of a logarithm, so that the last bits of a processor decide nothing.
_DECIMALS = 8


@dataclass(frozen=True)
class Torque:
    """A torque against time.

    Parameters
    ----------
    waveform
        Torque in shares of the largest.
    largest_Nm
        Largest torque.
    """

    waveform: Waveform
    largest_Nm: float


class TorqueSearch:
    """Objective of the search: torques of a family, rated with their best sampling.

    Parameters
    ----------
    wanted
        Design problem.
    shape
        Family of torques.
    """

    def __init__(self, wanted: Wanted, shape: Shape) -> None:
        self._wanted, self._shape = wanted, shape
        self._cells = cells(round(wanted.limits.longest_s * wanted.fastest_Hz), _GROWTH)
        elapsed_s = self._cells.middle / wanted.fastest_Hz
        self._views = Views(wanted.gripper, wanted.model, wanted.parameters, elapsed_s)

    def torque(self, shares: Array) -> Torque:
        """Return the torque of some shares, as large as limits of torque and stroke allow."""
        waveform = self._shape.waveform(shares, self._wanted.limits)
        return self._scaled(waveform, self._looked(waveform))

    def logarithm(self, shares: Array) -> float:
        """Return the log of the typical relative bound; where contact is lost, a larger penalty."""
        wanted = self._wanted
        waveform = self._shape.waveform(shares, wanted.limits)
        if not waveform.highest:
            return 2 * _LOST
        seen = self._looked(waveform)
        if seen.pull > 0:
            return _LOST * (1 + seen.pull)
        scale = self._scaled(waveform, seen).largest_Nm / waveform.highest / wanted.noise_rad
        best = best_sampling(
            scale * seen.sensitivity,
            seen.capacity,
            wanted.samples,
            wanted.criterion,
            gap=_GAP,
            most=_FILLINGS,
            before=wanted.before,
        )
        bound = wanted.criterion.typical_bound(best.covariances)
        return round(float(np.log(bound)), _DECIMALS) if bound > 0 else _LOST

    def _looked(self, waveform: Waveform) -> Looked:
        return looked(self._views, self._cells, waveform, self._wanted.fastest_Hz)

    def _scaled(self, waveform: Waveform, seen: Looked) -> Torque:
        stroke, highest = self._wanted.stroke_rad, waveform.highest
        allowed = min(
            self._wanted.largest_Nm / highest if highest else 0.0, stroke / seen.turned_rad
        )
        return Torque(waveform.in_shares, allowed * highest)


def best_torques(
    wanted: Wanted,
    tried: int,
    rng: np.random.Generator,
    progress: Callable[[int, float], None],
) -> list[Torque]:
    """Search for the torques with the lowest typical relative bounds; the best comes first.

    Parameters
    ----------
    wanted
        Design problem.
    tried
        Approximate number of torques to try, as many of each shape.
    rng
        The only source of randomness.
    progress
        Called with the number tried, and the lowest typical relative bound.

    Raises
    ------
    BiogripError
        If no torque was found that keeps contact.
    """
    from scipy.optimize import differential_evolution

    rounds = max(1, round(tried / len(wanted.shapes) / _CROWD))
    count, lowest = 0, np.inf
    found: list[tuple[float, TorqueSearch, Array]] = []
    for name, shape in SHAPES.items():
        if name not in wanted.shapes:
            continue
        search = TorqueSearch(wanted, shape)

        def objective(shares: Array, search: TorqueSearch = search) -> float:
            nonlocal count, lowest
            value = search.logarithm(shares)
            count, lowest = count + 1, min(lowest, value)
            if lowest < _LOST:
                progress(count, float(np.exp(lowest)))
            return value

        last = differential_evolution(
            objective,
            [(0.0, 1.0)] * shape.shares,
            maxiter=rounds - 1,
            popsize=_CROWD / shape.shares,
            init="sobol",
            tol=1e-3,
            polish=False,
            rng=rng,
        )
        found += [
            (float(value), search, shares)
            for value, shares in zip(last.population_energies, last.population, strict=True)
            if value < _LOST
        ]
    if not found:
        raise BiogripError(
            f"design: with none of {count} torques do the jaws press throughout; allowed are more "
            "(`tried`), or samples that are less different."
        )
    found.sort(key=lambda each: each[0])
    return [search.torque(shares) for _, search, shares in found]
