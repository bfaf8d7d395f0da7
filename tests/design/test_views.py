"""What plausible samples show, against responses and jaw forces made in another way."""

import numpy as np
import pytest

from biogrip.design.experiment import relative_bounds
from biogrip.design.shapes import SHAPES
from biogrip.design.steps import steps
from biogrip.design.time_bins import periodic_time_bins, time_bins, with_fine_end
from biogrip.design.views import Views
from biogrip.design.waveform import Limits, Waveform, hold, linear, swinging
from biogrip.experiment.exposure import average
from biogrip.experiment.protocol import Phase, load, torque_history
from biogrip.experiment.sample import MODELS
from biogrip.instrument.gripper import GRIPPER, NO_ARMS, Gripper
from biogrip.instrument.instruments import INSTRUMENTS
from biogrip.response.jaw_force import jaw_force
from biogrip.response.ringing import ringing_responses
from biogrip.response.sensitivity import linear_responses

MODEL = MODELS["generalized_maxwell"]
SAMPLES = np.array([[35.0, 12.3, 299.9, 1e-3], [9.5, 1e-4, 10.0, 1e-4]])
DURATIONS = np.array([0.5, 0.02, 1.0, 30.0])
LEVELS = np.array([0.7, 0.2, 1.0, 0.4])
WAVEFORMS = {
    "steps": hold(DURATIONS, LEVELS),
    "ramps": linear(DURATIONS, LEVELS, np.array([0.7, 0.9, 0.3, 0.0])),
    "sinusoids": swinging(
        DURATIONS, LEVELS, np.array([0.2, 0.1, 0.0, 0.4]), np.array([1.2e-4, 3e-3, 1.0, 70.0])
    ),
}


def phases_of(waveform: Waveform) -> tuple[Phase, ...]:
    frequencies = 1 / waveform.periods_s
    columns = (waveform.durations_s, waveform.levels, waveform.ends, waveform.amplitudes)
    rows = zip(*columns, frequencies, strict=True)
    loads = [load(d, level, end, a or None, f) for d, level, end, a, f in rows]
    pairs = zip(waveform.durations_s, loads, strict=True)
    return tuple(Phase(duration, one, one) for duration, one in pairs)


@pytest.mark.parametrize("name", WAVEFORMS)
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_against_responses(request: pytest.FixtureRequest, arms: str, name: str) -> None:
    gripper: Gripper = request.getfixturevalue(arms)
    waveform = WAVEFORMS[name]
    elapsed = np.geomspace(1e-6, 0.015, 30)
    moving = Views(gripper, MODEL, SAMPLES, elapsed, GRIPPER).under(waveform)
    view = moving.respond(np.arange(4))
    own = moving.respond(np.array([2]), elapsed[::3])
    np.testing.assert_allclose(own.force[:, 0], view.force[:, 2, ::3], rtol=1e-12)
    # Steps at times of their own.
    scales = np.array([[1.0], [0.5], [2.0]])
    each = moving.respond(np.array([1, 2, 3]), scales * elapsed)
    for k, scale in enumerate(scales):
        alone = moving.respond(np.array([k + 1]), scale * elapsed)
        np.testing.assert_allclose(each.force[:, k], alone.force[:, 0], rtol=1e-9)
        largest = np.abs(alone.sensitivity).max()
        np.testing.assert_allclose(
            each.sensitivity[:, :, k], alone.sensitivity[:, :, 0], atol=1e-12 * largest
        )
    torque = torque_history(phases_of(waveform))
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
            end = np.nextafter(start + waveform.durations_s[k], 0)[None]
            last = jaw_force(gripper, network, torque, end, nonlinear=False)[0, 0]
            assert moving.last_force[row, k] == pytest.approx(
                last, rel=1e-7, abs=1e-8 * force.max()
            )
            turned = ringing_responses(gripper, MODEL, torque, end, sample[None])[0, 0, 0]
            assert moving.last_rotation[row, k] == pytest.approx(turned, rel=1e-7)


