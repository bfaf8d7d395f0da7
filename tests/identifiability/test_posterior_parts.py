"""What a posterior is made of, each part against something independent."""

from typing import Any

import emcee
import numpy as np
import pytest
from scipy import integrate, stats
from scipy.special import xlogy

from biogrip.arrays import Array
from biogrip.experiment.sample import CANDIDATES, MODELS, Sample
from biogrip.identifiability.convergence import diagnose_convergence
from biogrip.identifiability.marginals import AGREES, DIFFERS, PRIOR, compute_marginals
from biogrip.identifiability.mixture import FREEDOM, Mixture, fit_mixture
from biogrip.identifiability.posterior import Posterior
from biogrip.identifiability.posterior_settings import LogNormal, PosteriorSettings
from biogrip.identifiability.prior import make_prior
from biogrip.identifiability.prior_sensitivity import (
    NOTABLE,
    compute_sensitivities,
    in_words,
    scaled,
)
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identifiability.valley_coordinates import ValleyCoordinates, valley_coordinates
from tests.helpers.problems import MODEL, problem

LOW, HIGH = np.log([0.1, 1e-3, 1.0, 1e-4]), np.log([100.0, 1e3, 1e4, 1e5])
POSTERIOR = {"k": LogNormal(5.0, 0.7), "c": LogNormal(1e5, 2.0)}


def test_the_prior_is_a_normal_distribution_cut_off_or_a_uniform_one() -> None:
    """Against SciPy's; the median of c is beyond the range."""
    prior = make_prior(MODEL, LOW, HIGH, POSTERIOR)
    own: list[Any] = [stats.uniform(a, b - a) for a, b in zip(LOW, HIGH, strict=True)]
    for index, median, spread in ((0, 5.0, 0.7), (2, 1e5, 2.0)):
        ends = (np.array([LOW[index], HIGH[index]]) - np.log(median)) / spread
        own[index] = stats.truncnorm(*ends, loc=np.log(median), scale=spread)
    drawn = prior.draw(2000, np.random.default_rng(0))
    wanted = np.sum([each.logpdf(x) for each, x in zip(own, drawn.T, strict=True)], axis=0)
    np.testing.assert_allclose(prior.log_density(drawn), wanted, rtol=1e-12)
    # One of four in a hundred thousand such tests would fail by chance; the draws are fixed.
    assert min(stats.kstest(x, each.cdf).pvalue for each, x in zip(own, drawn.T, strict=True)) > (
        1e-5
    )
    outside = drawn[:4].copy()
    outside[np.arange(4), np.arange(4)] = HIGH + 1e-9
    assert np.all(prior.log_density(outside) == -np.inf)


@pytest.mark.parametrize("name", ["generalized_maxwell_3", "springpots_in_series"])
def test_branches_come_in_their_order_and_the_prior_still_integrates_to_one(name: str) -> None:
    model = CANDIDATES[name].model
    size = len(model.names)
    low, high = np.zeros(size), np.full(size, 2.0)
    prior = make_prior(model, low, high, {})
    anywhere = np.random.default_rng(1).uniform(low, high, (100_000, size))
    density = np.exp(prior.log_density(anywhere))
    # A sixth of the points count: their share has a standard deviation of 0.7 %.
    assert np.mean(density) * 2.0**size == pytest.approx(1.0, rel=0.03)
    drawn = prior.draw(500, np.random.default_rng(2))
    assert np.all(np.isfinite(prior.log_density(drawn)))
    np.testing.assert_array_equal(
        model.in_order(np.exp(drawn)), np.tile(np.arange(size), (len(drawn), 1))
    )


@pytest.mark.parametrize("name", ["generalized_maxwell", "generalized_maxwell_3", "burgers"])
def test_straight_coordinates_lead_back_and_keep_volumes(name: str) -> None:
    model = CANDIDATES[name].model
    size = len(model.names)
    axes = valley_coordinates(model)
    points = np.random.default_rng(3).uniform(-8, 8, (20, size))
    np.testing.assert_allclose(axes.back(axes.of(points)), points, rtol=1e-12, atol=1e-12)
    low, high = axes.range(np.full(size, -8.0), np.full(size, 8.0))
    assert np.all((axes.of(points) >= low) & (axes.of(points) <= high))
    for point in points:
        # Central differences: to the square of the step.
        steps = 1e-5 * np.eye(size)
        slopes = (axes.of(point + steps) - axes.of(point - steps)) / 2e-5
        assert abs(np.linalg.det(slopes)) == pytest.approx(1.0, abs=1e-8)
    if model.exchangeable:
        members = [model.names.index(member) for member in model.exchangeable]
        total = np.log(np.sum(np.exp(points[:, members]), axis=1))
        np.testing.assert_allclose(axes.of(points)[:, members[-1]], total, atol=1e-13)


