"""Are several traces of one sample? Two tests, and which trace differs and how.

One sample is held against one each: chi^2 of the joint fit exceeds the sum over single fits by as
many as there are parameters more, of those that the traces determine. The same with one more
parameter for each trace but one, its stiffness as a ratio, is the stronger test of a sample that
stiffens, softens, ages, or was loaded otherwise. Of both, the smaller chance counts twice [1]_. The
noise of a trace is known with its degrees of freedom, so that increases follow F distributions,
with a weighted mean of these [2]_.

References
----------
.. [1] C. E. Bonferroni, 1936: of two tests at half the level each.
.. [2] F. E. Satterthwaite, Biometrics Bulletin 2 (1946), 110-114: variances known differently well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import fdtrc, stdtrit

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.fit.joint import stack
from biogrip.fit.least_squares import fit_from
from biogrip.fit.problem import TraceProblem
from biogrip.judging.likelihood import Likelihood

# Most e-folds of a ratio of stiffness; accuracy of its fit; freedom that counts as infinite.
_MOST_EFOLDS, _ACCURACY, _MOST_FREEDOM = 12.0, 1e-10, 1e9
# Kinds of parameters that rise with the stiffness.
_STIFF = ("stiffness", "damping", "springpot")


@dataclass(frozen=True)
class Agreement:
    """Whether several traces are of one sample, and how they differ."""

    chance: float
    """Chance of an increase that is as large if they are of one sample."""
    increase: float
    """Increase of chi^2 from a sample each to one sample."""
    freedom: float
    """Degrees of freedom of the increase."""
    in_stiffness: bool
    """True if ratios of stiffness explain it."""
    ratios: Array
    """Stiffness of each trace over the geometric mean of all, and limits, (n_traces, 3)."""
    to_first: Array
    """The same over that of the first trace, whose own is 1."""
    odd: int | None
    """The trace without which the others agree, if there is one such."""
    log_ratios: Array
    """Logarithms of ratios to the first trace, (n_traces,)."""
    covariance: Array
    """Their covariance, (n_traces, n_traces)."""
    root: float
    """Standard deviations of a difference that is one (`ONE_SAMPLE`)."""

    @property
    def holds(self) -> bool:
        """True if the traces may be of one sample (`ONE_SAMPLE`)."""
        return self.chance >= levels.ONE_SAMPLE

    def rises_with(self, what: Sequence[float]) -> int:
        """Return 1 if the ratio of stiffness rises with what differs, -1 if it falls, else 0.

        From its least to its largest value, (n_traces,), the ratio differs, and no step between
        goes the other way (`ONE_SAMPLE`).
        """
        order = np.argsort(what, kind="stable").tolist()
        if len({*what}) < len(what):
            return 0
        whole = self._step(order[0], order[-1])
        steps = [self._step(*pair) for pair in pairwise(order)]
        return whole if whole and -whole not in steps else 0

    def _step(self, one: int, other: int) -> int:
        """Return the sign of a difference, or 0 where it may be chance."""
        contrast = np.zeros(len(self.log_ratios))
        contrast[[one, other]] = -1.0, 1.0
        sd = float(np.sqrt(contrast @ self.covariance @ contrast))
        difference = float(contrast @ self.log_ratios)
        return int(np.sign(difference)) if abs(difference) > self.root * sd else 0


def compare_traces(likelihood: Likelihood, singles: Sequence[Likelihood]) -> Agreement:
    """Test whether the traces of a joint likelihood are of one sample.

    Parameters
    ----------
    likelihood
        Of all traces; its problem is their `stack`.
    singles
        Of each trace: its problem in the joint one, its optimum, noise and freedom.
    """
    own = [_own_fit(single, likelihood) for single in singles]
    increase, freedom, chance = _increase(likelihood, singles, own)
    ratios = _fit_ratios(likelihood, singles)
    after = increase - ratios.fall
    of_stiffness = _chance(ratios.fall, len(singles) - 1, _common(singles, None))
    rest = _chance(after, freedom - len(singles) + 1, _common(singles, None))
    chance = min(1.0, 2 * min(chance, of_stiffness))
    odd = None
    if chance < levels.ONE_SAMPLE and len(singles) > 2:
        odd = _find_odd(likelihood, singles, own)
    both = np.array([likelihood.confidence, 1 - levels.ONE_SAMPLE])
    root, certain = stdtrit(min(likelihood.freedom, _MOST_FREEDOM), 0.5 + both / 2).tolist()
    count = len(singles)
    first, mean = np.eye(count) - np.eye(count)[0], np.eye(count) - 1 / count
    return Agreement(
        chance,
        increase,
        freedom,
        rest >= levels.ONE_SAMPLE,
        ratios.over(mean, root),
        ratios.over(first, root),
        odd,
        ratios.logs,
        ratios.covariance,
        certain,
    )


def _common(singles: Sequence[Likelihood], shares: Array | None) -> float:
    """Return degrees of freedom of a mean of the traces' variances, by shares, (n_traces,)."""
    shares = np.full(len(singles), 1 / len(singles)) if shares is None else shares
    freedoms = np.array([single.freedom for single in singles])
    inverse = float(np.sum(shares**2 / freedoms))
    return 1 / inverse if inverse > 1 / _MOST_FREEDOM else _MOST_FREEDOM


def shared_freedom(best: Array, singles: Sequence[Likelihood]) -> float:
    """Return degrees of freedom of the noise of all traces, by what each tells of parameters."""
    parts = [_information(single.problem, best, single.noise_sd) for single in singles]
    total = sum(parts, np.eye(len(best)))
    told = np.array([np.trace(np.linalg.solve(total, part)) for part in parts])
    return _common(singles, told / told.sum())


