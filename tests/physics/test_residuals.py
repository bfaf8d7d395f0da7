"""Residuals: exact derivatives, and a few times and sums of series that stand for all readings.

Derivatives are held against differences of responses right to 1e-11 (test_protocols.py).
"""

import functools

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import NO_ARMS, Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.models import MODELS, Sample
from biogrip.physics.noise import nuisance_basis, within, without
from biogrip.physics.protocol import Course, Phase, hold, join_phases, sample_times
from biogrip.physics.residuals import CondensedTrace, Residuals
from biogrip.physics.response import linear_responses, simulated_response, step_response, superpose
from biogrip.physics.sample_model import SampleModel, with_fixed
from biogrip_study.methods.misfit import SeriesMisfit
from tests.helpers.problems import condensed_of
from tests.helpers.responses import PROTOCOLS, log_range, random_samples
from tests.helpers.responses import SAMPLING_TIMES as TIMES

MAXWELL = MODELS["generalized_maxwell"]
TRUTH = np.array([[35.0, 12.3, 299.9, 1e-3]])
_RNG = np.random.default_rng(5)
DENSE = {
    "uniform": np.linspace(0.0, 400.0, 200_000),
    "random": np.sort(_RNG.uniform(0.0, 400.0, 200_000)),
    "from late on": np.linspace(150.0, 400.0, 100_000),
}


def products(rows: Array, slopes: Array) -> Array:
    """Sum of squares, gradients and information: all that least squares sees."""
    together = np.vstack((rows, slopes))
    return together @ together.T


def assert_alike(residuals: Residuals, x: Array) -> int:
    """All samples and the rows give the same, to 1e-10 of the trace; so many rows there are."""
    every, (of_rows, *slopes) = residuals(x), residuals.condensed_responses(x[None])[0]
    few = of_rows - residuals.trace.rows, np.array(slopes)
    scale = np.linalg.norm(every[0]) + np.linalg.norm(every[1])
    assert np.max(np.abs(products(*every) - products(*few))) < 1e-10 * scale**2
    return len(few[0])


def posed(gripper: Gripper, model: SampleModel, rows: Condensed, trace: Array) -> Residuals:
    return Residuals(gripper, model, rows.course, CondensedTrace(trace, rows), instrument=GRIPPER)


def noise(count: int) -> Array:
    return 1e-3 * np.random.default_rng(1).standard_normal(count)


@pytest.mark.parametrize("nuisance", [False, True])
@pytest.mark.parametrize("times", [*TIMES, *DENSE])
@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_least_squares_sees_no_difference(
    gripper: Gripper, unequal_gripper: Gripper, protocol: str, times: str, nuisance: bool
) -> None:
    """To 1e-10 of the trace, over the whole search range; noise is at least 1e-3 of it."""
    torque, time_s = join_phases(PROTOCOLS[protocol]), (TIMES | DENSE)[times]
    rows = condensed_of(torque, time_s, offset=nuisance, drift=nuisance)
    many = times in DENSE
    samples, most = (TRUTH, 200) if many else (random_samples(8, seed=8), min(80, len(time_s) + 1))
    for arms in (gripper,) if many else (gripper, unequal_gripper):
        residuals = posed(arms, MAXWELL, rows, noise(len(time_s)))
        for sample in samples:
            assert assert_alike(residuals, np.log(sample)) <= most


@functools.cache
def condensed(protocol: str, device: str) -> Condensed:
    course = join_phases(PROTOCOLS[protocol], deforms=device == "relaxation")
    time_s = TIMES["few"] if device == "arms" else TIMES["uneven"][::5]
    return condensed_of(course, time_s, offset=True)


