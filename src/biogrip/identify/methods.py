"""The identifiers that there are: what is said of each, and nothing of how it works.

Each is a module of its own here, named like the method. It has the class of its settings,
whose fields are the keys of its config block (`biogrip.keys.Key`), and a function
``identify_many(problems, settings, rngs, progress)``, which returns an `Identification` of each
trace, to the bit as if it were alone. Ranges and traces are the problems', the budget of each is
in the settings, its generator is its only source of randomness, and progress is told of all.

What is made holds the `Method` that it shows in its settings: this module is in no job's digest,
so that one more method makes nothing again.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module


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
    color, dashes
        Its lines in figures, as no other method's: a colour by its name in
        `biogrip.products.figures.style.COLORS`, and Matplotlib's dashes.
    settings
        Class in its module that puts several blocks together, in their order.
    exact
        Whether it promises all digits of the optimum where it ends; tests hold it to that.
    sure
        Whether it promises the global optimum of (nearly) every trace; likewise.
    """

    name: str
    title: str
    blocks: Mapping[str, str]
    step: str
    color: str
    dashes: str
    settings: str = ""
    exact: bool = False
    sure: bool = False

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
    """Load the class that has the keys of a config block of some method."""
    method = next(method for method in METHODS.values() if block in method.blocks)
    return method.named(method.blocks[block])
