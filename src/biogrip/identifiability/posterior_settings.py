"""Settings of posterior sampling: priors of parameters, and numbers of walkers and steps."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

from biogrip.digits import counted
from biogrip.errors import nearest
from biogrip.experiment.sample import SampleModel
from biogrip.keys import Block, Problem


@dataclass(frozen=True)
class LogNormal(Block):
    """Log-normal prior of a parameter, truncated to the search range."""

    median: Annotated[float, Field(gt=0, le=1e12)]
    """Median, SI units."""
    spread: Annotated[float, Field(gt=0, le=100)]
    """Standard deviation of the natural logarithm."""


@dataclass(frozen=True)
class PosteriorSettings(Block):
    """Sampling of the posterior of the first trace; nothing is sampled without this block."""

    prior: Mapping[str, LogNormal] = field(default_factory=dict)
    """Log-normal priors by parameter: `k: {median: 30.0, spread: 0.5}`, the spread being the
    standard deviation of the natural logarithm. All others are uniform in their logarithms over the
    search range."""
    walkers: Annotated[int, Field(ge=20, le=10_000)] = 100
    """Number of walkers in the ensemble. By default 100."""
    most_steps: Annotated[int, Field(ge=1000, le=1_000_000)] = 5000
    """Steps of every walker after which sampling stops although it has not converged. By default
    5000."""
    evidence: bool = False
    """If true, the models of `model_selection` are sampled, too, and their evidence is compared. By
    default false."""

    def problems_of(self, model: SampleModel, known: Sequence[str]) -> Iterator[Problem]:
        """Find too few walkers, and priors of parameters that are not searched or are ordered.

        Parameters
        ----------
        model
            Sample model.
        known
            Names of parameters that are fixed.
        """
        searched = [name for name in model.names if name not in known]
        if self.walkers < 2 * len(searched):
            # emcee requires it: differences of walkers have to span all directions.
            text = f"found {self.walkers}, allowed are at least {2 * len(searched)}"
            yield ("walkers",), f"{text} to identify {counted(len(searched), 'parameter')}."
        branches = [name for pair in model.branches for name in pair] * (len(model.branches) > 1)
        for name in self.prior:
            if name not in searched:
                text = f"found {name}, allowed is what is identified, {', '.join(searched)}."
                yield ("prior", name), text + nearest(name, searched)
            elif name in branches:
                text = "is of one of several branches or springpots, which are named by their order"
                yield ("prior", name), f"{text}; allowed are priors of the other parameters."
