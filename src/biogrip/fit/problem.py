"""The identification of one trace: its problem, and its result."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.levenberg_marquardt import Minima
from biogrip.fit.search_range import GeneRange
from biogrip.physics.residuals import Residuals
from biogrip.physics.sample_model import SampleModel

ReportProgress = Callable[[int, float], None]
"""Callback that receives the number of simulated responses and the lowest misfit."""


HistoryRow = tuple[Array, float, float, int]
"""Row of a history: best parameters so far, lowest and median misfit, evaluations so far."""


def silent(evaluations: int, misfit: float) -> None:
    """Ignore a report of progress."""


@dataclass(frozen=True)
class History:
    """Course of an identification, step by step; the method defines what a step is."""

    best_misfit: Array
    """Lowest misfit so far in the unit of the readings, (n_steps + 1,)."""
    median_misfit: Array
    """Median over the method's population or fits, (n_steps + 1,)."""
    best_parameters: Array
    """Parameters of the lowest misfit, (n_steps + 1, n_parameters)."""
    evaluations: IntArray
    """Responses simulated so far, (n_steps + 1,)."""

    @classmethod
    def of(cls, rows: Sequence[HistoryRow]) -> "History":
        """Assemble a history from its rows."""
        parameters, best_misfit, median_misfit, counts = map(np.array, zip(*rows, strict=True))
        return cls(best_misfit, median_misfit, parameters, counts)


@dataclass(frozen=True)
class Fit:
    """The result of identifying one trace by one method."""

    parameters: Array
    """Parameters of lowest misfit, (n_parameters,)."""
    misfit: float
    """RMS misfit of these parameters."""
    generations: int
    """Number of steps: generations, or local fits."""
    evaluations: int
    """Number of simulated responses, with derivatives or not."""
    stop_reason: str
    """Reason why the method stopped."""
    history: History = field(repr=False)
    """Course of the identification; that of what was fitted first, where more fits followed."""
    converged: bool = True
    """False if the last local fit did not converge."""

    def at(self, fit: Minima) -> "Fit":
        """Return a copy with the optimum of a local fit of this trace alone."""
        misfit, converged = float(fit.misfit[0]), bool(fit.converged[0])
        return replace(self, parameters=np.exp(fit.x[0]), misfit=misfit, converged=converged)

    def in_order(self, model: SampleModel) -> "Fit":
        """Return a copy with Maxwell branches sorted by relaxation time, in its history as well."""
        way = self.history.best_parameters
        ordered = np.take_along_axis(way, model.in_order(way), axis=1)
        parameters = self.parameters[model.in_order(self.parameters[None])[0]]
        history = replace(self.history, best_parameters=ordered)
        return replace(self, parameters=parameters, history=history)


@dataclass(frozen=True)
class TraceProblem:
    """The identification of one trace, in the form that every method takes."""

    residuals: Residuals
    """Residuals with exact derivatives, and misfits, as functions of log-parameters."""
    low: Array
    """Logarithms of the lower ends of the search range (Table 4), (n_parameters,)."""
    high: Array
    """Those of the upper ends."""
    ranges: tuple[GeneRange, ...]
    """Search range of each parameter, as genes."""


def make_problem(residuals: Residuals, ranges: Mapping[str, GeneRange]) -> TraceProblem:
    """Set up a problem from its residuals, and search ranges by `Parameter.range_name`."""
    chosen = tuple(ranges[parameter.range_name] for parameter in residuals.model.parameters)
    low, high = (np.log([getattr(genes, end) for genes in chosen]) for end in ("low", "high"))
    return TraceProblem(residuals, low, high, chosen)
