"""What every identifier returns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.experiment.sample import SampleModel
from biogrip.identify.levenberg_marquardt import Minima

Progress = Callable[[int, float], None]
"""Is told, now and then, how many responses were simulated and the lowest misfit in rad."""


Row = tuple[Array, float, float, int]
"""Of a history: best parameters so far, lowest and median misfit, evaluations so far."""


def silent(evaluations: int, misfit_rad: float) -> None:
    """Report to nobody."""


@dataclass(frozen=True)
class History:
    """What happened, step by step; what a step is depends on the method.

    Parameters
    ----------
    best_misfit, median_misfit : (n_steps + 1,)
        Lowest misfit so far in rad, and the median over what the method works with.
    best_parameters : (n_steps + 1, n_parameters)
        Parameters of the lowest misfit.
    evaluations : (n_steps + 1,)
        Responses simulated so far.
    """

    best_misfit: Array
    median_misfit: Array
    best_parameters: Array
    evaluations: IntArray

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "History":
        """Put the rows of a history together."""
        parameters, best_misfit, median_misfit, counts = map(np.array, zip(*rows, strict=True))
        return cls(best_misfit, median_misfit, parameters, counts)


@dataclass(frozen=True)
class Identification:
    """The answer of one run.

    Parameters
    ----------
    parameters : (n_parameters,)
        Those of lowest misfit.
    misfit_rad
        Their misfit.
    generations
        Number of steps: generations, or local fits.
    evaluations
        Responses simulated; one with its derivatives counts as one. Those by which an
        optimum is settled to its last digits are left out.
    stop_reason
        Why it stopped there.
    history
        The way there.
    converged
        Whether an optimum that was to be settled to its last digits could be.
    """

    parameters: Array
    misfit_rad: float
    generations: int
    evaluations: int
    stop_reason: str
    history: History
    converged: bool = True

    def at(self, fit: Minima) -> "Identification":
        """Return the answer, with a fit of this trace alone in place of the optimum."""
        return self.replaced(
            np.exp(fit.x[0]), float(fit.misfit_rad[0]), converged=bool(fit.converged[0])
        )

    def replaced(
        self, parameters: Array, misfit_rad: float, *, converged: bool
    ) -> "Identification":
        """Return the answer, with other parameters and their misfit, in its history as well."""
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
        """Name branches, all the way, in the order in which they relax."""
        way = self.history.best_parameters
        ordered = np.take_along_axis(way, model.in_order(way), axis=1)
        found = self.parameters[model.in_order(self.parameters[None])[0]]
        return replace(
            self, parameters=found, history=replace(self.history, best_parameters=ordered)
        )
