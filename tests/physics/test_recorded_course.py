"""A course that was recorded: followed from row to row, and what samples do under it."""

import functools

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.trace_noise import NoiseModel, Whitening
from biogrip.physics import modes
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import NO_ARMS
from biogrip.physics.models import MODELS
from biogrip.physics.noise import nuisance_basis
from biogrip.physics.protocol import (
    Course,
    evaluate,
    follow_rows,
    hold,
    join_phases,
    ramp,
    with_steps,
)
from biogrip.physics.response import linear_responses, simulated_response
from tests.physics.test_residuals import assert_alike, posed

RNG = np.random.default_rng(4)
EVEN: Array = np.arange(251) / 25
UNEVEN = EVEN + np.r_[0.0, RNG.uniform(-0.01, 0.01, 249), 0.0]
CLOCKS = {"even": EVEN, "uneven": UNEVEN, "log": np.r_[0.0, np.geomspace(0.01, 10.0, 250)]}
OMEGA = 2 * np.pi


def rates_at(course: Course, rows_s: Array) -> tuple[Array, Array]:
    """Rates just before and just after rows within a course."""
    near = 1e-8
    before, at, after = (evaluate(course, rows_s + each) for each in (-near, 0.0, near))
    return (at - before) / near, (after - at) / near


@pytest.mark.parametrize("clock", ["even", "uneven"])
def test_a_sinusoid_is_followed_between_its_rows(clock: str) -> None:
    """With 25 rows a period; a line between two rows is off by (omega h)^2/8 = 8e-3."""
    rows_s = CLOCKS[clock]
    course = follow_rows(rows_s, np.sin(OMEGA * rows_s), deforms=True)
    between_s = np.linspace(0.2, 9.8, 2000)
    np.testing.assert_allclose(evaluate(course, between_s), np.sin(OMEGA * between_s), atol=3e-4)
    inner_s = rows_s[2:-2]
    for rates in rates_at(course, inner_s):
        # Of five even rows (omega h)^4/30 = 1.3e-4; uneven ones are a half further apart.
        np.testing.assert_allclose(rates / OMEGA, np.cos(OMEGA * inner_s), atol=1.5e-3)
    np.testing.assert_array_equal(course.jumps_s, [0.0])


def test_a_damper_is_not_read_at_a_first_row_that_comes_late() -> None:
    """What was there before it is held from 0, and the rate at it is that of neither side."""
    rows_s = np.r_[0.0, EVEN[1:]]
    course = follow_rows(rows_s, np.sin(OMEGA * np.maximum(rows_s, EVEN[1])), deforms=True)
    np.testing.assert_array_equal(course.jumps_s, rows_s[:2])


@pytest.mark.parametrize("rows_s", [*CLOCKS.values(), np.array([0.0, 1.0, 3.0])])
def test_rows_are_followed_whatever_they_are(rows_s: Array) -> None:
    values = RNG.standard_normal(len(rows_s))
    course = follow_rows(rows_s, values, deforms=False)
    np.testing.assert_allclose(evaluate(course, rows_s), values, atol=1e-11)
    before = evaluate(course, rows_s[1:-1] * (1 - 1e-15))
    np.testing.assert_allclose(before, values[1:-1], atol=1e-9)
    middle = evaluate(course, 0.5 * (rows_s[1:] + rows_s[:-1]))
    assert len(rows_s) > 3 or middle == pytest.approx(0.5 * (values[1:] + values[:-1]))


def test_a_step_between_two_rows_stands_in_the_middle() -> None:
    """On a rising line, that it goes on from; a triangle and a course of noise have none."""
    rows_s = np.arange(20.0)
    line = 0.1 * rows_s
    record, uncertain_s = with_steps(np.column_stack((rows_s, line + 3.0 * (rows_s > 7))))
    np.testing.assert_allclose(uncertain_s, [np.std(np.linspace(7, 8, 10_001))], rtol=1e-3)
    course = follow_rows(*record.T, deforms=False)
    np.testing.assert_allclose(course.steps_s, [7.5], rtol=1e-15)
    np.testing.assert_allclose(evaluate(course, rows_s), line + 3.0 * (rows_s > 7), atol=1e-14)
    # Between the two rows it stays where it was.
    np.testing.assert_allclose(evaluate(course, [7.49, 7.5]), [0.7, 3.8], atol=1e-3)
    for other in (np.abs(rows_s % 8 - 4), RNG.standard_normal(20)):
        same, none = with_steps(np.column_stack((rows_s, other)))
        assert len(none) == 0
        np.testing.assert_array_equal(same[:, 1], other)


