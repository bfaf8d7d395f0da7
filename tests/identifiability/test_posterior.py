"""Samples of posteriors and evidence against quadrature, on models with few parameters."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, simpson

from biogrip.arrays import Array
from biogrip.experiment.sample import MODELS, with_fixed
from biogrip.identifiability.evidence import compute_evidence
from biogrip.identifiability.posterior import Posterior
from biogrip.identifiability.posterior_settings import LogNormal, PosteriorSettings
from biogrip.identifiability.prior import make_prior
from biogrip.identifiability.sampling import Samples, sampled
from biogrip.identify.answer import silent
from biogrip.identify.problem import Problem
from tests.helpers.problems import MODEL, case_problem, clean, posed_for, run

SETTINGS = PosteriorSettings(walkers=60, most_steps=10_000)
FEW = PosteriorSettings(walkers=20, most_steps=1000)


def trace_of(case: str) -> tuple[Array, Array]:
    times, response = clean(case)
    rng = np.random.default_rng([11, len(case)])
    return times, response + 0.1 * response.max() * rng.standard_normal(len(times))


def posterior_of(problem: Problem, told: dict[str, LogNormal] | None = None) -> Posterior:
    model = problem.residuals.model
    return Posterior(problem, make_prior(model, problem.low, problem.high, told or {}))


def sample(posterior: Posterior, seed: int = 0, settings: PosteriorSettings = SETTINGS) -> Samples:
    return sampled(posterior, settings, np.random.default_rng(seed), silent)


@pytest.mark.parametrize("told", [{}, {"k": LogNormal(0.9, 0.05)}], ids=["flat", "told"])
def test_a_maxwell_liquid_against_quadrature(told: dict[str, LogNormal]) -> None:
    """Two parameters: marginals and evidence by Simpson's rule about the optimum."""
    problem = posed_for(MODELS["maxwell"], *trace_of("liquid_drop_2"))
    posterior = posterior_of(problem, told)
    best = np.log(run("least_squares", problem).parameters)
    k, c = best[0] + np.linspace(-4, 4, 801), best[1] + np.linspace(-0.5, 0.5, 801)
    points = np.stack(np.meshgrid(k, c, indexing="ij"), axis=-1).reshape(-1, 2)
    density = posterior.log_density(points).reshape(801, 801)
    largest = density.max()
    # Nothing that counts is outside.
    edge = max(density[0].max(), density[-1].max(), density[:, 0].max(), density[:, -1].max())
    assert edge < largest - 20
    plane = np.exp(density - largest)
    along = [simpson(plane, c, axis=1), simpson(plane, k, axis=0)]
    whole = simpson(along[0], k)
    found = sample(posterior)
    assert found.convergence.reached
    for column, axis, marginal in zip(range(2), (k, c), along, strict=True):
        cumulated = cumulative_simpson(marginal, x=axis, initial=0) / whole
        for level in (0.025, 0.25, 0.5, 0.75, 0.975):
            share = np.mean(found.log_parameters[:, :, column] <= np.interp(level, cumulated, axis))
            # Four standard deviations of as many independent samples as are claimed.
            few = min(found.convergence.bulk, found.convergence.tail)
            assert share == pytest.approx(level, abs=4 * np.sqrt(level * (1 - level) / few))
    evidence = compute_evidence(posterior, found, np.random.default_rng(1))
    assert evidence.reliable
    assert evidence.error < 0.02
    assert evidence.log == pytest.approx(largest + np.log(whole), abs=4 * evidence.error + 1e-3)


def test_both_arms_of_a_valley_are_found() -> None:
    """Drop 1, k_p known: c small and c_p 10, or c 10 and c_p small, over decades each.

    By Simpson's rule over k, the sum's logarithm and the ratio's, in which the valley
    is straight; the volume is the same. Steps half as long change the fifth digit.
    """
    times, trace = trace_of("liquid_drop_1")
    problem = posed_for(with_fixed(MODEL, {"k_p": 1e-4}), times, trace)
    posterior = posterior_of(problem)
    low, high = problem.low, problem.high
    k = np.linspace(low[0], high[0], 81)
    total = np.log(10.0) + np.linspace(-0.15, 0.15, 31)
    ratio = np.linspace(low[1] - high[2], high[1] - low[2], 361)
    density = np.empty((len(k), len(total), len(ratio)))
    for index, value in enumerate(k):
        s, r = (grid.ravel() for grid in np.meshgrid(total, ratio, indexing="ij"))
        c_p = s - np.logaddexp(0.0, r)
        points = np.stack([np.full_like(s, value), c_p + r, c_p], axis=1)
        density[index] = posterior.log_density(points).reshape(len(total), -1)
    weights = np.exp(density - density.max())
    by_ratio = simpson(simpson(weights, k, axis=0), total, axis=0)
    # Where the sum is not within the grid, the branch is too weak and slow to be seen.
    found = sample(posterior)
    assert found.convergence.reached
    x = found.log_parameters.reshape(-1, 3)
    inside = np.abs(np.logaddexp(x[:, 1], x[:, 2]) - np.log(10.0)) <= 0.15
    assert np.mean(inside) > 0.9
    ratios = (x[:, 1] - x[:, 2])[inside]
    for split in (-5.0, 0.0, 5.0):
        wanted = simpson(np.where(ratio < split, by_ratio, 0.0), ratio) / simpson(by_ratio, ratio)
        assert 0.05 < wanted < 0.95
        deviation = np.sqrt(wanted * (1 - wanted) / found.convergence.bulk)
        # And the half of a step, over which the rule smears the split.
        assert np.mean(ratios < split) == pytest.approx(wanted, abs=4 * deviation + 0.01)


def few_samples(seed: int) -> Samples:
    (problem,) = case_problem(*clean("liquid_drop_1"), 1)
    return sample(posterior_of(problem), seed, FEW)


@pytest.fixture(scope="module")
def few() -> Samples:
    return few_samples(5)


def test_the_same_stream_gives_the_same_samples(few: Samples) -> None:
    other, another = (few_samples(seed).log_parameters for seed in (5, 6))
    assert few.log_parameters.tobytes() == other.tobytes()
    assert few.log_parameters.tobytes() != another.tobytes()


def test_sampling_stops_at_its_limit_and_says_so(few: Samples) -> None:
    assert len(few.log_parameters) <= 500
    assert "have not converged" in few.convergence.words()
    assert "posterior.most_steps" in few.convergence.words()
