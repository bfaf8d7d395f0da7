"""Rating of torques: the bound with which the best sampling of each determines the parameters."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.design.cell_responses import CellResponses, compute_cell_responses
from biogrip.design.experiment import DesignInputs
from biogrip.design.neighbours import NEW
from biogrip.design.sampling import Mixture, Optimum, best_sampling
from biogrip.design.spread_readings import effective_capacity
from biogrip.design.time_bins import time_bins
from biogrip.design.views import Views
from biogrip.design.waveform import Waveform

# Growth of cells, gap and fillings of samplings during the search; the final torque is sampled
# more finely.
_GROWTH, _GAP, _FILLINGS = 1.2, 0.03, 8
# Least force between the jaws relative to the largest.
_MARGIN = 2e-3
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

    def carried(self, origins: IntArray, responses: CellResponses) -> Mixture | None:
        """Return the fillings for the cells of a torque that was made from this one.

        The origins, (n_steps,), are those of its steps, see `biogrip.design.neighbours`.
        """
        if self.best is None or self.responses is None:
            return None
        old, mixture = self.responses, self.best.mixture.main
        many = 1 + max(int(old.places.max()), int(responses.places.max()))
        by_step = np.zeros((len(mixture.shares), int(old.steps.max()) + 1, many))
        by_step[:, old.steps, old.places] = mixture.fillings
        here = origins[responses.steps]
        known = (here != NEW) & (here < by_step.shape[1])
        fillings = by_step[:, np.where(known, here, 0), responses.places] * known
        return Mixture(fillings, mixture.shares)


class Rater:
    """Rating of torques for a design problem.

    The jaws have to press with a margin, relative to the largest force: the force is computed at
    few instants.
    """

    def __init__(self, inputs: DesignInputs, margin: float = _MARGIN) -> None:
        self._inputs, self._margin = inputs, margin
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
            self._views, self._time_bins, waveform, self._inputs.fastest_Hz, self._margin
        )

    def _scaled(self, waveform: Waveform, responses: CellResponses) -> Torque:
        stroke, highest = self._inputs.stroke_rad, waveform.highest
        allowed = min(
            self._inputs.largest_Nm / highest if highest else 0.0, stroke / responses.turned_rad
        )
        return Torque(waveform.in_shares, allowed * highest)
