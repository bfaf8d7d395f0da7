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
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc, stdtrit

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.fit.joint import stack
from biogrip.fit.least_squares import fit_from
from biogrip.fit.problem import TraceProblem
from biogrip.judging.likelihood import Likelihood

# Accuracy of ratios of stiffness; degrees of freedom that count as infinite.
_ACCURACY, _MOST_FREEDOM = 1e-10, 1e9
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
    odd: int | None
    """The trace without which the others agree, if there is one such."""
    log_ratios: Array
    """Logarithms of the stiffness over that of the first trace, (n_traces,)."""
    covariance: Array
    """Their covariance, (n_traces, n_traces)."""
    roots: tuple[float, float]
    """Standard deviations to a limit, and of a difference that is one (`ONE_SAMPLE`)."""

    @property
    def holds(self) -> bool:
        """True if the traces may be of one sample (`ONE_SAMPLE`)."""
        return self.chance >= levels.ONE_SAMPLE

    def ratios(self, weights: Array) -> Array:
        """Return the stiffness of each trace over a geometric mean, and limits, (n_traces, 3).

        Weights of the traces in the mean, (n_traces,), have the sum one.
        """
        contrasts = np.eye(len(weights)) - weights
        sd = np.sqrt(np.diagonal(contrasts @ self.covariance @ contrasts.T))
        room = np.outer(sd, (0.0, -self.roots[0], self.roots[0]))
        return np.exp((contrasts @ self.log_ratios)[:, None] + room)

    def rises_with(self, what: Sequence[float]) -> int:
        """Return 1 if the ratio of stiffness rises with what differs, -1 if it falls, else 0.

        From its least to its largest value, (n_traces,), the ratio differs, and no step between
        goes the other way, or is one between equal values (`ONE_SAMPLE`).
        """
        order = np.argsort(what, kind="stable")
        apart = np.subtract.outer(self.log_ratios, self.log_ratios)[order][:, order].T
        own = np.diagonal(self.covariance)
        sd = np.sqrt(np.add.outer(own, own) - 2 * self.covariance)[order][:, order]
        signs = np.where(np.abs(apart) > self.roots[1] * sd, np.sign(apart), 0.0)
        steps, equal = np.diagonal(signs, 1), np.diff(np.take(what, order)) == 0
        right = (steps == 0) | ((steps == signs[0, -1]) & ~equal)
        return int(signs[0, -1]) if np.all(right) else 0


def compare_traces(likelihood: Likelihood, singles: Sequence[Likelihood]) -> Agreement:
    """Test whether the traces of a joint likelihood are of one sample.

    Parameters
    ----------
    likelihood
        Of all traces; its problem is their `stack`.
    singles
        Of each trace: its problem in the joint one, its optimum, noise and freedom.
    """
    own = [_best([one.problem] * 2, [one.best, likelihood.best], one) for one in singles]
    increase, freedom, chance = _increase(likelihood, own)
    log_ratios, covariance, fall = _fit_ratios(likelihood, singles)
    common, more = _common(own, np.ones(len(own))), len(own) - 1
    chance = min(1.0, 2 * min(chance, _chance(fall, more, common)))
    odd = []
    if chance < levels.ONE_SAMPLE and more > 1:
        rest = [[*own[:index], *own[index + 1 :]] for index in range(len(own))]
        odd = [index for index, some in enumerate(rest) if _agree(some)]
    both = 0.5 + np.array([likelihood.confidence, 1 - levels.ONE_SAMPLE]) / 2
    return Agreement(
        chance,
        increase,
        freedom,
        _chance(increase - fall, freedom - more, common) >= levels.ONE_SAMPLE,
        odd[0] if len(odd) == 1 else None,
        log_ratios,
        covariance,
        tuple(stdtrit(min(likelihood.freedom, _MOST_FREEDOM), both).tolist()),
    )


def shared_freedom(best: Array, singles: Sequence[Likelihood]) -> float:
    """Return degrees of freedom of the noise of all traces, by what each tells of parameters."""
    parts = [_information(replace(single, best=best)) for single in singles]
    total = sum(parts, np.eye(len(best)))
    return _common(singles, np.array([np.trace(np.linalg.solve(total, part)) for part in parts]))


