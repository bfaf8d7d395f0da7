"""What is known of a sample beforehand: its true values, and what the paper says of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from biogrip.experiment.sample import Parameter, Sample, SampleModel


@dataclass(frozen=True)
class Published:
    """What the paper reports of a sample; data to compare with.

    Parameters
    ----------
    table, figure, generation
        Numbers of the table and of the figure; generation at which the figure
        shows the fit. None where the paper has none.
    axis_rad
        Ends of the figure's rotation axis.
    identified, error_percent
        Identified parameters in SI units, and their errors as printed, by name.
    """

    table: int | None = None
    figure: int | None = None
    generation: int | None = None
    axis_rad: tuple[float, ...] = ()
    identified: Mapping[str, float] = field(default_factory=dict)
    error_percent: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Truth:
    """What is known of a sample that was simulated, and what the paper says of it.

    Parameters
    ----------
    title
        Name in print.
    sample
        Its constitutive model.
    parameters
        True values by name, SI units; empty if the trace was recorded.
    published
        What the paper reports.
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
        """Return the true value of a parameter or a sum, unless the trace was recorded."""
        return sum(self.parameters[p.name] for p in quantity) if self.parameters else None
