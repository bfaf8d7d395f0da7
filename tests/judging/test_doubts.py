"""Tests of residuals: how often they are wrong, what they see, and what is misfit."""

import re
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from biogrip.command.words import in_words
from biogrip.fit.trace_noise import NoiseModel
from biogrip.judging.doubts import (
    DOUBT,
    DOUBTFUL,
    HARMLESS,
    OK,
    Note,
    _about_growth,
    examine_residuals,
    find_slow_misfit,
    has_fast_noise,
)
from biogrip.judging.likelihood import Likelihood, make_likelihood
from biogrip.library import identify_trace
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.noise import AR1, Noise, Outliers, add_noise
from tests.helpers.default import seen
from tests.helpers.identified import told
from tests.helpers.places import ROOT
from tests.helpers.problems import MODEL, clean, likelihood_of, pose_noisy, posed_for, rotation


def notes_on(likelihood: Likelihood) -> list[Note]:
    _, find_notes = examine_residuals(likelihood)
    return find_notes()


@pytest.mark.parametrize(
    ("parts", "place", "said"),
    [
        ({}, None, ""),
        ({}, 3, "1 outlier, at 3 s of the protocol"),
        ({}, 200, "1 outlier, at 200 s of the protocol"),
        ({"ar1": AR1(0.9, 2.0)}, None, "noise of neighbouring readings, as of noise"),
        ({"ar1": AR1(0.25, 5.0)}, None, "residuals are correlated"),
        ({"ar1": AR1(0.2, 30.0)}, None, "The residual wanders"),
        ({"outliers": Outliers(0.02, 20.0)}, None, "outliers, at "),
    ],
)
def test_what_is_not_white_is_said(parts: dict[str, Any], place: int | None, said: str) -> None:
    """Doubts about noise of a cell's rotation, 2 % of its peak, fitted by its own model."""
    times, response = clean("endothelial_cell")
    noise = Noise("gaussian", 0.02, "peak", **parts)
    trace = add_noise(response, noise, np.random.default_rng(0), times)
    if place is not None:
        trace[place] += response.max()
    notes = notes_on(likelihood_of(posed_for(MODEL, times, trace)))
    doubts = " ".join(note.text for note in notes if note.weight == DOUBT)
    assert said in doubts
    assert bool(doubts) == bool(said)


@pytest.mark.parametrize(("neighbours", "named"), [(1, True), (3, False)])
def test_what_a_misfit_has_in_a_row_is_no_outlier(neighbours: int, named: bool) -> None:
    """A slow misfit of twice the noise, and readings that are off by twenty times the noise."""
    times, response = clean("endothelial_cell")
    noise = 0.005 * float(response.max())
    trace = response + noise * np.random.default_rng(0).standard_normal(len(times))
    trace += 2 * noise * np.sin(2 * np.pi * times / 100)
    trace[100 : 100 + neighbours] += 20 * noise
    notes = notes_on(likelihood_of(posed_for(MODEL, times, trace)))
    assert "is not noise" in notes[0].text
    assert any(", at 100 s" in note.text for note in notes) == named


@pytest.mark.parametrize(("beyond", "said"), [(0.98, False), (1.02, True)])
def test_a_given_noise_is_held_against_what_parameters_leave(beyond: float, said: bool) -> None:
    """Of eleven readings and four parameters: chi-squared of seven, once in 333 traces more."""
    times, response = (values[::40] for values in clean("liquid_drop_2"))
    (problem,) = pose_noisy(times, response, 1)
    fit = likelihood_of(problem)
    noise_sd = fit.misfit * np.sqrt(len(times) / (beyond * chi2.isf(0.003, 7)))
    held = make_likelihood(problem, fit.best, fit.misfit, confidence=0.95, noise_sd=noise_sd)
    notes = notes_on(held)
    assert any("the noise that was given" in note.text for note in notes) == said


def test_where_nothing_is_left_no_noise_is_doubted() -> None:
    times, _ = clean("liquid_drop_2")
    posed = posed_for(MODEL, times, rotation(MODEL, [1.0, 1.0, 10.0, 0.1], times, inertia=False))
    fit = likelihood_of(posed)
    held = make_likelihood(posed, fit.best, fit.misfit, confidence=0.95, noise_sd=1e-6)
    assert notes_on(held) == []


TIMES = np.linspace(0.25, 100, 400)
ZENER: dict[str, Any] = {"reads": "modulus", "model": "zener_maxwell"}


