"""What a confidence limit is, by other means than the study's.

With a quantity held, SciPy searches all samples for the lowest chi^2 over what is left free,
without a prior. A parameter is held by leaving it out; of a sum what is left free is the logarithm
of the ratio of its two members. The starts are random points, and what is handed in.
"""

from collections.abc import Iterable

import numpy as np
from scipy.optimize import least_squares
from scipy.special import expit, log_expit

from biogrip.arrays import Array
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.quantities import Quantity

ROUGH, TIGHT = 1e-6, 1e-11
# What the project says of branches that do not relax within the experiment.
HINGE = 10.0


class FitConstraint:
    """A quantity's logarithm held at a target; points are of what is left free.

    Parameters
    ----------
    likelihood
        The trace.
    quantity
        A parameter, or the sum of two.
    target
        Its logarithm.
    """

    def __init__(self, likelihood: Likelihood, quantity: Quantity, target: float) -> None:
        self._likelihood, self._quantity, self._target = likelihood, quantity, target
        problem = likelihood.problem
        self._last: tuple[Array, Array, Array] | None = None
        self._first = quantity.members[0]
        low, high = problem.low, problem.high
        if len(quantity.members) == 1:
            self._rest = [i for i in range(len(low)) if i != self._first]
            self.low, self.high = low[self._rest], high[self._rest]
        else:
            assert quantity.form == "sum"
            assert len(quantity.members) == 2
            second = quantity.members[1]
            self._rest = [i for i in range(len(low)) if i not in quantity.members]
            lows = max(ratio(low[self._first], target), -ratio(high[second], target))
            highs = min(ratio(high[self._first], target), -ratio(low[second], target))
            self.low, self.high = (
                np.append(low[self._rest], lows),
                np.append(high[self._rest], highs),
            )

    def log_parameters(self, point: Array) -> Array:
        """All log-parameters."""
        x = np.empty(len(self._likelihood.best))
        x[self._rest] = point[: len(self._rest)]
        x[self._first] = self._target
        if len(self._quantity.members) == 2:
            x[self._first] += log_expit(point[-1])
            x[self._quantity.members[1]] = self._target + log_expit(-point[-1])
        return x

    def point(self, x: Array) -> Array:
        """What is left free, at or near log-parameters."""
        free = x[self._rest]
        if len(self._quantity.members) == 2:
            free = np.append(free, x[self._first] - x[self._quantity.members[1]])
        inside = 1e-9 * (self.high - self.low)
        return np.clip(free, self.low + inside, self.high - inside)

    def _rows(self, point: Array) -> Array:
        return self._both(point)[0]

    def _slopes(self, point: Array) -> Array:
        return self._both(point)[1]

    def _both(self, point: Array) -> tuple[Array, Array]:
        """Rows and their slopes; the last are kept, for both are asked for in turn."""
        if self._last is None or not np.array_equal(self._last[0], point):
            x = self.log_parameters(point)
            residual, sensitivity = self._likelihood.problem.residuals(x)
            late = self._late(x)
            slopes_of = np.zeros((len(late), len(x)))
            branches = [hinge.branch for hinge in self._quantity.penalties]
            for row, (k, c), beyond in zip(slopes_of, branches, late, strict=True):
                if beyond > 0:
                    row[c], row[k] = HINGE, -HINGE
            noise = self._likelihood.noise_rad
            rows = np.append(residual / noise, [HINGE * max(beyond, 0.0) for beyond in late])
            slopes = np.vstack((sensitivity.T / noise, slopes_of))
            turned = slopes[:, self._rest]
            if len(self._quantity.members) == 2:
                first, second = slopes[:, self._quantity.members].T
                along = first * expit(-point[-1]) - second * expit(point[-1])
                turned = np.column_stack((turned, along))
            self._last = point.copy(), rows, turned
        return self._last[1], self._last[2]

    def _late(self, x: Array) -> list[float]:
        longest = np.log(self._likelihood.problem.residuals.duration_s)
        return [
            float(x[c] - x[k] - longest)
            for k, c in (hinge.branch for hinge in self._quantity.penalties)
        ]

    def fitted(self, x: Array, tolerance: float = TIGHT) -> tuple[float, Array]:
        """Rise of chi^2 of a fit from log-parameters, and where it ends."""
        ends = dict.fromkeys(("ftol", "xtol", "gtol"), tolerance)
        bounds = (self.low, self.high)
        found = least_squares(self._rows, self.point(x), self._slopes, bounds, max_nfev=200, **ends)
        residuals = self._likelihood.problem.residuals
        least = residuals.samples * (self._likelihood.misfit_rad / self._likelihood.noise_rad) ** 2
        return 2 * float(found.cost) - least, self.log_parameters(found.x)

    def increase(self, rng: np.random.Generator, count: int, starts: Iterable[Array] = ()) -> float:
        """Lowest rise of chi^2 from so many random starts, and some more."""
        random = rng.uniform(self.low, self.high, (count, len(self.low)))
        first = [*starts, *map(self.log_parameters, random)]
        found = sorted((self.fitted(x, ROUGH) for x in first), key=lambda fit: fit[0])
        return min(self.fitted(x)[0] for _, x in found[:3])


def ratio(log_member: float, log_sum: float) -> float:
    """Logarithm of a member of a sum over the rest of it."""
    share = log_member - log_sum
    return np.inf if share >= 0 else float(share - np.log(-np.expm1(share)))


def rise_at(
    likelihood: Likelihood,
    quantity: Quantity,
    limit: float,
    rng: np.random.Generator,
    count: int,
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
