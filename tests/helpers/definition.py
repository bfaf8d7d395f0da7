"""What a confidence limit is, by other means than the study's.

SciPy searches all samples for the lowest chi^2, without a prior; a quantity is held by one stiff
residual more, which changes chi^2 by less than a thousandth.
"""

from collections.abc import Iterable

import numpy as np
from scipy.optimize import least_squares

from biogrip.arrays import Array
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.quantities import Quantity

ROUGH, TIGHT = 1e-6, 1e-11
STIFF = 1e5
# What the project says of branches that do not relax within the experiment.
HINGE = 10.0


class FitConstraint:
    """A quantity's logarithm held at a target."""

    def __init__(self, likelihood: Likelihood, quantity: Quantity, target: float) -> None:
        self._likelihood, self._quantity, self._target = likelihood, quantity, target
        self._last: tuple[Array, Array, Array] | None = None

    def _both(self, x: Array) -> tuple[Array, Array]:
        """Rows and their slopes; the last are kept, for both are asked for in turn."""
        if self._last is None or not np.array_equal(self._last[0], x):
            residuals, noise = self._likelihood.problem.residuals, self._likelihood.noise_rad
            residual, slopes = residuals(x)
            off = self._quantity.log(x) - self._target
            more = [(STIFF * off, STIFF * self._quantity.gradient(x))]
            for k, c in (hinge.branch for hinge in self._quantity.penalties):
                late = float(x[c] - x[k] - np.log(residuals.duration_s))
                turn = HINGE * (np.eye(len(x))[c] - np.eye(len(x))[k])
                more.append((HINGE * max(late, 0.0), turn * (late > 0)))
            values, turns = zip(*more, strict=True)
            rows = np.append(residual / noise, values)
            self._last = x.copy(), rows, np.vstack((slopes.T / noise, turns))
        return self._last[1], self._last[2]

    def fitted(self, x: Array, tolerance: float = TIGHT) -> tuple[float, Array]:
        """Rise of chi^2 of a fit from log-parameters, and where it ends."""
        problem = self._likelihood.problem
        inside = 1e-9 * (problem.high - problem.low)
        found = least_squares(
            lambda x: self._both(x)[0],
            np.clip(x, problem.low + inside, problem.high - inside),
            lambda x: self._both(x)[1],
            (problem.low, problem.high),
            max_nfev=300,
            **dict.fromkeys(("ftol", "xtol", "gtol"), tolerance),
        )
        shares = self._likelihood.misfit_rad / self._likelihood.noise_rad
        return 2 * float(found.cost) - problem.residuals.samples * shares**2, found.x

    def increase(self, rng: np.random.Generator, count: int, starts: Iterable[Array] = ()) -> float:
        """Lowest rise of chi^2 from so many random starts, and some more."""
        problem = self._likelihood.problem
        random = rng.uniform(problem.low, problem.high, (count, len(problem.low)))
        found = sorted((self.fitted(x, ROUGH) for x in (*starts, *random)), key=lambda fit: fit[0])
        return min(self.fitted(x)[0] for _, x in found[:3])


def rise_at(
    likelihood: Likelihood, quantity: Quantity, limit: float, rng: np.random.Generator, count: int
) -> float:
    """Rise at a limit: lowest over random starts, from the best fit, and from the other basin.

    In the other basin the parallel damper is the large one, beside a branch of any stiffness.
    """
    k, k_p, c, c_p = likelihood.best
    total = np.logaddexp(c, c_p)
    others = [
        np.array((k - softer, k_p, total - small, total))
        for softer in (0.0, 3.0, 6.0)
        for small in (1.0, 2.5, 5.0)
    ]
    held = FitConstraint(likelihood, quantity, limit)
    return held.increase(rng, count, (likelihood.best, *others))
