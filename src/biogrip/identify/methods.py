"""The identifiers that there are.

Each is a module of its own here, named like the method, with two functions or three:
``settings_of(blocks)`` reads its config blocks, ``identify(problem, settings,
rng, progress)`` returns an `Identification`, and ``identify_many(problems, settings,
rngs, progress)`` those of many traces at once. Ranges and traces are the
problem's, randomness is the generator's, the budget is in the settings.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from biogrip.identify.answer import Identification, Progress
from biogrip.identify.problem import Problem

Identify = Callable[
    [Sequence[Problem], Sequence[np.random.Generator], Progress], list[Identification]
]
"""Identifies traces, each with a generator of its own, and each as if it were alone."""


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
    """

    name: str
    title: str
    blocks: tuple[str, ...]
    step: str

    @property
    def module(self) -> str:
        """Name of its module."""
        return f"biogrip.identify.{self.name}"


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method("genetic", "genetic algorithm", ("genetic_algorithm",), "generation"),
        Method(
            "genetic_refined",
            "genetic, polished",
            ("genetic_algorithm", "genetic_refined"),
            "generation, then local fit",
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


def method_settings(name: str, blocks: Mapping[str, Any]) -> object:
    """Build a method's settings from config blocks, at least its own."""
    return import_module(METHODS[name].module).settings_of(blocks)


def identifier(name: str, settings: object) -> Identify:
    """Load a method with its settings.

    Parameters
    ----------
    name
        One of `METHODS`.
    settings
        What `method_settings` gives for it.
    """
    module = import_module(METHODS[name].module)

    def identify(
        problems: Sequence[Problem], rngs: Sequence[np.random.Generator], progress: Progress
    ) -> list[Identification]:
        if hasattr(module, "identify_many"):
            answers: list[Identification] = module.identify_many(problems, settings, rngs, progress)
            return answers
        pairs = zip(problems, rngs, strict=True)
        return [module.identify(problem, settings, rng, progress) for problem, rng in pairs]

    return identify
