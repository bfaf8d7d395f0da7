"""The result that every identification method returns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.experiment.sample import SampleModel
from biogrip.fit.levenberg_marquardt import Minima

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
    history: History
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
