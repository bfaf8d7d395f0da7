"""What moves the result: errors of the instrument, planted and fitted again, move as is said."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import fit_from, identify_from
from biogrip.judging.diagnosis import Diagnosis, diagnose
from biogrip.judging.what_moves import error_in_words
from biogrip.judging.without_model import tell_without_model
from biogrip.library import Sample, set_up, simulate
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import hold, joined, ramp
from tests.helpers.problems import GRIPPER

EVERY_S = 0.2
TIMES: Array = np.arange(1.0, 101.0, EVERY_S)
LEVELS = {"rotation": 1e-9, "displacement": 1e-9, "strain": 10.0, "compliance": 1.0}
LEVELS |= {"force": 1e-6, "stress": 0.1, "modulus": 1.0, "relative_modulus": 1.0}
SWEPT = [name for name, instrument in INSTRUMENTS.items() if instrument.sweeps]
# Stiffness and relaxation time of the samples, of which each instrument sees springs and dampers.
SOFT = {"rotation": 20.0, "relative_modulus": 0.4}
OMEGA: Array = np.geomspace(0.01, 10.0, 40)


def sample_of(reads: str) -> dict[str, float]:
    k = SOFT.get(reads, 80.0)
    if INSTRUMENTS[reads].deforms or reads == "rotation":
        return {"k": k, "k_p": 1.25 * k, "c": 20 * k}
    return {"k_s": k, "k_v": 1.25 * k, "c_v": 20 * k}


def experiment_of(reads: str, *, rises_s: float = 0.0) -> Experiment:
    level, instrument = LEVELS.get(reads, 1.0), INSTRUMENTS[reads]
    rise = (ramp(rises_s, 0.0, level),) if rises_s else ()
    phases = (*rise, hold(101.0 - rises_s, level))
    model = "zener_maxwell" if "k" in sample_of(reads) else "zener_kelvin"
    return set_up(GRIPPER if instrument.has_jaws else instrument, phases, Sample(model))


def shown(reads: str, *, late_s: float = 0.0, rises_s: float = 0.0) -> Array:
    experiment, times = experiment_of(reads, rises_s=rises_s), TIMES + late_s
    if reads in SWEPT:
        # By hand: G* of a Zener solid.
        k, k_p, c = sample_of(reads).values()
        modulus = k_p + k * 1j * OMEGA / (1j * OMEGA + k / c)
        return joined(OMEGA, modulus.real, modulus.imag)[1]
    return simulate(experiment, sample_of(reads), times)


@cache
def judged(reads: str) -> Diagnosis:
    clean, experiment = shown(reads), experiment_of(reads)
    noise = 1e-3 * np.max(np.abs(clean))
    rng = np.random.default_rng(0)
    problem = experiment.of(axis(reads), clean + noise * rng.standard_normal(len(clean)))
    return diagnose(
        problem, identify_from(problem, experiment.logs(sample_of(reads))), confidence=0.95
    )


def axis(reads: str) -> Array:
    return np.append(-OMEGA[::-1], OMEGA) if reads in SWEPT else TIMES


def wrong(reads: str, name: str) -> Array:
    """What a mistake adds to the readings of the sample."""
    clean = shown(reads)
    if name == "zero":
        return np.full(len(clean), 0.01 * np.max(np.abs(clean)))
    if name == "gain":
        return 0.01 * clean
    if name == "phase":
        loss, storage = clean[: len(OMEGA)][::-1], clean[len(OMEGA) :]
        turned = (storage + 1j * loss) * np.exp(1j * np.radians(1.0))
        return joined(OMEGA, turned.real, turned.imag)[1] - clean
    given = {"late_s": EVERY_S} if name == "clock" else {"rises_s": EVERY_S}
    return shown(reads, **given) - clean


@pytest.mark.parametrize("reads", INSTRUMENTS)
def test_a_refit_moves_each_quantity_by_what_is_said(reads: str) -> None:
    """Within 5 % and 0.02 % of the value: errors of both signs cancel the second order."""
    diagnosis, experiment = judged(reads), experiment_of(reads)
    best, trace = diagnosis.likelihood.best, diagnosis.likelihood.problem.residuals.trace
    names = ["gain", "phase"] if reads in SWEPT else ["zero", "gain", "clock", "rise"]
    assert [move.name for move in diagnosis.moves] == names
    both = [move.words for move in diagnosis.moves if move.words.startswith("the moduli are read")]
    assert len(both) == (reads in SWEPT)
    for move in diagnosis.moves:
        change = wrong(reads, move.name)
        wrongs = (trace.readings + sign * change for sign in (1, -1))
        ends = [fit_from([experiment.of(axis(reads), own)], best).x[0] for own in wrongs]
        for finding in diagnosis.findings:
            log, label = finding.quantity.log, finding.quantity.label
            moved = 0.5 * (log(ends[0]) - log(ends[1]))
            assert np.log1p(move.changes[label]) == pytest.approx(moved, rel=0.05, abs=2e-4), move


@pytest.mark.parametrize("reads", INSTRUMENTS)
def test_any_linear_sample_moves_as_its_refit(reads: str) -> None:
    """Within 5 % and 0.05 %: the error is planted here by the true sample, not by the fit."""
    residuals = judged(reads).likelihood.problem.residuals
    found = tell_without_model(residuals, confidence=0.95)
    assert found.moves

    def values(change: Array) -> dict[str, float]:
        trace = replace(residuals.trace, readings=residuals.trace.readings + change)
        other = tell_without_model(replace(residuals, trace=trace), confidence=0.95)
        return {each.quantity: each.value for each in other.told if each.value}

    for move in found.moves:
        change = wrong(reads, move.name)
        above, below = values(change), values(-change)
        for own in found.told:
            label = own.quantity
            if own.value and own.kind == "level" and label in above and label in below:
                moved = np.expm1(0.5 * (above[label] - below[label]) / own.value)
                assert move.changes[label] == pytest.approx(moved, rel=0.05, abs=5e-4), move


def test_a_zero_is_a_spring_of_a_held_strain() -> None:
    """By hand: 1 % of the peak is added to the spring that stays, and to nothing else."""
    clean = shown("modulus")
    zero = next(move for move in judged("modulus").moves if move.name == "zero")
    assert zero.changes["k_p"] == pytest.approx(0.01 * clean.max() / 100.0, rel=1e-2)
    assert max(abs(zero.changes["k"]), abs(zero.changes["c"])) < 1e-4


@pytest.mark.parametrize(("every_s", "first_s", "rise_s"), [(0.5, 0.5, 0.5), (0.5, 0.2, 0.2)])
def test_what_is_printed_is_off_as_said_and_a_rise_ends_before_a_reading(
    every_s: float, first_s: float, rise_s: float
) -> None:
    """Creep under a stress with a rise, fitted as a step and, as it was, with its rise."""
    times: Array = np.float64(first_s) + every_s * np.arange(100)
    values = {"k_s": 80.0, "k_v": 100.0, "c_v": 200.0}
    sample, strain = Sample("zener_kelvin"), INSTRUMENTS["strain"]
    step = set_up(strain, (hold(51.0, 1.0),), sample)
    rising = set_up(strain, (ramp(rise_s, 0.0, 1.0), hold(51.0 - rise_s, 1.0)), sample)
    clean = simulate(rising, values, times)
    noise = 1e-4 * np.max(clean) * np.random.default_rng(1).standard_normal(len(times))
    of_step, of_rise = (
        diagnose(problem, identify_from(problem, step.logs(values)), confidence=0.95)
        for problem in (own.of(times, clean + noise) for own in (step, rising))
    )
    move = next(move for move in of_step.moves if move.name == "rise")
    assert f"took {rise_s:g} s" in move.words
    printed, known = (own.findings[2].value for own in (of_step, of_rise))
    assert error_in_words(move.changes["c_v"]).endswith("low" if printed < known else "high")
    assert 1 + move.changes["c_v"] == pytest.approx(printed / known, rel=0.02)


def test_beyond_a_factor_of_two_no_size_is_said() -> None:
    said = [error_in_words(by) for by in (-0.93, -0.5, -1e-7, 0.085, 9.7)]
    assert said[0] == "as less than half what it is"
    assert said[1:4] == ["50 % too low", "right", "8.5 % too high"]
    assert said[4] == "as more than twice what it is"
