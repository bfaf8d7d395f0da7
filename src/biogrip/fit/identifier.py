"""A method by its name, as what works with it calls it."""

from collections.abc import Callable, Sequence
from importlib import import_module

import numpy as np

from biogrip.fit.answer import Identification, Progress
from biogrip.fit.problem import Problem

Identify = Callable[
    [Sequence[Problem], Sequence[np.random.Generator], Progress], list[Identification]
]
"""Identifies traces as the ``identify_many`` of a method does, with its settings."""


def identifier(name: str, settings: object) -> Identify:
    """Load a method with its settings.

    Parameters
    ----------
    name
        One of `biogrip.fit.methods.METHODS`.
    settings
        Its block, or what puts its blocks together.
    """
    module = import_module(f"{__package__}.{name}")

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