def _common(singles: Sequence[Likelihood], weights: Array) -> float:
    """Return degrees of freedom of a mean of the traces' variances, by weights, (n_traces,)."""
    shares = weights / max(float(weights.sum()), float(np.finfo(float).tiny))
    freedoms = np.array([single.freedom for single in singles])
    return 1 / max(float(np.sum(shares**2 / freedoms)), 1 / _MOST_FREEDOM)


def _information(likelihood: Likelihood) -> Array:
    rows = likelihood.problem.residuals.condensed_responses(likelihood.best[None])[0, 1:]
    return rows @ rows.T / likelihood.noise_sd**2


def _told(likelihood: Likelihood) -> int:
    """Count the combinations of parameters that a fit adapts."""
    sizes = np.linalg.eigvalsh(_information(likelihood))
    return int(np.count_nonzero(sizes > levels.TELLS))


def _best(problems: list[TraceProblem], starts: list[Array], like: Likelihood) -> Likelihood:
    """Return a likelihood like another one, of a problem's best fit from several starts."""
    fits = fit_from(problems, np.array(starts))
    lowest = int(np.argmin(fits.misfit))
    given = {"best": fits.x[lowest], "misfit": float(fits.misfit[lowest])}
    return replace(like, problem=problems[0], **given)


def _chi_squared(likelihood: Likelihood) -> float:
    return likelihood.problem.residuals.samples * (likelihood.misfit / likelihood.noise_sd) ** 2


def _increase(joint: Likelihood, own: Sequence[Likelihood]) -> tuple[float, int, float]:
    """Return the increase of chi^2 to one sample, its degrees of freedom, and its chance."""
    increase, told = _chi_squared(joint) - sum(map(_chi_squared, own)), [*map(_told, own)]
    freedom = sum(told) - _told(joint)
    return increase, freedom, _chance(increase, freedom, _common(own, np.array(told)))


def _chance(increase: float, more: int, freedom: float) -> float:
    return float(fdtrc(more, freedom, max(increase, 0.0) / more)) if more > 0 else 1.0


def _agree(own: list[Likelihood]) -> bool:
    """Return True if some of the traces, with their own fits, may be of one sample."""
    problem = stack([one.problem for one in own], np.array([one.noise_sd for one in own]))
    starts = [one.best for one in own]
    joint = _best([problem] * len(own), starts, replace(own[0], noise_sd=1.0))
    return _increase(joint, own)[2] >= levels.ONE_SAMPLE


def _fit_ratios(joint: Likelihood, singles: Sequence[Likelihood]) -> tuple[Array, Array, float]:
    """Fit a sample of which each trace after the first has a stiffness of its own as a ratio.

    All springs, dampers and springpots of a trace are multiplied by its ratio. Returns logarithms
    of the ratios, (n_traces,), their covariance, and the fall of chi^2.
    """
    # Imported here: loading it takes longer than a short job.
    from scipy.optimize import least_squares

    parts, count = [single.problem.residuals for single in singles], len(joint.best)
    low, high = joint.problem.low, joint.problem.high
    stiff = np.array([p.kind in _STIFF for p in parts[0].model.parameters], float)

    def rows(z: Array) -> Array:
        at = [np.clip(z[:count] + stiff * ratio, low, high)[None] for ratio in (0.0, *z[count:])]
        shown = [
            part.condensed_responses(x, slopes=False)[0, 0]
            for part, x in zip(parts, at, strict=True)
        ]
        left = zip(shown, parts, singles, strict=True)
        return np.concatenate([(row - of.trace.rows) / one.noise_sd for row, of, one in left])

    start = np.append(joint.best, np.zeros(len(parts) - 1))
    accuracy = dict.fromkeys(("ftol", "xtol", "gtol"), _ACCURACY)
    fit = least_squares(rows, start, jac="3-point", x_scale="jac", **accuracy)
    # A prior of one e-fold, for parameters that no trace tells.
    information = fit.jac.T @ fit.jac + np.diag(np.arange(len(start)) < count)
    covariance = np.pad(np.linalg.pinv(information)[count:, count:], ((1, 0), (1, 0)))
    fall = max(_chi_squared(joint) - 2 * float(fit.cost), 0.0)
    return np.append(0.0, fit.x[count:]), covariance, fall
