"""Traces that start before their torque: given onsets, fitted ones, and what is said without."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.judging.onset import OnsetFit, OnsetFits, begins_constant, estimate_onset, is_cut_off
from biogrip.library import Sample, TraceResult, set_up, simulate
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import Phase, hold, ramp
from tests.helpers.default import STUDY
from tests.helpers.identified import told
from tests.helpers.places import ROOT

PHASES = (hold(20.0, 1e-9), hold(20.0, 0.4e-9), hold(20.0, 1.2e-9))
TRUTH = {"k": 29.0, "k_p": 6.0, "c": 100.0, "c_p": 20.0}
EXPERIMENT = set_up(STUDY.gripper, PHASES, Sample("generalized_maxwell"))
NOISE_RAD, ONSET_S = 3e-7, 8.07


def late(seed: int, onset_s: float = ONSET_S, *, flat: bool = False) -> tuple[Array, Array]:
    """Simulate a trace of 60 s at 5 Hz, with noise all over, or not before the onset."""
    times = np.arange(301) / 5
    before = times < onset_s
    noise = NOISE_RAD * np.random.default_rng(seed).standard_normal(len(times))
    response = np.zeros(len(times))
    response[~before] = simulate(EXPERIMENT, TRUTH, times[~before] - onset_s)
    return times, response + np.where(flat & before, 0.0, noise)


def gripped(times: Array, values: Array, **given: Any) -> TraceResult:
    phases = [{"duration_s": 20, "torque_Nm": each.level} for each in PHASES]
    return told(times, values, config={"protocol": {"phases": phases}}, **given)


@pytest.mark.parametrize("phases", [PHASES, (ramp(30.0, 0.0, 1e-9), hold(30.0, 0.3e-9))])
@pytest.mark.parametrize("model", ["generalized_maxwell", "fractional_kelvin_voigt"])
@pytest.mark.parametrize("options", [{}, {"offset": True, "drift": True}])
def test_before_the_protocol_nothing_responds(
    phases: tuple[Phase, ...], model: str, options: dict[str, Any]
) -> None:
    """Times before it are those of a first phase without torque."""
    own = replace(set_up(STUDY.gripper, phases, Sample(model)), **options)
    padded = replace(own, phases=(hold(8.0, 0.0), *phases))
    times, x = np.arange(-40, 301) / 5, np.log(own.model.example)
    values = 1e-5 * np.random.default_rng(0).standard_normal(len(times))
    one, other = own.of(times, values).residuals, padded.of(times + 8.0, values).residuals
    for got, expected in zip(one(x), other(x), strict=True):
        assert got == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
    misfits = [of.misfit(np.exp(x)[None]) for of in (one, other)]
    assert misfits[0] == pytest.approx(misfits[1], rel=1e-9)


@pytest.mark.parametrize("onset_s", [-3.0, 0.5, 8.07, 21.3])
@pytest.mark.parametrize("flat", [True, False])
def test_an_onset_is_estimated_within_a_reading(onset_s: float, flat: bool) -> None:
    times, values = late(3, onset_s + 5.0, flat=flat)
    found = estimate_onset(replace(EXPERIMENT, offset=True), times - 5.0, values)
    assert found == pytest.approx(onset_s, abs=0.2)
    assert begins_constant(times - 5.0, values, found)


# The protocol starts at 0 of clocks whose median interval tells nothing of the onset.
CLOCKS = {
    "later than the step": np.arange(5, 301) / 5,
    "eight decades": np.geomspace(1e-4, 1e4, 81),
    "log-spaced": np.geomspace(0.05, 60.0, 200),
}


@pytest.mark.parametrize("clock", CLOCKS)
def test_an_onset_is_fitted_on_any_clock(clock: str) -> None:
    """Its misfit is no higher than with the onset of the simulation."""
    times, truth = CLOCKS[clock], {"k": 300.0, "k_p": 200.0, "c": 3000.0}
    protocol = (hold(float(times[-1]), 1.0),)
    creep = set_up(INSTRUMENTS["strain"], protocol, Sample("zener_maxwell"))
    exact = simulate(creep, truth, times)
    noise = 0.02 * exact.max() * np.random.default_rng(0).standard_normal(len(times))
    fits = OnsetFits(creep, times, exact + noise)
    best, true = fits.best(float(times[0])), fits.at(0.0, np.log([*truth.values()]))
    assert best.misfit <= true.misfit * (1 + 1e-9)


def test_no_interval_of_onsets_is_fitted_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neighbours of neighbours are those that were tried."""
    times, values = late(3)
    fits, tried = OnsetFits(EXPERIMENT, times, values), []
    within = OnsetFits._within

    def counted(self: OnsetFits, start: OnsetFit, low_s: float, high_s: float) -> OnsetFit:
        tried.append((low_s, high_s))
        return within(self, start, low_s, high_s)

    monkeypatch.setattr(OnsetFits, "_within", counted)
    found = fits.near(fits.at(ONSET_S - 0.5, np.log([*TRUTH.values()])))
    assert found.onset_s == pytest.approx(ONSET_S, abs=0.1)
    assert len(tried) == len(set(tried)) < 10


