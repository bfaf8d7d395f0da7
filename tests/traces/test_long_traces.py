"""Traces of very many samples: seconds, little memory, and the answer of fewer samples."""

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.identify.one_trace import identify_batch
from biogrip.identify.settings import Asked, Setting, case_of
from biogrip.judging.diagnosis import diagnose
from biogrip.physics.gripper import Gripper
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import hold, torque_history
from biogrip.records.identifications import diagnosis_data
from biogrip.stages import judgement

SAMPLES, MEANS_OF = 200_000, 50
MODEL, TRUTH = MODELS["liquid_drop"], np.array([34.0, 12.0, 300.0])
_RNG = np.random.default_rng(6)
TIMES: dict[str, Array] = {
    "uniform": np.arange(SAMPLES, dtype=np.float64) * (400.0 / SAMPLES),
    "irregular": np.unique(np.round(_RNG.uniform(0.0, 400.0, SAMPLES), 7)).astype(float),
}


def written(path: Path, time_s: Array, rotation_rad: Array) -> Path:
    rows = zip(time_s.tolist(), rotation_rad.tolist(), strict=True)
    text = "".join(f"{time:.9f},{value:.9g}\n" for time, value in rows)
    path.write_text("time_s,rotation_rad\n" + text)
    return path


def options(path: Path) -> Asked:
    """A trace to be identified with its own model alone: others take as much memory, and time."""
    config = path.with_suffix(".yaml")
    config.write_text("model_selection: {models: []}\n")
    return Asked(path, config, (Setting("--model", ("sample", "model"), MODEL.name),))


def judged(path: Path, time_s: Array, rotation_rad: Array) -> dict[str, Any]:
    """What `identify_batch` finds of the sample, without a word on other models."""
    case = case_of(options(path))
    (fit,) = judgement.fits_judged([case], [case.problem], [(time_s, rotation_rad)], 0)
    searched, confidence = case.problem.searched, case.confidence
    return diagnosis_data(diagnose(fit.problem, searched, fit.found, confidence=confidence))


@pytest.mark.parametrize("times", TIMES)
@pytest.mark.nightly
def test_the_answer_is_that_of_means(gripper: Gripper, times: str, tmp_path: Path) -> None:
    """Means of fifty samples lose next to nothing: estimates and limits agree, to a fifth of one.

    Peak memory stays a few hundred bytes a sample.
    """
    torque, time_s = torque_history((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9))), TIMES[times]
    response = step_response(gripper, MODEL.network(TRUTH), symmetric=True)
    clean = rotation(response, torque, time_s)[0]
    trace = clean + 0.1 * clean.max() * _RNG.standard_normal(len(time_s))
    path = written(tmp_path / "every.csv", time_s, trace)
    # No mean over both sides of the second step.
    sides = np.split(np.arange(len(time_s)), [time_s.searchsorted(200.0)])
    groups = [side[: len(side) // MEANS_OF * MEANS_OF].reshape(-1, MEANS_OF) for side in sides]
    means = [
        np.concatenate([values[group].mean(axis=1) for group in groups])
        for values in (time_s, trace)
    ]
    fewer = judged(path, *means)
    # What libraries take is no part of it.
    few = written(tmp_path / "few.csv", time_s[::2000], trace[::2000])
    identify_batch([options(few)], None)
    tracemalloc.start()
    every = identify_batch([options(path)], None).found[0]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 330 * len(time_s)
    assert every["samples"] == len(time_s)
    for one, other in zip(every["quantities"], fewer["quantities"], strict=True):
        assert one["verdict"] == other["verdict"] == "determined"
        width = np.log(one["high"] / one["low"])
        for name in ("value", "low", "high"):
            assert abs(np.log(one[name] / other[name])) < 0.2 * width
        assert one["low"] < other["value"] < one["high"]
