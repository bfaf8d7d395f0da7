"""The identifiers that there are.

Each is a module of its own here, named like the method. It has the class of its settings,
whose fields are the keys of its config block (`biogrip.keys.Key`), and a function
``identify_many(problems, settings, rngs, progress)``, which returns an `Identification` of each
trace, to the bit as if it were alone. Ranges and traces are the problems', the budget of each is
in the settings, its generator is its only source of randomness, and progress is told of all.
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
"""Identifies traces as the ``identify_many`` of a method does, with its settings."""


@dataclass(frozen=True)
class Method:
    """What is said of an identifier without loading it.

    Parameters
    ----------
    name, title
        In the config and in files; in print.
    blocks
        Config blocks that hold its settings; of each, the class in its module that has the keys.
    step
        What a row of its history follows.
    settings
        Class in its module that puts several blocks together, in their order.
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
        """Load a class of its module."""
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
    """Load the class that has the keys of a config block of some method."""
    method = next(method for method in METHODS.values() if block in method.blocks)
    return method.named(method.blocks[block])


def identifier(name: str, settings: object) -> Identify:
    """Load a method with its settings.

    Parameters
    ----------
    name
        One of `METHODS`.
    settings
        Its block, or what puts its blocks together.
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
    """Identify one trace by multi-start least squares, the method of every judgement."""
    (found,) = identifier("least_squares", least_squares)([problem], [rng], progress)
    return found
