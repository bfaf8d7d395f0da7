"""True parameters of simulated samples, and the paper's results for comparison."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from biogrip.experiment.sample import SINGLE_BRANCH, Parameter, Sample, SampleModel
from biogrip.keys import Key

_PRINTED = Key(choices=tuple(parameter.name for parameter in SINGLE_BRANCH))
_SIGNED = Key(
    pattern=r"[<>]?[+-]?[0-9]{1,6}(\.[0-9]{1,3})?",
    form="a number of at most 12 characters, with < or > before it where the paper has it",
)


@dataclass(frozen=True)
class Published:
    """Results of the paper for a sample, to compare with."""

    table: Annotated[
        int | None, Key("Number of the paper's table.", low=1, high=1000, needed=True)
    ] = None
    figure: Annotated[
        int | None, Key("Number of the paper's figure of the fit.", low=1, high=1000)
    ] = None
    generation: Annotated[
        int | None,
        Key("Generation at which the paper shows the fit.", low=1, high=1_000_000),
    ] = None
    axis_rad: Annotated[
        tuple[Annotated[float, Key(low=-10, high=10)], ...],
        Key("Ends of the rotation axis of the paper's figure.", "rad", fewest=2, most=2),
    ] = ()
    identified: Annotated[
        Mapping[Annotated[str, _PRINTED], Annotated[float, Key(low=0, high=1e12)]],
        Key("Identified parameters as printed, SI units.", needed=True),
    ] = field(default_factory=dict)
    error_percent: Annotated[
        Mapping[Annotated[str, _PRINTED], Annotated[str, _SIGNED]],
        Key("Their errors in percent as printed, in quotes, for some are no numbers.", needed=True),
    ] = field(default_factory=dict)


@dataclass(frozen=True)
class Truth:
    """Model and true parameters of a simulated sample, and the paper's results for it.

    Parameters
    ----------
    title
        Name in print.
    sample
        Its constitutive model.
    parameters
        True values by name, SI units; empty if the trace was recorded.
    published
        Results of the paper.
    """

    title: str
    sample: Sample
    parameters: Mapping[str, float]
    published: Published

    @property
    def model(self) -> SampleModel:
        """Constitutive model."""
        return self.sample.model

    def target(self, quantity: list[Parameter]) -> float | None:
        """Return the true value of a parameter or a sum; None if the trace was recorded."""
        return sum(self.parameters[p.name] for p in quantity) if self.parameters else None
