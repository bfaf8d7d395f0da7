"""Confidence limits are where their definition has them, whatever the random starts."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.fit.local_fits import FINE
from biogrip.judging.constrained_fits import ConstrainedFits
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.limits import find_limits
from biogrip.judging.quantities import parameters_and_sum
from biogrip.judging.verdicts import DETERMINED
from biogrip.physics.models import MODELS
from tests.helpers.definition import FitConstraint
from tests.helpers.limits import (
    ALIKE,
    ALLOWED,
    NAMES,
    differences,
    example,
    likelihood_for,
    limits_of,
    misses,
)
from tests.helpers.problems import MODEL, clean, posed_for, run

QUANTITIES = parameters_and_sum(MODEL)


@pytest.mark.parametrize(
    ("case", "seed"), [("endothelial_cell", 0), ("liquid_drop_1", 4), ("liquid_drop_2", 0)]
)
@pytest.mark.nightly
def test_the_rise_at_a_limit_is_the_threshold(case: str, seed: int) -> None:
    found = list(misses(likelihood_for(case, seed), QUANTITIES))
    assert len(found) >= 8
    assert [miss for miss in found if abs(miss[-1]) > ALLOWED] == []


@pytest.mark.nightly
def test_the_name_of_a_trace_changes_no_limit() -> None:
    """Fast limits of all names, and two profiles of the two whose optima differ most."""
    likelihoods = [example(name) for name in NAMES]
    best = np.array([likelihood.best for likelihood in likelihoods])
    assert np.ptp(best, axis=0).max() < 1e-7
    fast = find_limits(likelihoods, QUANTITIES)[0]
    assert differences(fast).max() < ALIKE
    away = np.abs(best - best[0]).max(axis=1)
    two = QUANTITIES[0], QUANTITIES[4]
    pair = [limits_of(likelihoods[i], two) for i in (0, int(np.argmax(away)))]
    assert differences(np.array(pair)).max() < ALIKE
    assert [miss for miss in misses(likelihoods[3], two) if abs(miss[-1]) > ALLOWED] == []


def test_an_optimum_that_was_missed_is_judged_again() -> None:
    maxwell = MODELS["maxwell"]
    times, response = clean("liquid_drop_2")
    noise = 0.1 * response.max() * np.random.default_rng(2).standard_normal(len(times))
    case_problem = posed_for(maxwell, times, response + noise)
    found = run("least_squares", case_problem)
    elsewhere = found.parameters * np.array([1.1, 1.02])
    misfit_rad = float(case_problem.misfit(elsewhere[None])[0])
    missed = replace(found, parameters=elsewhere, misfit_rad=misfit_rad)
    right, again = (diagnose(case_problem, maxwell, f, confidence=0.95) for f in (found, missed))
    assert again.likelihood.misfit_rad == pytest.approx(right.likelihood.misfit_rad, rel=1e-9)
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
        scipys, _ = FitConstraint(likelihood, quantity, target).fitted(likelihood.best)
        assert increase == pytest.approx(scipys, abs=0.02)