# Springs in Pa; a sample that flows, one that a load does not strain at once, one of many branches.
WITHOUT_ARMS = {
    "zener_maxwell": [300.0, 200.0, 900.0],
    "maxwell": [300.0, 900.0],
    "kelvin_voigt": [300.0, 900.0],
    "burgers": [300.0, 900.0, 200.0, 50.0],
    "springpot": [120.0, 0.3],
}


@pytest.mark.parametrize("waveform", WAVEFORMS)
@pytest.mark.parametrize("name", WITHOUT_ARMS)
@pytest.mark.parametrize("reading", ["strain", "stress"])
def test_without_arms_against_responses(reading: str, name: str, waveform: str) -> None:
    """A slowest share of 1e-7 is the error, relative to the largest response."""
    instrument, model = INSTRUMENTS[reading], MODELS[name]
    sample = np.array([WITHOUT_ARMS[name]])
    elapsed = np.geomspace(1e-4, 0.015, 20)
    views = Views(NO_ARMS, model, sample, np.append(elapsed, 30.0), instrument)
    moving = views.under(WAVEFORMS[waveform])
    view = moving.respond(np.arange(4), elapsed)
    held = torque_history(phases_of(WAVEFORMS[waveform]), deforms=instrument.deforms)
    times = (held.time_s[:, None] + elapsed).ravel()
    exact = linear_responses(NO_ARMS, model, held, times, sample, inertia=False)[0]
    exact = exact.reshape(len(exact), 4, -1)
    peaks = np.abs(exact).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(view.rotation[0], exact[0], atol=1e-6 * peaks[0, 0, 0])
    np.testing.assert_allclose(view.sensitivity[0] / peaks[0], exact[1:] / peaks[0], atol=1e-6)
    ends = np.nextafter(held.time_s + DURATIONS, 0)
    last = linear_responses(NO_ARMS, model, held, ends, sample, inertia=False)[0, 0]
    np.testing.assert_allclose(moving.last_rotation[0], last, atol=1e-6 * peaks[0, 0, 0])


@pytest.mark.parametrize("name", WAVEFORMS)
@pytest.mark.parametrize("exposure_s", [1e-6, 1e-4, 3e-3])
def test_readings_are_averaged_and_the_force_is_not(
    gripper: Gripper, exposure_s: float, name: str
) -> None:
    """Against responses to torques that are averaged, from times as short as the exposure."""
    waveform = WAVEFORMS[name]
    phases = phases_of(waveform)
    elapsed = exposure_s + np.append(0.0, np.geomspace(1e-6, 0.015, 30))
    moving = Views(gripper, MODEL, SAMPLES, elapsed, GRIPPER, exposure_s).under(waveform)
    view, own = moving.respond(np.arange(4)), moving.respond(np.arange(4), elapsed[::3])
    now = Views(gripper, MODEL, SAMPLES, elapsed, GRIPPER).under(waveform).respond(np.arange(4))
    peak = np.abs(view.sensitivity).max()
    np.testing.assert_allclose(own.sensitivity, view.sensitivity[..., ::3], atol=1e-13 * peak)
    np.testing.assert_array_equal(view.force, now.force)
    np.testing.assert_array_equal(view.rotation, now.rotation)
    averaged = torque_history(average(phases, exposure_s))
    for k, start in enumerate(torque_history(phases).time_s):
        for row, sample in enumerate(SAMPLES):
            exact = ringing_responses(gripper, MODEL, averaged, start + elapsed, sample[None])[0]
            # A shorter exposure is the difference of larger responses to steeper ramps.
            share = 1e-8 * max(1.0, 1e-4 / exposure_s)
            np.testing.assert_allclose(
                view.sensitivity[row, :, k], exact[1:], atol=share * np.abs(exact[0]).max()
            )