def test_a_mixture_is_one_of_t_distributions() -> None:
    rng = np.random.default_rng(4)
    factors = np.tril(rng.uniform(0.2, 1.0, (3, 2, 2)))
    mixture = Mixture(np.array([0.5, 0.3, 0.2]), rng.normal(0, 3, (3, 2)), factors)
    points = rng.normal(0, 4, (50, 2))
    parts = zip(mixture.weights, mixture.centres, factors, strict=True)
    wanted = sum(
        weight * stats.multivariate_t(centre, factor @ factor.T, FREEDOM).pdf(points)
        for weight, centre, factor in parts
    )
    np.testing.assert_allclose(mixture.log_density(points), np.log(wanted), rtol=1e-11)
    drawn = mixture.draw(20_000, rng)
    for column in range(2):
        scales = np.linalg.norm(factors[:, column], axis=1)
        shapes = list(zip(mixture.weights, mixture.centres[:, column], scales, strict=True))

        def cumulated(x: np.ndarray, shapes: list[Any] = shapes) -> Any:
            return sum(w * stats.t(FREEDOM, m, scale).cdf(x) for w, m, scale in shapes)

        assert stats.kstest(drawn[:, column], cumulated).pvalue > 1e-4


def test_a_mixture_follows_what_is_narrow_here_and_wide_there() -> None:
    """A ridge a thousand times longer than wide beside a blob: weights of both, and few wasted."""
    rng = np.random.default_rng(5)
    ridge = np.stack([rng.uniform(-10, 10, 6000), rng.normal(0, 0.01, 6000)], axis=1)
    blob = rng.normal([0, 5], 0.3, (3000, 2))
    mixture = fit_mixture(np.concatenate([ridge, blob]), rng)
    drawn = mixture.draw(20_000, rng)
    density = (2 / 3) * stats.uniform(-10, 20).pdf(drawn[:, 0])
    density *= stats.norm(0, 0.01).pdf(drawn[:, 1])
    density += stats.multivariate_normal([0, 5], 0.09 * np.eye(2)).pdf(drawn) / 3
    weights = density / np.exp(mixture.log_density(drawn))
    assert np.mean(weights) == pytest.approx(1.0, abs=0.03)
    assert np.mean(weights) ** 2 / np.mean(weights**2) > 0.5


def test_noise_of_unknown_level_is_integrated_over() -> None:
    """Against SciPy's quadrature over the level, Jeffreys' prior 1/sigma."""
    case_problem = problem("endothelial_cell", 0, rate_Hz=0.05)
    posterior = Posterior(case_problem, make_prior(MODEL, case_problem.low, case_problem.high, {}))
    samples = case_problem.residuals.samples
    misfits = np.array([2e-6, 3e-6, 5e-6])
    for misfit_rad, found in zip(misfits, posterior.log_likelihood(misfits), strict=True):

        def density(log_sigma: float, misfit_rad: float = misfit_rad) -> float:
            sigma = np.exp(log_sigma)
            exponent = -0.5 * samples * (misfit_rad / sigma) ** 2
            return (2 * np.pi * sigma**2) ** (-samples / 2) * np.exp(exponent) / 1e100

        middle = np.log(misfit_rad)
        whole, _ = integrate.quad(density, middle - 5, middle + 5, epsabs=0, epsrel=1e-10)
        assert found == pytest.approx(np.log(whole) + 100 * np.log(10), abs=1e-8)