@pytest.mark.parametrize(
    ("times", "weight", "said"),
    [
        (1e-4, DOUBT, "is 10000 times the noise that was given: its value or unit"),
        (0.85, HARMLESS, "is 1.18 times the noise that was given: limits are too narrow"),
        (1.5, "", ""),
        (2.5, DOUBT, "is 0.4 times the noise that was given: its value or unit"),
        (1e5, DOUBT, "is 1e-05 times the noise that was given"),
    ],
)
def test_a_stated_noise_that_the_fit_does_not_leave_is_told(
    times: float, weight: str, said: str
) -> None:
    """Beside a standard deviation of 1 in what three parameters leave."""
    noise = np.random.default_rng(2).standard_normal(400)
    noise /= np.std(noise) * np.sqrt(400 / 397)
    found = told(TIMES, 100 + 80 * np.exp(-TIMES / 20) + noise, noise=times, **ZENER)
    # Of limits that are too narrow, a ramp before the first reading is said to move one.
    notes = [note for note in found.data["notes"] if "ramp" not in note["text"]]
    assert [note["weight"] for note in notes] == [weight] * bool(weight)
    assert all(said in note["text"] for note in notes)


def test_noise_that_grows_has_a_share_of_what_is_read() -> None:
    """A tenth of the readings is six times the others, with noise of 2 % of each."""
    growth = np.repeat([2.0, 12.0], [90, 10])
    read = seen(instrument=INSTRUMENTS["modulus"], coloured=False, response=lambda _: 200 * growth)
    likelihood = seen(problem=seen(residuals=read), best=np.zeros(1))
    (said,) = _about_growth(seen(likelihood=likelihood, growth=growth, scale=4.0))
    assert "it is 6 times as large for the largest tenth of the readings" in said
    assert said.endswith("weighted by --noise-share 0.02.")


def test_fast_noise_is_neither_smooth_nor_in_one_place() -> None:
    """Neighbours of a smooth misfit differ by 1, and all of it scatters by 14."""
    time_s, rng = np.arange(400.0), np.random.default_rng(0)
    residuals = seen(trace=seen(time_s=time_s), coloured=False, duration_s=399.0, noise_scale=1.0)
    fast = lfilter([1.0], [1.0, -0.6], rng.standard_normal(500))[100:]
    # Of a burst are 45 % of all squares, in a twentieth of the readings.
    most = np.sqrt(0.45 / 0.55 * np.sum(fast[20:] ** 2) / np.sum(fast[:20] ** 2))
    burst = fast * np.where(time_s < 20, most, 1.0)
    smooth = 20 * np.sin(2 * np.pi * time_s / 10) + rng.standard_normal(400)
    found = [has_fast_noise(residuals, it, np.ones((1, 400))) for it in (fast, burst, smooth)]
    assert found == [True, False, False]


def test_share_and_time_less_its_error_decide() -> None:
    for share, time_s, error, walk, said in (
        (0.6, 10.0, 0.0, 0.0, "is correlated over 10 s of a trace of 400 s, 60 % of its variance"),
        # Two standard deviations of the time below it are 8 s, a fiftieth of the trace, or less.
        (0.6, 10.0, 0.1, 0.0, "is correlated over 10 s"),
        (0.6, 10.0, 0.12, 0.0, ""),
        (0.4, 100.0, 0.0, 0.0, "is correlated over 100 s"),
        (0.4, 70.0, 0.0, 0.0, ""),
        (0.1, 400.0, 0.0, 0.4, "walks at random, 40 % of its variance"),
        (0.1, 400.0, 0.0, 0.3, ""),
        # Odds of two, of which two standard deviations leave 0.54, more than a half, or 0.49.
        (0.1, 400.0, 0.65, 2 / 3, "walks at random, 67 % of its variance"),
        (0.1, 400.0, 0.7, 2 / 3, ""),
    ):
        noise_model = NoiseModel(share, time_s, 0.0, walk=walk)
        note = find_slow_misfit(noise_model, (error, error), 400.0, 0.03, lambda: "it is so")
        assert (note is not None) == bool(said)
        assert note is None or (note.weight == DOUBT and said in note.text)


@pytest.mark.nightly
def test_noise_that_grows_over_decades_is_weighed_and_its_share_advised() -> None:
    """A Maxwell liquid, whose first readings hardly count without weights; then all holds."""
    times = np.geomspace(1e-4, 1e4, 90)
    noise = 1 + 0.01 * np.random.default_rng(1).standard_normal(90)
    models = ["kelvin_voigt", "liquid_drop"]
    given: dict[str, Any] = {"reads": "compliance", "model": "maxwell"}
    found = told(times, (1 + times / 5) * noise, models, **given)
    assert found.status == DOUBTFUL
    assert "none of the 3 models" in found.data["advice"]
    (share,) = re.findall(r"weighted by noise_share=(\S+?)\.(?:\s|$)", str(found))
    assert float(share) == pytest.approx(0.01, rel=0.2)
    weights = {"measurement": {"noise_share": float(share)}}
    again = told(times, (1 + times / 5) * noise, models, config=weights, **given)
    assert again.status == OK
    limits = again.to_frame().loc[["k", "c"]]
    assert np.all((limits["low"] < [1.0, 5.0]) & (limits["high"] > [1.0, 5.0]))


