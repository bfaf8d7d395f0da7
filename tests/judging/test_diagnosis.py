"""A better optimum is taken up; and what is said of jaws that pull and of arms that ring."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.judging.diagnosis import _pulling, _ringing, diagnose
from biogrip.judging.likelihood import make_likelihood
from biogrip.physics.models import MODELS
from biogrip.physics.sample_model import Network
from biogrip.physics.simulation import Grip
from tests.helpers.default import seen
from tests.helpers.problems import MODEL, clean, pose_noisy, run

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
    (taken,) = diagnose(problem, DAMPER, missed, confidence=0.95).likelihood.best
    assert np.exp(taken) == pytest.approx(elsewhere[0] if rise < 0.05 else best.parameters[0])


@pytest.mark.parametrize(("last_s", "notes"), [(199.0, 0), (200.0, 1)])
def test_jaws_that_pull_after_the_last_reading_are_not_told(last_s: float, notes: int) -> None:
    assert len([*_pulling(Grip(1e-6, -1e-7, 200.0, 200.0), last_s)]) == notes
    assert [*_pulling(Grip(1e-6, 1e-7, 200.0, None), last_s)] == []


@pytest.mark.parametrize(("low", "least"), [(None, 0.0), (2.0, 2.0)])
def test_arms_ring_as_beside_the_least_damper_that_the_trace_allows(
    low: float | None, least: float
) -> None:
    dampers: list[Array] = []

    def ring(network: Network, _: float) -> Any:
        dampers.append(network.c_p)

    judged = seen(
        likelihood=seen(
            problem=seen(residuals=seen(model=MODEL, ring=ring, noise_scale=1.0)),
            best=np.zeros(4),
            independent=np.inf,
            noise_sd=1.0,
        ),
        findings=[seen(quantity=seen(label="c_p"), low=low, value=3.0)],
    )
    assert [*_ringing(judged, rejected=False)] == []
    assert dampers == [[least]]