def _information(problem: TraceProblem, at: Array, noise_sd: float) -> Array:
    slopes = problem.residuals.condensed_responses(at[None])[0, 1:] / noise_sd
    return slopes @ slopes.T


def _told(problem: TraceProblem, at: Array, noise_sd: float = 1.0) -> int:
    """Count the combinations of parameters that a fit adapts."""
    sizes = np.linalg.eigvalsh(_information(problem, at, noise_sd))
    return int(np.count_nonzero(sizes > levels.TELLS))


def _own_fit(single: Likelihood, likelihood: Likelihood) -> tuple[Array, float]:
    """Return log-parameters and chi^2 of a trace's own fit, in the ranges of all."""
    starts = np.array([single.best, likelihood.best])
    fits = fit_from([single.problem] * 2, starts)
    best = int(np.argmin(fits.misfit))
    return fits.x[best], _chi_squared(single.problem, fits.x[best], single.noise_sd)


def _chi_squared(problem: TraceProblem, at: Array, noise_sd: float = 1.0) -> float:
    residuals = problem.residuals
    misfit = float(residuals.misfit(np.exp(at)[None])[0])
    return residuals.samples * misfit**2 / noise_sd**2


def _increase(
    likelihood: Likelihood, singles: Sequence[Likelihood], own: Sequence[tuple[Array, float]]
) -> tuple[float, float, float]:
    """Return the increase of chi^2 to one sample, its degrees of freedom, and its chance."""
    together = _chi_squared(likelihood.problem, likelihood.best)
    increase = max(together - sum(square for _, square in own), 0.0)
    pairs = [*zip(singles, own, strict=True)]
    told = [_told(single.problem, at, single.noise_sd) for single, (at, _) in pairs]
    freedom = sum(told) - _told(likelihood.problem, likelihood.best)
    shares = np.array(told) / max(sum(told), 1)
    return increase, freedom, _chance(increase, freedom, _common(singles, shares))


def _chance(increase: float, more: float, freedom: float) -> float:
    return float(fdtrc(more, freedom, max(increase, 0.0) / more)) if more > 0 else 1.0


def _find_odd(
    likelihood: Likelihood, singles: Sequence[Likelihood], own: Sequence[tuple[Array, float]]
) -> int | None:
    """Return the only trace without which the others agree, if there is one."""
    found = []
    for odd in range(len(singles)):
        rest = [single for index, single in enumerate(singles) if index != odd]
        fits = [fit for index, fit in enumerate(own) if index != odd]
        problem = stack([one.problem for one in rest], np.array([one.noise_sd for one in rest]))
        best = fit_from([problem] * len(own), np.array([likelihood.best, *(at for at, _ in fits)]))
        at = best.x[int(np.argmin(best.misfit))]
        together = Likelihood(problem, at, 1.0, 1.0, 0.0, 0.0)
        if _increase(together, rest, fits)[2] >= levels.ONE_SAMPLE:
            found.append(odd)
    return found[0] if len(found) == 1 else None


@dataclass(frozen=True)
class _Ratios:
    """Logarithms of ratios of stiffness to the first trace, their covariance, and fall of chi^2."""

    logs: Array
    covariance: Array
    fall: float

    def over(self, contrasts: Array, root: float) -> Array:
        """Return ratios, contrasts of their logarithms, with limits, (n_contrasts, 3)."""
        logs = contrasts @ self.logs
        variances = np.einsum("ij,jk,ik->i", contrasts, self.covariance, contrasts)
        room = root * np.sqrt(np.maximum(variances, 0.0))
        return np.exp(np.array([logs, logs - room, logs + room]).T)


def _fit_ratios(likelihood: Likelihood, singles: Sequence[Likelihood]) -> _Ratios:
    """Fit a sample of which each trace after the first has a stiffness of its own as a ratio.

    All springs, dampers and springpots of a trace are multiplied by its ratio.
    """
    # Imported here: loading it takes longer than a short job.
    from scipy.optimize import least_squares

    model, count = likelihood.problem.residuals.model, len(likelihood.best)
    stiff = np.array([float(parameter.kind in _STIFF) for parameter in model.parameters])

    def rows(z: Array) -> tuple[Array, Array]:
        left, slopes = list[Array](), list[Array]()
        for trace, single in enumerate(singles):
            by_ratio = np.eye(len(singles))[trace, 1:]
            at = z[:count] + stiff * (by_ratio @ z[count:])
            both = single.problem.residuals.condensed_responses(at[None])[0] / single.noise_sd
            left.append(both[0] - single.problem.residuals.trace.rows / single.noise_sd)
            slopes.append(np.vstack((both[1:], np.outer(by_ratio, stiff @ both[1:]))))
        return np.concatenate(left), np.concatenate(slopes, axis=1)

    problem, none = likelihood.problem, np.zeros(len(singles) - 1)
    start = np.append(np.clip(likelihood.best, problem.low, problem.high), none)
    ends = (
        np.append(end, none + by)
        for end, by in ((problem.low - 1e-9, -_MOST_EFOLDS), (problem.high + 1e-9, _MOST_EFOLDS))
    )
    how = {"x_scale": "jac", **dict.fromkeys(("ftol", "xtol", "gtol"), _ACCURACY)}
    fit = least_squares(lambda z: rows(z)[0], start, lambda z: rows(z)[1].T, tuple(ends), **how)
    slopes = rows(fit.x)[1]
    prior = np.append(np.ones(count), none)
    inverse = np.linalg.pinv(slopes @ slopes.T + np.diag(prior))[count:, count:]
    fall = _chi_squared(problem, likelihood.best) - 2 * float(fit.cost)
    logs = np.append(0.0, fit.x[count:])
    return _Ratios(logs, np.pad(inverse, ((1, 0), (1, 0))), max(fall, 0.0))
