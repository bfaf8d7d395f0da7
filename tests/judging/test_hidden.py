"""What a trace could hide: the errors planted in it, fitted again, move its results as is said."""

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import fit_from, identify_from
from biogrip.judging.diagnosis import Diagnosis, diagnose
from biogrip.judging.whiteness import compare_halves, find_step, wandering
from biogrip.levels import FALSE_ALARM
from biogrip.library import Sample, set_up, simulate
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import hold
from tests.judging.test_whiteness import relaxation

TIMES: Array = np.arange(1.0, 101.0)
SAMPLE, NOISE = {"k": 80.0, "k_p": 100.0, "c": 1600.0}, 3.6
EXPERIMENT = set_up(INSTRUMENTS["modulus"], (hold(100.0, 1.0),), Sample("zener_maxwell"))
CLEAN = simulate(EXPERIMENT, SAMPLE, TIMES)


NOISY = CLEAN + NOISE * np.random.default_rng(0).standard_normal(100)


def diagnosed(experiment: Experiment, sample: Mapping[str, float]) -> Diagnosis:
    problem = experiment.of(TIMES, NOISY)
    found = identify_from(problem, experiment.logs(sample))
    return diagnose(problem, found, confidence=0.95)


JUDGED = diagnosed(EXPERIMENT, SAMPLE)


def planted(words: str, response: Array) -> Array:
    """A response with an error as its sentence says."""
    if "late" in words:
        late_s, best = float(re.findall(r"by (\S+) s", words)[0]), JUDGED.likelihood.best
        fit = dict(zip(SAMPLE, np.exp(best), strict=True))
        # The first reading is one interval after the step.
        return simulate(EXPERIMENT, fit, np.maximum(TIMES - late_s, 1e-3))
    size = float(re.findall(r"(\S+) %", words)[0]) / 100
    after = float(re.findall(r"at (\S+) s", words)[0]) <= TIMES
    return response + size * after * (response if "gain" in words else np.max(np.abs(NOISY)))


@pytest.mark.parametrize("kind", ["A jump", "A gain", "A start"])
def test_an_error_that_is_planted_moves_what_is_said(kind: str) -> None:
    """To second order: its moves are a sixth at most."""
    (hidden,) = (each for each in JUDGED.hidden if each.words().startswith(kind))
    best = JUDGED.likelihood.best
    response = JUDGED.likelihood.problem.residuals.response(best)
    moved = fit_from([EXPERIMENT.of(TIMES, planted(hidden.words(), response))], best).x[0] - best
    for label, move in zip(SAMPLE, moved, strict=True):
        assert hidden.moves[label] == pytest.approx(move, rel=0.15, abs=0.02)
    label, ratio = hidden.beyond
    limits = next(each for each in JUDGED.findings if each.quantity.label == label)
    assert ratio > 1
    there = limits.value * np.exp(hidden.moves[label])
    assert not (limits.low or 0.0) < there < (limits.high or np.inf)


@pytest.mark.parametrize("kind", ["A jump", "A gain"])
def test_tests_tell_half_of_errors_of_that_size(kind: str) -> None:
    """In noise, by fits to first order; tests that are beside the best one tell a few more."""
    (hidden,) = (each for each in JUDGED.hidden if each.words().startswith(kind))
    _, basis = relaxation(TIMES)
    wrong = planted(hidden.words(), CLEAN) - CLEAN
    told = []
    for noise in NOISE * np.random.default_rng(1).standard_normal((200, 100)):
        left = wrong + noise
        left -= left @ basis.T @ basis
        step = find_step(left, basis, lambda rows: rows)
        assert step
        chances = step.chance, compare_halves(left, basis, 50), wandering(left, basis)
        told.append(min(chances) < FALSE_ALARM)
    assert 0.3 < np.mean(told) < 0.75


def test_a_late_start_is_a_stiffer_branch() -> None:
    """Of a relaxation that begins later by 1 s, k would be larger by exp(1 s / tau)."""
    (late,) = (each for each in JUDGED.hidden if "late by 1 s" in each.words())
    tau = JUDGED.findings[2].value / JUDGED.findings[0].value
    assert late.moves["k"] == pytest.approx(1 / tau, rel=0.02)
    assert late.moves["k_p"] == pytest.approx(0, abs=1e-3)


def test_a_second_branch_moves_what_is_said() -> None:
    """Added to the trace by hand, and fitted again with one branch: to second order."""
    (branch,) = (each for each in JUDGED.hidden if "second branch" in each.words())
    tau, share = map(float, re.findall(r"branch of (\S+) s with (\S+) %", branch.words())[0])
    k, k_p, c = np.exp(best := JUDGED.likelihood.best)
    assert tau == pytest.approx(10 * c / k, rel=0.05)
    response = k_p + k * np.exp(-TIMES * k / c) + share / 100 * k * np.exp(-TIMES / tau)
    moved = fit_from([EXPERIMENT.of(TIMES, response)], best).x[0] - best
    for label, move in zip(SAMPLE, moved, strict=True):
        assert branch.moves[label] == pytest.approx(move, rel=0.2, abs=0.02)


def test_a_sample_in_kelvins_form_has_a_second_branch_as_in_maxwells() -> None:
    """Both are one solid, with other names of its parameters, and hide the same."""
    k, k_p, c = SAMPLE.values()
    ratio = (k + k_p) / k
    values = {"k_s": k + k_p, "k_v": k_p * ratio, "c_v": c * ratio**2}
    other = diagnosed(replace(EXPERIMENT, sample=Sample("zener_kelvin")), values)
    said = ([each.words().split(", which")[0] for each in own.hidden] for own in (JUDGED, other))
    words, same = ([each for each in own if "second" in each] for own in said)
    assert words == same
