"""What drifts slowly beside the noise is said of a trace, and what does not is not."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, norm

from biogrip.arrays import Array
from biogrip.identify.prepare import flow_of
from biogrip.judging.likelihood import compute_fall
from biogrip.library import INSTRUMENTS, Sample, TraceResult, hold, set_up
from tests.helpers.identified import told
from tests.helpers.problems import clean

TIMES, CLEAN = clean("endothelial_cell", 5.0)
SIGMA = 0.1 * float(CLEAN.max())
DRIFT = SIGMA * TIMES / TIMES[-1]
OFFSET = np.full(len(TIMES), 0.6 * SIGMA)
CREEP = np.arange(0.5, 120.5, 0.5)


def gripped(seed: int, added: Array, until_s: float = 400.0, **given: Any) -> TraceResult:
    noise = SIGMA * np.random.default_rng([seed, 11]).standard_normal(len(TIMES))
    part = until_s >= TIMES
    return told(TIMES[part], (CLEAN + added + noise)[part], **{"model": "liquid_drop"} | given)


def crept(clean: Array, level: float = 1e-2, **given: Any) -> TraceResult:
    noise = level * clean.max() * np.random.default_rng(5).standard_normal(len(clean))
    return told(CREEP, clean + noise, **given)


def suspected(found: TraceResult) -> list[str]:
    return [note["text"] for note in found.data["notes"] if "χ² falls" in note["text"]]


def test_a_drift_that_a_sample_could_have_shown_is_suspected() -> None:
    """Most of it is fitted away, as a softer sample."""
    (said,) = suspected(gripped(0, 0.6 * DRIFT))
    assert "identify the trace with --offset --drift" in said
    assert "k_p would be " in said


@pytest.mark.nightly
def test_an_offset_beside_a_declared_drift_is_one_degree_of_freedom() -> None:
    """What is said of the fall of chi^2 is rounded to three digits, and its chance to one."""
    (said,) = suspected(gripped(0, OFFSET, drift=True))
    found = re.search(r"falls by (\S+), p = (\S+)\)", said)
    assert found is not None
    assert float(found[2]) == pytest.approx(chi2.sf(float(found[1]), 1), rel=0.6)


@pytest.mark.parametrize("known", [None, 2.0])
def test_chi_squared_falls_by_twice_the_logarithm_of_how_much_likelier(known: float | None) -> None:
    """With the noise that is known, or that with which each residual is likeliest."""
    before, after = (size * np.random.default_rng(4).standard_normal(50) for size in (2.0, 1.7))
    misfits = [float(np.sqrt(np.mean(fit**2))) for fit in (before, after)]
    likely = [
        norm.logpdf(fit, scale=known or misfit).sum()
        for fit, misfit in zip((before, after), misfits, strict=True)
    ]
    fall = compute_fall(50, misfits[0], misfits[1], known)
    assert fall == pytest.approx(2 * (likely[1] - likely[0]), rel=1e-12)


def test_an_offset_is_not_told_from_what_yields_at_once_under_a_constant_torque() -> None:
    held = {"protocol": {"phases": [{"duration_s": 200.0, "torque_Nm": 1.6e-9}]}}
    (said,) = suspected(gripped(0, 0 * DRIFT, 200.0, model="kelvin_voigt", config=held))
    assert "or the sample has an instantaneous compliance. Under" in said
    assert "identify the trace with" not in said
    assert "would be" not in said


@pytest.mark.nightly
def test_an_offset_alone_is_advised_if_it_explains_as_much() -> None:
    """And the fit that is advised is what is made of the trace if it is declared."""
    (said,) = suspected(gripped(0, OFFSET))
    assert said.startswith("An offset of the instrument, fitted along, explains the trace")
    assert "with --offset." in said
    advised = re.findall(r"(\S+|c \+ c_p) would be ([^;]+?)[;:.](?: |$)", said)
    found = gripped(0, OFFSET, offset=True).data["quantities"]
    words = {it["quantity"]: it["in_words"].removeprefix("determined: ") for it in found}
    assert advised
    assert all(words[name].startswith(value) for name, value in advised)


GOOD_TO_TWO_PERCENT = {"model": "zener_kelvin", "reads": "strain", "hold": 1.0, "level": 3e-3}


@pytest.mark.parametrize(
    ("exponent", "fit", "given"),
    [
        (-0.15, "rejected", {"model": "kelvin_voigt", "reads": "modulus"}),
        pytest.param(0.15, "doubtful", GOOD_TO_TWO_PERCENT, marks=pytest.mark.nightly),
    ],
)
def test_a_power_law_is_not_taken_for_an_offset_and_a_drift(
    exponent: float, fit: str, given: dict[str, Any]
) -> None:
    """Nor are its first readings outliers; the springpot fits far better."""
    found = crept(1e-2 * CREEP**exponent, models=["springpot"], **given)
    assert found.status == fit
    assert "(--model springpot) is preferred" in found.data["advice"]
    for word in ("offset", "drift", "outliers"):
        assert word not in str(found)


@pytest.mark.parametrize("noise_model", ["white", "coloured"])
def test_flow_under_a_constant_load_is_said_to_look_like_a_drift(noise_model: str) -> None:
    """Nor is a drift fitted along by default that would take the flow away."""
    given: dict[str, Any] = {"model": "maxwell", "reads": "strain", "hold": 1.0}
    found = crept(1 / 1000 + CREEP / 3e4, noise_model=noise_model, **given)
    assert "are one line: c holds if the instrument does not drift" in str(found)
    flow = found.to_frame().loc["c"]
    assert flow["value"] == pytest.approx(3e4, rel=0.1)
    assert flow["high"] < 2 * flow["low"]
    if noise_model == "white":
        found = crept(1 / 1000 + CREEP / 3e4, drift=True, **given)
        assert "of c and the drift that is fitted along, only the sum is determined" in str(found)


def test_dampers_without_a_spring_beside_them_let_a_sample_flow() -> None:
    for model, fixed, dampers in (
        *(("maxwell", (), "c"), ("burgers", (), "c_s"), ("zener_maxwell", (), "")),
        ("generalized_maxwell", ("k_p",), "c + c_p"),
    ):
        creep = set_up(INSTRUMENTS["strain"], (hold(120.0, 1.0),), Sample(model))
        assert flow_of(replace(creep, fixed=dict.fromkeys(fixed, 0.0))) == dampers
