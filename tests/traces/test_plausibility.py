import re
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.physics.drift import nuisance_basis
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.maxwell_models import generalized_maxwell
from biogrip.physics.models import MODELS
from biogrip.physics.noise import Noise, add_noise
from biogrip.physics.protocol import (
    Harmonic,
    Load,
    Phase,
    TorqueHistory,
    hold,
    sample_times,
    torque_history,
)
from biogrip.traces.columns import Columns
from biogrip.traces.plausibility import (
    LARGEST_SHARE,
    SMALLEST_SHARE,
    check_recording,
    free_rotation,
)
from biogrip.traces.reader import Recording

FILE = Path("trace.csv")
SI = Columns("time_s", "rotation_rad")
SAMPLES = {
    "endothelial_cell": (35.0, 12.3, 299.9, 1.0e-3),
    "liquid_drop_1": (9.5, 1.0e-4, 10.0, 1.0e-4),
    "liquid_drop_2": (1.0, 1.0e-4, 10.0, 1.0e-3),
}
PROTOCOLS = {
    "one hold": (hold(60.0, 1e-9),),
    "ramp": (Phase(100.0, Load(0.0, 2e-11), Load(0.0, 2e-11)), hold(50.0, 0.0)),
    "sinusoid": (
        Phase(
            200.0,
            Load(0.0, harmonics=(Harmonic(1e-9, 2.0, 0.3),)),
            Load(0.0, harmonics=(Harmonic(1e-9, 2.0, 0.3),)),
        ),
    ),
    "one arm": (hold(100.0, 1.6e-9, 0.0), hold(100.0, 0.0)),
    "the other arm": (hold(100.0, 0.0, 1.6e-9), hold(100.0, 0.0)),
    "opening": (hold(100.0, -1.6e-9), hold(100.0, 0.0)),
}


def check(
    recording: Recording,
    gripper: Gripper,
    torque: TorqueHistory,
    path: Path,
    columns: Columns,
    noise_rad: float | None = None,
    offset: bool = False,
) -> str | None:
    nuisance = nuisance_basis(recording.time_s, offset=offset, drift=False)
    return check_recording(
        recording, gripper, torque, path, columns, nuisance, GRIPPER, noise_rad, noise_rad
    )


def recorded(time_s: Array, rotation_rad: Array) -> Recording:
    """A trace as from a file with a header, on lines 2, 3, ..."""
    return Recording(time_s, rotation_rad, np.arange(len(time_s)) + 2, 0)


def trace(
    gripper: Gripper, torque: TorqueHistory, sample: tuple[float, ...], time_s: Array
) -> Array:
    response = step_response(gripper, generalized_maxwell(sample), symmetric=torque.symmetric)
    values: Array = rotation(response, torque, time_s)[0]
    return values


def refusal(
    recording: Recording, gripper: Gripper, torque: TorqueHistory, columns: Columns = SI
) -> str:
    with pytest.raises(BiogripError) as error:
        check(recording, gripper, torque, FILE, columns)
    return str(error.value)


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("rate_Hz", [10.0, 0.1])
@pytest.mark.parametrize("level", [0.0, 0.1, 0.4])
@pytest.mark.parametrize("kind", ["gaussian", "uniform"])
def test_the_papers_traces_pass_and_not_in_a_wrong_unit(
    gripper: Gripper, steps: TorqueHistory, sample: str, rate_Hz: float, level: float, kind: str
) -> None:
    times = sample_times(400.0, rate_Hz)
    clean = trace(gripper, steps, SAMPLES[sample], times)
    for seed in range(4):
        noisy = add_noise(clean, Noise(kind, level, "peak"), np.random.default_rng([7, seed]))
        check(recorded(times, noisy), gripper, steps, FILE, SI)
        noise_rad = level * clean.max()
        check(recorded(times, noisy), gripper, steps, FILE, SI, noise_rad)
        large = refusal(recorded(times, 1e3 * noisy), gripper, steps)
        line = np.argmax(np.abs(noisy)) + 2
        assert large.startswith(f"trace.csv, line {line}, column 'rotation_rad': found ")
        assert "allowed is at most 0.00545 rad" in large
        assert "It would fit if it were 0.001 times (is it in mrad?)" in large
        small = refusal(recorded(times, 1e-3 * noisy), gripper, steps)
        assert small.startswith(f"trace.csv, line {line}, column 'rotation_rad': found ")
        assert "allowed is at least 7.27e-06 rad" in small
        assert small.endswith("It would fit if it were 1000 times.")


