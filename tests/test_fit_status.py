from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.judging import doubts
from biogrip.judging.doubts import DOUBT, DOUBTFUL, HARMLESS, OK, REJECTED, REJECTION, Note
from biogrip.library import Sample, TraceResult, set_up, simulate
from biogrip.physics.protocol import hold
from tests.helpers.identified import told
from tests.helpers.problems import GRIPPER

TIMES = np.arange(0.0, 400.0, 0.5)


def response(step_s: float = 200.0) -> Array:
    """The rotation under the default protocol, but for the time of its step."""
    phases = hold(step_s, 1.6e-9), hold(400.0 - step_s, 0.32e-9)
    experiment = set_up(GRIPPER, phases, Sample("liquid_drop"))
    return simulate(experiment, {"k": 20.0, "k_p": 5.0, "c": 300.0}, TIMES)


RIGHT = response()
SIGMA = 0.02 * float(np.sqrt(np.mean(RIGHT**2)))


def identified(clean: Array, **given: Any) -> TraceResult:
    noise = SIGMA * np.random.default_rng(0).standard_normal(len(TIMES))
    return told(TIMES, clean + noise, **given)


def test_the_heaviest_note_decides() -> None:
    light, middle, heavy = (Note(weight, weight) for weight in (HARMLESS, DOUBT, REJECTION))
    assert doubts.compute_status([]) == doubts.compute_status([light]) == OK
    assert doubts.compute_status([light, middle]) == DOUBTFUL
    assert doubts.compute_status([middle, heavy, light]) == REJECTED
    assert doubts.order_notes([light, heavy, middle]) == [heavy, middle, light]
    assert doubts.find_reasons([light]) == []
    assert doubts.find_reasons([middle, heavy, light]) == [REJECTION]


def test_a_parameter_at_the_end_of_its_range_is_named() -> None:
    ranges = {"k_p": {"exponent": [-3, -1], "digit": [1, 9]}}
    narrow = identified(RIGHT, config={"search_range": ranges})
    assert narrow.status == REJECTED
    words = "k_p is at the upper end of its search range, 0.099 N/m"
    assert any(reason.startswith(words) for reason in narrow.data["reasons"])


def test_a_rejected_fit_says_only_why() -> None:
    gap = np.where(np.arange(len(TIMES)) == 700, np.nan, response(220.0))
    found = identified(gap, models=["kelvin_voigt", "liquid_drop"])
    assert found.status == REJECTED
    assert {item["verdict"] for item in found.data["quantities"]} == {"fit rejected"}
    assert all(item["low"] is item["high"] is None for item in found.data["quantities"])
    assert found.data["trades"] == []
    *heavy, light = found.data["notes"]
    assert [note["text"] for note in heavy] == found.data["reasons"]
    assert {note["weight"] for note in heavy} == {REJECTION}
    assert light == {"weight": HARMLESS, "text": "Left out for want of a number: 1 row of 800."}
    assert found.data["noise_rad"] is None
    for word in ("allow for", "richer", "suits the trace", "intervals", "Limits are"):
        assert word not in str(found)


def test_a_springpot_may_be_a_spring() -> None:
    """With exponents from 0.01 on, this right model would be rejected."""
    times = np.geomspace(1e-2, 1e4, 40)
    values = (30 + 100 / np.sqrt(times)) * (1 + 0.01 * np.random.default_rng(1).normal(size=40))
    given: dict[str, Any] = {"reads": "modulus", "noise_share": 0.01}
    found = told(times, values, model="springpots_in_parallel", **given)
    assert found.status == OK
    low, high = found.to_frame().loc["k_beta", ["low", "high"]]
    assert 29 < low < 30 < high < 32


def test_that_no_model_is_adequate_is_said() -> None:
    """Of a master curve of four processes and an equilibrium."""
    times, curve = np.logspace(-1, 6, 46), np.full(46, 5e5)
    for strength_Pa, relaxation_s in ((3e8, 0.3), (8e7, 30.0), (2e7, 3e3), (3e6, 1e5)):
        curve += strength_Pa * np.exp(-times / relaxation_s)
    curve *= 1 + 0.02 * np.random.default_rng(4).standard_normal(46)
    given = {"reads": "modulus", "model": "zener_maxwell", "noise_share": 0.02}
    found = told(times, curve, ["zener_maxwell", "generalized_maxwell_2"], **given).data
    assert (found["fit"], found["preferred_model"]) == ("rejected", None)
    assert found["advice"].startswith("None of the 2 models tried is adequate: the best of them, ")
