"""Limits are where their definition has them; sets in parts, and optima that were missed."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.least_squares import FINE
from biogrip.fit.trace_fit import TraceFit
from biogrip.judging.constrained_fits import ConstrainedFits
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.profiles import Profile, compute_profiles, find_gaps
from biogrip.judging.quantities import parameters_and_sum
from biogrip.judging.verdicts import DETERMINED, Finding
from biogrip.physics.models import MODELS
from biogrip.physics.response import step_response, superpose
from biogrip.physics.sample_model import with_fixed
from biogrip.stages.intervals import judge_quantities
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    TORQUE,
    clean,
    likelihood_of,
    posed_for,
    problem,
    run,
)
from tests.helpers.scipy_fits import rise_with_held

QUANTITIES = parameters_and_sum(MODEL)


def likelihood_for(case: str, seed: int) -> Likelihood:
    """What the limits of a simulated trace are measured against."""
    return likelihood_of(problem(case, seed, rate_Hz=10.0), seed)


def test_an_optimum_that_was_missed_is_judged_again() -> None:
    maxwell = MODELS["maxwell"]
    times, response = clean("liquid_drop_2")
    noise = 0.1 * response.max() * np.random.default_rng(2).standard_normal(len(times))
    experiment = posed_for(maxwell, times, response + noise)
    found = run("least_squares", experiment)
    elsewhere = found.parameters * np.array([1.1, 1.02])
    misfit = float(experiment.residuals.misfit(elsewhere[None])[0])
    missed = replace(found, parameters=elsewhere, misfit=misfit)
    right, again = (diagnose(experiment, maxwell, f, confidence=0.95) for f in (found, missed))
    assert again.likelihood.misfit == pytest.approx(right.likelihood.misfit, rel=1e-9)
    # Coverage is tested with limits of the same fit.
    fit = TraceFit(experiment, missed, None, np.zeros(len(times), bool))
    (alike,) = judge_quantities([fit], parameters_and_sum(maxwell), 0.95)
    assert alike.likelihood.misfit == again.likelihood.misfit
    for one, other in zip(alike.findings, again.findings, strict=True):
        assert (one.low, one.high) == (other.low, other.high)
    for one, other in zip(right.findings, again.findings, strict=True):
        assert one.verdict == DETERMINED
        assert other.profile.low == pytest.approx(one.profile.low, abs=1e-6)
        assert other.profile.high == pytest.approx(one.profile.high, abs=1e-6)


@pytest.mark.parametrize("label", ["k", "c", "c_p", "c + c_p"])
def test_a_held_fit_is_scipys(label: str) -> None:
    likelihood = likelihood_for("endothelial_cell", 1)
    (quantity,) = (q for q in QUANTITIES if q.label == label)
    fits, one = ConstrainedFits([likelihood], [quantity]), np.zeros(1, dtype=np.int64)
    for away in (-0.3, 0.1):
        target = quantity.log(likelihood.best) + away
        (increase,), (x,) = fits.at(one, np.array([target]), likelihood.best[None], FINE)
        assert quantity.log(x) == pytest.approx(target, abs=1e-11)
        scipys, _ = rise_with_held(likelihood, quantity, target, likelihood.best)
        assert increase == pytest.approx(scipys, abs=0.02)


def parabolas(values: Array) -> Array:
    """Two basins about -2 and 2, whose square roots are straight."""
    increases: Array = np.minimum((values + 2) ** 2, (values - 2) ** 2)
    return increases


def test_a_set_in_two_parts_has_a_gap_that_its_verdict_names() -> None:
    values = np.linspace(-5, 5, 101)
    (gap,) = find_gaps(values, parabolas(values), 1.0)
    assert gap == pytest.approx((-1.0, 1.0))
    assert find_gaps(values, parabolas(values), 4.5) == ()
    # What is above the threshold by no more than fits are good to, a hundredth of it, is none.
    assert find_gaps(values, np.minimum(parabolas(values), 1.005), 1.0) == ()
    assert len(find_gaps(values, np.minimum(parabolas(values), 1.02), 1.0)) == 1
    whole = Profile(values, parabolas(values), 2.0, -3.0, 3.0, np.zeros(4))
    parts = replace(whole, gaps=(gap,))
    words = [Finding(QUANTITIES[0], profile, 0.1).words() for profile in (whole, parts)]
    said = "determined only to 2.6 decades: 7.4 N/m (0.05 to 20)"
    assert words == [said, f"{said}, except 0.368 to 2.72 N/m"]


@pytest.mark.parametrize(("k_p", "stated"), [(0.0, False), (5.0, True)])
def test_a_sum_whose_condition_the_best_fit_breaks_is_not_stated(k_p: float, stated: bool) -> None:
    """A branch of 4 s beside a spring that is declared to be none: the branch takes its part."""
    times, _ = clean("liquid_drop_1")
    sample = {"k": 20.0, "k_p": 5.0, "c": 80.0, "c_p": 0.001}
    response = superpose(step_response(GRIPPER, MODEL.sample(sample)), TORQUE, times)[0]
    noise = 3e-6 * np.random.default_rng(0).standard_normal(len(times))
    model = with_fixed(MODEL, {"k_p": k_p})
    posed = posed_for(model, times, response + noise)
    told = diagnose(posed, model, run("least_squares", posed), confidence=0.95)
    total = next(each for each in told.findings if each.quantity.label == "c + c_p")
    assert (total.verdict == DETERMINED) == stated
    assert ("a branch of the best fit relaxes in" in total.words()) != stated
    if total.low and total.high:
        assert total.low < 80.001 < total.high
        assert total.high > 1.001 * total.low


def test_no_limit_is_said_only_of_what_has_none() -> None:
    """A profile that ends between 95 and 99.9 % has no limit, yet not every value fits."""
    likelihood = likelihood_for("liquid_drop_1", 0)
    k = QUANTITIES[:1]
    ((plain,),) = compute_profiles([likelihood], k, smooth=False)
    rise = max(plain.increases[[0, -1]])
    said = []
    for wanted in (2.0, 7.0):
        noise_sd = likelihood.noise_sd * np.sqrt(rise / wanted)
        ((found,),) = compute_profiles([replace(likelihood, noise_sd=noise_sd)], k, smooth=False)
        assert (found.low, found.high) == (None, None)
        assert max(found.increases[[0, -1]]) == pytest.approx(wanted, rel=0.05)
        said.append(Finding(QUANTITIES[0], found, 0.1).words())
    assert said[0] == "not determined: the trace sets no limit within the search range"
    assert said[1].startswith("not determined: towards an end of the search range the fit is worse")
    assert said[1].endswith("and a limit takes 10.8)")
