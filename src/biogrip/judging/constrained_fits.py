"""Increase of chi^2 with a quantity held at a value, for many traces and quantities at once.

One member of a quantity, a parameter in it, is eliminated: it follows from the others and the value
(generalized reduced gradients [1]_). The dominant member is eliminated, chosen anew at every step
among those that are not at a bound: any other would move far in a small step. A stiff penalty
residual instead would be violated, the more the better the trace determines the quantity.

References
----------
.. [1] J. Abadie and J. Carpentier, in R. Fletcher (ed.), Optimization, Academic Press, 1969, 37-47.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit.least_squares import LocalFits, Minima, Normal
from biogrip.judging.likelihood import Likelihood, Quantity

# E-folds from a bound at which a member counts as free, and by which rounding may exceed it.
_FREE_OF_BOUND, _BEYOND_BOUND = 1e-9, 1e-7
# Factor on the weight of members at a bound in the choice of the eliminated one.
_UNWILLING = 1e-9
_LEAST_SLOPE = 1e-200


class QuantityConstraint:
    """A constraint on each of n fits, which holds one quantity at a given value.

    Each fit has the index of its quantity, (n,), and the logarithm of its value, within its range.
    Bounds are (n, n_parameters). Branches must relax within a time for quantities that require it;
    the penalty is in standard deviations of the noise, over which the fits' unit is (n,).
    """

    def __init__(
        self,
        quantities: Sequence[Quantity],
        which: IntArray,
        targets: Array,
        low: Array,
        high: Array,
        longest_s: float,
        unit: Array,
    ) -> None:
        self._unit = unit[:, None]
        self._which, self._targets = which, targets
        self._low, self._high = low, high
        parameters = low.shape[1]
        self._powers = np.zeros((len(quantities), parameters))
        most = max(len(quantity.penalties) for quantity in quantities)
        self._forms = np.zeros((len(quantities), most, parameters))
        self._allowed, self._stiffness = np.zeros((2, len(quantities), most))
        for index, quantity in enumerate(quantities):
            self._powers[index, list(quantity.members)] = quantity.sign
            for row, penalty in enumerate(quantity.penalties):
                self._forms[index, row] = penalty.form(parameters)
                self._allowed[index, row] = penalty.allowed(longest_s)
                self._stiffness[index, row] = penalty.stiffness
        self._senses = np.array([float(quantity.sense) for quantity in quantities])
        self._most_members = max(len(quantity.members) for quantity in quantities)

    def started(self, x: Array) -> Array:
        """Move points, (n, n_parameters), onto the constraint."""
        everyone = np.arange(len(x))
        powers, sense = self._form(everyone)
        by = (self._targets - self._log(x, powers, sense))[:, None]
        first = np.cumsum(np.abs(powers), axis=1) * np.abs(powers) == 1
        moved = x + by * np.where(sense == 0, powers * first, powers)
        moved = np.clip(moved, self._low, self._high)
        eliminated = self._dominant(moved, everyone, self._slopes(moved, everyone))
        restored = self.restored(moved, everyone, eliminated)
        if np.any(np.isnan(restored)):
            raise ValueError("a quantity is to be held outside its range")
        return restored

    def added(self, normal: Normal, x: Array, fit: IntArray) -> Normal:
        """Return the normal equations with penalty residuals for branches that relax too late."""
        beyond, slopes = self._late(x, fit)
        if not slopes.size:
            return normal
        return replace(
            normal,
            square_sum=normal.square_sum + np.sum(beyond**2, axis=1),
            gradient=normal.gradient + np.sum(beyond[:, :, None] * slopes, axis=1),
            information=normal.information + slopes.swapaxes(1, 2) @ slopes,
        )

    def price(self, x: Array) -> Array:
        """Return the penalty on the sums of squares for branches that relax too late, (n,)."""
        return np.sum(self._late(x, np.arange(len(x)))[0] ** 2, axis=1)

    def eliminated(self, normal: Normal, x: Array, fit: IntArray) -> tuple[Normal, BoolArray]:
        """Eliminate one parameter; return reduced equations and its mask, (n, n_parameters)."""
        slopes = self._slopes(x, fit)
        basic = self._dominant(x, fit, slopes)
        # Minus the derivative of the eliminated parameter by each other one; 1 by itself.
        ratio = slopes / np.sum(slopes * basic, axis=1, keepdims=True)
        # Derivatives of all parameters by the others, none by the eliminated one.
        by_others = np.eye(x.shape[1]) - basic[:, :, None] * ratio[:, None, :]
        gradient = (normal.gradient[:, None] @ by_others)[:, 0]
        information = by_others.swapaxes(1, 2) @ normal.information @ by_others
        information += np.eye(x.shape[1]) * basic[:, :, None]
        return replace(normal, gradient=gradient, information=information), basic

    def restored(self, x: Array, fit: IntArray, eliminated: BoolArray) -> Array:
        """Move points, (n, n_parameters), onto the constraint; NaN where bounds forbid that."""
        x, basic, tried = x.copy(), eliminated, eliminated.copy()
        left = np.arange(len(x))
        for _ in range(self._most_members):
            value = self._followed(x[left], fit[left], basic)
            inside = np.clip(value, self._low[fit[left]], self._high[fit[left]])
            x[left] = np.where(basic, inside, x[left])
            reached = np.any(basic & (np.abs(value - inside) <= _BEYOND_BOUND), axis=1)
            left = left[~reached]
            if not len(left):
                return x
            # The eliminated member stays at its bound, and the next one is eliminated.
            slopes = self._slopes(x[left], fit[left])
            basic = self._dominant(x[left], fit[left], slopes, tried[left])
            tried[left] |= basic
        x[left] = np.nan
        return x

    def _dominant(
        self, x: Array, fit: IntArray, slopes: Array, tried: BoolArray | None = None
    ) -> BoolArray:
        """Mark the member to eliminate, none if all have been tried."""
        weight = np.abs(slopes)
        free = (x > self._low[fit] + _FREE_OF_BOUND) & (x < self._high[fit] - _FREE_OF_BOUND)
        weight = np.where(free, weight, _UNWILLING * weight)
        if tried is not None:
            weight = np.where(tried, 0.0, weight)
        chosen = np.argmax(weight, axis=1)[:, None] == np.arange(x.shape[1])
        return chosen & (weight > 0)

    def _late(self, x: Array, fit: IntArray) -> tuple[Array, Array]:
        """Return the residuals of hinges, (n, n_hinges), and their log-parameter derivatives."""
        which = self._which[fit]
        forms, stiffness = self._forms[which], self._stiffness[which] * self._unit[fit]
        beyond = np.sum(forms * x[:, None], axis=2) - self._allowed[which]
        late = beyond > 0
        slopes = stiffness[:, :, None] * forms * late[:, :, None]
        return np.where(late, stiffness * beyond, 0.0), slopes

    def _slopes(self, x: Array, fit: IntArray) -> Array:
        """Return the log-parameter derivatives of the quantities' logarithms on the constraint."""
        powers, sense = self._form(fit)
        shares = np.exp(np.minimum(sense * (x - self._targets[fit][:, None]), 0.0))
        return np.where(sense == 0, powers, np.maximum(shares, _LEAST_SLOPE) * (powers != 0))

    def _followed(self, x: Array, fit: IntArray, basic: BoolArray) -> Array:
        """Solve the constraints for the marked members; infinite where there is no solution."""
        powers, sense = self._form(fit)
        target = self._targets[fit][:, None]
        others = np.where(basic, 0.0, powers)
        of_product = (target - np.sum(others * x, axis=1, keepdims=True)) * powers
        taken = np.sum(np.abs(others) * np.exp(sense * (x - target)), axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            of_sum = target + sense * np.log1p(-np.minimum(taken, 1.0))
        return np.where(basic, np.where(sense == 0, of_product, of_sum), x)

    @staticmethod
    def _log(x: Array, powers: Array, sense: Array) -> Array:
        """Return the logarithms of quantities with these powers and senses, (n,)."""
        member = powers != 0
        largest = np.max(np.where(member, sense * x, -np.inf), axis=1, keepdims=True)
        terms = np.where(member, np.exp(np.minimum(sense * x - largest, 0.0)), 0.0)
        of_sum = sense[:, 0] * (largest[:, 0] + np.log(np.sum(terms, axis=1)))
        return np.where(sense[:, 0] == 0, np.sum(powers * x, axis=1), of_sum)

    def _form(self, fit: IntArray) -> tuple[Array, Array]:
        """Return the powers of the members, (n, n_parameters), and each sum's sense, (n, 1)."""
        which = self._which[fit]
        return self._powers[which], self._senses[which][:, None]


CLOSE = 1e-7
"""Tolerance of fits that give chi^2 to 0.001; to the last digit takes three times as many steps."""


class ConstrainedFits:
    """Fits of several traces, whose problems are `alike`, with one of several quantities held.

    Each profile belongs to a trace and a quantity; those of the first trace come first. Of each
    there are the index of its `trace`, the optimum `best`, (n_profiles, n_parameters), the
    logarithm of the quantity `at_best`, and `threshold` and `certainty`, no less, as in
    `Likelihood`.
    """

    def __init__(self, likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]) -> None:
        self.likelihoods, self.quantities = likelihoods, quantities
        problems = [likelihood.problem for likelihood in likelihoods]
        self.trace = np.repeat(np.arange(len(likelihoods)), len(quantities))
        self._optima = np.stack([likelihood.best for likelihood in likelihoods])
        self.best = self._optima[self.trace]
        self.at_best = np.array([q.log(x) for x in self._optima for q in quantities])
        settings = [(one.threshold, one.certainty, one.misfit, one.noise_sd) for one in likelihoods]
        threshold, certainty, self._misfit, self._noise_sd = np.array(settings).T
        self.threshold = threshold[self.trace]
        self.certainty = np.maximum(certainty, threshold)[self.trace]
        self._fits = LocalFits(problems)
        self._residuals = problems[0].residuals
        scale = np.array([problem.residuals.trace.scatter for problem in problems])
        self._unit = np.array([problem.residuals.noise_scale for problem in problems]) / scale
        # Ratio of chi^2 to the fits' sums of squares.
        self._ratio = (scale / self._noise_sd) ** 2

    def at(
        self, profile: IntArray, targets: Array, near: Array, tolerance: float
    ) -> tuple[Array, Array]:
        """Minimize chi^2 over all parameters with one quantity held at a value.

        A target is the logarithm at which the quantity of a profile is held, within its range,
        (n,). Starts near the fit, (n, n_parameters), are moved onto the constraint. Returns the
        increases of chi^2 over each trace's optimum, (n,), and the fitted log-parameters.
        """
        trace, which = np.divmod(profile, len(self.quantities))
        low, high = self._fits.low[trace], self._fits.high[trace]
        last_s = self._residuals.duration_s
        given = self.quantities, which, targets, low, high, last_s, self._unit[trace]
        constraint = QuantityConstraint(*given)
        minima = self._fits.fitted(near, trace, tolerance, constraint=constraint)
        price = constraint.price(minima.x) * self._ratio[trace]
        return self._increases(minima, trace) + price, minima.x

    def from_each(
        self, profile: IntArray, targets: Array, starts: Array, tolerance: float
    ) -> tuple[Array, Array]:
        """Fit as `at` does, each from several starts, (n_starts, n, n_parameters).

        Returns the increases from each start, (n_starts, n), and the log-parameters of the lowest,
        (n, n_parameters).
        """
        count, near = len(starts), np.concatenate(starts)
        increases, x = self.at(np.tile(profile, count), np.tile(targets, count), near, tolerance)
        increases = increases.reshape(count, -1)
        return increases, x.reshape(starts.shape)[np.argmin(increases, axis=0), range(len(profile))]

    def _increases(self, minima: Minima, trace: IntArray) -> Array:
        excess = minima.misfit**2 - self._misfit[trace] ** 2
        return self._residuals.samples * excess / self._noise_sd[trace] ** 2

    def slowest(self, profile: int) -> float | None:
        """Return the relaxation time in s of a branch of an optimum that is too slow, if any."""
        quantity = self.quantities[profile % len(self.quantities)]
        best, last_s = self.best[profile], self._residuals.duration_s
        times = [
            float(np.exp(penalty.form(len(best)) @ best))
            for penalty in quantity.penalties
            if penalty.before is None
        ]
        slowest = max(times, default=0.0)
        return slowest if slowest > last_s else None
