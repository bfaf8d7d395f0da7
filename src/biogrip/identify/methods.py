"""Registry of the identification methods.

Each method is a module of this package, named like the method. It has the class of its settings,
whose fields are the keys of its config block (`biogrip.keys.Key`), and a function
``identify_many(problems, settings, rngs, progress)`` that returns an `Identification` of each
trace, independent of the other traces to the last bit. Each trace's generator is its only source
of randomness. Search ranges belong to the problems, the budget of each trace to the settings.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from biogrip.identify.answer import Identification, Progress
from biogrip.identify.problem import Problem

Identify = Callable[
    [Sequence[Problem], Sequence[np.random.Generator], Progress], list[Identification]
]
"""The ``identify_many`` of a method with its settings already given."""


@dataclass(frozen=True)
class Method:
    """Description of an identification method, available without importing its module.

    Parameters
    ----------
    name, title
        Name in the config and in files; name in print.
    blocks
        Names of its config blocks, and of the settings class of each in its module.
    step
        Unit of work after which its history has a row.
    settings
        Name of the class in its module that combines several blocks, in their order.
    """

    name: str
    title: str
    blocks: Mapping[str, str]
    step: str
    settings: str = ""

    @property
    def module(self) -> str:
        """Name of its module."""
        return f"biogrip.identify.{self.name}"

    def named(self, name: str) -> type:
        """Import a class of its module by its name."""
        found: type = getattr(import_module(self.module), name)
        return found


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            "genetic",
            "genetic algorithm",
            {"genetic_algorithm": "GeneticSettings"},
            "generation",
        ),
        Method(
            "genetic_refined",
            "genetic, polished",
            {"genetic_algorithm": "GeneticSettings", "genetic_refined": "Polishing"},
            "generation, then local fit",
            "RefinedSettings",
        ),
        Method(
            "least_squares",
            "multi-start least squares",
            {"least_squares": "LeastSquaresSettings"},
            "local fit",
        ),
        Method(
            "differential_evolution",
            "differential evolution",
            {"differential_evolution": "DifferentialEvolutionSettings"},
            "generation",
        ),
    )
}


def block_class(block: str) -> type:
    """Import the settings class of a config block of any method."""
    method = next(method for method in METHODS.values() if block in method.blocks)
    return method.named(method.blocks[block])


def identifier(name: str, settings: object) -> Identify:
    """Return the function that identifies traces by a method with given settings.

    Parameters
    ----------
    name
        One of `METHODS`.
    settings
        Instance of the method's settings class.
    """
    module = import_module(METHODS[name].module)

    def identify(
        problems: Sequence[Problem], rngs: Sequence[np.random.Generator], progress: Progress
    ) -> list[Identification]:
        answers = module.identify_many(problems, settings, rngs, progress)
        pairs = zip(problems, answers, strict=True)
        return [answer.in_order(problem.residuals.model) for problem, answer in pairs]

    return identify


def best_fit(
    problem: Problem, least_squares: object, rng: np.random.Generator, progress: Progress
) -> Identification:
    """Identify one trace by multi-start least squares, the method of all further analyses."""
    (found,) = identifier("least_squares", least_squares)([problem], [rng], progress)
    return found
