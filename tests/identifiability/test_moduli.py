"""Limits of moduli over frequency: against parameters, and against brute force."""

import numpy as np
import pytest

from biogrip.experiment.models import MODELS
from biogrip.experiment.noise import add_noise
from biogrip.identifiability.likelihood import Likelihood, make_likelihood
from biogrip.identifiability.moduli import LOSS, STORAGE, moduli_at, profile_moduli
from biogrip.identifiability.profiles import Profile, compute_profiles
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identify.multi_start import fit_from
from tests.helpers.default import study_of

TEXT = """
cases:
  endothelial_cell: null
  liquid_drop_1: null
  liquid_drop_2: null
  sample:
    sample: {%s}
    measurement: {rate_Hz: 1.0, noise: {level: %g}}
"""


def limits_of(profile: Profile) -> tuple[float, float]:
    assert profile.low is not None
    assert profile.high is not None
    return profile.low, profile.high


def likelihood_of(sample: str, noise: float = 0.05) -> Likelihood:
    case = study_of(TEXT % (sample, noise)).case("sample")
    time_s = case.sampling.over(sum(phase.duration_s for phase in case.phases))
    logs = case.problem.logs(case.parameters)
    clean = case.problem.of(time_s, np.ones_like(time_s)).residuals.rotation(logs)
    trace = add_noise(clean, case.noise, np.random.default_rng(4))
    problem = case.problem.of(time_s, trace)
    optimum = fit_from([problem], logs)
    return make_likelihood(problem, optimum.x[0], float(optimum.misfit_rad[0]), confidence=0.95)


@pytest.mark.parametrize("name", ["generalized_maxwell", "burgers", "fractional_zener"])
def test_moduli_are_the_transforms_of_their_networks(name: str) -> None:
    """The impedance of the network, element by element, and derivatives by differences."""
    model = MODELS[name]
    x = np.log(np.array(model.example))
    network, omega = model.network(np.exp(x)[None]), 0.37
    s = 1j * omega
    impedance = network.k_p[0] + network.c_p[0] * s
    impedance += sum(
        1 / (1 / k + 1 / (c * s)) for k, c in zip(network.k[0], network.c[0], strict=True)
    )
    for modulus in moduli_at(model, np.array([omega])):
        expected = {STORAGE: impedance.real, LOSS: impedance.imag}[modulus.part]
        assert np.exp(modulus.log(x)) == pytest.approx(expected, rel=1e-9)
        steps = 1e-5 * np.eye(len(x))
        slopes = (modulus.logs(x + steps) - modulus.logs(x - steps)) / 2e-5
        assert modulus.gradient(x) == pytest.approx(slopes, abs=1e-6)


def test_moduli_of_a_solid_have_the_limits_of_its_spring_and_damper() -> None:
    likelihood = likelihood_of("model: kelvin_voigt, k_p: 0.3, c_p: 3.0")
    model, omega = MODELS["kelvin_voigt"], 0.2
    spring, damper = compute_profiles([likelihood], parameters_and_sum(model), smooth=False)[0]
    storage, loss = profile_moduli(likelihood, moduli_at(model, np.array([omega])))
    for modulus, parameter, factor in ((storage, spring, 1.0), (loss, damper, omega)):
        low, high = limits_of(parameter)
        expected = np.array((low, high)) + np.log(factor)
        assert limits_of(modulus) == pytest.approx(expected, abs=2e-3 * (high - low))


def test_limits_are_those_of_all_samples_within_the_threshold() -> None:
    """Found by walking at random over samples whose chi^2 rises by no more than the threshold."""
    likelihood = likelihood_of("model: liquid_drop, k: 1.0, k_p: 0.05, c: 10.0")
    model = MODELS["liquid_drop"]
    moduli = moduli_at(model, np.array([0.02, 0.3]))
    profiles = profile_moduli(likelihood, moduli)
    rng, best = np.random.default_rng(5), likelihood.best
    rows = likelihood.problem.residuals.condensed_responses(best[None])[0][1:]
    spread = np.linalg.inv(rows @ rows.T) * likelihood.noise_rad**2 * likelihood.threshold
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    # Along each direction of the ellipsoid, the farthest sample within the threshold.
    walks = (
        best
        + (directions @ np.linalg.cholesky(spread).T)[:, None]
        * np.linspace(0.8, 1.2, 41)[None, :, None]
    )
    misfit = likelihood.problem.misfit(np.exp(walks.reshape(-1, 3)))
    samples = likelihood.problem.residuals.samples
    rise = samples * (misfit**2 - likelihood.misfit_rad**2) / likelihood.noise_rad**2
    inside = walks.reshape(-1, 3)[rise <= likelihood.threshold]
    for modulus, profile in zip(moduli, profiles, strict=True):
        found, (low, high) = modulus.logs(inside), limits_of(profile)
        reached = float(found.min()), float(found.max())
        assert (low, high) == pytest.approx(reached, abs=0.02 * (high - low))


def test_a_modulus_that_an_excluded_element_would_make_is_bounded_on_one_side() -> None:
    """With noise that hides the branch, the storage modulus may be as small as ranges allow."""
    likelihood = likelihood_of(
        "model: generalized_maxwell, k: 9.5, k_p: 1e-4, c: 10, c_p: 1e-4", 0.1
    )
    model = MODELS["generalized_maxwell"]
    storage, loss = profile_moduli(likelihood, moduli_at(model, np.array([0.1])))
    assert storage.low is None
    assert storage.high is not None
    low, high = limits_of(loss)
    assert high - low < 1.0
