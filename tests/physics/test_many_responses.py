"""Rows of many responses at once: the same as one at a time, whoever else is there."""

import numpy as np
import pytest

from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.modes import linear_responses
from biogrip.physics.protocol import torque_history
from biogrip.physics.residuals import Residuals, Trace
from biogrip.physics.sample_model import SampleModel
from tests.helpers.problems import condensed_of
from tests.helpers.responses import MODEL_PARAMETERS, PROTOCOLS, log_range
from tests.helpers.responses import SAMPLING_TIMES as TIMES

TWO_BRANCHES = {"two branches": Sample("generalized_maxwell", 2).model}


def posed(gripper: Gripper, model: SampleModel, protocol: str) -> Residuals:
    torque, time_s = torque_history(PROTOCOLS[protocol]), TIMES["few"]
    silence = Trace(time_s, np.zeros(len(time_s)), condensed_of(torque, time_s, offset=True))
    return Residuals(gripper, model, torque, silence, instrument=GRIPPER)


@pytest.mark.parametrize("protocol", ["steps", "ramp, parabola and sinusoid"])
@pytest.mark.parametrize("name", MODEL_PARAMETERS)
def test_rows_and_slopes_are_those_of_one_at_a_time(
    gripper: Gripper, name: str, protocol: str
) -> None:
    rng = np.random.default_rng(5)
    middle = np.log(MODEL_PARAMETERS[name])
    x = np.clip(middle + rng.normal(size=(20, len(middle))), *log_range(MODELS[name]))
    residuals = posed(gripper, MODELS[name], protocol)
    found = residuals.condensed_responses(x)
    # Without derivatives numbers are real, and products of another shape: other last bits.
    alone = residuals.condensed_responses(x, slopes=False)
    peaks = np.abs(found[:, :1]).max(axis=2, keepdims=True)
    assert np.all(np.abs(alone - found[:, :1]) <= 1e-12 * peaks)
    condensed = residuals.trace.condensed
    given = residuals.gripper, residuals.model, residuals.torque, condensed.time_s
    for rows, point in zip(found, np.exp(x), strict=True):
        # From what the response is at few times.
        rotation, *slopes = condensed.rows(linear_responses(*given, point[None])[0])
        peak = np.abs(rotation).max()
        np.testing.assert_allclose(rows[0], rotation, rtol=0, atol=1e-10 * peak)
        np.testing.assert_allclose(rows[1:], slopes, rtol=0, atol=1e-9 * peak)


@pytest.mark.parametrize("name", [*MODEL_PARAMETERS, "two branches"])
def test_rows_do_not_depend_on_who_else_is_there(either_gripper: Gripper, name: str) -> None:
    """Byte for byte, for any subset in any order, down to a single one."""
    model = (MODELS | TWO_BRANCHES)[name]
    residuals = posed(either_gripper, model, "steps")
    low, high = log_range(model)
    x = np.random.default_rng(3).uniform(low, high, (40, len(low)))
    together = residuals.condensed_responses(x)
    rng = np.random.default_rng(7)
    for count in (1, 2, 7, 40):
        chosen = rng.permutation(40)[:count]
        np.testing.assert_array_equal(residuals.condensed_responses(x[chosen]), together[chosen])
