"""Constitutive models of the sample: spring-dashpot networks between the two jaws (Figure 5).

Every network is a parallel spring k_p and damper c_p beside any number of
Maxwell branches (a spring k and a damper c in series). Its force follows the
shortening delta of the sample as

    F(s) = [k_p + c_p s + sum_j k_j c_j s / (k_j + c_j s)] delta(s)

A model is one entry of `biogrip.experiment.models`; genome, tables and figures follow from it. Its
network is made by arithmetic alone, so that parameters with a small imaginary
part carry derivatives through it (`biogrip.response.sensitivity`).
"""

from dataclasses import dataclass

from biogrip.experiment.models import MODELS as MODELS
from biogrip.experiment.network import MOST_BRANCHES as MOST_BRANCHES
from biogrip.experiment.network import Network as Network
from biogrip.experiment.sample_model import SINGLE_BRANCH as SINGLE_BRANCH
from biogrip.experiment.sample_model import Parameter as Parameter
from biogrip.experiment.sample_model import SampleModel as SampleModel
from biogrip.experiment.sample_model import in_pascals
from biogrip.experiment.sample_model import with_fixed as with_fixed


@dataclass(frozen=True)
class Sample:
    """Name of a sample's constitutive model, and its number of branches."""

    name: str
    """Name of the model."""
    branches: int = 1
    """Number of Maxwell branches of a generalized one."""
    per_area: bool = False
    """True if its elements relate stress and strain, and have units of moduli."""

    @property
    def model(self) -> SampleModel:
        """The constitutive model."""
        model = MODELS[self.name]
        if self.branches != 1:
            if model.branched is None:
                raise ValueError(f"{self.name} has no number of branches")
            model = model.branched(self.branches)
        return in_pascals(model) if self.per_area else model

    @property
    def candidate(self) -> str:
        """Its name among `CANDIDATES`."""
        return self.name if self.branches == 1 else f"{self.name}_{self.branches}"


CANDIDATES: dict[str, Sample] = {
    sample.candidate: sample
    for sample in (
        *(Sample(name) for name in MODELS),
        *(
            Sample(name, branches)
            for name, model in MODELS.items()
            if model.branched
            for branches in range(2, MOST_BRANCHES + 1)
        ),
    )
}
"""Models that a trace may be fitted with, by name with the number of branches."""
