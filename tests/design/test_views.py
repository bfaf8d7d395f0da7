"""What plausible samples show, against responses and jaw forces made in another way."""

import numpy as np
import pytest

from biogrip.design.cells import cells
from biogrip.design.experiment import relative_bounds
from biogrip.design.steps import SHARES, Limits, Steps, train
from biogrip.design.views import Views
from biogrip.experiment.protocol import held, torque_history
from biogrip.experiment.sample import MODELS
from biogrip.instrument.gripper import Gripper
from biogrip.response.jaw_force import jaw_force
from biogrip.response.ringing import ringing_responses

MODEL = MODELS["generalized_maxwell"]
SAMPLES = np.array([[35.0, 12.3, 299.9, 1e-3], [9.5, 1e-4, 10.0, 1e-4]])
STEPS = Steps(np.array([0.5, 0.02, 1.0, 30.0]), np.array([0.7, 0.2, 1.0, 0.4]))


@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_against_responses(request: pytest.FixtureRequest, arms: str) -> None:
    gripper: Gripper = request.getfixturevalue(arms)
    elapsed = np.geomspace(1e-6, 0.015, 30)
    view = Views(gripper, MODEL, SAMPLES, elapsed).under(STEPS)
    torque = torque_history(
        tuple(held(*pair) for pair in zip(STEPS.durations_s, STEPS.levels, strict=True))
    )
    for k, start in enumerate(torque.time_s):
        times = start + elapsed
        for row, sample in enumerate(SAMPLES):
            exact = ringing_responses(gripper, MODEL, torque, times, sample[None])[0]
            peak = np.abs(exact[0]).max()
            # Times of 1e-6 s are lost to 1e-16 of the 1.5 s before them.
            np.testing.assert_allclose(view.rotation[row, k], exact[0], atol=1e-8 * peak)
            np.testing.assert_allclose(view.sensitivity[row, :, k], exact[1:], atol=1e-8 * peak)
            network = MODEL.network(sample)
            force = jaw_force(gripper, network, torque, times, nonlinear=False)[0]
            np.testing.assert_allclose(view.force[row, k], force, atol=1e-8 * np.abs(force).max())
            end = np.nextafter(start + STEPS.durations_s[k], 0)[None]
            last = jaw_force(gripper, network, torque, end, nonlinear=False)[0, 0]
            assert view.last_force[row, k] == pytest.approx(last, rel=1e-7)
            turned = ringing_responses(gripper, MODEL, torque, end, sample[None])[0, 0, 0]
            assert view.last_rotation[row, k] == pytest.approx(turned, rel=1e-7)


def test_trains_keep_to_their_limits() -> None:
    limits = Limits(100.0, 0.01, 20)
    rng = np.random.default_rng(0)
    for shares in rng.random((300, SHARES)):
        steps = train(shares, limits)
        assert steps.durations_s.sum() == pytest.approx(100.0)
        units = steps.durations_s / 0.01
        np.testing.assert_allclose(units, np.round(units), atol=1e-6)
        assert units.min() > 0.5
        assert len(steps.levels) <= 20
        assert np.all((steps.levels >= 0) & (steps.levels <= 1))
        assert np.all(np.diff(steps.levels) != 0)


def test_a_train_as_it_is_meant() -> None:
    """Four cycles of 1 s, high for half of it, levels changing from cycle to cycle."""
    length = np.log(4 / 0.08) / np.log(99.99 / 0.08)
    shares = [np.log(4) / np.log(9), length, 0.5, 0.45, 0.4, 1.0, 0.5, 0.0, 0.3]
    steps = train(np.array(shares), Limits(100.0, 0.01, 20))
    np.testing.assert_allclose(steps.durations_s, [0.5] * 8 + [96.0])
    high, low = np.array([0.4, 0.6, 0.8, 1.0]), np.array([0.5, 1 / 3, 1 / 6, 0.0])
    levels = np.stack((high, high * low), axis=1).ravel()
    np.testing.assert_allclose(steps.levels, [*levels, 0.3])


@pytest.mark.parametrize("slots", [2, 10, 24, 25, 26, 1000, 10**7])
def test_cells_have_every_slot_once(slots: int) -> None:
    found = cells(slots, 1.3)
    assert found.first[0] == 1
    np.testing.assert_array_equal(found.first[1:], (found.first + found.slots)[:-1])
    assert found.first[-1] + found.slots[-1] == slots
    assert np.all((found.middle >= found.first) & (found.middle < found.first + found.slots))


def test_bounds_take_nothing_for_known() -> None:
    information = np.array([[[4.0, 1.9], [1.9, 1.0]], [[4.0, 2.0], [2.0, 1.0]]])
    bounds = relative_bounds(information)
    np.testing.assert_allclose(bounds[0], np.sqrt(np.diag(np.linalg.inv(information[0]))))
    assert np.all(np.isinf(bounds[1]))
    apart = np.zeros((1, 3, 3))
    apart[0, :2, :2], apart[0, 2, 2] = information[1], 9.0
    np.testing.assert_allclose(relative_bounds(apart)[0], [np.inf, np.inf, 1 / 3])
