"""The study's identification methods: a module and an entry of `METHODS` each.

A module has the class of its settings, whose fields are the keys of its config block
(`biogrip.keys`), and a function ``identify_many(problems, settings, rngs, progress)``, which
returns a `Fit` of each trace, to the bit as if it were alone. Ranges and traces are the problems',
the budget is in the settings, the generator of each trace is the only source of randomness, and
progress is told of all. A history has a row for the start and one a step, of which there are
`Fit.generations`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from biogrip.fit.least_squares import LeastSquaresSettings
from biogrip.fit.problem import Fit, ReportProgress, TraceProblem
from biogrip.keys import Block
from biogrip_study.methods.genetic import GeneticSettings


@dataclass(frozen=True)
class Method:
    """Description of an identification method."""

    name: str
    """Name in the config and in files."""
    title: str
    """Name in print."""
    key: str
    """Key of its config block."""
    settings: type[Block]
    """Class of this block."""
    step: str
    """Name of a step of the method, after each of which its history has a row."""
    color: str
    """Colour of its lines in figures, its own, of `biogrip.figures.style.COLORS`."""
    dashes: str
    """Their dashes, as Matplotlib has them."""
    package: str = __package__
    """Package of its module, which has the method's name."""


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            "genetic",
            "genetic algorithm",
            key="genetic_algorithm",
            settings=GeneticSettings,
            step="generation",
            color="grey",
            dashes="-",
        ),
        Method(
            "least_squares",
            "multi-start least squares",
            key="least_squares",
            settings=LeastSquaresSettings,
            step="local fit",
            color="blue",
            dashes="--",
            package="biogrip.fit",
        ),
    )
}


def identify_by(
    name: str,
    settings: object,
    problems: Sequence[TraceProblem],
    rngs: Sequence[np.random.Generator],
    progress: ReportProgress,
) -> list[Fit]:
    """Identify traces by a method of `METHODS`, branches in the order in which they relax.

    Parameters
    ----------
    name
        Name of the method.
    settings
        Config block of the method.
    problems, rngs
        Problem of each trace, and its random numbers.
    progress
        Told of the share that is done.

    Returns
    -------
    list of Fit
        That of each trace.
    """
    module = import_module(f"{METHODS[name].package}.{name}")
    fits = module.identify_many(problems, settings, rngs, progress)
    pairs = zip(problems, fits, strict=True)
    return [fit.in_order(problem.residuals.model) for problem, fit in pairs]
