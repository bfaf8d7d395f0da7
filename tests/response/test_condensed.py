"""A few times stand for all: the same sums of squares, gradients and information."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.experiment.protocol import torque_history
from biogrip.experiment.sample import MODELS, model_named
from biogrip.instrument.gripper import Gripper
from biogrip.response.condensed import Condensed
from biogrip.response.nuisance import nuisance_basis
from biogrip.response.residuals import Residuals
from tests.helpers.responses import PROTOCOLS, random_samples
from tests.helpers.responses import SAMPLING_TIMES as TIMES


def products(rows: Array, slopes: Array) -> Array:
    """Sum of squares, gradients and information: all that least squares sees."""
    together = np.vstack((rows, slopes))
    found: Array = together @ together.T
    return found


@pytest.mark.parametrize("nuisance", [False, True])
@pytest.mark.parametrize("times", TIMES)
@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_least_squares_sees_no_difference(
    request: pytest.FixtureRequest, arms: str, protocol: str, times: str, nuisance: bool
) -> None:
    """To 1e-10 of the trace, over the whole search range; noise is at least 1e-3 of it."""
    gripper: Gripper = request.getfixturevalue(arms)
    torque, time_s = torque_history(PROTOCOLS[protocol]), TIMES[times]
    condensed = Condensed(torque, time_s, nuisance_basis(time_s, offset=nuisance, drift=nuisance))
    trace = 1e-3 * np.random.default_rng(1).standard_normal(len(time_s))
    model = MODELS["generalized_maxwell"]
    residuals = Residuals(gripper, model, torque, time_s, trace, condensed, nonlinear=False)
    for sample in random_samples(20, seed=8):
        every, few = residuals(np.log(sample)), residuals.condensed(np.log(sample))
        scale = np.linalg.norm(every[0]) + np.linalg.norm(every[1])
        assert np.max(np.abs(products(*every) - products(*few))) < 1e-10 * scale**2
        assert len(few[0]) <= min(80 if torque.symmetric else 160, len(time_s) + 1)


def test_a_clean_trace_leaves_no_residual(gripper: Gripper) -> None:
    torque, time_s = torque_history(PROTOCOLS["steps"]), TIMES["uniform"]
    condensed = Condensed(torque, time_s, nuisance_basis(time_s, offset=False, drift=False))
    model, x = model_named("generalized_maxwell", 2), np.log([5.0, 0.2, 1.0, 9.0, 99.0, 0.5])
    empty = Residuals(
        gripper, model, torque, time_s, np.zeros(len(time_s)), condensed, nonlinear=False
    )
    clean, _ = empty(x)
    exact = Residuals(gripper, model, torque, time_s, clean, condensed, nonlinear=False)
    assert np.linalg.norm(exact.condensed(x)[0]) < 1e-10 * np.linalg.norm(clean)


@pytest.mark.parametrize("times", TIMES)
@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_the_nonlinear_model_is_condensed_along(
    gripper: Gripper, protocol: str, times: str
) -> None:
    torque, time_s = torque_history(PROTOCOLS[protocol]), TIMES[times]
    nuisance = nuisance_basis(time_s, offset=True, drift=True)
    condensed = Condensed(torque, time_s, nuisance, nonlinear=True)
    trace = 1e-3 * np.random.default_rng(1).standard_normal(len(time_s))
    model, x = MODELS["liquid_drop"], np.log([9.5, 0.3, 10.0])
    residuals = Residuals(gripper, model, torque, time_s, trace, condensed, nonlinear=True)
    every, few = residuals(x), residuals.condensed(x)
    scale = np.linalg.norm(every[0]) + np.linalg.norm(every[1])
    assert np.max(np.abs(products(*every) - products(*few))) < 1e-10 * scale**2
