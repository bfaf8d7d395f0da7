"""Noise, thresholds, bounds, verdicts and notes, by hand and against closed forms."""

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.judging.diagnosis import Diagnosis, _pulling, _ringing, diagnose
from biogrip.judging.likelihood import (
    Likelihood,
    characteristic_times,
    check_rows,
    covariance,
    find_combinations,
    least_sd,
    make_likelihood,
    parameters_and_sum,
)
from biogrip.judging.profiles import BOUNDED_ABOVE, DETERMINED, NOT_DETERMINED
from biogrip.physics.models import CANDIDATES, MODELS, Sample
from biogrip.physics.response import Grip
from biogrip.physics.sample_model import Network
from tests.helpers.default import seen
from tests.helpers.problems import (
    MODEL,
    SAMPLES,
    clean,
    diagnosis_of,
    likelihood_of,
    pose_noisy,
    problem,
    run,
)


def test_a_parameter_without_information_is_taken_as_known() -> None:
    t = np.linspace(0.0, 1.0, 100)
    j = np.stack((t, 1e-9 * t**2))
    spring, damper = parameters_and_sum(MODELS["maxwell"])
    assert np.diag(covariance(j, 0.1)) == pytest.approx([0.01 / np.sum(t**2), np.inf])
    assert math.isinf(least_sd(j, 0.1, np.zeros(2), damper))
    assert math.isinf(least_sd(0 * j, 0.1, np.zeros(2), spring))


def test_covariances_of_few_readings() -> None:
    """Of parameters told to less than an e-fold, too; in noise that grows, of an unweighted fit."""
    found = covariance(np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]]), 1.0)
    assert found == pytest.approx(np.array([[2.0, -1.0], [-1.0, 2.0]]) / 3)
    # (10^2 + 20^2 3^2) / (10^2 + 20^2)^2.
    grows = covariance(np.array([[10.0, 20.0]]), np.array([1.0, 3.0]))
    assert grows[0, 0] == pytest.approx(3700 / 500**2)


def test_quantities_and_their_gradients() -> None:
    """Ranges are of parameters from 1/e to e^2 times the values."""
    for form, value, low, high in (
        # From a sum one spring can be absent; in a row the others can be rigid.
        ("sum", 5.0, np.log(5.0) - 1, np.log(3.0) + 2),
        ("series", 1.2, np.log(2.0) - 1, np.log(1.2) + 2),
        ("time", 40 / 3, np.log(40 / 3) - 3, np.log(40 / 3) + 3),
        ("parameter", 200.0, np.log(200.0) - 1, np.log(200.0) + 2),
    ):
        model = Sample("burgers").model
        x = np.log([3.0, 200.0, 2.0, 40.0])
        springs, times = find_combinations(model, [0, 2]), find_combinations(model, [0, 3])
        every = {"sum": springs[0], "series": springs[1], "time": times[0]}
        quantity = (every | {"parameter": parameters_and_sum(model)[1]})[form]
        assert math.exp(quantity.log(x)) == pytest.approx(value, rel=1e-12)
        slopes = [(quantity.log(x + h) - quantity.log(x - h)) / 2e-6 for h in 1e-6 * np.eye(4)]
        assert quantity.gradient(x) == pytest.approx(np.array(slopes), abs=1e-8)
        assert quantity.range(x - 1, x + 2) == pytest.approx((low, high))


@functools.cache
def told(case: str) -> Diagnosis:
    return diagnosis_of(problem(case, 4, rate_Hz=10.0))


YES, ABOVE, NO = DETERMINED, BOUNDED_ABOVE, NOT_DETERMINED


