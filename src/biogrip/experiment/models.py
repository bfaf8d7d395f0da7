"""The sample models that there are, by name.

Each is declared, beside its network, in a module here.
"""

from biogrip.experiment.burgers import BURGERS
from biogrip.experiment.fractional import FRACTIONAL_MODELS
from biogrip.experiment.maxwell_models import (
    DAMPER,
    GENERALIZED_MAXWELL,
    KELVIN_VOIGT,
    LIQUID_DROP,
    MAXWELL,
    ZENER_KELVIN,
    ZENER_MAXWELL,
)
from biogrip.experiment.sample_model import SampleModel

MODELS: dict[str, SampleModel] = {
    model.name: model
    for model in (
        GENERALIZED_MAXWELL,
        LIQUID_DROP,
        DAMPER,
        KELVIN_VOIGT,
        MAXWELL,
        ZENER_MAXWELL,
        ZENER_KELVIN,
        BURGERS,
        *FRACTIONAL_MODELS,
    )
}