def test_noise_of_known_level_has_its_normal_density() -> None:
    case_problem = problem("endothelial_cell", 0)
    prior = make_prior(MODEL, case_problem.low, case_problem.high, {})
    points = prior.draw(5, np.random.default_rng(6))
    found = Posterior(case_problem, prior, noise_rad=3e-6).log_density(points)
    for point, density in zip(points, found, strict=True):
        residual, _ = case_problem.residuals(point)
        wanted = np.sum(stats.norm(0, 3e-6).logpdf(residual))
        assert density - prior.log_density(point[None])[0] == pytest.approx(wanted, rel=1e-10)


def test_the_density_of_a_sample_does_not_depend_on_the_others() -> None:
    case_problem = problem("liquid_drop_1", 1)
    posterior = Posterior(case_problem, make_prior(MODEL, case_problem.low, case_problem.high, {}))
    points = posterior.prior.draw(300, np.random.default_rng(7))
    points[3] = case_problem.high + 1.0
    together = posterior.log_density(points)
    alone = [posterior.log_density(points[some])[0] for some in np.arange(300)[:, None]]
    np.testing.assert_array_equal(together, alone)
    np.testing.assert_array_equal(posterior.log_density(points[::-1]), together[::-1])
    assert together[3] == -np.inf
    assert np.count_nonzero(np.isfinite(together)) == 299


def test_marginals_are_quantiles_of_what_counts() -> None:
    """Of normal logarithms, those of SciPy; and half of the samples relax too late."""
    rng = np.random.default_rng(8)
    steps = stats.norm.ppf((np.arange(4000) + 0.5) / 4000)
    columns = [rng.permutation(steps) for _ in range(4)]
    samples = np.stack(columns, axis=1) * 0.1 + np.log([1.0, 1e-3, 400.0, 1e-3])
    quantities = parameters_and_sum(MODEL)
    found = {m.quantity.label: m for m in compute_marginals(samples, quantities, 400.0, 0.9)}
    width = 0.1 * stats.norm.ppf(0.95)
    assert found["k"].median == pytest.approx(1.0, rel=1e-3)
    assert np.log(found["k"].outer) == pytest.approx([-width, width], abs=1e-3)
    assert np.log(found["k"].inner) == pytest.approx([-0.06745, 0.06745], abs=1e-3)
    assert found["k"].share == 1.0
    within = np.sum(samples[:, 2] - samples[:, 0] <= np.log(400.0))
    assert found["c + c_p"].share == within / 4000
    # c/k is 400 s in the middle, so that of c the smaller half counts.
    assert found["c + c_p"].median < 0.97 * found["c"].median
    assert "provided the branch relaxes" in found["c + c_p"].words()
    k = found["k"]
    assert k.against(*np.exp([-width, width])) == AGREES
    assert k.against(*np.exp([-1.4 * width, width])) == DIFFERS
    assert k.against(None, 2.0) == PRIOR
    for exact in (True, False):
        assert "no lower limit (its upper 2)" in k.why(None, 2.0, exact_onset=exact)
        assert "no lower and upper limit." in k.why(None, None, exact_onset=exact)
        favours = "takes the best fit at every value" in k.why(0.5, 2.0, exact_onset=exact)
        assert favours is not exact
    assert "which the posterior takes as exact" in k.why(0.5, 2.0, exact_onset=True)


def jensen_shannon(p: Array, q: Array, x: Array) -> float:
    """Cumulative Jensen-Shannon divergence, both ways, of two distribution functions."""
    middle = 0.5 * (p + q)
    both = xlogy(p, p / middle) + xlogy(q, q / middle)
    return float(integrate.trapezoid(both, x) / np.log(2))


@pytest.mark.parametrize("slope", [0.3, 1.0])
def test_sensitivity_is_that_of_the_scaled_distribution(slope: float) -> None:
    """A normal distribution that a part of its density tilts: raised to a power, it shifts."""
    x = stats.norm.ppf((np.arange(20_000) + 0.5) / 20_000)
    grid = np.linspace(x[0], x[-1], 20_001)
    wanted = []
    for power in (0.99, 1.01):
        shift = (power - 1) * slope
        distances = []
        for way in (1, -1):
            p, q = stats.norm.cdf(grid), stats.norm.cdf(grid - way * shift)
            bound = integrate.trapezoid(p + q, grid)
            distances.append(np.sqrt(jensen_shannon(p, q, grid) / bound))
        wanted.append(max(distances) / abs(np.log2(power)))
    # Tails of weights are smoothed.
    assert scaled(x, slope * x) == pytest.approx(np.mean(wanted), rel=0.01)


