"""A zero, a rise, a contact, a share: by the command, of traces that are simulated by hand."""

import re
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from tests.helpers.identified import by_quantity, identified, identify, write_trace

K, K_P, TAU_S = 80.0, 100.0, 20.0
AFTER_S: Array = np.arange(1.0, 201.0) * 0.5
RELAXATION = ("--model", "zener_maxwell", "--no-compare", "--start", "0")


def modulus(time_s: Array) -> Array:
    return K_P + K * np.exp(-time_s / TAU_S)


def noise(count: int, sd: float) -> Array:
    return sd * np.random.default_rng(6).standard_normal(count)


def holds(found: dict, **true: float) -> None:  # type: ignore[type-arg]
    """Twice as wide as 95 % limits, what is said holds the truth."""
    limits = by_quantity(found)
    for name, value in true.items():
        low, high = limits[name]["low"], limits[name]["high"]
        assert low - (high - low) / 2 < value < high + (high - low) / 2, limits[name]


def test_rows_before_the_start_tell_the_zero(tmp_path: Path) -> None:
    """Off by 5 % of the peak, k_p would be off by 9 %."""
    before = np.arange(-30, 1) * 0.5
    clean = np.append(np.zeros(len(before)), modulus(AFTER_S))
    readings = clean + noise(len(clean), 1.8) + 9.0
    trace = tmp_path / "zero.csv"
    write_trace(trace, np.append(before, AFTER_S), readings, header="time_s,modulus_Pa")
    found = identified(tmp_path, trace, "--reading", "modulus", *RELAXATION)
    holds(found, k=K, k_p=K_P, tau=TAU_S)
    (said,) = (note["text"] for note in found["notes"] if "Zero from" in note["text"])
    assert said.startswith("Zero from 29 rows before the strain: ")
    known = identified(
        tmp_path, trace, "--reading", "modulus", *RELAXATION, "--set", "measurement.offset=false"
    )
    assert "offset_rad" not in known


def test_a_rise_that_is_told_moves_nothing(tmp_path: Path) -> None:
    """The hereditary integral of a ramp of 4 s, by hand; taken for a step, k is off by 10 %."""
    inside = np.minimum(AFTER_S, 4.0)
    spring = TAU_S / 4 * (np.exp(-(AFTER_S - inside) / TAU_S) - np.exp(-AFTER_S / TAU_S))
    stress = K_P * inside / 4 + K * spring + noise(200, 1.0)
    trace = write_trace(tmp_path / "rise.csv", AFTER_S, stress, header="time_s,stress_Pa")
    given = ("--reading", "stress", "--hold", "1", *RELAXATION)
    found = identified(tmp_path, trace, *given, "--ramp", "4s")
    assert found["fit"] == "ok"
    holds(found, k=K, k_p=K_P, tau=TAU_S)
    assert "reached within 4 s" in found["load"]
    assert identified(tmp_path, trace, *given)["fit"] != "ok"


def test_of_a_modulus_readings_within_the_rise_are_left_out(tmp_path: Path) -> None:
    inside = np.minimum(AFTER_S, 4.0)
    spring = TAU_S / inside * (np.exp(-(AFTER_S - inside) / TAU_S) - np.exp(-AFTER_S / TAU_S))
    readings = K_P + K * spring + noise(200, 1.0)
    trace = write_trace(tmp_path / "rise.csv", AFTER_S, readings, header="time_s,modulus_Pa")
    found = identified(tmp_path, trace, "--reading", "modulus", *RELAXATION, "--ramp", "4000 ms")
    # The reading at the end of the rise may be of either side.
    assert found["samples"] == 192
    holds(found, k=K, k_p=K_P, tau=TAU_S)


def test_a_rise_goes_with_a_hold(tmp_path: Path) -> None:
    columns = AFTER_S, modulus(AFTER_S), np.ones(200)
    trace = write_trace(tmp_path / "rise.csv", *columns, header="time_s,stress_Pa,strain")
    given = (trace, "--reading", "stress", "--load", "strain", *RELAXATION)
    status, _, complained = identify(*given, "--ramp", "4s")
    assert status
    assert "--ramp: goes with --hold" in complained
    for wrong in ("0s", "4 Pa", "fast"):
        with pytest.raises(SystemExit):
            identify(*given, "--ramp", wrong)
    given = (trace, "--reading", "stress", "--hold", "1", *RELAXATION)
    status, _, complained = identify(*given, "--ramp", "200s")
    assert status
    assert "--ramp: found 200 s, allowed is less than the trace's 100 s" in complained


