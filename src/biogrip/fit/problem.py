"""The identification problem of one trace, and the result that every method returns."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.genome import GeneRange, Genome, make_genome
from biogrip.fit.levenberg_marquardt import Minima
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import Instrument
from biogrip.physics.misfit import Misfit, make_misfit
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.residuals import Residuals, Trace
from biogrip.physics.sample_model import SampleModel

Progress = Callable[[int, float], None]
"""Callback that receives the number of simulated responses and the lowest misfit in rad."""


Row = tuple[Array, float, float, int]
"""Row of a history: best parameters so far, lowest and median misfit, evaluations so far."""


def silent(evaluations: int, misfit_rad: float) -> None:
    """Ignore a report of progress."""


@dataclass(frozen=True)
class History:
    """Course of an identification, step by step; the method defines what a step is."""

    best_misfit: Array
    """Lowest misfit so far in rad, (n_steps + 1,)."""
    median_misfit: Array
    """Median over the method's population or fits, (n_steps + 1,)."""
    best_parameters: Array
    """Parameters of the lowest misfit, (n_steps + 1, n_parameters)."""
    evaluations: IntArray
    """Responses simulated so far, (n_steps + 1,)."""

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "History":
        """Assemble a history from its rows."""
        parameters, best_misfit, median_misfit, counts = map(np.array, zip(*rows, strict=True))
        return cls(best_misfit, median_misfit, parameters, counts)


@dataclass(frozen=True)
class Identification:
    """The result of identifying one trace by one method."""

    parameters: Array
    """Parameters of lowest misfit, (n_parameters,)."""
    misfit_rad: float
    """RMS misfit of these parameters."""
    generations: int
    """Number of steps: generations, or local fits."""
    evaluations: int
    """Number of simulated responses; a response with its derivatives counts as one. Those of the
    final Newton refinement are not counted."""
    stop_reason: str
    """Reason why the method stopped."""
    history: History = field(repr=False)
    """Course of the identification."""
    converged: bool = True
    """False if the final Newton refinement of the optimum did not converge."""

    def at(self, fit: Minima, which: int = 0) -> "Identification":
        """Return a copy with the optimum of one of the local fits `fit`, that of this trace."""
        return self.replaced(
            np.exp(fit.x[which]), float(fit.misfit_rad[which]), converged=bool(fit.converged[which])
        )

    def replaced(
        self, parameters: Array, misfit_rad: float, *, converged: bool
    ) -> "Identification":
        """Return a copy with other parameters and misfit, in its last row of history as well."""
        history = self.history
        best_misfit, best_parameters = history.best_misfit.copy(), history.best_parameters.copy()
        best_misfit[-1], best_parameters[-1] = misfit_rad, parameters
        return replace(
            self,
            parameters=parameters,
            misfit_rad=misfit_rad,
            converged=converged,
            history=replace(history, best_misfit=best_misfit, best_parameters=best_parameters),
        )

    def in_order(self, model: SampleModel) -> "Identification":
        """Return a copy with Maxwell branches sorted by relaxation time, in its history as well."""
        way = self.history.best_parameters
        ordered = np.take_along_axis(way, model.in_order(way), axis=1)
        found = self.parameters[model.in_order(self.parameters[None])[0]]
        return replace(
            self, parameters=found, history=replace(self.history, best_parameters=ordered)
        )


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
    gripper, model, torque, instrument
        Gripper, sample model and torques of the simulated responses; instrument, for its words.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    ranges
        Gene ranges by the name of the range, see `Parameter.range_name`.
    condensed
        Condensed rows of the protocol and times; traces that are fitted together share them.
    noise_rad
        Standard deviation of the noise, if it is known.
    """
    trace = Trace(time_s, rotation_rad, condensed, noise_rad)
    residuals = Residuals(gripper, model, torque, trace, instrument=instrument)
    return searched(make_misfit(residuals), residuals, ranges)


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
