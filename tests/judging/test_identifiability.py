"""Bounds, profiles and verdicts, against closed forms, simulation and exhaustive search."""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from biogrip.judging.diagnosis import Diagnosis, diagnose
from biogrip.judging.likelihood import Likelihood, bound, covariance
from biogrip.judging.profiles import _increases, compute_valley
from biogrip.judging.quantities import characteristic_times, find_combinations, parameters_and_sum
from biogrip.judging.verdicts import BOUNDED_ABOVE, BOUNDED_BELOW, DETERMINED, NOT_DETERMINED
from biogrip.physics.models import CANDIDATES, MODELS, Sample
from biogrip.physics.response import step_response, superpose
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    SAMPLES,
    TORQUE,
    clean,
    pose_noisy,
    posed_for,
    problem,
    run,
)

DAMPER = MODELS["damper"]


def test_a_parameter_without_information_is_taken_as_known() -> None:
    t = np.linspace(0.0, 1.0, 100)
    j = np.stack((t, 1e-9 * t**2))
    found = covariance(j, 0.1)
    assert found[0, 0] == pytest.approx(0.01 / np.sum(t**2))
    assert math.isinf(found[1, 1])
    assert math.isinf(bound(j, 0.1, np.zeros(2), parameters_and_sum(MODELS["maxwell"])[1]))
    none = np.zeros((2, 100))
    assert math.isinf(bound(none, 0.1, np.zeros(2), parameters_and_sum(MODELS["maxwell"])[0]))


@pytest.mark.parametrize("form", ["sum", "series", "time", "parameter"])
def test_quantities_and_their_gradients(form: str) -> None:
    model = Sample("burgers").model
    x = np.log([3.0, 200.0, 2.0, 40.0])
    k_s, c_s, k_v, c_v = np.exp(x)
    springs, times = find_combinations(model, [0, 2]), find_combinations(model, [0, 3])
    quantity, value = {
        "sum": (springs[0], k_s + k_v),
        "series": (springs[1], k_s * k_v / (k_s + k_v)),
        "time": (times[0], c_v / k_s),
        "parameter": (parameters_and_sum(model)[1], c_s),
    }[form]
    assert math.exp(quantity.log(x)) == pytest.approx(value, rel=1e-12)
    for index in range(4):
        h = 1e-6 * np.eye(4)[index]
        slope = (quantity.log(x + h) - quantity.log(x - h)) / 2e-6
        assert quantity.gradient(x)[index] == pytest.approx(slope, abs=1e-8)
    low, high = quantity.range(x - 1, x + 2)
    # What the other members are is all the same: of a sum nothing, in series rigid.
    others = {"sum": -50.0, "series": 50.0}.get(form)
    places = (3 * np.array(place) - 1.0 for place in np.ndindex(2, 2, 2, 2))
    corners = [quantity.log(x + place) for place in places]
    alone = []
    for member in quantity.members if others is not None else ():
        for place in (-1.0, 2.0):
            at = x.copy()
            at[list(quantity.members)] = others
            at[member] = x[member] + place
            alone.append(quantity.log(at))
    assert low == pytest.approx(min(alone if form == "series" else corners))
    assert high == pytest.approx(max(alone if form == "sum" else corners))


@functools.cache
def told(case: str) -> tuple[Diagnosis, Likelihood]:
    posed = problem(case, 4, rate_Hz=10.0)
    found = run("least_squares", posed)
    diagnosis = diagnose(posed, MODEL, found, confidence=0.95)
    return diagnosis, diagnosis.likelihood


@pytest.mark.parametrize(
    ("case", "verdicts"),
    [
        ("endothelial_cell", [DETERMINED, DETERMINED, DETERMINED, BOUNDED_ABOVE, DETERMINED]),
        (
            "liquid_drop_1",
            [NOT_DETERMINED, BOUNDED_ABOVE, NOT_DETERMINED, BOUNDED_ABOVE, DETERMINED],
        ),
        ("liquid_drop_2", [DETERMINED, BOUNDED_ABOVE, DETERMINED, BOUNDED_ABOVE, DETERMINED]),
    ],
)
def test_verdicts_on_the_papers_cases(case: str, verdicts: list[str]) -> None:
    diagnosis, _ = told(case)
    assert [finding.verdict for finding in diagnosis.findings] == verdicts
    pulls = case != "endothelial_cell"
    assert ["would have to pull" in note.text for note in diagnosis.notes] == [True] * pulls
    trades = [(trade.members, trade.finding.quantity.label) for trade in diagnosis.trades]
    assert trades == ([(("c", "c_p"), "c + c_p")] if case == "liquid_drop_1" else [])
    total = diagnosis.findings[-1]
    assert total.low is not None
    assert total.high is not None
    truth = SAMPLES[case]["c"] + SAMPLES[case]["c_p"]
    # Wider than the 95 % interval: one seed must not decide.
    assert total.low * 0.98 < truth < total.high * 1.02