@pytest.mark.nightly
def test_deviations_that_are_a_share_of_each_reading_are_of_the_smooth_course(
    tmp_path: Path,
) -> None:
    """Weighted by their own noise of 15 %, readings would be too low by 4.5 %: three limits."""
    means = []
    for seed in range(4):
        scatter = 1 + 0.15 * np.random.default_rng(seed).standard_normal(200)
        readings = modulus(AFTER_S) * scatter
        columns = AFTER_S, readings, np.round(0.15 * readings, 2)
        trace = tmp_path / "share.csv"
        write_trace(trace, *columns, header="time_s,modulus_Pa,sd_Pa")
        found = identified(tmp_path, trace, "--reading", "modulus", "--sd", "sd_Pa", *RELAXATION)
        assert any("15 % of each reading" in note["text"] for note in found["notes"])
        means.append(by_quantity(found)["k_p"]["value"])
    # Their standard deviation is 1.5 % together.
    assert abs(np.mean(means) / K_P - 1) < 0.04


RADIUS_M, OFF_M = 2.5e-6, 60e-9
SPHERE = ("--reading", "force=force_N", "--load", "depth_m", "--shape", "sphere 2.5 um")


def approach(off_m: float, name: Path) -> Path:
    """Approach with 2 um/s to 500 nm, then dwell: Hertz's hereditary integral, by hand."""
    time_s = np.arange(0, 15, 0.025)
    depth_m = np.minimum((time_s - 0.5) * 2e-6, 5e-7)
    force = []
    for now in time_s:
        s = np.linspace(0.5, np.clip(now, 0.5, 0.75), 1001)
        rate = 1.5 * np.sqrt((s - 0.5) * 2e-6) * 2e-6
        relaxed = 800 + 1200 * np.exp(-(now - s) / 3.0)
        force.append(16 / 9 * np.sqrt(RADIUS_M) * np.trapezoid(relaxed * rate, s))
    read = np.array(force) + 1.2e-10 + noise(len(time_s), 8e-12)
    return write_trace(name, time_s, read, depth_m - off_m, header="time_s,force_N,depth_m")


def test_a_contact_is_fitted_with_baseline_and_sample(tmp_path: Path) -> None:
    trace = approach(OFF_M, tmp_path / "afm.csv")
    given = (*SPHERE, "--model", "zener_maxwell", "--no-compare")
    found = identified(tmp_path, trace, *given, "--contact", "fit")
    assert found["fit"] == "ok"
    holds(found, k=1200.0, k_p=800.0, tau=3.0)
    low, high = found["contact_limits_m"]
    assert low - (high - low) / 2 < OFF_M < high + (high - low) / 2
    assert high - low < 20e-9
    doubted = identified(tmp_path, trace, *given)
    assert doubted["fit"] != "ok"
    assert any("say --contact fit" in reason for reason in doubted["reasons"])


def test_a_right_contact_is_not_doubted(tmp_path: Path) -> None:
    trace = approach(0.0, tmp_path / "afm.csv")
    found = identified(tmp_path, trace, *SPHERE, "--model", "zener_maxwell", "--no-compare")
    assert found["fit"] == "ok"
    holds(found, k=1200.0, k_p=800.0, tau=3.0)


