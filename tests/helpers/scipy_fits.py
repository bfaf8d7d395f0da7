"""Fits by SciPy, of all samples and one at a time: independent of how the study fits.

A quantity is held by one stiff residual more, which changes chi^2 by less than a thousandth.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from biogrip.arrays import Array
from biogrip.fit.problem import TraceProblem
from biogrip.judging.likelihood import Likelihood, Quantity

_Rows = Callable[[Array], tuple[Array, Array]]
STIFF = 1e5
# What the project says of branches that do not relax within the experiment.
HINGE = 10.0


def scipy_fit(
    problem: TraceProblem, start: Array, more: _Rows | None = None, noise_sd: float | None = None
) -> float:
    """Return the RMS misfit of a fit of all samples from log-parameters.

    There may be more residuals, in units of the noise, with their slopes.
    """
    noise_sd = noise_sd or problem.residuals.noise_scale

    def rows(x: Array) -> tuple[Array, Array]:
        residual, slopes = problem.residuals(x)
        values, turns = more(x) if more else (np.zeros(0), np.zeros((0, len(x))))
        return np.append(residual / noise_sd, values), np.vstack((slopes.T / noise_sd, turns))

    inside = 1e-9 * (problem.high - problem.low)
    found = least_squares(
        lambda x: rows(x)[0],
        np.clip(start, problem.low + inside, problem.high - inside),
        lambda x: rows(x)[1],
        (problem.low, problem.high),
        max_nfev=300,
        **dict.fromkeys(("ftol", "xtol", "gtol"), 1e-11),
    )
    return noise_sd * float(np.sqrt(2 * found.cost / problem.residuals.samples))


def rise_of_held(likelihood: Likelihood, quantity: Quantity, target: float, start: Array) -> float:
    """Rise of chi^2 of a fit with a quantity's logarithm held at a target."""
    residuals = likelihood.problem.residuals

    def more(x: Array) -> tuple[Array, Array]:
        held = [(STIFF * (quantity.log(x) - target), STIFF * quantity.gradient(x))]
        for k, c in (hinge.branch for hinge in quantity.penalties):
            late = float(x[c] - x[k] - np.log(residuals.duration_s))
            turn = HINGE * (np.eye(len(x))[c] - np.eye(len(x))[k])
            held.append((HINGE * max(late, 0.0), turn * (late > 0)))
        values, turns = map(np.array, zip(*held, strict=True))
        return values, turns

    misfit = scipy_fit(likelihood.problem, start, more, likelihood.noise_sd)
    squares = misfit**2 - likelihood.misfit**2
    return float(residuals.samples * squares / likelihood.noise_sd**2)
