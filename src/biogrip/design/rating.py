"""Rating of torques: the bound with which the best sampling of each determines the parameters."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.cell_responses import CellResponses, compute_cell_responses
from biogrip.design.experiment import DesignInputs
from biogrip.design.sampling import Mixture, Optimum, best_sampling
from biogrip.design.spread_readings import effective_capacity
from biogrip.design.time_bins import time_bins
from biogrip.design.views import Views
from biogrip.design.waveform import Waveform

# Growth of cells, gap and fillings of samplings during the search; the final torque is sampled
# more finely.
_GROWTH, _GAP, _FILLINGS = 1.35, 0.03, 8
# Decimals of a logarithm, so that the last bits of a processor decide nothing.
_DECIMALS = 8

LOST = 1e3
"""Rating from which on contact is lost."""


@dataclass(frozen=True)
class Torque:
    """A torque against time."""

    waveform: Waveform
    """Torque in shares of the largest."""
    largest_Nm: float
    """Largest torque."""


@dataclass(frozen=True)
class Rated:
    """A rated torque."""

    logarithm: float
    """Log of the typical relative bound; where contact is lost, a larger penalty."""
    best: Optimum | None = None
    """The best sampling, unless contact is lost."""
    responses: CellResponses | None = None
    """Responses in the cells that it distributes readings over, likewise."""


class Rater:
    """Rating of torques for a design problem."""

    def __init__(self, inputs: DesignInputs) -> None:
        self._inputs = inputs
        self._time_bins = time_bins(round(inputs.limits.longest_s * inputs.fastest_Hz), _GROWTH)
        elapsed_s = self._time_bins.middle / inputs.fastest_Hz
        self._views = Views(
            inputs.gripper,
            inputs.model,
            inputs.parameters,
            elapsed_s,
            inputs.instrument,
            inputs.noise.exposure_s,
        )

    def torque(self, waveform: Waveform) -> Torque:
        """Return a torque as large as its limits and the stroke allow."""
        return self._scaled(waveform, self._compute_responses(waveform))

    def rate(
        self,
        waveform: Waveform,
        *,
        gap: float = _GAP,
        most: int = _FILLINGS,
        start: Callable[[CellResponses], Mixture | None] | None = None,
        to_beat: float = np.inf,
    ) -> Rated:
        """Rate a torque by its best sampling, arguments of which are those of `best_sampling`."""
        inputs = self._inputs
        if not waveform.highest:
            return Rated(2 * LOST)
        responses = self._compute_responses(waveform)
        if responses.pull > 0:
            return Rated(LOST * (1 + responses.pull))
        scale = self._scaled(waveform, responses).largest_Nm / waveform.highest / inputs.noise_rad
        best = best_sampling(
            np.append(scale * responses.sensitivity, self._along(responses), axis=1),
            self._capacity(responses),
            inputs.samples,
            inputs.criterion,
            gap=gap,
            most=most,
            before=inputs.before_along,
            start=start(responses) if start else None,
            to_beat=to_beat,
        )
        bound = inputs.criterion.typical_bound(best.covariances)
        if bound <= 0:
            return Rated(LOST)
        return Rated(round(float(np.log(bound)), _DECIMALS), best, responses)

    def _along(self, responses: CellResponses) -> Array:
        """Return what is fitted along in cells, (n, n_functions, n_cells)."""
        along = self._inputs.along(responses.middle_s)
        return np.broadcast_to(along, (len(responses.sensitivity), *along.shape))

    def _capacity(self, responses: CellResponses) -> Array:
        """Return how many independent readings each cell has room for, (n_cells,)."""
        if not self._inputs.noise.has_memory:
            return responses.capacity
        return effective_capacity(responses.capacity, responses.lasting_s, *self._inputs.processes)

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
