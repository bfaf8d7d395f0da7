"""Traces of very many samples: seconds, little memory, and the answer of fewer samples."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.identify.one_trace import identify_batch
from biogrip.identify.settings import Asked, Setting
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS
from tests.helpers.identified import by_quantity, write_trace
from tests.helpers.problems import GRIPPER, TORQUE

SAMPLES, MEANS_OF = 200_000, 50
MODEL, TRUTH = MODELS["liquid_drop"], np.array([34.0, 12.0, 300.0])


def asked(path: Path) -> list[Asked]:
    """A trace to be identified with its own model alone: others take as much memory, and time."""
    config = path.with_suffix(".yaml")
    config.write_text("model_selection: {models: []}\n")
    return [Asked(path, config, (Setting("--model", ("sample", "model"), MODEL.name),))]


@pytest.mark.parametrize("uniform", [True, False])
@pytest.mark.nightly
def test_the_answer_is_that_of_means(tmp_path: Path, uniform: bool) -> None:
    """Means of fifty samples lose next to nothing: estimates and limits agree, to a fifth of one.

    Peak memory stays a few hundred bytes a sample.
    """
    rng = np.random.default_rng(6)
    irregular = np.unique(np.round(rng.uniform(0.0, 400.0, SAMPLES), 6))
    times: Array = np.linspace(0.0, 400.0, SAMPLES, endpoint=False) if uniform else irregular
    clean = rotation(step_response(GRIPPER, MODEL.network(TRUTH)), TORQUE, times)[0]
    trace = clean + 0.1 * clean.max() * rng.standard_normal(len(times))
    path = write_trace(tmp_path / "every.csv", times, trace)
    # No mean over both sides of the second step.
    sides = np.split(np.arange(len(times)), [times.searchsorted(200.0)])
    groups = [side[: len(side) // MEANS_OF * MEANS_OF].reshape(-1, MEANS_OF) for side in sides]
    mean_times, means = (
        np.concatenate([values[group].mean(axis=1) for group in groups])
        for values in (times, trace)
    )
    few = write_trace(tmp_path / "few.csv", mean_times, means)
    # What libraries take is no part of the memory.
    fewer = identify_batch(asked(few), None).found[0]
    tracemalloc.start()
    every = identify_batch(asked(path), None).found[0]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 330 * len(times)
    assert every["samples"] == len(times)
    for name, one in by_quantity(every).items():
        other = by_quantity(fewer)[name]
        assert one["verdict"] == other["verdict"] == "determined"
        width = np.log(one["high"] / one["low"])
        for key in ("value", "low", "high"):
            assert abs(np.log(one[key] / other[key])) < 0.2 * width
        assert one["low"] < other["value"] < one["high"]
