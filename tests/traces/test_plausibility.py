"""Traces in a right and a wrong unit, of a right and a wrong sign, and noise."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.identify.prepare import _responds, check_recording
from biogrip.library import Sample, set_up, simulate
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.models import MODELS
from biogrip.physics.noise import Noise, add_noise
from biogrip.physics.protocol import Phase, hold, join_phases, ramp, sample_times
from biogrip.physics.response import step_response, superpose
from biogrip.traces.measurement_block import MeasurementBlock
from biogrip.traces.reader import Recording
from tests.helpers.columns import columns_of
from tests.helpers.default import STUDY
from tests.helpers.problems import GRIPPER

UNEQUAL = Gripper(1.5e-3, 75.0, Arm(1.0e-14, 3.3e-12, 4.4e-7), Arm(1.3e-14, 2.5e-12, 5.5e-7))
SI = columns_of()
SAMPLES = {name: tuple(case.parameters.values()) for name, case in STUDY.cases.items()}
TIMES = sample_times(400.0, 1.0)
NO_RESPONSE = "found no response to the torque"
MIRRORED = "found a rotation that goes against the torque"


def trace(
    sample: tuple[float, ...], time_s: Array = TIMES, phases: tuple[Phase, ...] = STUDY.phases
) -> Array:
    model = Sample("generalized_maxwell")
    values = dict(zip(model.model.names, sample, strict=True))
    return simulate(set_up(GRIPPER, phases, model), values, time_s)


def said(
    time_s: Array,
    values: Array,
    columns: MeasurementBlock = SI,
    gripper: Gripper = GRIPPER,
    phases: tuple[Phase, ...] = STUDY.phases,
    *,
    noise_sd: float | None = None,
    offset: bool = False,
) -> str:
    """What is said of a trace on lines 2, 3, ...: why it is refused, a note on it, or nothing."""
    time, reading = columns.named.values()
    units = time.removeprefix("time_"), reading.removeprefix("rotation_")
    lines, file = np.arange(len(time_s)) + 2, Path("trace.csv")
    recording = Recording(time_s, values, lines, file, columns, units)
    problem = set_up(gripper, phases, Sample("maxwell"))
    problem = replace(problem, offset=offset, noise_sd=noise_sd)
    try:
        return check_recording(recording, problem) or ""
    except BiogripError as error:
        return str(error)


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("rate_Hz", [10.0, 0.1])
@pytest.mark.parametrize("level", [0.0, 0.1, 0.4])
def test_the_papers_traces_pass_and_not_in_a_wrong_unit_or_mirrored(
    sample: str, rate_Hz: float, level: float
) -> None:
    times = sample_times(400.0, rate_Hz)
    noise = Noise("gaussian", level, "peak")
    noisy = add_noise(trace(SAMPLES[sample], times), noise, np.random.default_rng(7))
    assert said(times, noisy) == ""
    assert said(times, -noisy).startswith(
        f"trace.csv, lines 2 to {len(times) + 1}, column 'rotation_rad': {MIRRORED}, allowed is "
        "the closing rotation, positive where the arm closes. It would fit if it were -1 times "
        "(then say --set measurement.scale=-1)"
    )
    found = f"trace.csv, line {np.argmax(np.abs(noisy)) + 2}, column 'rotation_rad': found "
    for factor, allowed, fits in (
        (1e3, "allowed is at most 0.00545 rad", "0.001 times (is it in mrad?)"),
        (1e-3, "allowed is at least 7.27e-06 rad", "1000 times."),
    ):
        text = said(times, factor * noisy)
        assert text.startswith(found)
        assert allowed in text
        assert f"It would fit if it were {fits}" in text


def test_the_largest_reading_and_the_smoothed_one_are_told() -> None:
    values = 1e3 * trace(SAMPLES["liquid_drop_1"])
    values[57] = 7.25
    found = said(TIMES, values)
    assert found.startswith("trace.csv, line 59, column 'rotation_rad': found 7.25 rad as the lar")
    (smoothed,) = re.findall(r"and ([\d.]+) rad as the largest with the noise smoothed out", found)
    assert float(smoothed) == pytest.approx(3.2, rel=0.15)
    assert "without any sample the arm turns by 0.00364 rad" in found
    assert "allowed is at most 0.00545 rad" in said(TIMES, 1e297 * values)


def test_the_unit_that_would_fit_is_named() -> None:
    for column, factor, found, hint in (
        ("rotation_rad", 1e6, "line ", "1e-06 times (is it in urad?)."),
        ("rotation_rad", 180 / np.pi, "line ", "0.001 times (is it in mrad?) or 0.01745 times (i"),
        ("rotation_mrad", 1e-3, "line ", "1000 times (is it in rad?) or 17.45 times (is it in d"),
        ("rotation_urad", 1e3, "line ", "0.001 times."),
        ("time_s", 1e3, "line 3, column 'time_s': found 1000 s", "0.001 times (is it in ms?)."),
        ("time_ms", 1e-3, "lines 2 to 402, column 'time_ms': found only 0 to 0.4 s", "1000 times"),
        ("time_min", 60.0, "line 9, column 'time_min': found 420 s", "0.01667 times (is it in s?)"),
    ):
        values, of_time = trace(SAMPLES["liquid_drop_1"]), column.startswith("time")
        if of_time:
            text = said(factor * TIMES, values, columns_of(column))
        else:
            text = said(TIMES, factor * values, columns_of(reading=column))
        assert text.startswith(f"trace.csv, {found}")
        assert f"column '{column}'" in text
        assert f"It would fit if it were {hint}" in text
        assert ("400 s" in text) == of_time


def test_a_stiff_sample_passes_if_its_rotation_is_far_above_a_given_noise() -> None:
    values = trace((35e3, 12.3e3, 3e5, 1.0))
    refused = "allowed is at least 7.27e-06 rad, or less with a given noise (--noise)"
    assert refused in said(TIMES, values)
    assert refused in said(TIMES, values, noise_sd=values.max() / 5)
    note = said(TIMES, values, noise_sd=values.max() / 20)
    assert note.startswith("The largest rotation is")
    assert "the sample is very stiff, or the unit is not the right one. It would fit if" in note
    assert said(TIMES, trace(SAMPLES["liquid_drop_1"]), noise_sd=1e-6) == ""


@pytest.mark.parametrize(("explained", "responds"), [(7.9, False), (8.2, True)])
def test_a_response_explains_more_than_noise_would(explained: float, responds: bool) -> None:
    """Ten readings, three unknowns: F(3, 7) at 99.9 % is 18.77, times 3 / 7 of the rest."""
    trace = np.sqrt(1 + explained) * np.eye(10)[0]
    assert _responds(trace, np.zeros((0, 10)), 1.0, 3, 7) == responds


@pytest.mark.parametrize("rate_Hz", [10.0, 0.1])
@pytest.mark.parametrize("mean", [0.0, -1e-3, 5.0])
@pytest.mark.parametrize("sd", [0.0, 1e-9, 1e-4, 1.0])
def test_noise_about_a_constant_is_no_response(rate_Hz: float, mean: float, sd: float) -> None:
    times = sample_times(400.0, rate_Hz)
    where = f"trace.csv, lines 2 to {len(times) + 1}, column 'rotation_rad': {NO_RESPONSE}"
    for seed in range(20):
        values = mean + sd * np.random.default_rng([5, seed]).standard_normal(len(times))
        text = said(times, values)
        assert text.startswith(where)
        (told,) = re.findall(r", but (\S+) rad throughout, give or take (\S+) rad", text)
        assert [*map(float, told)] == pytest.approx([values.mean(), values.std()], rel=0.05)


def test_a_number_that_is_no_reading_is_named_and_not_the_response() -> None:
    values = trace(SAMPLES["liquid_drop_1"]) + 1e-6 * np.random.default_rng(0).normal(size=401)
    values[77] = -9999.0
    found = said(TIMES, values)
    assert found.startswith("trace.csv, line 79, column 'rotation_rad': found -9999 rad, far from")


def test_an_offset_is_no_response_no_hindrance_and_no_wrong_sign() -> None:
    noise = 3e-4 * np.random.default_rng(0).standard_normal(len(TIMES))
    values = trace((1.0, 1e-4, 10.0, 1e-3)) + noise + 0.02
    assert NO_RESPONSE in said(TIMES, values)
    assert said(TIMES, values, offset=True) == ""
    assert NO_RESPONSE in said(TIMES, noise + 0.02, offset=True)
    for sample in SAMPLES.values():
        clean = trace(sample)
        for share in (-0.2, -0.5, -1.0, -3.0):
            assert MIRRORED not in said(TIMES, clean + share * clean.max())


@pytest.mark.parametrize("samples", [10, 12, 15, 57, 300])
def test_what_rounding_leaves_of_a_torque_is_no_response(samples: int) -> None:
    """While one torque is held, the quickest lag is a constant: nothing of it is beside an offset.

    The sample relaxes within the hold, so that its rotation is no constant.
    """
    phases, rng = (hold(60.0, 1e-9),), np.random.default_rng(samples)
    even = np.linspace(0.0, 60.0, samples + 1)[1:]
    for times in (even, *np.sort(rng.uniform(0.1, 60.0, (10, samples)))):
        clean = trace((10.0, 0.1, 100.0, 1.0), times, phases=phases)
        noisy = clean + 0.01 * clean.max() * rng.standard_normal(samples)
        for values in (clean, noisy):
            assert said(times, values + 1e-4, phases=phases, offset=True) == ""
            assert MIRRORED in said(times, -values, phases=phases)


def test_times_outside_the_protocol_are_refused() -> None:
    values = trace(SAMPLES["liquid_drop_1"])
    columns = columns_of()
    for shift_s, found in ((-1.0, "line 2, column 'time_s': found -1 s"), (1.5, "line 401, ")):
        text = said(TIMES + shift_s, values, columns)
        assert text.startswith(f"trace.csv, {found}")
        assert "allowed is the protocol's time, 0 to 400 s. If the protocol starts" in text
        assert "not at 0 of the clock, --start says when" in text
    # Times are written with few digits.
    for times in (TIMES * (1 + 0.9e-5), TIMES - 1e-10):
        assert said(times, values) == ""
    assert "allowed is the protocol's time" in said(TIMES * (1 + 1.1e-5), values)


def test_a_share_of_the_protocol_is_enough_wherever_it_is() -> None:
    """A fiftieth of 400 s, counted from the first reading."""
    for start_s in (0.0, 30.0, 190.0):
        times = start_s + sample_times(20.0, 10.0)
        values = trace(SAMPLES["liquid_drop_1"], times)
        assert said(times[:81], values[:81]) == ""
        assert said(times[:80], values[:80]).startswith(
            f"trace.csv, lines 2 to 81, column 'time_s': found only {start_s:g} to "
            f"{start_s + 7.9:g} s of the protocol's 400 s, allowed are at least 8 s of it. If the "
            "protocol starts after readings, or not at 0 of the clock, "
        )


PULLING = {
    "steps": STUDY.phases,
    "ramp": (ramp(100.0, 0.0, 2e-9), hold(50.0, 0.0)),
    "late": (hold(50.0, 0.0), hold(50.0, 1e-9), hold(100.0, 0.0)),
    "stairs": tuple(hold(40.0, 1e-10 * (step + 1)) for step in range(8)),
    "opening": (hold(100.0, -1.6e-9), hold(100.0, 0.0)),
}


@pytest.mark.parametrize("protocol", PULLING)
def test_the_sign_of_a_trace_is_told(protocol: str) -> None:
    """Nearly all good traces pass, never is one called mirrored; few mirrored ones pass as good."""
    torque, rng = join_phases(PULLING[protocol]), np.random.default_rng(10)
    mirrored = missed = passed = 0
    for trial in range(40):
        model = [*MODELS.values()][trial % len(MODELS)]
        gripper = (GRIPPER, UNEQUAL)[trial // 2 % 2]
        powers = rng.uniform(-2, 2.5, len(model.names))
        exponents = np.array([parameter.kind == "exponent" for parameter in model.parameters])
        network = model.network(np.where(exponents, (powers + 2.1) / 4.7, 10**powers))
        times = np.sort(rng.uniform(0, torque.end_s, 500))
        values = superpose(step_response(gripper, network, inertia=False), torque, times)[0]
        size, offset = np.abs(values).max(), trial % 3 == 0
        values += rng.choice([0.0, 0.05, 0.3]) * size * rng.standard_normal(len(times))
        values += offset * size * rng.standard_normal()
        given = (SI, gripper, PULLING[protocol])
        good, bad = (said(times, sign * values, *given, offset=offset) for sign in (1, -1))
        assert MIRRORED not in good
        mirrored += MIRRORED in bad
        missed += not bad
        passed += not good
    assert mirrored >= 20
    # Samples that are far too stiff for the gripper show nothing.
    assert passed >= 32
    assert missed <= 3