@pytest.mark.parametrize(
    ("case", "verdicts"),
    [
        ("endothelial_cell", [YES, YES, YES, ABOVE, YES]),
        ("liquid_drop_1", [NO, ABOVE, NO, ABOVE, YES]),
        ("liquid_drop_2", [YES, ABOVE, YES, ABOVE, YES]),
    ],
)
def test_verdicts_on_the_papers_cases(case: str, verdicts: list[str]) -> None:
    diagnosis = told(case)
    assert [finding.verdict for finding in diagnosis.findings] == verdicts
    pulls = case != "endothelial_cell"
    assert ["would have to pull" in note.text for note in diagnosis.notes] == [True] * pulls
    trades = [(trade.members, trade.finding.quantity.label) for trade in diagnosis.trades]
    assert trades == ([(("c", "c_p"), "c + c_p")] if case == "liquid_drop_1" else [])
    total = diagnosis.findings[-1]
    truth = SAMPLES[case]["c"] + SAMPLES[case]["c_p"]
    # Wider than the 95 % interval: one seed must not decide.
    assert (total.low or np.inf) * 0.98 < truth < (total.high or 0.0) * 1.02


def test_elements_of_spring_and_damper_have_a_time() -> None:
    for candidate, found in (
        ("generalized_maxwell_2", {"tau_1": "c_1/k_1", "tau_2": "c_2/k_2"}),
        ("burgers", {"tau_s": "c_s/k_s", "tau_v": "c_v/k_v"}),
        ("kelvin_voigt", {"tau_p": "c_p/k_p"}),
        ("springpot_beside_damper", {}),
    ):
        model = CANDIDATES[candidate].model
        times, logs = characteristic_times(model), np.log(model.example)
        own = {each.label: "/".join(model.names[it] for it in each.members) for each in times}
        assert own == found
        assert all(each.log(logs) == logs[list(each.members)] @ [1, -1] for each in times)


@pytest.mark.parametrize("name", ["springpots_in_series", "springpots_in_parallel"])
def test_the_larger_exponent_is_that_of_the_first_springpot(name: str) -> None:
    """Quantities of two springpots are penalised where the exponents exchange their order."""
    for q in parameters_and_sum(MODELS[name]):
        (penalty,) = q.penalties
        late = [penalty.form(4) @ np.log([9.0, alpha, 2.0, 0.5]) for alpha in (0.4, 0.6)]
        assert late == pytest.approx([np.log(0.5 / 0.4), np.log(0.5 / 0.6)])
        assert penalty.allowed(400.0) == 0


DAMPER = MODELS["damper"]


@pytest.mark.parametrize("rise", [0.02, 0.2])
def test_an_optimum_is_one_to_a_twentieth_of_chi_squared(rise: float) -> None:
    """Profiles find what is lower by more, and all is done again from there."""
    (problem,) = pose_noisy(*clean("liquid_drop_2"), 1, DAMPER)
    best = run("least_squares", problem)
    likelihood = make_likelihood(problem, np.log(best.parameters), best.misfit, confidence=0.95)
    slopes = problem.residuals(likelihood.best)[1] / likelihood.noise_sd
    elsewhere = best.parameters * np.exp(np.sqrt(rise) / np.linalg.norm(slopes))
    misfit = float(problem.residuals.misfit(elsewhere[None])[0])
    assert likelihood.increase(misfit) == pytest.approx(rise, rel=0.1)
    missed = replace(best, parameters=elsewhere, misfit=misfit)
    (taken,) = diagnose(problem, missed, confidence=0.95).likelihood.best
    assert np.exp(taken) == pytest.approx(elsewhere[0] if rise < 0.05 else best.parameters[0])


@pytest.mark.parametrize(("last_s", "notes"), [(199.0, 0), (200.0, 1)])
def test_jaws_that_pull_after_the_last_reading_are_not_told(last_s: float, notes: int) -> None:
    assert len([*_pulling(Grip(1e-6, -1e-7, 200.0, 200.0), last_s)]) == notes
    assert [*_pulling(Grip(1e-6, 1e-7, 200.0, None), last_s)] == []


