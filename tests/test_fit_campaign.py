"""The independent residuals of the campaign of fits, and a few of its traces."""

from math import inf

import numpy as np
import pytest

from biogrip.experiment.sample import CANDIDATES
from biogrip.library import hold, set_up, simulate
from tests.helpers.fit_campaign import (
    ACCURACY,
    ACCURACY_OF_POWER_LAWS,
    GRIPPER,
    NAMES,
    PAIRS,
    TRIED,
    Judged,
    StepResponses,
    judged,
    plausible,
    tables,
    trace_of,
    violations,
)

STEPS = ((0, 1e-9), (80, 2e-9), (170, -3e-9))
SAMPLES = 301
FEW = (60, 4)


@pytest.mark.parametrize("interval_s", [0.002, 0.02, 3.0])
@pytest.mark.parametrize("model", TRIED)
def test_rotations_are_those_of_the_library(model: str, interval_s: float) -> None:
    """Power laws of the library are Maxwell branches, which differ by more."""
    rng = np.random.default_rng(1)
    samples = plausible(model, 8, interval_s, interval_s * SAMPLES, rng)
    found = StepResponses(interval_s, SAMPLES, STEPS, inertia=True)(model, samples)[0]
    lengths = interval_s * np.diff([*(start for start, _ in STEPS), SAMPLES - 1])
    phases = tuple(map(hold, lengths.tolist(), np.cumsum([jump for _, jump in STEPS]).tolist()))
    experiment = set_up(GRIPPER, phases, CANDIDATES[model])
    time_s = interval_s * np.arange(float(SAMPLES))
    for parameters, rotation in zip(samples.tolist(), found, strict=True):
        values = dict(zip(NAMES[model], parameters, strict=True))
        expected = simulate(experiment, values, time_s)
        power_law = CANDIDATES[model].model.power_law
        accuracy = ACCURACY_OF_POWER_LAWS if power_law else ACCURACY
        assert np.abs(rotation - expected).max() < accuracy * np.abs(expected).max()


@pytest.mark.parametrize("inertia", [True, False])
@pytest.mark.parametrize("model", TRIED)
def test_derivatives_are_those_of_the_rotations(model: str, inertia: bool) -> None:
    rng = np.random.default_rng(2)
    parameters = plausible(model, 1, 0.004, 1.0, rng)
    responses = StepResponses(0.004, SAMPLES, STEPS, inertia=inertia)
    found = responses(model, parameters, slopes=True)[1:, 0]
    shifts = 2e-6 * np.eye(len(NAMES[model]))
    later, earlier = (responses(model, parameters * np.exp(s))[0] for s in (shifts, -shifts))
    expected = (later - earlier) / 4e-6
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("model", "parameters", "contained", "its_parameters"),
    [
        ("kelvin_voigt", [0.0, 0.2], "damper", [0.2]),
        ("maxwell", [inf, 0.2], "damper", [0.2]),
        ("liquid_drop", [2.0, 0.0, 0.2], "maxwell", [2.0, 0.2]),
        ("liquid_drop", [inf, 2.0, 0.2], "kelvin_voigt", [2.0, 0.2]),
        ("zener_kelvin", [2.0, 0.0, 0.2], "maxwell", [2.0, 0.2]),
        ("zener_kelvin", [inf, 2.0, 0.2], "kelvin_voigt", [2.0, 0.2]),
        ("zener_kelvin", [3.0, 6.0, 0.9], "liquid_drop", [1.0, 2.0, 0.1]),
        ("burgers", [2.0, inf, 3.0, 0.2], "zener_kelvin", [2.0, 3.0, 0.2]),
        ("burgers", [2.0, 0.2, inf, 1.0], "maxwell", [2.0, 0.2]),
        ("burgers", [2.0, 0.2, 1.0, inf], "maxwell", [2.0, 0.2]),
        ("burgers", [inf, 0.2, inf, 1.0], "damper", [0.2]),
        ("burgers", [inf, inf, 2.0, 0.2], "kelvin_voigt", [2.0, 0.2]),
        ("generalized_maxwell", [1.0, 2.0, 0.0, 0.2], "kelvin_voigt", [2.0, 0.2]),
        ("generalized_maxwell", [0.0, 2.0, 1.0, 0.2], "kelvin_voigt", [2.0, 0.2]),
        ("generalized_maxwell", [1.0, 2.0, 0.3, 0.0], "liquid_drop", [1.0, 2.0, 0.3]),
        (
            "generalized_maxwell_2",
            [1.0, 0.0, 2.0, 0.3, 0.0, 0.4],
            "generalized_maxwell",
            [1.0, 2.0, 0.3, 0.4],
        ),
        (
            "generalized_maxwell_3",
            [1.0, 3.0, 0.0, 2.0, 0.3, 0.1, 0.0, 0.4],
            "generalized_maxwell_2",
            [1.0, 3.0, 2.0, 0.3, 0.1, 0.4],
        ),
        ("fractional_maxwell", [inf, 0.3, 0.2], "damper", [0.2]),
    ],
)
def test_elements_that_vanish_or_are_rigid_leave_a_contained_model(
    model: str, parameters: list[float], contained: str, its_parameters: list[float]
) -> None:
    responses = StepResponses(0.01, SAMPLES, STEPS, inertia=True)
    found = responses(model, np.array([parameters]), slopes=True)
    assert np.all(np.isfinite(found))
    expected = responses(contained, np.array([its_parameters]))
    np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=1e-10 * expected.max())


@pytest.mark.parametrize("seed", [20])
def test_no_fit_is_above_the_best_known(seed: int) -> None:
    trace = trace_of(seed)
    found = judged(trace, FEW)
    assert list(found) == list(TRIED)
    assert not list(violations(trace, found))


def test_what_is_wrong_is_told_and_counted() -> None:
    found = {model: Judged(80.0, 80.0, 80.0, 0.0) for model in TRIED}
    found["damper"] = Judged(100.0, 100.0, 100.0, 0.0)
    found["kelvin_voigt"] = Judged(100.3, 99.8, 100.3, 0.0)
    found["maxwell"] = Judged(90.0, 90.0, 95.0, 0.0)
    told = [line.split(": ", 1)[1] for line in violations(trace_of(1), found)]
    assert told == [
        "chi^2 100.300, best known 99.800",
        "chi^2 90.000, by its misfit 95.000",
        "chi^2 of kelvin_voigt 100.300, damper 100.000",
    ]
    table = list(tables([found, found]))
    assert "| kelvin_voigt | 2 | 2 | 0.5 | 0 | 0 |" in table
    assert "| maxwell | 2 | 0 | 0 | 2 | 0 |" in table
    pairs = 2 * len(PAIRS["elements are zero"])
    assert f"| elements are zero | {pairs} | 2 | 0.3 |" in table
