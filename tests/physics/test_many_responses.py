"""Rows of many responses at once: the same as one at a time, whoever else is there."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.condensed import Condensed
from biogrip.physics.drift import nuisance_basis
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.protocol import torque_history
from biogrip.physics.residuals import Residuals
from biogrip.physics.sample_model import SampleModel
from biogrip.physics.sensitivity import rotation_and_sensitivity
from tests.helpers.responses import MODEL_PARAMETERS, PROTOCOLS, log_range
from tests.helpers.responses import SAMPLING_TIMES as TIMES

MANY_BRANCHES = {branches: Sample("generalized_maxwell", branches).model for branches in (2, 3, 4)}


def case_problem(
    gripper: Gripper, model: SampleModel, protocol: str, times: str, *, nuisance: bool = False
) -> Residuals:
    torque, time_s = torque_history(PROTOCOLS[protocol]), TIMES[times]
    condensed = Condensed(torque, time_s, nuisance_basis(time_s, offset=nuisance, drift=nuisance))
    silence = np.zeros(len(time_s))
    return Residuals(gripper, model, torque, time_s, silence, condensed, instrument=GRIPPER)


def samples(model: SampleModel, count: int) -> Array:
    """Log-parameters all over the search range."""
    rng = np.random.default_rng(3)
    found: Array = rng.uniform(*log_range(model), (count, len(model.parameters)))
    return found


def assert_alike(residuals: Residuals, x: Array) -> None:
    found = residuals.condensed_responses(x)
    # Without derivatives numbers are real, and products of another shape: other last bits.
    alone = residuals.condensed_responses(x, slopes=False)
    peaks = np.abs(found[:, :1]).max(axis=2, keepdims=True)
    assert np.all(np.abs(alone - found[:, :1]) <= 1e-12 * peaks)
    condensed = residuals._condensed
    for rows, point in zip(found, x, strict=True):
        # From what the response is at few times.
        rotation, slopes = (
            condensed.rows(values)
            for values in rotation_and_sensitivity(
                residuals._gripper,
                residuals.model,
                residuals._torque,
                condensed.time_s,
                np.exp(point),
            )
        )
        peak = np.abs(rotation).max()
        np.testing.assert_allclose(rows[0], rotation, rtol=0, atol=1e-10 * peak)
        np.testing.assert_allclose(rows[1:], slopes, rtol=0, atol=1e-9 * peak)


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize(
    ("arms", "times", "nuisance"),
    [("gripper", "few", False), ("unequal_gripper", "uneven", True)],
)
def test_rows_and_slopes_are_those_of_one_at_a_time(
    request: pytest.FixtureRequest, arms: str, protocol: str, times: str, nuisance: bool
) -> None:
    model = MODELS["generalized_maxwell"]
    residuals = case_problem(
        request.getfixturevalue(arms), model, protocol, times, nuisance=nuisance
    )
    assert_alike(residuals, samples(model, 20))


@pytest.mark.parametrize("protocol", ["steps", "ramp, parabola and sinusoid"])
@pytest.mark.parametrize("name", MODEL_PARAMETERS)
def test_every_model(gripper: Gripper, name: str, protocol: str) -> None:
    rng = np.random.default_rng(5)
    middle = np.log(MODEL_PARAMETERS[name])
    x = np.clip(middle + rng.normal(size=(20, len(middle))), *log_range(MODELS[name]))
    assert_alike(case_problem(gripper, MODELS[name], protocol, "few"), x)


@pytest.mark.parametrize("branches", MANY_BRANCHES)
def test_many_branches(unequal_gripper: Gripper, branches: int) -> None:
    model = MANY_BRANCHES[branches]
    rng = np.random.default_rng(6)
    dampers = np.log(np.geomspace(1.0, 1e3, branches))
    x = np.concatenate((np.zeros(branches + 1), dampers, [-3.0]))
    near = x + 0.3 * rng.normal(size=(10, len(x)))
    assert_alike(case_problem(unequal_gripper, model, "steps", "few"), near)


@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
@pytest.mark.parametrize("name", [*MODEL_PARAMETERS, "two branches"])
def test_rows_do_not_depend_on_who_else_is_there(
    request: pytest.FixtureRequest, arms: str, name: str
) -> None:
    """Byte for byte, for any subset in any order, down to a single one."""
    model = MANY_BRANCHES[2] if name == "two branches" else MODELS[name]
    residuals = case_problem(request.getfixturevalue(arms), model, "steps", "few")
    x = samples(model, 40)
    together = residuals.condensed_responses(x)
    rng = np.random.default_rng(7)
    for count in (1, 1, 1, 2, 3, 7, 23, 40):
        chosen = rng.permutation(40)[:count]
        np.testing.assert_array_equal(residuals.condensed_responses(x[chosen]), together[chosen])