@pytest.mark.parametrize(("low", "least"), [(None, 0.0), (2.0, 2.0)])
def test_arms_ring_as_beside_the_least_damper_allowed(low: float | None, least: float) -> None:
    dampers: list[Array] = []

    def ring(network: Network, _: float) -> Any:
        dampers.append(network.c_p)

    problem = seen(residuals=seen(model=MODEL, ring=ring, noise_scale=1.0))
    known = seen(problem=problem, best=np.zeros(4), independent=np.inf, noise_sd=1.0)
    found = seen(quantity=seen(label="c_p"), low=low, value=3.0)
    judged = seen(likelihood=known, findings=[found])
    assert [*_ringing(judged, rejected=False)] == []
    assert dampers == [[least]]


def likelihood_with(freedom: float) -> Likelihood:
    """Of 100 readings, three parameters and a noise model that is known with some freedom."""
    residuals = seen(samples=100, free=100, freedom=freedom)
    return make_likelihood(seen(residuals=residuals), np.zeros(3), 2.0, confidence=0.95)


def test_a_noise_model_that_is_hardly_known_widens_limits() -> None:
    """To Student's t of its own freedom at 97.5 %, from tables; so does a misfit.

    A limit takes as many times the threshold as of known noise: 3.2905^2 over 1.96^2.
    """
    found = likelihood_with(8.0)
    assert found.threshold == pytest.approx(2.306**2, rel=1e-3)
    assert found.noise_sd == pytest.approx(2.0 * np.sqrt(100 / 97))
    found = likelihood_with(np.inf).as_misfit(independent=25.0, freedom=8.0)
    assert found.noise_sd == pytest.approx(4.0)
    assert found.threshold == pytest.approx(2.306**2, rel=1e-3)
    assert found.certainty / found.threshold == pytest.approx(3.2905**2 / 1.96**2, rel=1e-4)


def test_parameters_that_stand_for_one_another_have_no_bounds() -> None:
    """Of c and c_p a trace shows 9.9 c + 0.1 c_p, of k itself: the sum alone has a bound.

    The third row moves along with the second, so that their logarithms trade: 9.9 to 0.1.
    """
    rows = np.array([[300.0, 0.0], [0.0, 9.9 * 500], [0.0, 0.1 * 500]])
    shares = np.array([0.0, 0.99, 0.01])
    found = np.diag(covariance(rows, 1.0, np.vstack([np.eye(3), shares])))
    assert found == pytest.approx([1 / 300**2, np.inf, np.inf, 1 / 5000**2])
    inverse = np.diag(covariance(rows, 1.0, -np.eye(3)))
    assert inverse == pytest.approx([1 / 300**2, np.inf, np.inf])


def test_what_a_trace_without_noise_tells_may_outweigh_every_prior() -> None:
    """Two parameters of which it tells the sum, to 1e-12: their prior is lost in rounding."""
    rows = np.array([[[0.0], [1e12], [1e12]]])
    residuals = seen(samples=100, free=100, freedom=np.inf, condensed_responses=lambda best: rows)
    given = seen(residuals=residuals), np.zeros(2), 1.0
    likelihood = make_likelihood(*given, confidence=0.95, noise_sd=1.0)
    total = seen(gradient=lambda best: np.ones(2))
    assert likelihood.deviation(total) == pytest.approx(1e-12, rel=1e-6, abs=0)


def test_rows_of_another_misfit_than_that_of_the_readings_have_no_limits() -> None:
    """A reading is moved behind the back of the rows, by four standard deviations of the noise."""
    likelihood = likelihood_of(problem("liquid_drop_1", 0))
    check_rows(likelihood)
    residuals = likelihood.problem.residuals
    readings = residuals.trace.readings + 0.0
    readings[7] += 4 * likelihood.noise_sd
    moved = replace(residuals.trace, readings=readings)
    moved.__dict__["rows"] = residuals.trace.rows
    posed = replace(likelihood.problem, residuals=replace(residuals, trace=moved))
    with pytest.raises(ArithmeticError, match="stand for readings with"):
        check_rows(replace(likelihood, problem=posed))
