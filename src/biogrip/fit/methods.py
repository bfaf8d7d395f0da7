"""The identification methods.

Each method is a module of this package, named like the method. It has the class of its settings,
whose fields are the keys of its config block (`biogrip.keys`), and a function
``identify_many(problems, settings, rngs, progress)``, which returns an `Fit` of each
trace, to the bit as if it were alone. Ranges and traces are the problems', the budget of each is
in the settings, its generator is its only source of randomness, and progress is told of all. A
method with several blocks is given a tuple of their settings. A history has a row for the start
and one a step, of which there are `Fit.generations`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from biogrip.fit.problem import Fit, Progress, TraceProblem


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
    """Colour of its lines in figures, as no other method's: a name in
    `biogrip.figures.style.COLORS`."""
    dashes: str
    """Their dashes, as Matplotlib has them."""
    exact: bool = False
    """True if the method ends at an optimum to all digits; tests hold it to that."""
    sure: bool = False
    """True if the method finds the global optimum of (nearly) every trace; likewise."""


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            name="genetic",
            title="genetic algorithm",
            blocks=("genetic_algorithm",),
            step="generation",
            color="grey",
            dashes="-",
        ),
        Method(
            name="genetic_refined",
            title="genetic, polished",
            blocks=("genetic_algorithm", "genetic_refined"),
            step="generation, then local fit",
            color="vermilion",
            dashes="-",
            exact=True,
            sure=True,
        ),
        Method(
            name="least_squares",
            title="multi-start least squares",
            blocks=("least_squares",),
            step="local fit",
            color="blue",
            dashes="--",
            exact=True,
            sure=True,
        ),
        Method(
            name="differential_evolution",
            title="differential evolution",
            blocks=("differential_evolution",),
            step="generation",
            color="purple",
            dashes="-.",
            exact=True,
        ),
    )
}


Identify = Callable[[Sequence[TraceProblem], Sequence[np.random.Generator], Progress], list[Fit]]
"""Identifies traces as the ``identify_many`` of a method does, with its settings."""


def identifier(name: str, settings: object) -> Identify:
    """Load a method of `METHODS` with its settings, those of several blocks as a tuple."""
    module = import_module(f"{__package__}.{name}")

    def identify(
        problems: Sequence[TraceProblem], rngs: Sequence[np.random.Generator], progress: Progress
    ) -> list[Fit]:
        answers = module.identify_many(problems, settings, rngs, progress)
        pairs = zip(problems, answers, strict=True)
        return [answer.in_order(problem.residuals.model) for problem, answer in pairs]

    return identify
