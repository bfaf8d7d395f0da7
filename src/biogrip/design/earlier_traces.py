"""Information of earlier traces, as input for the design of the next experiment.

Plausible samples are drawn from the likelihood, which is taken as Gaussian around the best fit
for parameters that are determined well. For others, e.g. a damper that only has an upper bound,
this fails: they are drawn log-uniformly over their range, the others are fitted with these held,
and a draw is kept with a probability of its likelihood relative to the best.

References
----------
.. [1] K. Chaloner and I. Verdinelli, Bayesian experimental design: a review, Statistical Science 10
   (1995), 273-304: information of earlier experiments adds to that of the next.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.design.experiment import compute_information
from biogrip.identify.answer import Identification, silent
from biogrip.identify.local_fits import FAIR, LocalFits
from biogrip.identify.multi_start import best_of_starts
from biogrip.identify.problem import Problem

# Standard deviation of a logarithm from which on a Gaussian is not trusted.
_BADLY = 0.25
# Draws of parameters that are badly determined, of which some are kept.
_TRIED = 128


@dataclass(frozen=True, eq=False)
class Earlier:
    """Information of earlier traces: plausible samples and their Fisher information."""

    parameters: Array
    """Plausible samples, the best fit first, (n, n_parameters)."""
    information: Array
    """Fisher information on the log-parameters of each from these experiments, (n, n_parameters,
    n_parameters)."""
    misfit_rad: float
    """RMS misfit of the best fit."""

    @property
    def best(self) -> Array:
        """Log-parameters of the best fit, (n_parameters,)."""
        return np.log(self.parameters[0])


def estimate_from_traces(
    problem: Problem,
    noise_rad: float,
    identify: Callable[[Problem], Identification],
    within: tuple[Array, Array],
    drawn: int,
    rng: np.random.Generator,
    before: Earlier | None = None,
) -> Earlier:
    """Fit a trace, or several at once, and draw plausible samples from the likelihood.

    Several are a problem of `biogrip.design.replicates.joint_problem`, whose noise is their common
    one, see `compute_common_noise`. A function identifies the global optimum. Parameters that are
    badly determined are drawn within their lowest and highest logarithms, (n_parameters,) each.
    Fewer samples are returned than asked for if too few draws are kept. From the samples of earlier
    information, which is that of all but the last trace, the fit starts, too.
    """
    found = identify(problem)
    if before is not None:
        starts = np.log(np.concatenate((found.parameters[None], before.parameters)))
        row = found.parameters, found.misfit_rad, found.misfit_rad, found.evaluations
        (found,) = best_of_starts([problem], [starts], [row], silent)
    best = np.log(found.parameters)
    around = _drawn(problem, noise_rad, found, within, drawn - 1, rng)
    logs = np.concatenate((best[None], around))
    return Earlier(np.exp(logs), information_at(problem, noise_rad, logs), found.misfit_rad)


def information_at(problem: Problem, noise_rad: float, log_parameters: Array) -> Array:
    """Compute the Fisher information on log-parameters, (n, n_parameters, n_parameters).

    That of several traces is their sum. Samples are (n, n_parameters).
    """
    slopes = problem.residuals.condensed_responses(log_parameters)[:, 1:] / noise_rad
    return compute_information(slopes)


def _drawn(
    problem: Problem,
    noise_rad: float,
    found: Identification,
    within: tuple[Array, Array],
    count: int,
    rng: np.random.Generator,
) -> Array:
    """Draw plausible log-parameters, (at most count, n_parameters)."""
    best = np.log(found.parameters)
    fixed = _undetermined(information_at(problem, noise_rad, best[None])[0], problem)
    tried = _TRIED if fixed.any() else count
    x = np.tile(best, (tried, 1))
    if fixed.any():
        low, high = within
        x[:, fixed] = rng.uniform(low[fixed], high[fixed], (tried, int(fixed.sum())))
        fits = LocalFits([problem])
        bounds = np.where(fixed, x, problem.low), np.where(fixed, x, problem.high)
        trace = np.zeros(tried, dtype=np.intp)
        fitted = fits.fitted(x, trace, FAIR, low=bounds[0], high=bounds[1])
        x, misfit = fitted.x, fitted.misfit_rad
        increase = problem.residuals.samples * (misfit**2 - misfit.min() ** 2) / noise_rad**2
        x = x[rng.random(tried) < np.exp(-0.5 * increase)][:count]
    free = ~fixed
    if not free.any():
        return x
    # With R^T R the precision, R^-1 z has its inverse as covariance.
    sensitivity = information_at(problem, noise_rad, x)[:, free][:, :, free]
    roots = np.linalg.cholesky(sensitivity + np.eye(int(free.sum()))).swapaxes(1, 2)
    z = rng.standard_normal((len(x), int(free.sum()), 1))
    x[:, free] += np.linalg.solve(roots, z)[..., 0]
    return np.clip(x, problem.low, problem.high)


def _undetermined(information: Array, problem: Problem) -> BoolArray:
    """Mark the worst determined parameters in turn, until the others are determined well."""
    fixed = np.zeros(len(information), dtype=bool)
    # The search range acts as a prior.
    precision = information + np.diag((problem.high - problem.low) ** -2)
    while not fixed.all():
        free = np.flatnonzero(~fixed)
        variance = np.diag(np.linalg.inv(precision[np.ix_(free, free)]))
        worst = int(np.argmax(variance))
        if variance[worst] <= _BADLY**2:
            break
        fixed[free[worst]] = True
    return fixed
