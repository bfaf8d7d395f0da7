"""What the rise of chi^2 over a trace's best fit is measured against.

The rise of the sum of squares over its minimum, in units of the noise's
variance, is the rise of chi^2. A quantity has a confidence limit where the rise
is the threshold.

References
----------
.. [1] D. M. Bates and D. G. Watts, Nonlinear Regression Analysis and Its Applications, Wiley,
   1988: profiles and the F threshold where the noise is estimated.
"""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from biogrip.arrays import Array
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.problem import Problem

CERTAIN = 0.999
"""Confidence with which a profile has to rise, at an end of the range, for that side to close."""

MISSED = 0.05
"""Chi^2 that the prior, by which optima are chosen where the trace says nothing, may cost.

What is deeper than an optimum by more says that it was not the global one.
"""


@dataclass(frozen=True)
class Likelihood:
    """What the profiles of one trace are measured against.

    Parameters
    ----------
    problem
        The trace and the model.
    best : (n_parameters,)
        Log-parameters of the global optimum.
    misfit_rad
        Misfit there.
    noise_rad
        Standard deviation of the noise, known or estimated from the residual.
    threshold
        Rise of chi^2 at the confidence limits: chi-squared with one degree of
        freedom where the noise is known, F where it, or its colour, is estimated. It is that of an
        interval with two ends: a limit that stands alone is one of these ends, and
        holds with more than the confidence.
    certainty
        Rise that a profile must have reached at the end of the range to be closed
        there; the same at `CERTAIN`. A profile that levels off between the two has
        a confidence limit by the luck of the noise alone.
    """

    problem: Problem
    best: Array
    misfit_rad: float
    noise_rad: float
    threshold: float
    certainty: float

    def rise(self, misfit_rad: float) -> float:
        """Rise of chi^2 over the optimum."""
        excess = misfit_rad**2 - self.misfit_rad**2
        return float(self.problem.residuals.samples * excess / self.noise_rad**2)

    def deviation(self, quantity: Quantity) -> float:
        """Standard deviation of a quantity's logarithm to first order, some e-folds at most.

        Every parameter counts as known to an e-fold beforehand: beyond that a
        straight line says nothing of it, nor of what it does to others. Unlike a
        `bound`, this has no threshold that a parameter's information may pass.
        """
        rows = self.problem.residuals.condensed_responses(self.best[None])[0]
        relative = rows[1:] / self.noise_rad
        slope = quantity.gradient(self.best)
        information = relative @ relative.T + np.eye(len(slope))
        return float(np.sqrt(slope @ np.linalg.solve(information, slope)))


def likelihood_of(
    problem: Problem,
    best: Array,
    misfit_rad: float,
    *,
    confidence: float,
    noise_rad: float | None = None,
) -> Likelihood:
    """Set the scale of a trace's profiles.

    Parameters
    ----------
    problem, best, misfit_rad
        As of `Likelihood`.
    confidence
        Of the limits, e.g. 0.95.
    noise_rad
        Standard deviation of the noise if it is known.
    """
    levels = (confidence, CERTAIN)
    if noise_rad is not None:
        threshold, certainty = (NormalDist().inv_cdf((1 + level) / 2) ** 2 for level in levels)
    else:
        left = problem.residuals.free - len(best)
        noise_rad = misfit_rad * float(np.sqrt(problem.residuals.samples / left))
        from scipy.special import fdtri

        threshold, certainty = fdtri(1, min(left, problem.residuals.freedom), levels)
    return Likelihood(problem, best, misfit_rad, noise_rad, float(threshold), float(certainty))
