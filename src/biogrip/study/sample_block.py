"""Config block of the sample: constitutive model and true parameters."""

from collections.abc import Iterator, Mapping
from typing import Annotated

from pydantic import BaseModel, Field

from biogrip.errors import nearest
from biogrip.experiment.sample import MODELS, MOST_BRANCHES, Sample, SampleModel
from biogrip.instrument.contact import LARGEST_M, SMALLEST_M
from biogrip.keys import OPEN, Checked, OneOf, Problem

LARGEST_PARAMETER = 1e12
_LEAST = 1e-18


class SampleBlock(Checked, BaseModel):
    """Constitutive model of the sample and its true parameters."""

    model_config = OPEN
    __pydantic_extra__: dict[
        str,
        Annotated[
            float,
            Field(
                le=LARGEST_PARAMETER,
                description="True values of the model's parameters, by name, SI units.",
            ),
        ],
    ] = Field(init=False)

    model: Annotated[
        str,
        OneOf(MODELS),
        Field(
            description='Constitutive model; which parameters it has is listed under "Sample '
            'models".'
        ),
    ]
    branches: Annotated[
        int,
        Field(
            ge=1,
            le=MOST_BRANCHES,
            description="Number of Maxwell branches of `generalized_maxwell`; with more than one, "
            "its parameters are k_1, k_2, ..., k_p, c_1, c_2, ..., c_p. By default 1.",
        ),
    ] = 1
    size_m: Annotated[
        float | None,
        Field(
            ge=SMALLEST_M,
            le=LARGEST_M,
            description="Diameter of the sample. It decides at which angle the jaws touch the "
            "sample.",
        ),
    ] = None

    @property
    def parameters(self) -> dict[str, float]:
        """True values of the model's parameters, by name."""
        return self.__pydantic_extra__

    @property
    def sample(self) -> Sample:
        """Constitutive model, with its number of branches."""
        return Sample(self.model, self.branches)

    def problems(self) -> Iterator[Problem]:
        """Find parameters that the model does not have, or whose values it does not allow."""
        if self.branches != 1 and MODELS[self.model].branched is None:
            yield ("branches",), "only generalized_maxwell has a number of branches."
            return
        model = self.sample.model
        yield from _parameter_problems(model, self.parameters, model.name)

    def missing(self) -> Iterator[Problem]:
        """Find parameters of the model without a true value."""
        model = self.sample.model
        for name in model.names:
            if name not in self.parameters:
                yield (name,), f"is missing: {model.name} needs {', '.join(model.names)}."


def fixed_problems(model: SampleModel, values: Mapping[str, float]) -> Iterator[Problem]:
    """Find fixed parameters that the model does not have, or whose values it does not allow."""
    yield from _parameter_problems(model, values, "the sample")
    if set(model.names) <= set(values):
        yield (), "leaves nothing to identify; allowed are fewer parameters."


def _parameter_problems(
    model: SampleModel, values: Mapping[str, float], called: str
) -> Iterator[Problem]:
    """Find unknown names, and values out of range; 0 is allowed for those that may vanish."""
    by_name = {parameter.name: parameter for parameter in model.parameters}
    for name, value in values.items():
        if name not in by_name:
            text = f"is no parameter of {called}, which has {', '.join(model.names)}."
            yield (name,), text + nearest(name, model.names)
            continue
        parameter = by_name[name]
        vanishes = value == 0 and parameter.may_vanish
        if not (vanishes or _LEAST <= value <= LARGEST_PARAMETER) or value >= parameter.below:
            zero = "0 or " if parameter.may_vanish else ""
            bounded = parameter.below < LARGEST_PARAMETER
            most = f"below {parameter.below:g}" if bounded else f"at most {LARGEST_PARAMETER:g}"
            text = f"found {value:g}, allowed is {zero}at least {_LEAST:g} and {most}"
            yield (name,), f"{text} {parameter.unit}".rstrip() + "."