@pytest.mark.nightly
def test_limits_of_quiet_traces_allow_for_a_wrong_model() -> None:
    """A second branch of 6 % of the first, six times as slow; noise of 0.05 % of the peak."""
    times = np.linspace(0.1, 60, 600)
    values = 1500 + 3000 * (np.exp(-times / 2) + 0.06 * np.exp(-times / 12))
    values += 2.2 * np.random.default_rng(0).standard_normal(600)
    found = told(times, values, ["springpot"], **ZENER)
    assert found.status == DOUBTFUL
    (good,) = re.findall("good to (.+) % of the peak", str(found))
    assert float(good) == pytest.approx(0.4, rel=0.2)
    limits, truth = found.to_frame().loc[["k", "k_p", "c"]], [3000, 1500, 6000]
    assert np.all((limits["low"] < truth) & (limits["high"] > truth))
    assert np.all(limits["high"] < 2 * limits["low"])


@pytest.mark.nightly
def test_of_a_sensor_that_is_logged_more_often_than_read_one_of_each_reading_is_kept() -> None:
    time_s, times = np.arange(1, 601) / 10, 5
    values = 1500 + 3000 * np.exp(-time_s / 2) + 20 * np.random.default_rng(0).standard_normal(600)
    found, alone = (
        told(*trace, **ZENER)
        for trace in (
            (time_s, np.repeat(values[::times], times)),
            (time_s[::times], values[::times]),
        )
    )
    assert (found.status, found.data["samples"]) == (OK, 600 // times)
    assert found.data["quantities"] == alone.data["quantities"]
    assert "repeat the one before, as of a sensor that is read less often" in str(found)
    assert "480 of 600 readings" in str(found)
    # It stands still for half of the trace.
    stuck = np.where(time_s < 30, np.repeat(values[::times], times), values[300])
    assert told(time_s, stuck, **ZENER).status != OK


def test_rounding_is_named_and_limits_allow_for_it() -> None:
    """The last readings are all 1600 where 1510 is true, of which noise would tell more."""
    time_s = np.arange(1, 601) / 10
    values = 1510 + 3000 * np.exp(-time_s / 2)
    found = told(time_s, 200 * np.round(values / 200), **ZENER)
    assert found.status == DOUBTFUL
    (rounded,) = found.data["reasons"]
    assert rounded.startswith("The readings are rounded to steps of 200 Pa")
    limits, truth = found.to_frame().loc[["k", "k_p", "c"]], [3000, 1510, 6000]
    assert np.all((limits["low"] < truth) & (limits["high"] > truth))
    assert np.all(limits["high"] < 3 * limits["low"])


@pytest.mark.nightly
def test_rounding_rejects_no_trace_that_has_long_come_to_rest() -> None:
    """Most readings of a creep are the same, which a fit follows: few errors tell of rounding."""
    time_s = np.arange(0.1, 60.0, 0.1)
    strain = 100 * (1 / 2000 + (1 / 800 - 1 / 2000) * (1 - np.exp(-time_s / 5)))
    found = identify_trace(
        *(time_s, 0.01 * np.round(strain / 0.01)), reads="strain", hold=100, model="zener_kelvin"
    )
    assert found.status == DOUBTFUL
    limits, truth = found.to_frame().loc[["k_s", "k_v", "c_v"]], [2000, 4000 / 3, 20000 / 3]
    assert np.all((limits["low"].fillna(0.0) < truth) & (limits["high"].fillna(np.inf) > truth))


@pytest.mark.nightly
def test_of_mucus_the_misfit_comes_before_the_reading_that_does_not_fit() -> None:
    time_s, compliance = np.loadtxt(
        ROOT / "data" / "measured" / "mucus.csv", delimiter=",", skiprows=1
    ).T
    found = told(time_s, compliance, reads="compliance", model="springpot_beside_damper")
    misfit, first = found.data["reasons"][:2]
    assert misfit.startswith("The RMS residual is 3.9 times the noise of the trace; ")
    assert first.startswith("The first reading (0.5 s) does not fit the rest")
    assert "Leave out that reading (" in first
    assert "no linear sample fits to the noise; the closest ones, " in in_words(found.data)