@pytest.mark.nightly
def test_a_fitted_start_costs_some_three_times_a_known_one(tmp_path: Path) -> None:
    """In processor time of the command in turn, the lowest of three each: 3.1 when written."""
    command = [sys.executable, "-m", "biogrip", "identify", str(ROOT / "data/example_trace.csv")]
    spent: dict[str, list[float]] = {"0": [], "fit": []}
    for _ in range(3):
        for start, times_s in spent.items():
            given = [*command, "--start", start, "--output", str(tmp_path / "found.json")]
            before = os.times().children_user
            subprocess.run(given, check=True, capture_output=True)
            times_s.append(os.times().children_user - before)
    assert min(spent["fit"]) < 3.5 * min(spent["0"])


def test_padding_before_the_onset_is_no_measurement() -> None:
    """All but the last zero; with noise-free readings, the noise would seem too small."""
    found = gripped(*late(2, flat=True), start=ONSET_S)
    assert (found.status, found.data["samples"]) == ("ok", 301 - 40)
    assert "Left out for want of a number: 40 rows of 301." in str(found)


@pytest.mark.nightly
def test_readings_before_the_onset_tell_the_zero() -> None:
    """On a clock with negative times, too."""
    times, values = late(2)
    whole, without = (
        gripped(times[cut] - ONSET_S, values[cut] + 2e-6, offset=True, start=0.0)
        for cut in (times >= 0, times >= ONSET_S)
    )
    assert whole.data["offset_rad"] == pytest.approx(2e-6, abs=5 * NOISE_RAD / np.sqrt(40))
    wide, narrow = (np.ptp(it.to_frame().loc["k_p", ["low", "high"]]) for it in (whole, without))
    assert wide < 0.9 * narrow


def test_a_clock_outside_the_protocol_is_refused() -> None:
    times, values = late(2)
    for earlier_s, start, message in (
        (ONSET_S, None, 'found -8.07 s, .* start says when, be it 0, or start="fit" finds it.'),
        (0.0, -5.0, "found 55.2 s, allowed is the protocol's time, -5 to 55 s."),
    ):
        with pytest.raises(BiogripError, match=message):
            gripped(times - earlier_s, values, start=start)


def notes_on(times: Array, values: Array, **given: Any) -> tuple[str, str]:
    found = told(times, values, **given)
    notes = " ".join(note["text"] for note in found.data["notes"])
    assert "--" not in f"{notes} {found}", "options of the command, which are arguments here"
    return found.status, notes


def test_only_readings_on_another_clock_seem_cut_off() -> None:
    """Whatever unit their clock has: readings that someone spaced from the step on do not."""
    for planned in (
        np.geomspace(1e-3, 1e5, 80),
        86_400 * np.r_[np.arange(0.2, 1, 0.01), np.arange(1, 10, 0.1), np.arange(10, 100.0)],
        1e-3 * np.sort(np.random.default_rng(0).uniform(0, 60, 200)),
    ):
        assert not is_cut_off(planned)
        assert is_cut_off(planned + 20 * (planned[-1] - planned[0]))


def test_readings_are_planned_whose_spacing_grows_by_a_power_of_time_near_one() -> None:
    """25 times as late they are 5 to 125 times as far apart; the first ones ten intervals late."""
    for apart_s, cut in ((4.9, True), (5.1, False), (124, False), (126, True)):
        assert is_cut_off(np.r_[16:20, 40, 100, 400 + apart_s * np.arange(4)]) == cut
    assert not is_cut_off(np.arange(10.0, 30.0))
    assert is_cut_off(np.arange(10.1, 30.1))


@pytest.mark.nightly
def test_a_late_start_is_advised_with_its_limits_and_its_rows_tell_the_zero() -> None:
    """A ramp from 8.4 to 8.7 s, and a preload: a start without the offset would be biased."""
    times = np.arange(0, 60, 0.5)
    since = [np.clip(times - start_s, 0.0, None) for start_s in (8.4, 8.7)]
    first, second = (40 * s - 800 * -np.expm1(-s / 20) for s in since)
    values = 42 + (first - second) / 0.3
    values += 0.3 * np.random.default_rng(2).standard_normal(len(times))
    given: dict[str, Any] = {"reads": "strain", "model": "kelvin_voigt", "hold": 1.0}
    status, notes = notes_on(times, values, **given)
    assert (status, "drifts" in notes) == ("rejected", False)
    (limits,) = re.findall(r"constant until \S+ s \((\S+) to (\S+)\) of its clock", notes)
    assert float(limits[0]) < 8.7
    assert float(limits[1]) > 8.4
    found = told(times, values, start="fit", **given)
    assert found.data["offset_rad"] == pytest.approx(42, abs=0.3)
    assert "rows before the stress: 42" in str(found)
    low, high = found.data["onset_limits_s"]
    assert low < 8.7
    assert high > 8.4
    assert f"({low:.2f} to {high:.2f}) of the clock, as fitted" in str(found)