@pytest.mark.parametrize("off_m", [0.0, -60e-9, pytest.param(60e-9, marks=pytest.mark.nightly)])
def test_where_the_force_is_recorded_a_contact_is_named(tmp_path: Path, off_m: float) -> None:
    """Depths of a sphere under a ramp of force, then a hold: the integral of the compliance."""
    time_s = np.arange(0.2, 30, 0.2)
    force_N = 4e-9 * np.minimum(time_s / 10, 1.0)
    yielded = [
        np.trapezoid(1 / 800 - np.expm1(-(t - s) / 3) / 1200, s) * 4e-10
        for t, s in ((t, np.linspace(0, min(t, 10.0), 2001)) for t in time_s)
    ]
    depth_m = (9 / 16 / np.sqrt(RADIUS_M) * np.array(yielded)) ** (2 / 3)
    read = depth_m - off_m + noise(len(time_s), 2e-9)
    trace = write_trace(tmp_path / "creep.csv", time_s, read, force_N, header="time_s,d_m,F_N")
    given = ("--reading", "displacement=d_m", "--load", "F_N", "--shape", "sphere 2.5 um")
    found = identified(tmp_path, trace, *given, "--model", "zener_kelvin", "--no-compare")
    said = [reason for reason in found["reasons"] if "The tip seems to touch" in reason]
    assert bool(said) == bool(off_m), found["reasons"]
    for reason in said:
        assert f"nm {'before' if off_m > 0 else 'after'} the zero of its depth" in reason
        assert "count its depths from there" in reason
        (size,) = re.findall(r"about (\d+) nm", reason)
        assert float(size) == pytest.approx(60, rel=0.5)


def test_of_a_dwell_alone_nothing_tells_the_contact(tmp_path: Path) -> None:
    trace = write_trace(tmp_path / "dwell.csv", AFTER_S, AFTER_S, header="time_s,force_N")
    given = (trace, "--reading", "force=force_N", "--hold", "500 nm", "--shape", "sphere 2.5 um")
    status, _, complained = identify(*given, "--contact", "fit")
    assert status
    assert "takes the shape of a tip, and a recorded depth (--load)" in complained
    with pytest.raises(SystemExit):
        identify(*given, "--contact", "5 nm")


def test_a_load_that_is_on_or_off_has_its_steps(tmp_path: Path) -> None:
    """Two pulls of 40 pN, as a bead's; all changes are of one size, which is no rounding."""
    time_s = np.arange(0.0, 40.0, 0.1)
    pulled = (time_s >= 4.95) & (time_s < 9.95) | (time_s >= 19.95) & (time_s < 24.95)
    load = np.where(pulled, 40.0, 0.0)
    depth = np.zeros(len(time_s))
    for at_s, force in ((4.95, 40.0), (9.95, -40.0), (19.95, 40.0), (24.95, -40.0)):
        since = np.maximum(time_s - at_s, 0.0)
        depth += force / 20.0 * (1 - np.exp(-since / 2.0))
    read_um = depth + noise(len(time_s), 0.01)
    trace = write_trace(tmp_path / "pulls.csv", time_s, read_um, load, header="t_s,x_um,F_pN")
    given = ("--time", "t_s", "--reading", "displacement=x_um", "--load", "F_pN")
    found = identified(tmp_path, trace, *given, "--model", "kelvin_voigt", "--no-compare")
    assert found["fit"] == "ok"
    holds(found, k_p=2e-5, c_p=4e-5)


SINE_S: Array = np.linspace(0.0, 25.0, 1000)


def oscillating(path: Path, phase: float, *, rested: bool, tau_s: float = 3.0) -> Path:
    """Strain sin(t + phase), and stress by the complex modulus; from rest a branch fades, too."""
    turn = np.exp(1j * (SINE_S + phase))
    pole = 1j * tau_s / (1 + 1j * tau_s)
    fading = K * (np.sin(phase) - (pole * np.exp(1j * phase)).imag) * np.exp(-SINE_S / tau_s)
    stress = ((K_P + K * pole) * turn).imag + rested * fading + noise(len(SINE_S), 1.0)
    table, names = np.column_stack((SINE_S, turn.imag, stress)), "time_s,strain,stress_Pa"
    np.savetxt(path, table, delimiter=",", header=names, comments="")
    return path


def test_a_sample_that_moved_before_the_first_row_is_doubted(tmp_path: Path) -> None:
    """Steady from before the first row on, limits exclude the truth, as they hang on its rest."""
    given = ("--reading", "stress", "--load", "strain", "--model", "zener_maxwell", "--no-compare")
    rested = oscillating(tmp_path / "rested.csv", 0.0, rested=True)
    found = identified(tmp_path, rested, *given)
    assert found["fit"] == "ok", found["reasons"]
    holds(found, k=K, k_p=K_P, tau=3.0)
    moved = oscillating(tmp_path / "moved.csv", 1.0, rested=False)
    found = identified(tmp_path, moved, *given)
    assert found["fit"] == "doubtful"
    assert "The strain moves from the first row on" in found["reasons"][0]
    assert by_quantity(found)["k_p"]["low"] > K_P
    told = by_quantity(identified(tmp_path, moved, *given, "--from", "12"))["k_p"]
    assert (told["low"] or 0) < K_P < (told["high"] or np.inf)


