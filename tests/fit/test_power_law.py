"""Power-law samples are identified like all others, and told from branches that relax."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.judging.likelihood import make_likelihood
from biogrip.judging.limits import find_limits
from biogrip.judging.quantities import parameters_and_sum
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS
from biogrip.physics.sample_model import SampleModel
from tests.helpers.problems import (
    GRIPPER,
    SETTINGS,
    TORQUE,
    case_problem,
    identified,
)

SOLID, LIQUID = MODELS["fractional_kelvin_voigt"], MODELS["fractional_maxwell"]
TIMES = np.arange(401.0)
# Enough for three parameters; a fit that ends elsewhere would be seen below.
FEW = replace(SETTINGS, candidates=100, starts=4)


def response(model: SampleModel, sample: list[float]) -> Array:
    step = step_response(GRIPPER, model.network(sample), inertia=False)
    found: Array = rotation(step, TORQUE, TIMES)[0]
    return found


@pytest.mark.parametrize(
    ("model", "truth", "level"),
    [
        (SOLID, [0.3, 10.0, 0.4], 0.03),
        (LIQUID, [10.0, 0.3, 300.0], 0.03),
        (MODELS["springpot"], [10.0, 0.4], 0.03),
        (MODELS["springpot_beside_damper"], [10.0, 0.3, 50.0], 0.03),
        (MODELS["fractional_maxwell_gel"], [5.0, 20.0, 0.5], 0.03),
        (MODELS["fractional_solid"], [1.0, 10.0, 0.3, 300.0], 0.01),
        (MODELS["springpots_in_parallel"], [60.0, 0.8, 5.0, 0.2], 0.01),
    ],
)
@pytest.mark.nightly
def test_intervals_hold_the_exponent(model: SampleModel, truth: list[float], level: float) -> None:
    """20 seeds, 95 %: fewer than 15 hold it once in 3000 times."""
    problems = case_problem(TIMES, response(model, truth), 20, model, level=level)
    found = identified(problems, list(range(20)), FEW)
    likelihoods = [
        make_likelihood(problem, np.log(one.parameters), one.misfit_rad, confidence=0.95)
        for problem, one in zip(problems, found, strict=True)
    ]
    limits, _ = find_limits(likelihoods, parameters_and_sum(model))
    held = (limits[..., 0] <= np.log(truth)) & (np.log(truth) <= limits[..., 1])
    assert np.all(held.sum(axis=0) >= 15)
    # And are of use: the exponent's are a fifth of it wide, or less.
    index = model.names.index("alpha")
    assert np.median(limits[:, index, 1] - limits[:, index, 0]) < 0.2