@pytest.mark.parametrize("device", ["arms", "creep", "relaxation"])
@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("name", MODELS)
def test_of_no_model_it_sees_a_difference(
    gripper: Gripper, name: str, protocol: str, device: str
) -> None:
    """Rows without slopes are the same, too, but for last bits: they are real numbers."""
    arms, rows = gripper if device == "arms" else NO_ARMS, condensed(protocol, device)
    residuals = posed(arms, MODELS[name], rows, noise(len(rows.all_s)))
    middle, rng = np.log(MODELS[name].example), np.random.default_rng(5)
    x = np.clip(middle + rng.normal(size=(2, len(middle))), *log_range(MODELS[name]))
    for each in x:
        assert_alike(residuals, each)
    found = residuals.condensed_responses(x)[:, :1]
    alone = residuals.condensed_responses(x, slopes=False)
    assert np.all(np.abs(alone - found) <= 1e-12 * np.abs(found).max(axis=2, keepdims=True))


@pytest.mark.parametrize("name", [*MODELS, "two branches"])
def test_rows_do_not_depend_on_who_else_is_there(either_gripper: Gripper, name: str) -> None:
    """Byte for byte, for any subset in any order, down to a single one."""
    model = MODELS.get(name, Sample("generalized_maxwell", 2).model)
    rows = condensed_of(join_phases(PROTOCOLS["steps"]), TIMES["few"], offset=True)
    residuals = posed(either_gripper, model, rows, np.zeros(len(TIMES["few"])))
    low, high = log_range(model)
    x = np.random.default_rng(3).uniform(low, high, (40, len(low)))
    together = residuals.condensed_responses(x)
    rng = np.random.default_rng(7)
    for count in (1, 2, 7, 40):
        chosen = rng.permutation(40)[:count]
        np.testing.assert_array_equal(residuals.condensed_responses(x[chosen]), together[chosen])


PAPER = PROTOCOLS["steps"]


@pytest.mark.parametrize(
    ("phases", "rate_Hz", "level", "rtol"),
    [
        # Large sums cancel: eps times (squares summed / squares left), 1e6 for the stiffest samples
        # under the noise of the first four.
        (PAPER, 10.0, None, 1e-9),
        ((hold(300.0, 1.6e-9),), 3.0, None, 1e-9),
        (PAPER, 1 / 200, None, 1e-9),
        (PAPER, 1 / 100, None, 1e-9),
        (PAPER, 10.0, 1e-4, 1e-9),
        # Against zero the misfit is the response itself: of their way to rest, 1e6 s, the slowest
        # go a fraction 4e-4; constant and mode cancel to its square.
        (PAPER, 10.0, 0.0, 1e-8),
    ],
)
def test_sums_of_series_are_those_of_all_residuals(
    gripper: Gripper, phases: tuple[Phase, ...], rate_Hz: float, level: float | None, rtol: float
) -> None:
    """Of a noisy trace or a constant one; parameters that are no numbers have no misfit."""
    steps = join_phases(phases)
    time_s = sample_times(steps.end_s, rate_Hz)
    samples = np.vstack((TRUTH, random_samples(500, 3)))
    response = step_response(gripper, MAXWELL.network(samples), inertia=False)
    responses = superpose(response, steps, time_s)
    noise = np.random.default_rng(1).standard_normal(len(time_s))
    noisy = responses[0] + 0.1 * np.abs(responses[0]).max() * noise
    trace = noisy if level is None else np.full(len(time_s), level)
    misfit = SeriesMisfit(gripper, MAXWELL, steps, 1 / rate_Hz, trace)
    expected = np.sqrt(np.mean((responses - trace) ** 2, axis=1))
    found = misfit(np.vstack((samples, np.full(4, np.nan))))
    np.testing.assert_allclose(found, [*expected, np.nan], rtol=rtol)


SEEN_S = np.array([0.1, 1.0, 7.5, 60.0, 199.0, 200.1, 201.0, 230.0, 399.0])


GIVEN: list[tuple[SampleModel, tuple[float, ...]]] = [
    *((model, model.example) for model in MODELS.values()),
    (Sample("generalized_maxwell", 2).model, (5.0, 0.2, 1.0, 9.0, 99.0, 0.5)),
    (with_fixed(MODELS["burgers"], {"c_s": 200.0}), (3.0, 2.0, 40.0)),
]
DEVICES = [
    *(("equal arms", "steps"), ("equal arms", "ramps and parabola"), ("unequal arms", "steps")),
    *((device, "ramps and parabola") for device in ("unequal arms", "creep", "relaxation")),
]
DRAWN = [("equal arms", "steps", MAXWELL, tuple(given)) for given in random_samples(12, seed=5)]


