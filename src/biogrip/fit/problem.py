"""The identification problem: a trace, a sample model and the search range."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.fit.genome import GeneRange, Genome, make_genome
from biogrip.instrument.gripper import Gripper
from biogrip.instrument.instrument import Instrument
from biogrip.response.condensed import Condensed
from biogrip.response.misfit import Misfit, make_misfit
from biogrip.response.residuals import Residuals


@dataclass(frozen=True)
class Problem:
    """The identification of one trace, in the form that every method takes."""

    misfit: Misfit
    """RMS misfit in rad of parameters of shape (n, n_parameters)."""
    residuals: Residuals
    """Residuals and exact derivatives, as functions of log-parameters."""
    genome: Genome
    """Encoding of the parameters for the genetic algorithm."""
    low: Array
    """Logarithms of the lower ends of the search range (Table 4), (n_parameters,)."""
    high: Array
    """Those of the upper ends."""

    def later(self, change_s: float) -> "Problem":
        """Return the problem of the same trace for a protocol that starts later by some s."""
        moved = self.residuals.later(change_s)
        return replace(self, misfit=moved.condensed_misfit, residuals=moved)


def make_problem(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    rotation_rad: Array,
    ranges: Mapping[str, GeneRange],
    condensed: Condensed,
    *,
    noise_rad: float | None = None,
    instrument: Instrument,
) -> Problem:
    """Set up the identification of one trace.

    Parameters
    ----------
    gripper, model, torque
        Gripper, sample model and torques of the simulated responses.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    ranges
        Gene ranges by the name of the range, see `Parameter.range_name`.
    condensed
        Condensed rows of the protocol and times; traces that are fitted together share them.
    noise_rad
        Standard deviation of the noise, if it is known.
    instrument
        The instrument, for its words.
    """
    residuals = Residuals(
        gripper,
        model,
        torque,
        time_s,
        rotation_rad,
        condensed,
        noise_rad=noise_rad,
        instrument=instrument,
    )
    misfit = make_misfit(residuals, gripper, torque, time_s, rotation_rad)
    return searched(misfit, residuals, ranges)


def searched(misfit: Misfit, residuals: Residuals, ranges: Mapping[str, GeneRange]) -> Problem:
    """Set up a problem from its misfit and residuals, with `ranges` as in `make_problem`."""
    chosen = [ranges[parameter.range_name] for parameter in residuals.model.parameters]
    return Problem(
        misfit,
        residuals,
        make_genome(residuals.model, ranges),
        np.log([genes.low for genes in chosen]),
        np.log([genes.high for genes in chosen]),
    )
