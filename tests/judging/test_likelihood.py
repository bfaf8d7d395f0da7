"""Noise, thresholds and covariance by hand."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.judging.likelihood import Likelihood, check_rows, covariance, make_likelihood
from tests.helpers.default import seen
from tests.helpers.problems import likelihood_of, problem


def likelihood_with(freedom: float) -> Likelihood:
    """Of 100 readings, three parameters and a noise model that is known with some freedom."""
    residuals = seen(samples=100, free=100, freedom=freedom)
    return make_likelihood(seen(residuals=residuals), np.zeros(3), 2.0, confidence=0.95)


def test_a_noise_model_that_is_hardly_known_widens_limits() -> None:
    """To Student's t of its own freedom at 97.5 %, from tables."""
    found = likelihood_with(8.0)
    assert found.threshold == pytest.approx(2.306**2, rel=1e-3)
    assert found.noise_sd == pytest.approx(2.0 * np.sqrt(100 / 97))


def test_a_misfit_has_the_thresholds_of_its_own_freedom() -> None:
    """A limit takes as many times the threshold as of known noise: 3.2905^2 over 1.96^2."""
    found = likelihood_with(np.inf).as_misfit(independent=25.0, freedom=8.0)
    assert found.noise_sd == pytest.approx(4.0)
    assert found.threshold == pytest.approx(2.306**2, rel=1e-3)
    assert found.certainty / found.threshold == pytest.approx(3.2905**2 / 1.96**2, rel=1e-4)


def test_a_parameter_that_is_told_to_less_than_an_e_fold_counts() -> None:
    """J J^T is 2 1, 1 2: each has a standard deviation of 0.7 with the other known."""
    found = covariance(np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]]), 1.0)
    assert found == pytest.approx(np.array([[2.0, -1.0], [-1.0, 2.0]]) / 3)


def test_parameters_that_stand_for_one_another_have_no_bounds() -> None:
    """Of c and c_p a trace shows 9.9 c + 0.1 c_p, of k itself: the sum alone has a bound.

    The third row moves along with the second, so that their logarithms trade: 9.9 to 0.1.
    """
    rows = np.array([[300.0, 0.0], [0.0, 9.9 * 500], [0.0, 0.1 * 500]])
    shares = np.array([0.0, 0.99, 0.01])
    found = np.diag(covariance(rows, 1.0, np.vstack([np.eye(3), shares])))
    assert found == pytest.approx([1 / 300**2, np.inf, np.inf, 1 / 5000**2])


def test_what_a_trace_without_noise_tells_may_outweigh_every_prior() -> None:
    """Two parameters of which it tells the sum, to 1e-12: their prior is lost in rounding."""
    rows = np.array([[[0.0], [1e12], [1e12]]])
    residuals = seen(samples=100, free=100, freedom=np.inf, condensed_responses=lambda best: rows)
    given = seen(residuals=residuals), np.zeros(2), 1.0
    likelihood = make_likelihood(*given, confidence=0.95, noise_sd=1.0)
    total = seen(gradient=lambda best: np.ones(2))
    assert likelihood.deviation(total) == pytest.approx(1e-12, rel=1e-6, abs=0)


def test_noise_that_grows_has_the_covariance_of_unweighted_fits() -> None:
    """Of a slope from readings at 10 and 20: (10^2 + 20^2 3^2) / (10^2 + 20^2)^2."""
    found = covariance(np.array([[10.0, 20.0]]), np.array([1.0, 3.0]))
    assert found[0, 0] == pytest.approx(3700 / 500**2)


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
