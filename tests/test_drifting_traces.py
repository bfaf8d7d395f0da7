"""What drifts slowly beside the noise is said of a trace, and what does not is not."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, norm

from biogrip.arrays import Array
from biogrip.fit.problem import silent
from biogrip.identify.notebook import TraceResult, identify_trace
from biogrip.identify.one_trace import identify_batch
from biogrip.identify.other_fits import second_opinions
from biogrip.identify.settings import Asked, Setting, case_of
from biogrip.identify.trace_case import TraceCase
from biogrip.judging.diagnosis import Diagnosis, diagnose
from biogrip.judging.doubts import Note
from biogrip.judging.likelihood import compute_fall
from biogrip.records.traces import Measurements
from tests.helpers.identified import write_trace
from tests.helpers.problems import clean, run

TIMES, CLEAN = clean("endothelial_cell", 5.0)
SIGMA = 0.1 * float(CLEAN.max())
DRIFT = SIGMA * TIMES / TIMES[-1]
DECLARED = [Setting(f"--{name}", ("measurement", name), True) for name in ("offset", "drift")]
SLOW = SIGMA * np.sin(2 * np.pi * TIMES / 150)


def trace(seed: int, added: Array) -> Array:
    noise: Array = SIGMA * np.random.default_rng([seed, 11]).standard_normal(len(TIMES))
    return CLEAN + added + noise


def asked(
    file: Path, *declared: Setting, model: str = "liquid_drop", config: Path | None = None
) -> Asked:
    return Asked(file, config, (Setting("--model", ("sample", "model"), model), *declared))


def suspected(
    folder: Path, seed: int, added: Array, *declared: Setting
) -> tuple[Diagnosis, list[Note]]:
    """What is said of a trace, and of an offset and a drift in it."""
    rotation = trace(seed, added)
    case = case_of(asked(write_trace(folder / "t.csv", TIMES, rotation), *declared))
    problem = case.problem.of(TIMES, rotation)
    told = diagnose(problem, case.problem.searched, run("least_squares", problem), confidence=0.95)
    recorded = Measurements(TIMES, None, {0: rotation})
    read = TraceCase(case, recorded, case.problem, {})
    (notes,) = second_opinions([read], [told], silent, [0.0])
    return told, notes


def test_what_is_slow_is_seen_where_neighbouring_samples_do_not_show_it(tmp_path: Path) -> None:
    """An eighth of the noise: neighbouring residuals are correlated by less than chance."""
    told, _ = suspected(tmp_path, 0, 0.3 * SLOW)
    assert any("wanders" in note.text for note in told.notes)
    assert not any("correlated" in note.text for note in told.notes)


def test_a_drift_that_a_sample_could_have_shown_is_suspected(tmp_path: Path) -> None:
    """Most of it is fitted away, as a softer sample."""
    for seed in range(2):
        (said,) = suspected(tmp_path, seed, 0.6 * DRIFT)[1]
        assert "--offset --drift" in said.text
        assert "k_p would be " in said.text


def test_a_trace_that_does_not_drift_is_not_suspected(tmp_path: Path) -> None:
    """Each would be in three of a thousand traces, by each of the tests."""
    for seed in range(3):
        told, doubts = suspected(tmp_path, seed, 0 * DRIFT)
        assert (told.notes, doubts) == ([], [])
    # Nor is one whose drift is declared.
    assert suspected(tmp_path, 0, DRIFT, *DECLARED)[1] == []


def test_an_offset_beside_a_declared_drift_is_one_degree_of_freedom(tmp_path: Path) -> None:
    """What is said of the fall of chi^2 is rounded to three digits, and its chance to one."""
    (said,) = suspected(tmp_path, 0, np.full(len(TIMES), 0.6 * SIGMA), DECLARED[1])[1]
    found = re.search(r"falls by (\S+); by chance it would once in (\S+) traces", said.text)
    assert found is not None
    assert float(found[2]) == pytest.approx(1 / chi2.sf(float(found[1]), 1), rel=0.6)


@pytest.mark.parametrize("known", [None, 2.0])
def test_chi_squared_falls_by_twice_the_logarithm_of_how_much_likelier(
    known: float | None,
) -> None:
    """With the noise that is known, or that with which each residual is likeliest."""
    residual = np.random.default_rng(4).standard_normal(50)
    fits = 2.0 * residual, 1.7 * residual
    before_rad, after_rad = (float(np.sqrt(np.mean(fit**2))) for fit in fits)
    before = norm.logpdf(fits[0], scale=known or before_rad).sum()
    after = norm.logpdf(fits[1], scale=known or after_rad).sum()
    found = compute_fall(50, before_rad, after_rad, known)
    assert found == pytest.approx(2 * (after - before), rel=1e-12)


def test_under_a_constant_torque_a_drift_is_not_told_from_flow(tmp_path: Path) -> None:
    """Nor an offset from what yields at once: a drop that does is not said to have one."""
    held = tmp_path / "held.yaml"
    held.write_text(
        "protocol: {phases: [{duration_s: 200.0, torque_Nm: 1.6e-9}]}\n"
        "model_selection: {models: []}\n"
    )
    first = TIMES <= 200
    file = write_trace(tmp_path / "t.csv", TIMES[first], trace(0, 0 * DRIFT)[first])
    (found,) = identify_batch([asked(file, model="kelvin_voigt", config=held)], None).found
    (said,) = [note["text"] for note in found["notes"] if "χ² falls" in note["text"]]
    assert "the instrument has an offset, or the sample yields at once" in said
    assert "--" not in said
    assert "would be" not in said


CREEP = np.arange(0.5, 120.5, 0.5)


def told(clean: Array, *, model: str, level: float = 1e-2, **given: Any) -> TraceResult:
    values = clean + level * clean.max() * np.random.default_rng(5).standard_normal(len(clean))
    config = {"model_selection": {"models": given.pop("models", [])}}
    return identify_trace(CREEP, values, config=config, model=model, **given)


def test_an_offset_alone_is_advised_if_it_explains_as_much(tmp_path: Path) -> None:
    """And the fit that is advised is what its command makes of the trace."""
    seed, added = 0, np.full(len(TIMES), 0.6 * SIGMA)
    (said,) = suspected(tmp_path, seed, added)[1]
    assert said.text.startswith("An offset of the instrument, fitted along, explains the trace")
    assert "with --offset." in said.text
    file = write_trace(tmp_path / "t.csv", TIMES, trace(seed, added))
    config = tmp_path / "few.yaml"
    config.write_text("model_selection: {models: []}\n")
    (found,) = identify_batch([asked(file, DECLARED[0], config=config)], None).found
    for quantity in found["quantities"]:
        would_be = f"{quantity['quantity']} would be "
        words = quantity["in_words"].removeprefix("determined: ")
        assert would_be not in said.text or f"{would_be}{words}" in said.text


def test_a_better_model_is_not_taken_for_an_offset_and_a_drift() -> None:
    """A power law: with offset and drift the fit would be as wrong."""
    found = told(1000 * CREEP**-0.15, model="kelvin_voigt", reads="modulus", models=["springpot"])
    assert found.status == "rejected"
    assert "springpot" in found.data["advice"]
    assert "offset" not in str(found)


def test_what_a_power_law_leaves_is_no_drift_and_its_first_readings_are_no_outliers() -> None:
    """The fit is good to two per cent, so doubtful; the springpot fits far better."""
    found = told(
        1e-2 * CREEP**0.15,
        model="zener_kelvin",
        reads="strain",
        models=["springpot"],
        hold=1.0,
        level=3e-3,
    )
    assert found.status == "doubtful"
    assert "springpot" in found.data["advice"]
    assert "drift" not in str(found)
    assert "outliers" not in str(found)


@pytest.mark.parametrize(
    ("model", "names"), [("burgers", "c_s"), ("maxwell", "c"), ("generalized_maxwell", "c + c_p")]
)
@pytest.mark.parametrize("noise_model", ["white", "coloured"])
def test_flow_under_a_constant_load_is_said_to_look_like_a_drift(
    model: str, names: str, noise_model: str
) -> None:
    """Nor is a drift fitted along by default that would take the flow away."""
    delayed = (1 - np.exp(-CREEP / 6)) / 800 if model == "burgers" else 0.0
    given: dict[str, Any] = {"reads": "strain", "hold": 1.0, "noise_model": noise_model}
    given |= {"fixed": {"k_p": 0.0}} if "+" in names else {}
    found = told(1 / 1000 + CREEP / 3e4 + delayed, model=model, **given)
    assert f"are one line: {names} holds if the instrument does not drift" in str(found)
    flow = found.to_frame().loc[names]
    assert flow["value"] == pytest.approx(3e4, rel=0.1)
    assert flow["high"] < 2 * flow["low"]


def test_of_a_drift_that_is_declared_and_flow_only_the_sum_is_determined() -> None:
    found = told(1 / 1000 + CREEP / 3e4, model="maxwell", reads="strain", hold=1.0, drift=True)
    assert "of c and the drift that is fitted along, only the sum is determined" in str(found)
