"""The identification of one trace: its problem, its result, and the methods.

Each method is a module of this package, named like the method. It has the class of its settings,
whose fields are the keys of its config block (`biogrip.keys`), and a function
``identify_many(problems, settings, rngs, progress)``, which returns a `Fit` of each trace, to the
bit as if it were alone. Ranges and traces are the problems', the budget of each is in the settings,
its generator is its only source of randomness, and progress is told of all. A method with several
blocks is given a tuple of their settings. A history has a row for the start and one a step, of
which there are `Fit.generations`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.genome import GeneRange, Genome, make_genome
from biogrip.fit.levenberg_marquardt import Minima
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
        found = self.parameters[model.in_order(self.parameters[None])[0]]
        history = replace(self.history, best_parameters=ordered)
        return replace(self, parameters=found, history=history)


@dataclass(frozen=True)
class TraceProblem:
    """The identification of one trace, in the form that every method takes."""

    residuals: Residuals
    """Residuals with exact derivatives, and misfits, as functions of log-parameters."""
    genome: Genome
    """Encoding of the parameters for the genetic algorithm."""
    low: Array
    """Logarithms of the lower ends of the search range (Table 4), (n_parameters,)."""
    high: Array
    """Those of the upper ends."""


def make_problem(residuals: Residuals, ranges: Mapping[str, GeneRange]) -> TraceProblem:
    """Set up a problem from its residuals, and gene ranges by `Parameter.range_name`."""
    chosen = [ranges[parameter.range_name] for parameter in residuals.model.parameters]
    return TraceProblem(
        residuals,
        make_genome(residuals.model, ranges),
        np.log([genes.low for genes in chosen]),
        np.log([genes.high for genes in chosen]),
    )


@dataclass(frozen=True)
class Method:
    """Description of an identification method, available without importing its module."""

    name: str
    """Name in the config and in files."""
    title: str
    """Name in print."""
    blocks: tuple[str, ...]
    """Names of its config blocks."""
    step: str
    """Name of a step of the method, after each of which its history has a row."""
    color: str
    """Colour of its lines in figures, its own, of `biogrip.figures.style.COLORS`."""
    dashes: str
    """Their dashes, as Matplotlib has them."""
    sure: bool = False
    """True if it finds the global optimum of (nearly) every trace; tests hold it to that."""


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            "genetic",
            "genetic algorithm",
            blocks=("genetic_algorithm",),
            step="generation",
            color="grey",
            dashes="-",
        ),
        Method(
            "genetic_refined",
            "genetic, polished",
            blocks=("genetic_algorithm", "genetic_refined"),
            step="generation, then local fit",
            color="vermilion",
            dashes="-",
            sure=True,
        ),
        Method(
            "least_squares",
            "multi-start least squares",
            blocks=("least_squares",),
            step="local fit",
            color="blue",
            dashes="--",
            sure=True,
        ),
        Method(
            "differential_evolution",
            "differential evolution",
            blocks=("differential_evolution",),
            step="generation",
            color="purple",
            dashes="-.",
        ),
    )
}

Identify = Callable[
    [Sequence[TraceProblem], Sequence[np.random.Generator], ReportProgress], list[Fit]
]
"""Identifies traces as the ``identify_many`` of a method does, with its settings."""


def identifier(name: str, settings: object) -> Identify:
    """Load a method of `METHODS` with its settings, those of several blocks as a tuple."""
    module = import_module(f"{__package__}.{name}")

    def identify(
        problems: Sequence[TraceProblem],
        rngs: Sequence[np.random.Generator],
        progress: ReportProgress,
    ) -> list[Fit]:
        answers = module.identify_many(problems, settings, rngs, progress)
        pairs = zip(problems, answers, strict=True)
        return [answer.in_order(problem.residuals.model) for problem, answer in pairs]

    return identify