def test_the_prior_shapes_what_the_trace_leaves_open() -> None:
    """Within a decade of c_p any value fits, and c makes up for it; k_p is known to a percent."""
    trace = problem("liquid_drop_2", 0)
    posterior = Posterior(trace, make_prior(MODEL, trace.low, trace.high, {}))
    x = np.log([1.0, 1.0, 10.0, 0.1]) + np.random.default_rng(3).uniform(-1, 1, (2000, 4)) * [
        *(0.02, 0.01, 0.02, 1.15)
    ]
    found = {
        each.quantity.label: each
        for each in compute_sensitivities(posterior, x, parameters_and_sum(MODEL))
    }
    assert found["c_p"].prior > NOTABLE > found["k_p"].prior
    said = in_words(list(found.values()))
    assert said.startswith("The prior shapes c_p (")
    assert "k_p" not in said
    assert in_words([found["k_p"]]).startswith("A slightly stronger or weaker prior")


def test_samples_that_have_not_converged_are_told() -> None:
    rng = np.random.default_rng(9)
    axes = ValleyCoordinates((2, 3))
    good = rng.normal(0, 1, (500, 20, 4))
    told = diagnose_convergence(good, axes)
    assert told.reached
    assert told.words().startswith("The samples have converged")
    # One walker in twenty elsewhere, in a single parameter.
    stuck = good.copy()
    stuck[:, 7, 1] += 3.0
    assert diagnose_convergence(stuck, axes).r_hat > 1.02
    # What shows in the sum only: parameters that cancel.
    bent = good.copy()
    # Logarithms of two dampers whose sum is another one for every walker.
    share = rng.uniform(0.2, 0.8, (500, 20))
    total = np.exp(0.001 * np.arange(20))
    bent[:, :, 2], bent[:, :, 3] = np.log(share * total), np.log((1 - share) * total)
    assert diagnose_convergence(bent, ValleyCoordinates(())).r_hat < 1.02
    assert diagnose_convergence(bent, axes).r_hat > 1.02
    # Slow walks: few independent samples.
    slow = np.cumsum(rng.normal(0, 0.1, (500, 20, 4)), axis=0)
    assert "have not converged" in diagnose_convergence(slow, axes).words()


def test_priors_are_of_what_is_identified() -> None:
    settings = PosteriorSettings(prior={"k": LogNormal(1, 1), "kp": LogNormal(1, 1)})
    assert [path for path, _ in settings.problems_of(MODEL, [])] == [("prior", "kp")]
    assert [path for path, _ in settings.problems_of(MODEL, ["k"])] == [
        ("prior", "k"),
        ("prior", "kp"),
    ]
    several = CANDIDATES["generalized_maxwell_2"].model
    branch = PosteriorSettings(prior={"k_1": LogNormal(1, 1), "k_p": LogNormal(1, 1)})
    assert [path for path, _ in branch.problems_of(several, [])] == [("prior", "k_1")]
    assert list(settings.problems_of(MODELS["maxwell"], [])) != []


def test_as_many_walkers_as_the_sampler_wants() -> None:
    """Twice the parameters: with fewer, emcee itself refuses to begin."""
    model = Sample("generalized_maxwell", 5).model
    least = 2 * len(model.names)
    (problem,) = PosteriorSettings(walkers=least - 1).problems_of(model, [])
    said = f"found {least - 1}, allowed are at least {least} to identify 12 parameters."
    assert problem == (("walkers",), said)
    assert not list(PosteriorSettings(walkers=least).problems_of(model, []))
    assert not list(PosteriorSettings(walkers=least - 1).problems_of(model, ["k_1"]))
    for walkers in (least - 1, least):
        start = np.random.default_rng(0).normal(size=(walkers, 12))
        sampler = emcee.EnsembleSampler(walkers, 12, lambda x: -float(x @ x))
        if walkers < least:
            with pytest.raises(RuntimeError, match="fewer walkers than twice"):
                sampler.run_mcmc(start, 1)
        else:
            assert len(sampler.run_mcmc(start, 1).coords) == walkers
