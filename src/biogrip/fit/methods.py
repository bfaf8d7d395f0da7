"""The identifiers that there are: what is said of each, and nothing of how it works.

Each method is a module of this package, named like the method. It has the class of its settings,
whose fields are the keys of its config block (`biogrip.keys`), and a function
``identify_many(problems, settings, rngs, progress)``, which returns an `Identification` of each
trace, to the bit as if it were alone. Ranges and traces are the problems', the budget of each is
in the settings, its generator is its only source of randomness, and progress is told of all.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module


@dataclass(frozen=True)
class Method:
    """Description of an identification method, available without importing its module."""

    name: str
    """Name in the config and in files."""
    title: str
    """Name in print."""
    blocks: Mapping[str, str]
    """Names of its config blocks, and of the settings class of each in its module."""
    step: str
    """Name of a step of the method, after each of which its history has a row."""
    color: str
    """Colour of its lines in figures, as no other method's: a name in
    `biogrip.figures.style.COLORS`."""
    dashes: str
    """Their dashes, as Matplotlib has them."""
    settings: str = ""
    """Class in its module that puts several blocks together, in their order."""
    exact: bool = False
    """True if the method ends at an optimum to all digits; tests hold it to that."""
    sure: bool = False
    """True if the method finds the global optimum of (nearly) every trace; likewise."""

    @property
    def module(self) -> str:
        """Name of its module."""
        return f"biogrip.fit.{self.name}"

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
            "grey",
            "-",
        ),
        Method(
            "genetic_refined",
            "genetic, polished",
            {"genetic_algorithm": "GeneticSettings", "genetic_refined": "Polishing"},
            "generation, then local fit",
            "vermilion",
            "-",
            "RefinedSettings",
            exact=True,
            sure=True,
        ),
        Method(
            "least_squares",
            "multi-start least squares",
            {"least_squares": "LeastSquaresSettings"},
            "local fit",
            "blue",
            "--",
            exact=True,
            sure=True,
        ),
        Method(
            "differential_evolution",
            "differential evolution",
            {"differential_evolution": "DifferentialEvolutionSettings"},
            "generation",
            "purple",
            "-.",
            exact=True,
        ),
    )
}


def block_class(block: str) -> type:
    """Import the settings class of a config block of any method."""
    method = next(method for method in METHODS.values() if block in method.blocks)
    return method.named(method.blocks[block])
