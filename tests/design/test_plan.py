"""From what is wanted to an experiment that can be set."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.design.criteria import Criterion
from biogrip.design.experiment import DesignInputs, relative_bounds
from biogrip.design.rating import Rater, Torque
from biogrip.design.schedule import Plan, planned
from biogrip.design.search import best_torques
from biogrip.design.shapes import SHAPES
from biogrip.design.waveform import Limits, hold
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import largest_load
from biogrip.experiment.sample import MODELS
from biogrip.identify.answer import silent
from biogrip.instrument.gripper import Arm, Gripper
from biogrip.instrument.instruments import INSTRUMENTS
from biogrip.response.jaw_force import jaw_force
from biogrip.response.linear import rotation, step_response

ARM = Arm(1.0e-14, 3.3e-12, 4.4e-7)
GRIPPER = Gripper(1.5e-3, 75.0, ARM, ARM)
MODEL = MODELS["generalized_maxwell"]
DROP = DesignInputs(
    gripper=GRIPPER,
    model=MODEL,
    parameters=np.array([[9.5, 1e-4, 10.0, 1e-4]]),
    noise_rad=3e-6,
    samples=1000,
    fastest_Hz=1e5,
    limits=Limits(400.0, 0.01, 8, 1e-5),
    shapes=("steps",),
    largest_Nm=8e-9,
    stroke_rad=0.0785,
    criterion=Criterion("largest", "worst", (0, 1, 2, 3)),
    before=np.zeros((4, 4)),
    instrument=INSTRUMENTS["rotation"],
)


@cache
def _plan(tried: int = 128, shape: str = "steps") -> Plan:
    # Ramps of 0.1 ms: of 10 ms they show nothing of what is over after 0.1 ms.
    limits = replace(DROP.limits, shortest_s=0.01 if shape == "steps" else 1e-4)
    inputs = replace(DROP, shapes=(shape,), limits=limits)
    return planned(inputs, best_torques(inputs, tried, np.random.default_rng(1), silent))


def _rotation(plan: Plan, sample: Array) -> Array:
    return rotation(step_response(GRIPPER, MODEL.network(sample)), plan.torque, plan.time_s)[0]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_plan_can_be_set(shape: str) -> None:
    plan = _plan(shape=shape)
    times = plan.time_s
    assert len(times) == 1000
    assert np.all(np.diff(times) > 0.999e-5)
    assert times[0] > 0
    assert times[-1] <= plan.torque.end_s == pytest.approx(400.0)
    assert 0.98 * 8e-9 < largest_load(plan.phases) <= 8e-9 * (1 + 1e-12)
    assert len(plan.phases) <= 8
    assert plan.gap < 0.01
    has_ramps = any(phase.left.slope_Nm_per_s for phase in plan.phases)
    has_sinusoids = any(phase.left.harmonics for phase in plan.phases)
    assert (has_ramps, has_sinusoids) == (shape == "ramps", shape == "sinusoids")


@pytest.mark.parametrize("shape", SHAPES)
def test_what_it_promises_differences_of_responses_give(shape: str) -> None:
    plan = _plan(shape=shape)
    sample = DROP.parameters[0]
    slopes = np.array(
        [
            (_rotation(plan, sample * np.exp(h)) - _rotation(plan, sample * np.exp(-h))) / 6e-3
            for h in 3e-3 * np.eye(4)
        ]
    )
    expected = np.linalg.inv(slopes @ slopes.T / DROP.noise_rad**2)
    # Differences leave 2e-6 times the third derivative; superposed ramps of 0.1 ms lose 1e-16 of
    # what they are after 400 s, 1e-10, which over a step and inverted is as little.
    np.testing.assert_allclose(
        relative_bounds(plan.information)[0], np.sqrt(np.diag(expected)), rtol=1e-3
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_contact_is_kept(shape: str) -> None:
    plan = _plan(shape=shape)
    edges = np.append(plan.torque.time_s, plan.torque.end_s)
    after = np.concatenate(([0], np.geomspace(1e-7, 1, 3000), np.linspace(0, 1, 3000)))
    times = np.unique((edges[:-1, None] + np.diff(edges)[:, None] * after * (1 - 1e-12)).ravel())
    force = jaw_force(GRIPPER, MODEL.network(DROP.parameters), plan.torque, times, nonlinear=False)
    assert force.min() > -1e-9 * force.max()


def test_stroke_limits_the_torque() -> None:
    inputs = replace(DROP, stroke_rad=1e-3)
    waveform = SHAPES["steps"].waveform(np.full(9, 0.5), inputs.limits)
    torque = Rater(inputs).torque(waveform)
    plan = planned(replace(inputs, samples=50), [torque])
    turned = np.abs(_rotation(plan, DROP.parameters[0])).max()
    assert turned <= 1e-3 * 1.001
    assert torque.largest_Nm < 1e-9


def test_the_search_repeats_itself_and_looking_longer_is_no_worse() -> None:
    again = planned(DROP, best_torques(DROP, 128, np.random.default_rng(1), silent))
    assert again.phases == _plan().phases
    assert again.bursts == _plan().bursts
    longer = relative_bounds(_plan(512).information).max()
    # The search looks at coarser cells than the plan.
    assert longer < 1.05 * relative_bounds(again.information).max()


def test_sinusoids_repeat_themselves() -> None:
    first, again = _plan(shape="sinusoids"), _plan.__wrapped__(shape="sinusoids")
    assert first.phases == again.phases
    assert first.bursts == again.bursts


def test_of_several_shapes_the_best_is_taken() -> None:
    """For a drop, sinusoids."""
    inputs = replace(DROP, shapes=("steps", "sinusoids"))
    plan = planned(inputs, best_torques(inputs, 256, np.random.default_rng(1), silent))
    assert any(phase.left.harmonics for phase in plan.phases)
    assert relative_bounds(plan.information).max() < relative_bounds(_plan().information).max()


def test_what_is_known_already_is_not_asked_again() -> None:
    """With k, k_p and c known far better, every reading in which c_p shows is made."""
    steps = Torque(hold(np.array([1.0, 1.0]), np.array([0.5, 1.0])), 8e-9)
    inputs = replace(DROP, before=np.diag([1e12, 1e12, 1e12, 0.0]))
    plan = planned(inputs, [steps])
    after = plan.time_s - plan.torque.time_s[plan.torque.time_s.searchsorted(plan.time_s) - 1]
    # The drop's ring decays with 2.1e4/s; twenty slots after each of two steps.
    assert np.sum(after < 2.05e-4) == 40
    alone = planned(DROP, [steps])
    bounds = [relative_bounds(one.information)[0, 3] for one in (plan, alone)]
    assert bounds[0] < bounds[1]


def test_where_jaws_would_pull_it_says_so() -> None:
    """The paper's protocol on a drop: let go to a fifth, which a viscous drop resists."""
    steps = hold(np.array([200.0, 200.0]), np.array([1.0, 0.2]))
    with pytest.raises(BiogripError, match="have to pull"):
        planned(DROP, [Torque(steps, 1.6e-9)])


def test_a_whole_search_beats_the_best_single_step() -> None:
    single = Torque(hold(np.array([400.0]), np.ones(1)), 8e-9)
    best = relative_bounds(_plan(512).information).max()
    assert best < relative_bounds(planned(DROP, [single]).information).max()
