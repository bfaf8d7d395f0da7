"""Noise and thresholds that define the profile likelihoods of a trace.

The increase of chi^2 is that of the sum of squares over its minimum, in units of the noise's
variance. A quantity has a confidence limit where the increase equals a threshold: a quantile of
chi-squared with one degree of freedom if the noise is known, of F if it is estimated [1]_. It has
none unless the increase at the end of the search range reaches the quantile at `CERTAIN`.

References
----------
.. [1] D. M. Bates and D. G. Watts, Nonlinear Regression Analysis and Its Applications, Wiley,
   1988: profiles and the F threshold where the noise is estimated.
"""

from dataclasses import dataclass
from math import inf
from statistics import NormalDist

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.problem import Problem
from biogrip.judging.quantities import Quantity

CERTAIN = 0.999
"""Confidence that a profile must reach at an end of the range to have a limit on that side."""

MISSED = 0.05
"""Largest increase of chi^2 that the weak prior of local fits may cause.

A fit that is deeper than an optimum by more shows that the optimum is not the global one.
"""


@dataclass(frozen=True)
class Likelihood:
    """Optimum, noise and thresholds that define the profile likelihoods of one trace."""

    problem: Problem
    """The trace and the model."""
    best: Array
    """Log-parameters of the global optimum, (n_parameters,)."""
    misfit_rad: float
    """Misfit there."""
    noise_rad: float
    """Standard deviation of the noise, known or estimated from the residual."""
    threshold: float
    """Increase of chi^2 at the confidence limits. It is that of an interval with two ends: a single
    limit is one of these ends, and holds with more than the confidence."""
    certainty: float
    """Increase that a profile must reach at an end of the range to have a limit on that side. A
    profile that levels off between `threshold` and this would have a limit by chance alone."""
    freedom: float = inf
    """Degrees of freedom of the noise's estimated variance; infinite if the noise is known."""

    def increase(self, misfit_rad: float) -> float:
        """Return the increase of chi^2 over the optimum."""
        excess = misfit_rad**2 - self.misfit_rad**2
        return float(self.problem.residuals.samples * excess / self.noise_rad**2)

    def deviation(self, quantity: Quantity) -> float:
        """Return the first-order standard deviation of a quantity's logarithm.

        Every parameter has a prior standard deviation of one e-fold, beyond which the
        linear approximation fails; so the result is some e-folds at most. Unlike in a
        `bound`, no parameter is left out for want of information.
        """
        rows = self.problem.residuals.condensed_responses(self.best[None])[0]
        relative = rows[1:] / self.noise_rad
        slope = quantity.gradient(self.best)
        information = relative @ relative.T + np.eye(len(slope))
        return float(np.sqrt(slope @ np.linalg.solve(information, slope)))


def make_likelihood(
    problem: Problem,
    best: Array,
    misfit_rad: float,
    *,
    confidence: float,
    noise_rad: float | None = None,
) -> Likelihood:
    """Compute the noise and the thresholds for the profile likelihoods of a trace.

    Parameters
    ----------
    problem, best, misfit_rad
        As in `Likelihood`.
    confidence
        Confidence level of the limits, e.g. 0.95.
    noise_rad
        Standard deviation of the noise if it is known.
    """
    from scipy.special import fdtri

    levels, freedom = (confidence, CERTAIN), inf
    if noise_rad is not None:
        threshold, certainty = (NormalDist().inv_cdf((1 + level) / 2) ** 2 for level in levels)
    else:
        left = problem.residuals.free - len(best)
        noise_rad = misfit_rad * float(np.sqrt(problem.residuals.samples / left))
        freedom = float(min(left, problem.residuals.freedom))
        threshold, certainty = fdtri(1, freedom, levels)
    return Likelihood(
        problem, best, misfit_rad, noise_rad, float(threshold), float(certainty), freedom
    )


def compute_fall(
    samples: int, before_rad: float, after_rad: float, noise_rad: float | None = None
) -> float:
    """Compute the decrease of chi^2, twice the increase of log-likelihood, between RMS residuals.

    If the standard deviation of the noise is not known, each fit's misfit estimates it.
    """
    if noise_rad is not None:
        return samples * (before_rad**2 - after_rad**2) / noise_rad**2
    return 2 * samples * float(np.log(before_rad / after_rad))