@pytest.mark.parametrize("zeroed", [False, True])
def test_readings_that_begin_anew_in_a_later_block_are_named(
    tmp_path: Path, *, zeroed: bool
) -> None:
    """Creep of 1/1200 at once and 1/800 with 20 s, then recovery, zeroed or not."""

    def compliance(time_s: Array) -> Array:
        return (time_s >= 0) * (1 / 1200 - np.expm1(-np.maximum(time_s, 0) / 20) / 800)

    creep_s, recovery_s = np.arange(1.0, 121.0) * 0.5, np.arange(1.0, 181.0)
    crept = 50 * compliance(creep_s) + noise(120, 2e-4)
    recovered = 50 * (compliance(60 + recovery_s) - compliance(recovery_s)) + noise(180, 2e-4)
    both = (creep_s, crept, 50), (recovery_s, recovered - zeroed * crept[-1], 0)
    trace = tmp_path / "blocks.csv"
    with trace.open("w") as file:
        for times, strain, load in both:
            table = np.column_stack((times, strain, np.full(len(times), load)))
            np.savetxt(file, table, delimiter=",", header="time_s,strain,load_Pa", comments="")
    given = ("--reading", "strain", "--load", "load_Pa", "--model", "zener_kelvin", "--no-compare")
    found = identified(tmp_path, trace, *given, "--block", "1,2")
    offset = identified(tmp_path, trace, *given, "--block", "1,2", "--offset")
    if not zeroed:
        assert found["fit"] == "ok", found["reasons"]
        assert not any("seem to begin anew" in note["text"] for note in offset["notes"])
        return
    assert found["fit"] == "rejected"
    for doubted in (found, offset):
        (said,) = (it for it in doubted["reasons"] if "begin anew at 60 s:" in it)
        (block,) = re.findall(r"the first alone: --block (\d)\.", said)
        assert "--offset" not in " ".join(doubted["reasons"])
    holds(identified(tmp_path, trace, *given, "--block", block), k_s=1200.0, k_v=800.0)


@pytest.mark.parametrize("offset_Pa", [0.4, 1.0, -0.5])
def test_a_tare_and_an_offset_at_once_are_told_by_rows_before(
    tmp_path: Path, offset_Pa: float
) -> None:
    """0.2 % for 5 s, which the sample does not feel, then 5 % more: k_p would be 3 % too large."""
    time_s = np.linspace(0.0, 64.9, 650)
    strain = np.repeat([0.002, 0.052], [50, 600])
    stress = np.append(np.zeros(50), 0.05 * modulus(time_s[50:] - 4.95))
    read = stress + offset_Pa + noise(650, 0.05)
    trace = write_trace(tmp_path / "tare.csv", time_s, read, strain, header="time_s,s_Pa,strain")
    given = ("--reading", "stress=s_Pa", "--load", "strain", *RELAXATION[:3])
    for more in ([], ["--offset"]):
        found = identified(tmp_path, trace, *given, *more)
        assert found["fit"] == "ok", found["reasons"]
        holds(found, k=K, k_p=K_P, tau=TAU_S)


@pytest.mark.parametrize("turned", [False, True])
def test_one_modulus_far_off_in_a_sweep_is_named(tmp_path: Path, *, turned: bool) -> None:
    """A tenth of a storage modulus, or 8 degrees more of a phase; in 2 %, and in 0.3 degrees."""
    omega = np.logspace(-1, 2, 25)
    whole = K_P + 3 * K * 0.5j * omega / (1 + 0.5j * omega) + 0.5j * omega
    size = np.abs(whole) * (1 + noise(25, 0.02))
    phase = np.angle(whole) + 0.005 * np.random.default_rng(7).standard_normal(25)
    phase[12] += turned * np.radians(8)
    storage, loss = size * np.cos(phase), size * np.sin(phase)
    storage[0] *= 1.0 if turned else 0.1
    columns, names = (storage, loss), ("storage", "loss")
    if turned:
        columns, names = (size, np.degrees(phase)), ("complex_modulus", "phase")
    header = f"w (rad/s),{names[0]}_Pa,{names[1]}_{'deg' if turned else 'Pa'}"
    trace = write_trace(tmp_path / "sweep.csv", omega, *columns, header=header)
    read = zip(names, header.split(",")[1:], strict=True)
    options = [it for pair in read for it in ("--reading", "=".join(pair))]
    given = ("--frequency", "w (rad/s)", "--model", "zener_maxwell", "--no-compare")
    found = identified(tmp_path, trace, *options, *given)
    assert found["fit"] == "rejected"
    place = f"{omega[12]:.4g} rad/s (loss)" if turned else f"{omega[0]:.4g} rad/s (storage)"
    assert f"single readings are far off, the furthest at {place}, as" in found["reasons"][0]


