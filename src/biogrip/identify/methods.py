"""The identifiers that there are.

Each is a module of its own here, named like the method, with two functions:
``settings_of(blocks)`` reads its config blocks, and ``identify(problem, settings,
rng, progress)`` returns an `Identification`. Ranges and traces are the
problem's, randomness is the generator's, the budget is in the settings. Where many
samples are identified faster side by side, it has ``identify_many(problems, settings,
rngs, progress)``, whose answers are the same.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from biogrip.identify.answer import Identification, Progress
from biogrip.identify.problem import Problem

Identify = Callable[[Problem, np.random.Generator, Progress], Identification]
IdentifyMany = Callable[
    [Sequence[Problem], Sequence[np.random.Generator], Progress], list[Identification]
]


@dataclass(frozen=True)
class Method:
    """What is said of an identifier without loading it.

    Parameters
    ----------
    name, title
        In the config and in files; in print.
    blocks
        Config blocks that hold its settings.
    step
        What a row of its history follows.
    side_by_side
        How many problems are worth identifying at once: more are no faster and take
        more memory.
    """

    name: str
    title: str
    blocks: tuple[str, ...]
    step: str
    side_by_side: int = 1

    @property
    def module(self) -> str:
        """Name of its module."""
        return f"biogrip.identify.{self.name}"


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method("genetic", "genetic algorithm", ("genetic_algorithm",), "generation", 25),
        Method(
            "genetic_refined",
            "genetic, polished",
            ("genetic_algorithm", "genetic_refined"),
            "generation, then local fit",
            25,
        ),
        Method("least_squares", "multi-start least squares", ("least_squares",), "local fit"),
        Method(
            "differential_evolution",
            "differential evolution",
            ("differential_evolution",),
            "generation",
        ),
    )
}


def identifier(name: str, blocks: Mapping[str, Any]) -> Identify:
    """Load a method with its settings.

    Parameters
    ----------
    name
        One of `METHODS`.
    blocks
        Config blocks, at least its own.
    """
    module = import_module(METHODS[name].module)
    settings = module.settings_of(blocks)

    def identify(problem: Problem, rng: np.random.Generator, progress: Progress) -> Identification:
        answer: Identification = module.identify(problem, settings, rng, progress)
        return answer

    return identify


def identifier_of_many(name: str, blocks: Mapping[str, Any]) -> IdentifyMany:
    """Load a method with its settings, to identify problems with the same genome.

    Parameters
    ----------
    name
        One of `METHODS`.
    blocks
        Config blocks, at least its own.
    """
    module = import_module(METHODS[name].module)
    settings = module.settings_of(blocks)

    def identify_many(
        problems: Sequence[Problem], rngs: Sequence[np.random.Generator], progress: Progress
    ) -> list[Identification]:
        if METHODS[name].side_by_side > 1:
            answers: list[Identification] = module.identify_many(problems, settings, rngs, progress)
            return answers
        return [
            module.identify(problem, settings, rng, progress)
            for problem, rng in zip(problems, rngs, strict=True)
        ]

    return identify_many