@pytest.mark.nightly
def test_models_are_compared_each_at_its_own_onset() -> None:
    """At that of one without a power law, a third branch would seem the best."""
    times = np.arange(0, 60, 0.5)
    values = np.where(times > 5, np.clip(times - 5, 1e-9, None) ** 0.32, 0.0)
    values += 0.02 * np.random.default_rng(4).standard_normal(len(times))
    models = ["kelvin_voigt", "zener_kelvin", "springpot"]
    found = told(times, values, models, start="fit", reads="strain", model=models[0], hold=1.0)
    misfits = {row["model"]: row["misfit_rad"] for row in found.data["models"]}
    assert misfits["springpot"] == pytest.approx(0.02, rel=0.15)


HOLD = np.arange(0.4, 44, 0.4)


@pytest.mark.nightly
def test_limits_of_any_sample_hold_whatever_the_fitted_start() -> None:
    """Creep after a jump looks the same from any start up to the first reading."""
    values = 5 - 3 * np.exp(-HOLD / 8)
    values += 5e-3 * np.random.default_rng(5).standard_normal(len(HOLD))
    given: dict[str, Any] = {"reads": "compliance", "model": "zener_kelvin", "start": "fit"}
    limits = told(HOLD + 12, values, **given).without_model([1.0, 10.0]).set_index("quantity")
    found = limits.loc[["J(1 s)", "J(10 s)"], ["low", "high"]].to_numpy()
    truth = 5 - 3 * np.exp(np.array([-1, -10]) / 8)
    assert not np.any((truth < found[:, 0]) | (truth > found[:, 1]))
    assert truth[1] < found[1, 1] < 1.05 * truth[1]


def test_a_clock_may_count_seconds_since_1970() -> None:
    """Within the 2e-7 s to which it is read; and without a start that is asked for."""
    values = (1 - np.exp(-HOLD / 8)) / 100
    values += 1e-4 * np.random.default_rng(3).standard_normal(len(HOLD))
    given: dict[str, Any] = {"reads": "compliance", "model": "kelvin_voigt"}
    found = told(HOLD + 1.764e9, values, start=1.764e9, **given).to_frame()
    expected = told(HOLD, values, **given).to_frame()
    np.testing.assert_allclose(found["low"], expected["low"], rtol=1e-5)
    with pytest.raises(BiogripError, match="Or say when it started"):
        told(HOLD + 1.764e9, values, **given)


@pytest.mark.parametrize(
    ("model", "reads", "fit"),
    [("maxwell", "force", "doubtful"), ("kelvin_voigt", "strain", "rejected")],
)
def test_a_hold_on_the_clock_of_the_whole_test_is_not_ok(model: str, reads: str, fit: str) -> None:
    """Exponentials look alike from any start; where readings show another, the fit is rejected."""
    left = np.exp(-HOLD / 8)
    clean, held = (2.0 * left, 1e-3) if reads == "force" else ((1 - left) / 100, 1.0)
    values = clean + 2e-3 * clean.max() * np.random.default_rng(3).standard_normal(len(HOLD))
    given = {"reads": reads, "model": model, "hold": held}
    status, notes = notes_on(HOLD + 16, values, **given)
    assert (status, "drifts" in notes) == (fit, False)
    assert "The readings begin 16.4 s after the step of the protocol" in notes
    status, notes = notes_on(HOLD + 16, values, start=16.0, **given)
    assert (status, "begin" in notes) == ("ok", False)


def test_a_ramp_before_the_first_reading_is_said_to_change_values() -> None:
    """Not where it is told."""
    times = np.geomspace(1.01, 200.0, 200)
    values = 100 + 600 * np.expm1(1 / 3) * np.exp(-times / 3.0)
    values += 0.5 * np.random.default_rng(0).standard_normal(len(times))
    given = {"reads": "stress", "model": "zener_maxwell"}
    status, notes = notes_on(times, values, hold=1.0, **given)
    assert (status, "If the load was no step" in notes) == ("ok", True)
    (said,) = re.findall("k would be (.*?) Pa; c", notes)
    assert float(said) == pytest.approx(200.0, rel=0.02)
    ramped = {"duration_s": 1.0, "strain": 0.0, "to_strain": 1.0}
    phases = {"phases": [ramped, {"duration_s": 300.0, "strain": 1.0}]}
    protocol = {"instrument": "relaxation", "protocol": phases}
    assert "If the load was no step" not in notes_on(times, values, config=protocol, **given)[1]


@pytest.mark.parametrize("readings", [6, 12])
def test_an_onset_leaves_readings_to_fit(readings: int) -> None:
    """Of a trace that is nearly constant any onset fits; three parameters take five readings."""
    times: Array = 2.5 * np.arange(1.0, readings + 1)
    values = 100 + 3.6 * np.random.default_rng(0).standard_normal(readings)
    protocol, sample = (hold(float(times[-1]), 1.0),), Sample("zener_maxwell")
    experiment = set_up(INSTRUMENTS["modulus"], protocol, sample)
    fits = OnsetFits(experiment, times, values)
    best = fits.best(float(times[-1]))
    assert best.onset_s <= times[-5]
    assert np.isfinite(best.misfit)
    assert OnsetFits(experiment, times[:4], values[:4])._latest_s == times[0]