def test_contacts_that_are_off_are_told_before_traces_that_do_not_agree(tmp_path: Path) -> None:
    """Of one sphere and sample: contacts 60 nm before and after make it softer and stiffer."""
    for name, off_m in (("early", OFF_M), ("late", -OFF_M)):
        approach(off_m, tmp_path / f"{name}.csv")
    sheet = tmp_path / "cells.csv"
    sheet.write_text("file,sample\nearly.csv,cell\nlate.csv,cell\n")
    status, said, complained = identify(sheet, *SPHERE, "--model", "zener_maxwell", "--no-compare")
    assert not status, complained
    before, _, after = said.partition("The traces are not of one linear sample")
    assert after
    for side in ("before", "after"):
        assert re.search(rf"touch about \d+ nm {side} the zero .* --contact fit\.", before)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_load_that_was_taken_off_unsaid_is_named(tmp_path: Path, seed: int) -> None:
    """Creep by 1/500 at once and by 1/400 with 5 s, and recovery after 60 s, under a hold.

    By chance that is no response, which is refused, or a fit, which is rejected.
    """

    def compliance(time_s: Array) -> Array:
        return (time_s > 0) * (1 / 500 - np.expm1(-np.maximum(time_s, 0) / 5) / 400)

    time_s = np.linspace(0.5, 119.5, 239)
    scatter = 1e-4 * np.random.default_rng(seed).standard_normal(239)
    strain = 10 * (compliance(time_s) - compliance(time_s - 60)) + scatter
    trace = write_trace(tmp_path / "t.csv", time_s, strain, header="time_s,strain")
    given = ("--reading", "strain", "--hold", "10 Pa", "--model", "zener_kelvin", "--no-compare")
    status, said, complained = identify(trace, *given)
    assert bool(status) == bool(seed)
    assert "after 60 s, as if nothing was held from there on: --until 60." in said + complained
    holds(identified(tmp_path, trace, *given, "--until", "60"), k_s=500.0, k_v=400.0)
    # An outlier is no end.
    spoilt = 10 * compliance(time_s) + scatter + 0.1 * (time_s == 40)
    write_trace(trace, time_s, spoilt, header="time_s,strain")
    assert "as if nothing was held" not in "".join(identify(trace, *given)[1:])


def test_of_a_dwell_alone_the_block_that_tells_its_zero_is_named(tmp_path: Path) -> None:
    """Taken for a step from zero, k_p would be a tenth too large."""
    whole = approach(0.0, tmp_path / "afm.csv").read_text().splitlines()
    at = 1 + round(0.75 / 0.025)
    (tmp_path / "blocks.csv").write_text("\n".join([*whole[:at], whole[0], *whole[at:]]))
    given = (*SPHERE[:2], *SPHERE[-2:], "--model", "zener_maxwell", "--no-compare")
    trace, hold = tmp_path / "blocks.csv", ("--hold", "500 nm", "--start", "0.75")
    alone = identified(tmp_path, trace, *given, *hold, "--block", "2")
    said = "Block 1 tells the zero and the approach: read it, too, with --load DEPTH."
    assert said in [note["text"] for note in alone["notes"]]
    assert by_quantity(alone)["k_p"]["low"] > 820
    found = identified(tmp_path, trace, *given, "--load", "depth_m", "--block", "1,2")
    assert said not in [note["text"] for note in found["notes"]]
    holds(found, k=1200.0, k_p=800.0, tau=3.0)