@pytest.mark.parametrize("name", SHAPES)
def test_trains_keep_to_their_limits(name: str) -> None:
    shape, limits = SHAPES[name], Limits(100.0, 0.01, 20, 1e-5)
    rng = np.random.default_rng(0)
    for shares in rng.random((300, shape.shares)):
        made = shape.waveform(shares, limits)
        assert made.durations_s.sum() == pytest.approx(100.0)
        units = made.durations_s / 0.01
        np.testing.assert_allclose(units, np.round(units), atol=1e-6)
        assert units.min() > 0.5
        assert len(made.levels) <= 20
        assert 0 < made.highest <= 1 + 1e-12
        assert np.all((made.levels - made.amplitudes >= 0) & (made.ends >= 0))


def test_steps_step() -> None:
    limits = Limits(100.0, 0.01, 20, 1e-5)
    for shares in np.random.default_rng(1).random((50, 9)):
        assert np.all(np.diff(steps(shares, limits).levels) != 0)


def test_ramps_never_jump() -> None:
    limits = Limits(100.0, 0.01, 20, 1e-5)
    for shares in np.random.default_rng(2).random((50, 11)):
        made = SHAPES["ramps"].waveform(shares, limits)
        assert made.levels[0] == 0
        np.testing.assert_array_equal(made.levels[1:], made.ends[:-1])
        assert np.any(made.ends > made.levels)
        assert np.any(made.ends < made.levels)


def test_sinusoids_go_from_one_period_to_another_and_a_camera_follows() -> None:
    limits = Limits(100.0, 0.01, 20, 1e-5)
    for shares in np.random.default_rng(3).random((50, 10)):
        made = SHAPES["sinusoids"].waveform(shares, limits)
        slots = made.periods_s[made.swings] / 1e-5
        np.testing.assert_allclose(slots / 2, np.round(slots / 2), atol=1e-6)
        assert slots.min() > 7.9
        assert np.all(made.durations_s[made.swings] / made.periods_s[made.swings] < 10_001)
        differences = np.diff(slots)
        assert np.all(differences >= -1e-6) or np.all(differences <= 1e-6)


def test_a_sinusoid_without_amplitude_is_a_hold() -> None:
    shares = np.array([0.9, 0.5, 0.1, 0.9, 0.5, 0.6, 0.6, 0.0, 0.0, 0.6])
    made = SHAPES["sinusoids"].waveform(shares, Limits(100.0, 0.01, 20, 1e-5))
    assert made.durations_s == pytest.approx([100.0])
    assert made.levels == pytest.approx([0.6])


def test_triangles_as_they_are_meant() -> None:
    """Two cycles of 1 s, of which a quarter is the rise; torque of the hold as of the valleys."""
    whole = 100.0 - 2 * 0.01 * 3
    length = np.log(2 / 0.04) / np.log(whole / 0.04)
    shares = [np.log(2) / np.log(9), length, 0.5, 0.25 * 0.9, 0.8, 0.8, 0.5, 0.5, 0.4, 1.0, 1.0]
    made = SHAPES["ramps"].waveform(np.array(shares), Limits(100.0, 0.01, 20, 1e-5))
    # A ramp is a unit longer than its share.
    np.testing.assert_allclose(made.durations_s, [0.26, 0.76, 0.26, 0.76, 97.96], atol=0.011)
    np.testing.assert_allclose(made.levels, [0.0, 0.8, 0.4, 0.8, 0.4])
    np.testing.assert_allclose(made.ends, [0.8, 0.4, 0.8, 0.4, 0.4])


