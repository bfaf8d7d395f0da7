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
from biogrip.design.cell_responses import CellResponses, compute_cell_responses
from biogrip.design.experiment import DesignInputs
from biogrip.design.sampling import best_sampling
from biogrip.design.shapes import SHAPES, Shape
from biogrip.design.time_bins import time_bins
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
    """A torque against time."""

    waveform: Waveform
    """Torque in shares of the largest."""
    largest_Nm: float
    """Largest torque."""


class TorqueSearch:
    """Objective of the search: torques of a family, rated with their best sampling."""

    def __init__(self, inputs: DesignInputs, shape: Shape) -> None:
        self._inputs, self._shape = inputs, shape
        self._time_bins = time_bins(round(inputs.limits.longest_s * inputs.fastest_Hz), _GROWTH)
        elapsed_s = self._time_bins.middle / inputs.fastest_Hz
        self._views = Views(
            inputs.gripper, inputs.model, inputs.parameters, elapsed_s, inputs.instrument
        )

    def torque(self, shares: Array) -> Torque:
        """Return the torque of some shares, as large as limits of torque and stroke allow."""
        waveform = self._shape.waveform(shares, self._inputs.limits)
        return self._scaled(waveform, self._compute_responses(waveform))

    def logarithm(self, shares: Array) -> float:
        """Return the log of the typical relative bound; where contact is lost, a larger penalty."""
        inputs = self._inputs
        waveform = self._shape.waveform(shares, inputs.limits)
        if not waveform.highest:
            return 2 * _LOST
        responses = self._compute_responses(waveform)
        if responses.pull > 0:
            return _LOST * (1 + responses.pull)
        scale = self._scaled(waveform, responses).largest_Nm / waveform.highest / inputs.noise_rad
        best = best_sampling(
            scale * responses.sensitivity,
            responses.capacity,
            inputs.samples,
            inputs.criterion,
            gap=_GAP,
            most=_FILLINGS,
            before=inputs.before,
        )
        bound = inputs.criterion.typical_bound(best.covariances)
        return round(float(np.log(bound)), _DECIMALS) if bound > 0 else _LOST

    def _compute_responses(self, waveform: Waveform) -> CellResponses:
        return compute_cell_responses(
            self._views, self._time_bins, waveform, self._inputs.fastest_Hz
        )

    def _scaled(self, waveform: Waveform, responses: CellResponses) -> Torque:
        stroke, highest = self._inputs.stroke_rad, waveform.highest
        allowed = min(
            self._inputs.largest_Nm / highest if highest else 0.0, stroke / responses.turned_rad
        )
        return Torque(waveform.in_shares, allowed * highest)


def best_torques(
    inputs: DesignInputs,
    tried: int,
    rng: np.random.Generator,
    progress: Callable[[int, float], None],
) -> list[Torque]:
    """Search for the torques with the lowest typical relative bounds; the best comes first.

    About as many are tried as asked for, equally many of each shape. The callback gets the number
    tried, and the lowest typical relative bound.

    Raises
    ------
    BiogripError
        If no torque was found that keeps contact.
    """
    from scipy.optimize import differential_evolution

    rounds = max(1, round(tried / len(inputs.shapes) / _CROWD))
    count, lowest = 0, np.inf
    found: list[tuple[float, TorqueSearch, Array]] = []
    for name, shape in SHAPES.items():
        if name not in inputs.shapes:
            continue
        search = TorqueSearch(inputs, shape)

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
            "(`candidates`), or samples that are less different."
        )
    found.sort(key=lambda each: each[0])
    return [search.torque(shares) for _, search, shares in found]
