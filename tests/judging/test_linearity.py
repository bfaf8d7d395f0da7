"""Gains of levels: simulated staircases of samples that stiffen, and of linear ones."""

import re

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import fit_from
from biogrip.judging.doubts import Note, notes_on_gains
from biogrip.judging.likelihood import make_likelihood
from biogrip.library import Sample, set_up
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import hold
from tests.helpers.identified import told as told_of

LEVELS = (2.0, 5.0, 10.0)
TIMES: Array = np.arange(1.0, 451.0)
PHASES = tuple(hold(75.0, level) for each in LEVELS for level in (each, 0.0))
SAMPLE = {"k_s": 400.0, "k_v": 300.0, "c_v": 6000.0}


def staircase(gains: tuple[float, ...], seed: int) -> Array:
    """Creep and recovery at three levels, whose strains have these gains."""
    strain: Array = np.zeros(len(TIMES))
    for start_s, gain, level in zip((0.0, 150.0, 300.0), gains, LEVELS, strict=True):
        for since, sign in ((TIMES - start_s, 1), (TIMES - start_s - 75.0, -1)):
            yielded = 1 / 400 - np.expm1(-np.maximum(since, 0.0) / 20) / 300
            strain += sign * gain * level * yielded * (since > 0)
    noise = 0.005 * np.max(strain) * np.random.default_rng(seed).standard_normal(len(TIMES))
    return strain + noise


def told(gains: tuple[float, ...], seed: int) -> list[Note]:
    """Notes on such a trace."""
    experiment = set_up(INSTRUMENTS["strain"], PHASES, Sample("zener_kelvin"))
    return notes_of(experiment, staircase(gains, seed))


def notes_of(experiment: Experiment, strain: Array) -> list[Note]:
    """Notes on a fit from near the truth."""
    problem = experiment.of(TIMES, strain)
    fit = fit_from([problem], experiment.logs(SAMPLE))
    given = problem, fit.x[0], float(fit.misfit[0])
    return list(notes_on_gains(make_likelihood(*given, confidence=0.95), []))


def test_gains_of_a_sample_that_stiffens_hold_the_truth() -> None:
    """A third off, where first order would be off by ten limits."""
    (note,) = told((1.0, 1 / 1.12, 1 / 1.35), 0)
    assert re.search(r"^Strain per stress at .* of that at 2 Pa .*is not linear\.$", note.text)
    found = re.findall(r"(\S+) Pa is \S+ \((\S+) to (\S+)\)", note.text)
    for true, (level, low, high) in zip((1 / 1.12, 1 / 1.35), found, strict=True):
        assert level == {1 / 1.12: "5", 1 / 1.35: "10"}[true]
        # Limits hold in 95 %; twice as wide, in all.
        middle, room = (float(low) + float(high)) / 2, float(high) - float(low)
        assert abs(true - middle) < room < 0.03


def test_of_linear_samples_nothing_is_said() -> None:
    """Of 20, none: the level is 0.3 %."""
    assert not [note for seed in range(20) for note in told((1.0, 1.0, 1.0), seed)]


def test_one_level_has_no_gain() -> None:
    experiment = set_up(INSTRUMENTS["strain"], (hold(450.0, 2.0),), Sample("zener_kelvin"))
    assert not notes_of(experiment, 2 / 400 - 2 * np.expm1(-TIMES / 20) / 300)


def test_of_a_sample_that_is_not_linear_no_other_linear_model_is_advised() -> None:
    phases = [{"duration_s": 75.0, "stress_Pa": level} for each in LEVELS for level in (each, 0.0)]
    given = {"reads": "strain", "config": {"protocol": {"phases": phases}}}
    strain = staircase((1.0, 0.96, 1.04), 0)
    found = told_of(TIMES, strain, ["burgers"], model="zener_kelvin", **given).data
    assert any("of that at 2 Pa" in note["text"] for note in found["notes"])
    assert min(found["models"], key=lambda row: row["delta_bic"])["model"] == "burgers"
    assert found["advice"] is found["preferred_model"] is None


def test_of_a_sample_that_is_not_linear_no_offset_is_advised() -> None:
    """Where that rejects the fit; else both are said."""
    phases = [{"duration_s": 75.0, "stress_Pa": level} for each in LEVELS for level in (each, 0.0)]
    strain, config = staircase((1.0, 0.8, 0.65), 0), {"protocol": {"phases": phases}}
    found = told_of(TIMES, strain, model="zener_kelvin", reads="strain", config=config).data
    texts = [note["text"] for note in found["notes"]]
    assert any("of that at 2 Pa" in text for text in texts)
    assert not any("--offset" in text for text in texts), texts
