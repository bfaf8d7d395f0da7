"""Fits that are rejected determine nothing, and right set-ups are ok."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from biogrip.arrays import Array
from biogrip.judging.doubts import (
    DOUBT,
    DOUBTFUL,
    HARMLESS,
    OK,
    REJECTED,
    REJECTION,
    Note,
    compute_status,
    find_reasons,
    order_notes,
)
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import hold, torque_history
from tests.helpers.identified import identify, write_trace
from tests.helpers.problems import GRIPPER

FEW = "least_squares: {candidates: 100, starts: 4}\nmodel_selection: {models: []}\n"
TIMES = np.arange(0.0, 400.0, 0.5)
NOISE_MODELS = ["white", pytest.param("coloured", marks=pytest.mark.nightly)]


def response(step_s: float = 200.0) -> Array:
    """The rotation under the default protocol, but for the time of its step."""
    torque = torque_history((hold(step_s, 1.6e-9), hold(400.0 - step_s, 0.32e-9)))
    network = MODELS["liquid_drop"].network([[20.0, 5.0, 300.0]])
    return rotation(step_response(GRIPPER, network), torque, TIMES)[0]


RIGHT = response()
SIGMA = 0.02 * float(np.sqrt(np.mean(RIGHT**2)))
# The torque comes 5 % of the trace late; a step 10 % late; five standard deviations from 260 s on.
WRONG = {
    "late torque": np.concatenate((np.zeros(40), RIGHT[:-40])),
    "late step": response(220.0),
    "jump": RIGHT + 5 * SIGMA * (TIMES > 260.0),
}


def identified(
    folder: Path, clean: Array, *options: str, config: str = FEW, seed: int = 0, gap: str = ""
) -> tuple[str, dict[str, Any]]:
    """What is said of a trace with noise, and what is written of it."""
    noise = SIGMA * np.random.default_rng(seed).standard_normal(len(TIMES))
    trace = write_trace(folder / "t.csv", TIMES, clean + noise)
    with trace.open("a") as stream:
        stream.write(gap)
    (folder / "few.yaml").write_text(config)
    given = ("--config", folder / "few.yaml", "--csv", folder / "table.csv")
    status, said, complained = identify(trace, *given, *options)
    assert status == 0, complained
    found = json.loads((folder / "t.identified.json").read_text())
    assert pd.read_csv(folder / "table.csv")["fit"].tolist() == [found["fit"]]
    return said, found


def test_the_heaviest_note_decides() -> None:
    light, middle, heavy = (Note(weight, weight) for weight in (HARMLESS, DOUBT, REJECTION))
    assert compute_status([]) == compute_status([light]) == OK
    assert compute_status([light, middle]) == DOUBTFUL
    assert compute_status([middle, heavy, light]) == REJECTED
    assert order_notes([light, heavy, middle]) == [heavy, middle, light]
    assert find_reasons([light]) == []
    assert find_reasons([middle, heavy, light]) == [REJECTION]


@pytest.mark.parametrize("noise_model", ["white", "coloured"])
@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.nightly
def test_a_wrong_set_up_determines_nothing(tmp_path: Path, wrong: str, noise_model: str) -> None:
    said, data = identified(tmp_path, WRONG[wrong], "--noise-model", noise_model)
    assert f"{tmp_path / 't.csv'}: fit rejected" in said.splitlines()
    assert "determined:" not in said
    assert data["fit"] == REJECTED
    assert data["reasons"][0] in said
    assert {item["verdict"] for item in data["quantities"]} == {"fit rejected"}
    assert all(item["low"] is item["high"] is None for item in data["quantities"])
    assert data["trades"] == []


@pytest.mark.parametrize("noise_model", NOISE_MODELS)
def test_a_right_set_up_is_ok(tmp_path: Path, noise_model: str) -> None:
    for seed in range(2):
        options = ("--noise-model", noise_model)
        assert identified(tmp_path, RIGHT, *options, seed=seed)[1]["fit"] == OK


def test_a_parameter_at_the_end_of_its_range_is_named(tmp_path: Path) -> None:
    """What the other parameters then are, is not what they are in truth."""
    narrow = "search_range: {k_p: {exponent: [-3, -1], digit: [1, 9]}}\n"
    _, data = identified(tmp_path, RIGHT, config=FEW + narrow)
    assert data["fit"] == REJECTED
    words = "k_p is at the upper end of its search range, 0.099 N/m"
    assert any(reason.startswith(words) for reason in data["reasons"])
    # The true c_p is none at all: its range ends above that, and nothing is amiss.
    high = "search_range: {c_p: {exponent: [-1, 8], digit: [1, 9]}}\n"
    assert identified(tmp_path, RIGHT, config=FEW + high)[1]["fit"] == OK


@pytest.mark.parametrize("noise_model", NOISE_MODELS)
def test_a_rejected_fit_says_only_why(tmp_path: Path, noise_model: str) -> None:
    """Noise models, simpler models and doubts about limits speak of results that it lacks."""
    config = FEW.replace("[]", "[kelvin_voigt, liquid_drop]")
    options = ("--noise-model", noise_model)
    said, data = identified(tmp_path, WRONG["late step"], *options, config=config, gap="400,\n")
    assert data["fit"] == REJECTED
    heavy = [note["text"] for note in data["notes"] if note["weight"] == REJECTION]
    light = [note["text"] for note in data["notes"] if note["weight"] != REJECTION]
    assert heavy == data["reasons"]
    assert light == ["Left out for want of a number: 1 row of 801."]
    assert data["noise_rad"] is None
    assert ("noise that cannot be told" in said) == (noise_model == "coloured")
    for word in ("allow for", "richer", "suits the trace", "intervals", "Limits are"):
        assert word not in said