def test_a_step_among_the_noise_of_a_sensor_is_one_and_noise_is_none() -> None:
    """Of 40 records with noise of 5 % all have the one step; a rise within two rows is none."""
    rows_s, rng = np.arange(200.0), np.random.default_rng(0)
    for _ in range(40):
        noise = 0.05 * rng.standard_normal(200)
        for risen, steps in ((rows_s > 9, 1), (np.clip(rows_s - 9, 0, 2) / 2, 0), (0 * rows_s, 0)):
            record = np.column_stack((rows_s, risen + noise))
            assert len(with_steps(record, noise_sd=0.05)[1]) == steps


def test_a_row_off_a_line_has_the_mean_of_the_rates_on_both_sides() -> None:
    values = EVEN + 0.4 * (EVEN[100] == EVEN)
    before, after = rates_at(follow_rows(EVEN, values, deforms=True), EVEN[99:102])
    # The rows beside it go on as the line does.
    np.testing.assert_allclose(before, 1.0, atol=1e-4)
    np.testing.assert_allclose(after, 1.0, atol=1e-4)


@pytest.mark.parametrize("corner_s", [4.0, 4.013, 4.027])
def test_lines_are_followed_to_their_corner(corner_s: float) -> None:
    """On a row the rate jumps; between two rows, both go on as on their own side."""
    values = np.interp(EVEN, [0.0, corner_s, 10.0], [0.0, 2.0, 0.0])
    course = follow_rows(EVEN, values, deforms=True)
    up, down = 2 / corner_s, -2 / (10 - corner_s)
    rows_s = EVEN[1:-1]
    before, after = rates_at(course, rows_s)
    np.testing.assert_allclose(before[rows_s <= corner_s], up, atol=1e-4)
    np.testing.assert_allclose(after[rows_s >= corner_s], down, atol=1e-4)
    np.testing.assert_allclose(before[rows_s > corner_s + 0.05], down, atol=1e-4)
    assert course.jumps_s.tolist() == [0.0, *rows_s[rows_s == corner_s]]


def test_a_step_between_two_rows_stays_between_them() -> None:
    values = np.where(EVEN < 3, 1.0, 5.0)
    course = follow_rows(EVEN, values, deforms=False)
    np.testing.assert_array_equal(course.time_s, [0.0, *EVEN[74:76]])
    found = evaluate(course, np.linspace(0, 10, 5001))
    assert (found.min(), found.max()) == (1.0, pytest.approx(5.0, abs=1e-14))
    assert course.steps_s.tolist() == [0.0]


def test_times_are_moved_to_changes_that_they_are_but_for_rounding_on() -> None:
    course = join_phases((hold(0.7, 1.0), hold(0.1, 2.0), hold(1.0, 0.0)), deforms=True)
    assert course.time_s[2] != 0.8
    times = np.array([0.1, 0.7, 0.8, 0.9, 0.95, 1.2])
    moved = np.isin(course.snapped(times), course.changes_s)
    assert moved.tolist() == [False, True, True, False, False, False]
    far = times + 1e-8
    np.testing.assert_array_equal(course.snapped(far), far)


def test_a_ramp_that_goes_on_at_its_rate_is_no_jump() -> None:
    one = join_phases((ramp(0.3, 0.0, 0.1), ramp(0.6, 0.1, 0.3), hold(1.0, 0.3)), deforms=True)
    assert one.jumps_s.tolist() == [0.0, pytest.approx(0.9)]