@pytest.mark.parametrize(
    ("candidate", "found"),
    [
        ("generalized_maxwell", {"tau": "c/k"}),
        ("generalized_maxwell_2", {"tau_1": "c_1/k_1", "tau_2": "c_2/k_2"}),
        ("burgers", {"tau_s": "c_s/k_s", "tau_v": "c_v/k_v"}),
        ("kelvin_voigt", {"tau_p": "c_p/k_p"}),
        ("damper", {}),
        ("springpot_beside_damper", {}),
    ],
)
def test_elements_of_spring_and_damper_have_a_time(candidate: str, found: dict[str, str]) -> None:
    model = CANDIDATES[candidate].model
    times = characteristic_times(model)
    quotients = ("/".join(model.names[index] for index in each.members) for each in times)
    assert dict(zip([each.label for each in times], quotients, strict=True)) == found
    logs = np.log(model.example)
    assert all(each.log(logs) == logs[list(each.members)] @ [1, -1] for each in times)


def test_a_bare_damper_is_known_from_one_side_by_a_spring_it_hides() -> None:
    """A stiff Maxwell liquid, seen slowly: its damper is determined, its spring bounded below."""

    times, _ = clean("liquid_drop_1")
    response = superpose(step_response(GRIPPER, DAMPER.network([[10.0]])), TORQUE, times)[0]
    noise = 1e-5 * np.random.default_rng(0).standard_normal(len(times))
    maxwell = MODELS["maxwell"]
    posed = posed_for(maxwell, times, response + noise)
    diagnosis = diagnose(posed, maxwell, run("least_squares", posed), confidence=0.95)
    k, c = diagnosis.findings
    assert (k.verdict, c.verdict) == (BOUNDED_BELOW, DETERMINED)
    assert "only bounded below: at least" in k.words()
    assert c.words().startswith("determined: 9.996 N s/m (")


@pytest.mark.parametrize(("times", "said"), [(0.5, True), (1.1, False), (1.5, False), (2.5, True)])
def test_a_noise_that_leaves_more_than_it_is_is_doubted(times: float, said: bool) -> None:
    """But of a trace without noise nothing is left at all, whatever noise it is held against."""
    at, response = clean("liquid_drop_2")
    (noisy,) = pose_noisy(at, response, 1, DAMPER)
    found = run("least_squares", noisy)
    noise_sd = times * found.misfit
    exact = posed_for(DAMPER, at, noisy.residuals.response(np.log(found.parameters)))
    many = f"{times:.2g} times what the fit leaves" if times > 1 else "2 times the noise that was"
    for posed, doubted in ((noisy, said), (exact, False)):
        fit = run("least_squares", posed)
        told = diagnose(posed, DAMPER, fit, confidence=0.95, noise_sd=noise_sd)
        assert any(many in note.text for note in told.notes) == doubted


def test_the_valley_is_as_deep_along_the_sum_as_the_profile_says() -> None:
    diagnosis, likelihood = told("liquid_drop_1")
    valley, _ = compute_valley(likelihood, MODEL)
    assert valley is not None
    along, arm = ({key: np.array(grid[key]) for key in grid} for grid in valley["grids"])
    increases = along["increases"]
    sums = along["x_values"] + along["y_values"]
    best = float(np.exp(diagnosis.findings[-1].profile.best))
    on = np.abs(sums / best - 1) < 1e-4
    assert np.all(increases[on] < likelihood.certainty)
    assert np.all(increases[sums / best < 0.93] > likelihood.certainty)
    assert increases.min() > -0.1
    # Beyond the sum a weak, slow branch hides any c: c_p alone is what the sum was.
    beyond = arm["x_values"] > 0.5 * best
    lowest = [
        arm["increases"][:, i].min() for i in range(arm["increases"].shape[1]) if beyond[0, i]
    ]
    assert max(lowest) < likelihood.certainty
    assert np.ptp(lowest) < 0.5
    assert compute_valley(likelihood, MODELS["maxwell"]) == (None, None)
    # A point of the valley that lies below what was taken for the best fit is told.
    c, c_p = np.exp(likelihood.best[2:, None, None])
    for times, expected in ((1.0, None), (1.01, pytest.approx(likelihood.best, abs=1e-3))):
        above = replace(likelihood, misfit=times * likelihood.misfit)
        assert _increases(above, [2, 3], c * [[0.9, 1.0, 1.1]], c_p * np.ones(3))[1] == expected


def test_the_larger_exponent_is_that_of_the_first_springpot() -> None:
    """Quantities of two springpots are penalised where the exponents exchange their order."""
    for name in ("springpots_in_series", "springpots_in_parallel"):
        for q in parameters_and_sum(MODELS[name]):
            (penalty,) = q.penalties
            late = [penalty.form(4) @ np.log([9.0, alpha, 2.0, 0.5]) for alpha in (0.4, 0.6)]
            assert late == pytest.approx([np.log(0.5 / 0.4), np.log(0.5 / 0.6)])
            assert penalty.allowed(400.0) == 0