def test_a_short_ramp_is_a_step_and_a_small_sinusoid_a_hold(gripper: Gripper) -> None:
    elapsed = np.geomspace(1e-4, 0.4, 20)
    views = Views(gripper, MODEL, SAMPLES, elapsed, GRIPPER)
    step = views.under(hold(np.array([1.0, 1.0]), np.array([0.0, 1.0]))).respond(np.array([1]))
    ramped = linear(np.array([1.0, 1e-9, 1.0]), np.array([0.0, 0, 1.0]), np.array([0.0, 1.0, 1.0]))
    swung = swinging(np.ones(2), np.array([0.0, 1.0]), np.array([0.0, 1e-9]), np.full(2, 1e-3))
    for waveform in (ramped, swung):
        other = views.under(waveform).respond(np.array([len(waveform.levels) - 1]))
        for name in ("sensitivity", "rotation", "force"):
            one, same = getattr(step, name), getattr(other, name)
            # A nanosecond of the ring, 1e5/s, and 1e-9 of the torque near resonance.
            np.testing.assert_allclose(same, one, atol=1e-4 * np.abs(one).max())


def test_a_train_as_it_is_meant() -> None:
    """Four cycles of 1 s, high for half of it, levels changing from cycle to cycle."""
    length = np.log(4 / 0.08) / np.log(99.99 / 0.08)
    shares = [np.log(4) / np.log(9), length, 0.5, 0.45, 0.4, 1.0, 0.5, 0.0, 0.3]
    made = steps(np.array(shares), Limits(100.0, 0.01, 20, 1e-5))
    np.testing.assert_allclose(made.durations_s, [0.5] * 8 + [96.0])
    high, low = np.array([0.4, 0.6, 0.8, 1.0]), np.array([0.5, 1 / 3, 1 / 6, 0.0])
    levels = np.stack((high, high * low), axis=1).ravel()
    np.testing.assert_allclose(made.levels, [*levels, 0.3])


@pytest.mark.parametrize("fine_end", [False, True])
@pytest.mark.parametrize("slots", [2, 10, 24, 25, 26, 1000, 10**7])
def test_cells_have_every_slot_once(slots: int, fine_end: bool) -> None:
    found = time_bins(slots, 1.3)
    if fine_end:
        found = with_fine_end(found)
        assert found.slots[-1] == 1
    assert found.first[0] == 1
    np.testing.assert_array_equal(found.first[1:], (found.first + found.slots)[:-1])
    assert found.first[-1] + found.slots[-1] == slots
    assert np.all((found.middle >= found.first) & (found.middle < found.first + found.slots))


@pytest.mark.parametrize("period", [8, 14, 100, 3000, 10**6])
@pytest.mark.parametrize("slots", [2, 1000, 12_345])
def test_cells_of_a_sinusoid_have_every_slot_once(slots: int, period: int) -> None:
    found = periodic_time_bins(slots, period, 12, 1.5)
    columns = (column.tolist() for column in (found.first, found.slots, found.repeats))
    every = [
        first + period * turn + slot
        for first, several, repeats in zip(*columns, strict=True)
        for turn in range(repeats)
        for slot in range(several)
    ]
    assert sorted(every) == list(range(1, slots))
    assert len(every) == found.capacity.sum()
    middle = found.middle - found.first
    # In one of its own parts, of a period near the middle of those that it is spread over.
    assert np.all((middle % period >= 0) & (middle % period < found.slots))
    assert np.all(middle // period < found.repeats)
    # Parts are no longer than a twelfth of a period, to rounding.
    assert found.slots.max() <= max(24, period / 12 + 1)


def test_bounds_take_nothing_for_known() -> None:
    information = np.array([[[4.0, 1.9], [1.9, 1.0]], [[4.0, 2.0], [2.0, 1.0]]])
    bounds = relative_bounds(information)
    np.testing.assert_allclose(bounds[0], np.sqrt(np.diag(np.linalg.inv(information[0]))))
    assert np.all(np.isinf(bounds[1]))
    apart = np.zeros((1, 3, 3))
    apart[0, :2, :2], apart[0, 2, 2] = information[1], 9.0
    np.testing.assert_allclose(relative_bounds(apart)[0], [np.inf, np.inf, 1 / 3])