@pytest.mark.parametrize("deforms", [False, True])
@pytest.mark.parametrize("rows", ["even", "uneven"])
def test_phases_in_blocks_are_phases_one_by_one(
    monkeypatch: pytest.MonkeyPatch, rows: str, deforms: bool
) -> None:
    """Slow and fast modes, read at rows, and between them."""
    rows_s = CLOCKS[rows]
    course = follow_rows(rows_s, RNG.standard_normal(251), deforms=deforms)
    rates = -np.array([[0.0, 1e-4, 0.3, 20.0], [3.0, 400.0, 1e5, 1e9]])
    for times in (rows_s, np.sort(RNG.uniform(-1.0, 10.0, 400))):
        found = [*modes.responses_in_turn(rates, course, times)]
        with monkeypatch.context() as one_by_one:
            one_by_one.setattr(modes, "_MOST_ONE_BY_ONE", 1000)
            one_by_one.setattr(modes, "_MODE_NUMBERS_AT_ONCE", 500)
            expected = [*modes.responses_in_turn(rates, course, times)]
        own, other = (np.concatenate([it for _, it in of], axis=3) for of in (found, expected))
        assert np.all(np.abs(own - other) <= 1e-12 * np.abs(other).max(axis=3, keepdims=True))


def under_a_sinusoid(name: str, t: Array) -> tuple[Array, Array]:
    """Controlled sin(w t) from 0 on, and what is read, by hand; 25 rows a period."""
    w, k_p, c_p, k_s, k_v, c_v = OMEGA, 180.0, 25.0, 500.0, 300.0, 150.0
    if name == "kelvin_voigt":
        return np.array([k_p, c_p]), k_p * np.sin(w * t) + c_p * w * np.cos(w * t)
    tau = c_v / k_v
    voigt = (np.sin(w * t) - w * tau * np.cos(w * t) + w * tau * np.exp(-t / tau)) / k_v
    return np.array([k_s, k_v, c_v]), np.sin(w * t) / k_s + voigt / (1 + (w * tau) ** 2)


@pytest.mark.parametrize("name", ["kelvin_voigt", "zener_kelvin"])
def test_a_sample_under_a_recorded_sinusoid_responds_as_under_the_true_one(name: str) -> None:
    """To 2e-4 of the peak, where a line from row to row would cost 5e-3, and 1e-2 of a rate."""
    parameters, expected = under_a_sinusoid(name, EVEN)
    course = follow_rows(EVEN, np.sin(OMEGA * EVEN), deforms=name == "kelvin_voigt")
    model, read = MODELS[name], slice(3, -2)
    found, *_ = linear_responses(NO_ARMS, model, course, EVEN, parameters[None])[0]
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found[read], expected[read], atol=2e-4 * scale)
    network = model.network([parameters])
    simulated = simulated_response(NO_ARMS, network, course, EVEN)[0]
    np.testing.assert_allclose(simulated, found, atol=1e-12 * scale)


@functools.cache
def condensed(deforms: bool, noise: str) -> Condensed:
    """Rows for readings before the course, at its rows, and beside them."""
    held = np.sin(3 * UNEVEN) + 0.02 * RNG.standard_normal(251)
    course = follow_rows(UNEVEN, held, deforms=deforms)
    time_s = np.unique(np.r_[-0.3, -0.1, UNEVEN[1:], RNG.uniform(0, 10, 40)])
    nuisance = nuisance_basis(time_s, offset=noise != "plain", drift=noise != "plain")
    colour = NoiseModel(ar1=0.5, time_s=0.3, flicker=0.0)
    whitening = Whitening(time_s, colour, nuisance) if noise == "coloured" else None
    return Condensed(course, time_s, nuisance[:0] if whitening else nuisance, whitening)


@pytest.mark.parametrize(
    ("deforms", "noise"), [(False, "plain"), (True, "drifting"), (True, "coloured")]
)
@pytest.mark.parametrize("name", MODELS)
def test_rows_have_the_sums_of_squares_of_readings(name: str, deforms: bool, noise: str) -> None:
    """Slow samples and fast ones; to 1e-10 of the trace, as of steps (test_residuals.py)."""
    rows, model, rng = condensed(deforms, noise), MODELS[name], np.random.default_rng(3)
    residuals = posed(NO_ARMS, model, rows, 1e-3 * rng.standard_normal(len(rows.all_s)))
    moved = [parameter.kind != "exponent" for parameter in model.parameters]
    for x in np.log([model.example]) + 3 * rng.standard_normal((2, len(moved))) * moved:
        assert_alike(residuals, x)