@pytest.mark.parametrize(
    ("device", "protocol", "model", "given"),
    [*((*device, *sample) for device in DEVICES for sample in GIVEN), *DRAWN],
)
def test_against_differences(
    request: pytest.FixtureRequest, device: str, protocol: str, model: SampleModel, given: Array
) -> None:
    torque = join_phases(PROTOCOLS[protocol], deforms=device == "relaxation")
    arms = {"equal arms": "gripper", "unequal arms": "unequal_gripper"}.get(device)
    gripper, sample = request.getfixturevalue(arms) if arms else NO_ARMS, np.array(given)
    phi, *slopes = linear_responses(gripper, model, torque, SEEN_S, sample[None])[0]

    def simulated(parameters: Array) -> Array:
        network = model.network([parameters])
        if not arms:
            return simulated_response(NO_ARMS, network, torque, SEEN_S)[0]
        return superpose(step_response(gripper, network, inertia=False), torque, SEEN_S)[0]

    np.testing.assert_allclose(phi, simulated(sample), rtol=1e-12, atol=1e-12 * np.abs(phi).max())
    for index in range(len(sample)):
        unit = np.eye(len(sample))[index]
        ends = [simulated(sample * np.exp(h * unit)) for h in (2e-3, -2e-3, 1e-3, -1e-3)]
        # Extrapolated: h^4 = 1e-12, and rounding 1e-16 / h = 1e-13; derivatives cancel some more.
        exact = (8 * (ends[2] - ends[3]) - (ends[0] - ends[1])) / 12e-3
        assert np.max(np.abs(slopes[index] - exact)) <= 1e-9 * np.abs(phi).max()


@pytest.mark.parametrize(("offset", "drift"), [(True, False), (False, True), (True, True)])
def test_nuisance_takes_out_offset_and_drift_and_nothing_else(offset: bool, drift: bool) -> None:
    times = np.linspace(0.0, 10.0, 101)
    basis = nuisance_basis(times, offset=offset, drift=drift)
    np.testing.assert_allclose(basis @ basis.T, np.eye(offset + drift), atol=1e-14)
    added = 3.0 * offset + 0.2 * drift * times
    wave = without(basis, np.sin(times))
    np.testing.assert_allclose(without(basis, wave + added), wave, atol=1e-12)
    np.testing.assert_allclose(within(basis, wave + added), added, atol=1e-12)


def test_directions_with_corners_are_projected_out_of_all_readings(
    gripper: Gripper, steps: Course
) -> None:
    """As those of a load that was smoothed: no polynomial of a piece carries a corner."""
    times = np.linspace(0.0, 400.0, 5001)
    corners = np.maximum(0.0, times[None] - np.array([[57.3], [260.0]]))
    rows = Condensed(steps, times, np.linalg.qr(corners.T)[0].T)
    residuals = posed(gripper, MODELS["maxwell"], rows, noise(5001))
    assert_alike(residuals, np.log([2.0, 50.0]))


READ_S = np.arange(401.0)
AT = np.log([2.0, 50.0])


def test_a_later_protocol_is_one_of_earlier_readings(gripper: Gripper, steps: Course) -> None:
    nothing, both = np.zeros((0, 401)), (READ_S, READ_S - 3.0)
    rows = (Condensed(steps, times, nothing) for times in both)
    here, there = (posed(gripper, MODELS["maxwell"], each, noise(401)) for each in rows)
    moved, parameters = here.later(3.0), np.exp(AT)[None]
    np.testing.assert_array_equal(moved(AT)[0], there(AT)[0])
    expected = there.misfit(parameters)
    assert moved.misfit(parameters) == pytest.approx(expected, rel=1e-12)
    assert moved.noise_scale == here.noise_scale