@pytest.mark.parametrize("samples", [10, 12, 15, 45, 57, 300])
def test_what_rounding_leaves_of_a_torque_is_no_response(gripper: Gripper, samples: int) -> None:
    """While one torque is held, the quickest lag is a constant: nothing of it is beside an offset.

    The sample relaxes within the hold, so that its rotation is no constant.
    """
    torque = torque_history(PROTOCOLS["one hold"])
    even = np.linspace(0.0, 60.0, samples + 1)[1:]
    rng = np.random.default_rng(samples)
    for times in (even, *np.sort(rng.uniform(0.1, 60.0, (20, samples)))):
        clean = trace(gripper, torque, (10.0, 0.1, 100.0, 1.0), times)
        assert np.ptp(clean) > 0.2 * clean.max()
        noisy = clean + 0.01 * clean.max() * rng.standard_normal(samples)
        for values in (clean, noisy):
            check(recorded(times, values + 1e-4), gripper, torque, FILE, SI, offset=True)
            assert "goes against the torque" in refusal(recorded(times, -values), gripper, torque)


def test_a_rotation_too_large_to_be_squared_is_refused(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    times = sample_times(400.0, 1.0)
    values = trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    for factor in (1e12, 1e160, 1e300):
        said = refusal(recorded(times, factor * values), gripper, steps)
        assert "as the largest with the noise smoothed out; allowed is at most 0.00545 rad" in said


def test_the_largest_sample_and_the_smoothed_one_are_told(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    times = sample_times(400.0, 1.0)
    values = 1e3 * trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    values[57] = 7.25
    said = refusal(recorded(times, values), gripper, steps)
    assert said.startswith("trace.csv, line 59, column 'rotation_rad': found 7.25 rad as the lar")
    smoothed = re.search(r"and ([\d.]+) rad as the largest with the noise smoothed out", said)
    assert smoothed is not None
    assert float(smoothed[1]) == pytest.approx(3.2, rel=0.15)
    assert "without any sample the arm turns by 0.00364 rad" in said


@pytest.mark.parametrize(
    ("unit", "factor", "hint"),
    [
        ("rad", 1e6, "1e-06 times (is it in urad?)."),
        ("rad", 1e3, "0.001 times (is it in mrad?)."),
        ("rad", 180 / np.pi, "0.001 times (is it in mrad?) or 0.01745 times (is it in deg?)."),
        ("mrad", 1e-3, "1000 times (is it in rad?) or 17.45 times (is it in deg?)."),
        ("mrad", 1e3, "0.001 times (is it in urad?)."),
        ("urad", 1e-6, "1e+06 times (is it in rad?) or 1.745e+04 times (is it in deg?)."),
        ("urad", 1e3, "0.001 times."),
    ],
)
def test_the_unit_that_would_fit_is_named(
    gripper: Gripper, steps: TorqueHistory, unit: str, factor: float, hint: str
) -> None:
    times = sample_times(400.0, 1.0)
    values = factor * trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    for columns in (Columns("time_s", f"phi_{unit}"), Columns("time_s", "phi", None, unit)):
        said = refusal(recorded(times, values), gripper, steps, columns)
        assert f"column '{columns.reading}'" in said
        assert said.endswith(f"It would fit if it were {hint}")


def test_a_stiff_sample_passes_if_its_rotation_is_far_above_a_given_noise(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    times = sample_times(400.0, 1.0)
    values = trace(gripper, steps, (35e3, 12.3e3, 3e5, 1.0), times)
    seen = recorded(times, values)
    assert "allowed is at least 7.27e-06 rad, or less with a given noise (--noise)" in refusal(
        seen, gripper, steps
    )
    note = check(seen, gripper, steps, FILE, SI, noise_rad=values.max() / 20)
    assert note is not None
    assert "the sample is very stiff, or the unit is not the right one" in note
    assert "It would fit if it were" in note
    with pytest.raises(BiogripError, match="allowed is at least"):
        check(seen, gripper, steps, FILE, SI, noise_rad=values.max() / 5)
    plausible = trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    assert check(recorded(times, plausible), gripper, steps, FILE, SI, noise_rad=1e-6) is None


def test_no_trace_passes_in_two_units_a_thousand_apart(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    assert LARGEST_SHARE / SMALLEST_SHARE < 1000
    rng = np.random.default_rng(1)
    times = sample_times(400.0, 1.0)
    for _ in range(80):
        values = trace(gripper, steps, tuple(10 ** rng.uniform(-4, 5, 4)), times)
        values += rng.uniform(0, 0.3) * values.max() * rng.standard_normal(len(times))
        passed = 0
        for power in (-9, -6, -3, 0, 3, 6, 9):
            try:
                check(recorded(times, 10.0**power * values), gripper, steps, FILE, SI)
            except BiogripError:
                continue
            passed += 1
        assert passed <= 1


@pytest.mark.parametrize("rate_Hz", [10.0, 0.1])
@pytest.mark.parametrize("sigma_rad", [1e-9, 1e-4, 1.0])
def test_mere_noise_is_refused(
    gripper: Gripper, steps: TorqueHistory, rate_Hz: float, sigma_rad: float
) -> None:
    times = sample_times(400.0, rate_Hz)
    for seed in range(50):
        values = sigma_rad * np.random.default_rng([5, seed]).standard_normal(len(times))
        said = refusal(recorded(times, values), gripper, steps)
        assert said.startswith(
            f"trace.csv, lines 2 to {len(times) + 1}, column 'rotation_rad': found no response to"
        )
        for noise_rad in (sigma_rad, 2 * sigma_rad):
            with pytest.raises(BiogripError, match="found no response"):
                check(recorded(times, values), gripper, steps, FILE, SI, noise_rad)


@pytest.mark.nightly
def test_noise_is_taken_for_a_response_as_rarely_as_said(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    times = sample_times(400.0, 0.1)
    rng = np.random.default_rng(6)
    taken = 0
    for _ in range(5000):
        try:
            check(recorded(times, 1e-3 * rng.standard_normal(len(times))), gripper, steps, FILE, SI)
        except BiogripError:
            continue
        taken += 1
    assert taken <= 12


@pytest.mark.parametrize("value", [0.0, 1e-3, -1e-3, 5.0])
@pytest.mark.parametrize("sigma", [0.0, 0.03])
def test_a_constant_is_no_response(
    gripper: Gripper, steps: TorqueHistory, value: float, sigma: float
) -> None:
    times = sample_times(400.0, 1.0)
    values = value * (1 + sigma * np.random.default_rng(1).standard_normal(len(times)))
    said = refusal(recorded(times, values), gripper, steps)
    assert "found no response to the torque" in said
    found = re.search(r"but (\S+) rad throughout, give or take (\S+) rad", said)
    assert found is not None
    assert float(found[1]) == pytest.approx(value, rel=0.01)
    assert float(found[2]) == pytest.approx(abs(sigma * value), rel=0.15)


def test_a_response_below_the_known_noise_is_refused(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    times = sample_times(400.0, 0.1)
    values = trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    check(recorded(times, values), gripper, steps, FILE, SI, 0.0)
    check(recorded(times, values), gripper, steps, FILE, SI, 0.4 * values.max())
    with pytest.raises(BiogripError, match="found no response"):
        check(recorded(times, values), gripper, steps, FILE, SI, 3 * values.max())


@pytest.mark.parametrize("phases", PROTOCOLS.values(), ids=PROTOCOLS)
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_other_protocols_and_samples_pass(
    request: pytest.FixtureRequest, phases: tuple[Phase, ...], arms: str
) -> None:
    gripper: Gripper = request.getfixturevalue(arms)
    torque = torque_history(phases)
    rng = np.random.default_rng(8)
    times = np.sort(rng.uniform(0, torque.end_s, 3000))
    for _ in range(20):
        sample = tuple(10 ** rng.uniform((-2, -2, -2, -3), (1, 0, 2, 0)))
        values = trace(gripper, torque, sample, times)
        values += 0.1 * np.abs(values).max() * rng.standard_normal(len(times))
        check(recorded(times, values), gripper, torque, FILE, SI)
        with pytest.raises(BiogripError, match="column 'rotation_rad': found"):
            check(recorded(times, 1e3 * values), gripper, torque, FILE, SI)


@pytest.mark.parametrize(
    ("phases", "largest_rad"),
    [
        ((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)), 1.6e-9 / 4.4e-7),
        ((hold(1.0, -1.6e-9), hold(1.0, 0.32e-9)), 1.6e-9 / 4.4e-7),
        ((hold(1.0, 0.0), hold(1e-9, 1.6e-9), hold(1.0, 0.0)), 1.6e-9 / 4.4e-7),
        ((Phase(7.0, Load(0.0, 2e-10), Load(0.0, 2e-10)),), 1.4e-9 / 4.4e-7),
        ((hold(1.0, 0.0, 1.6e-9),), 1.6e-9 / 9.9e-7),
        ((hold(1.0, 1.0e-9, -1.6e-9),), 2.6e-9 / 9.9e-7),
        (PROTOCOLS["sinusoid"], 1e-9 / 4.4e-7),
    ],
)
def test_the_free_rotation_is_that_of_the_left_arm(
    unequal_gripper: Gripper, phases: tuple[Phase, ...], largest_rad: float
) -> None:
    found = free_rotation(unequal_gripper, torque_history(phases))
    assert found == pytest.approx(largest_rad, rel=2e-3)


def test_no_sample_lets_the_arm_turn_further_than_the_free_rotation(
    unequal_gripper: Gripper,
) -> None:
    rng = np.random.default_rng(9)
    for phases in ((hold(1e4, 1e-9, 2e-9),), (hold(1e4, 2e-9, -1e-9),), (hold(1e4, 0.0, 1e-9),)):
        torque = torque_history(phases)
        largest = free_rotation(unequal_gripper, torque)
        turned = [
            abs(
                trace(unequal_gripper, torque, tuple(10 ** rng.uniform(-4, 4, 4)), np.array([1e4]))[
                    0
                ]
            )
            for _ in range(100)
        ]
        assert 0.9 * largest < max(turned) <= largest * (1 + 1e-9)


@pytest.mark.parametrize(
    ("unit", "factor", "found", "hint"),
    [
        ("s", 1e3, "line 3, column 'time_s': found 1000 s", "0.001 times (is it in ms?)."),
        (
            "ms",
            1e-3,
            "lines 2 to 402, column 'time_ms': found only 0 to 0.4 s",
            "1000 times (is it in s?).",
        ),
        (
            "s",
            1 / 60,
            "lines 2 to 402, column 'time_s': found only 0 to 6.66667 s",
            "60 times (is it in min?).",
        ),
        (
            "s",
            1 / 3600,
            "lines 2 to 402, column 'time_s': found only 0 to 0.111111 s",
            "3600 times (is it in h?).",
        ),
        ("min", 60, "line 9, column 'time_min': found 420 s", "0.01667 times (is it in s?)."),
        ("ms", 1e3, "line 3, column 'time_ms': found 1000 s", "0.001 times."),
    ],
)
def test_times_in_a_wrong_unit_are_refused(
    gripper: Gripper, steps: TorqueHistory, unit: str, factor: float, found: str, hint: str
) -> None:
    times = sample_times(400.0, 1.0)
    values = trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    columns = Columns(f"time_{unit}", "rotation_rad")
    said = refusal(recorded(factor * times, values), gripper, steps, columns)
    assert said.startswith(f"trace.csv, {found}")
    assert "400 s" in said
    assert said.endswith(f"It would fit if it were {hint}")


@pytest.mark.parametrize(
    ("shift_s", "found"),
    [
        (-1.0, "line 2, column 'time_s': found -1 s"),
        (1.5, "line 401, column 'time_s': found 400.5 s"),
    ],
)
def test_times_outside_the_protocol_are_refused(
    gripper: Gripper, steps: TorqueHistory, shift_s: float, found: str
) -> None:
    times = sample_times(400.0, 1.0)
    values = trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    said = refusal(recorded(times + shift_s, values), gripper, steps)
    remedy = "If the protocol starts at another time of the clock than 0, start_s under measurement"
    allowed = "allowed is the protocol's time, 0 to 400 s."
    assert said == f"trace.csv, {found}, {allowed} {remedy} says when."


def test_the_last_digit_of_a_time_does_not_matter(gripper: Gripper, steps: TorqueHistory) -> None:
    times = sample_times(400.0, 1.0)
    values = trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    check(recorded(times * (1 + 1e-12), values), gripper, steps, FILE, SI)
    check(recorded(times - 1e-10, values), gripper, steps, FILE, SI)


def test_a_share_of_the_protocol_is_enough(gripper: Gripper, steps: TorqueHistory) -> None:
    times = sample_times(20.0, 10.0)
    values = trace(gripper, steps, SAMPLES["liquid_drop_1"], times)
    check(recorded(times, values), gripper, steps, FILE, SI)
    check(recorded(times[:81], values[:81]), gripper, steps, FILE, SI)
    said = refusal(recorded(times[:80], values[:80]), gripper, steps)
    assert said == (
        "trace.csv, lines 2 to 81, column 'time_s': found only 0 to 7.9 s of the protocol's 400 s, "
        "allowed are at least 8 s of it."
    )


def test_an_offset_is_no_response_and_no_hindrance(gripper: Gripper, steps: TorqueHistory) -> None:
    times, rng = sample_times(400.0, 1.0), np.random.default_rng(0)
    noise = 3e-4 * rng.standard_normal(len(times))
    sample = generalized_maxwell([[1.0, 1e-4, 10.0, 1e-3]])
    values = rotation(step_response(gripper, sample), steps, times)[0] + noise + 0.02
    with pytest.raises(BiogripError, match="found no response"):
        check(recorded(times, values), gripper, steps, FILE, SI)
    check(recorded(times, values), gripper, steps, FILE, SI, offset=True)
    with pytest.raises(BiogripError, match="found no response"):
        check(recorded(times, noise + 0.02), gripper, steps, FILE, SI, offset=True)


def sinusoid(duration_s: float, mean_Nm: float, omega_rad_per_s: float) -> Phase:
    """A torque between zero and twice its mean: comb drives only pull."""
    load = Load(mean_Nm, harmonics=(Harmonic(mean_Nm, omega_rad_per_s, -np.pi / 2),))
    return Phase(duration_s, load, load)


PULLING = {
    "steps": (hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)),
    "hold": PROTOCOLS["one hold"],
    "ramp": PROTOCOLS["ramp"],
    "late": (hold(50.0, 0.0), hold(50.0, 1e-9), hold(100.0, 0.0)),
    "stairs": tuple(hold(40.0, 1e-10 * (step + 1)) for step in range(8)),
    "sinusoid": (sinusoid(200.0, 1e-9, 2.0),),
    "slow sinusoid": (sinusoid(200.0, 1e-9, 0.05),),
    "one arm": PROTOCOLS["one arm"],
    "the other arm": PROTOCOLS["the other arm"],
    "one after the other": (
        hold(50.0, 1e-9, 0.0),
        hold(50.0, 0.0, 1e-9),
        hold(100.0, 1e-9, 1.2e-9),
    ),
    "unequal": (hold(100.0, 1.0e-9, 1.6e-9), hold(100.0, 0.2e-9, 0.1e-9)),
}
MIRRORED = "found a rotation that goes against the torque"


def said_of(recording: Recording, gripper: Gripper, torque: TorqueHistory, basis: Array) -> str:
    try:
        check_recording(recording, gripper, torque, FILE, SI, basis, GRIPPER)
    except BiogripError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("phases", PULLING.values(), ids=PULLING)
@pytest.mark.parametrize("arms", ["gripper", "unequal_gripper"])
def test_the_sign_of_a_trace_is_told(
    request: pytest.FixtureRequest, phases: tuple[Phase, ...], arms: str
) -> None:
    """Never is a good trace called mirrored; of the mirrored ones few pass for good ones."""
    gripper: Gripper = request.getfixturevalue(arms)
    torque = torque_history(phases)
    rng = np.random.default_rng(10)
    mirrored = missed = 0
    for trial in range(40):
        model = list(MODELS.values())[trial % len(MODELS)]
        powers = rng.uniform(-2, 2.5, len(model.names))
        exponents = np.array([parameter.kind == "exponent" for parameter in model.parameters])
        network = model.network(np.where(exponents, (powers + 2.1) / 4.7, 10**powers))
        times = np.sort(rng.uniform(0, torque.end_s, 500))
        # The ring is over before any but one in a thousand of the samples.
        response = step_response(gripper, network, symmetric=torque.symmetric, inertia=False)
        values = rotation(response, torque, times)[0]
        size = np.abs(values).max()
        values += rng.choice([0.0, 0.05, 0.3]) * size * rng.standard_normal(len(times))
        offset = bool(trial % 3 == 0)
        values += offset * size * rng.standard_normal()
        basis = nuisance_basis(times, offset=offset, drift=False)
        good, bad = (
            said_of(recorded(times, sign * values), gripper, torque, basis) for sign in (1, -1)
        )
        assert MIRRORED not in good
        mirrored += MIRRORED in bad
        missed += not bad
    assert mirrored >= 20
    # An arm that the other one pushes back differs little from one that opens.
    assert missed <= (12 if phases is PULLING["unequal"] else 3)


def test_a_mirrored_trace_is_refused_with_its_place_and_a_hint(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    times = sample_times(400.0, 1.0)
    values = trace(gripper, steps, SAMPLES["liquid_drop_2"], times)
    said = refusal(recorded(times, -values), gripper, steps)
    assert said.startswith(f"trace.csv, lines 2 to 402, column 'rotation_rad': {MIRRORED}, allowed")
    assert (
        "It would fit if it were -1 times (is opening counted as positive? Then scale it by -1)"
        in said
    )
    noise = 0.1 * values.max() * np.random.default_rng(0).standard_normal(len(times))
    with pytest.raises(BiogripError, match=MIRRORED):
        check(recorded(times, noise - values), gripper, steps, FILE, SI, 0.1 * values.max())


def test_a_large_offset_that_is_not_declared_is_not_called_a_wrong_sign(
    gripper: Gripper, steps: TorqueHistory
) -> None:
    times = sample_times(400.0, 1.0)
    for sample in SAMPLES.values():
        values = trace(gripper, steps, sample, times)
        for share in (-0.2, -0.5, -1.0, -3.0):
            shifted = recorded(times, values + share * values.max())
            assert MIRRORED not in said_of(
                shifted, gripper, steps, nuisance_basis(times, offset=False, drift=False)
            )
