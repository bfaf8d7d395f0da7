"""Local fits and confidence limits in the libraries of others.

All see the residuals that our own fits see, condensed to some fifty rows in units of
the noise, with exact derivatives by the log-parameters, and the prior, as in `Objective`: what
has been computed at a point is kept there for them. Each is set up as its documentation shows.
"""

from collections.abc import Sequence

import lmfit
import numpy as np
import pypesto
from pypesto import optimize, profile
from scipy.optimize import least_squares
from scipy.special import chdtr

from benchmarks.starts import Started
from biogrip.arrays import Array
from biogrip.identify.local_fits import FINE, PRIOR_WIDTH, ROUGH
from biogrip.identify.multi_start import FINISHED
from biogrip.identify.problem import Problem as Posed

# Of pyPESTO's steps along a profile, in standard deviations: first, smallest and largest.
_STEPS = (0.5, 0.1, 1.0)


class Objective:
    """Rows of the residuals in units of the noise, and of the prior, for one point at a time.

    Parameters
    ----------
    case_problem
        What is fitted.
    """

    def __init__(self, case_problem: Posed) -> None:
        self.low, self.high = case_problem.low, case_problem.high
        self._residuals = case_problem.residuals
        self._middle = 0.5 * (case_problem.low + case_problem.high)
        self._prior = np.eye(len(self._middle)) / PRIOR_WIDTH
        self._last: tuple[Array, Array, Array, float] | None = None

    def rows(self, x: Array) -> Array:
        """Rows, (n_rows,), at log-parameters (n_parameters,)."""
        return self._at(x)[1]

    def jacobian(self, x: Array) -> Array:
        """Their Jacobian, (n_rows, n_parameters)."""
        return self._at(x)[2]

    def misfit_rad(self, x: Array) -> float:
        """RMS misfit."""
        return self._at(x)[3]

    def _at(self, x: Array) -> tuple[Array, Array, Array, float]:
        """All of it; the last is kept, for rows and Jacobian are asked for in turn."""
        if self._last is None or not np.array_equal(self._last[0], x):
            found = self._residuals.condensed_responses(x[None])[0]
            found[0] -= self._residuals.condensed_trace
            misfit_rad = float(np.linalg.norm(found[0])) / np.sqrt(self._residuals.samples)
            found /= self._residuals.noise_scale_rad
            rows = np.append(found[0], (x - self._middle) / PRIOR_WIDTH)
            self._last = x.copy(), rows, np.concatenate((found[1:].T, self._prior)), misfit_rad
        return self._last


def by_scipy(trace: Started) -> Array:
    """Fit by SciPy's bounded trust region from every start; log-parameters of the best."""
    case_problem, objective = trace.case_problem, Objective(trace.case_problem)
    bounds = case_problem.low, case_problem.high
    found = [
        least_squares(objective.rows, start, objective.jacobian, bounds) for start in trace.starts
    ]
    best: Array = min(found, key=lambda fit: fit.cost).x
    return best


def by_scipy_in_two_turns(trace: Started) -> Array:
    """Fit by the same roughly from every start, and only the best of these to the end."""
    objective = Objective(trace.case_problem)
    rough = [_local_fit(objective, start, ROUGH) for start in trace.starts]
    rough.sort(key=objective.misfit_rad)
    fine = [_local_fit(objective, x, FINE) for x in rough[:FINISHED]]
    return min(fine, key=objective.misfit_rad)


def _local_fit(objective: Objective, start: Array, tolerance: float) -> Array:
    inside = 1e-9 * (objective.high - objective.low)
    found: Array = least_squares(
        objective.rows,
        np.clip(start, objective.low + inside, objective.high - inside),
        objective.jacobian,
        (objective.low, objective.high),
        ftol=tolerance,
        xtol=FINE,
        gtol=FINE,
    ).x
    return found


def by_lmfit(trace: Started) -> Array:
    """Fit by lmfit's Levenberg-Marquardt from every start; log-parameters of the best."""
    found = [minimizer(trace.case_problem, start).minimize() for start in trace.starts]
    best = min(found, key=lambda fit: fit.chisqr)
    return np.array([parameter.value for parameter in best.params.values()])


def by_pypesto(trace: Started) -> Array:
    """Fit by pyPESTO's multi-start of a trust region; log-parameters of the best."""
    _, result = multi_start(trace.case_problem, trace.starts)
    best: Array = result.optimize_result.x[0]
    return best


def minimizer(case_problem: Posed, start: Array) -> lmfit.Minimizer:
    """Set lmfit up."""
    objective = Objective(case_problem)
    parameters = lmfit.create_params(
        **{
            f"x{index}": {"value": value, "min": low, "max": high}
            for index, (value, low, high) in enumerate(
                zip(start, case_problem.low, case_problem.high, strict=True)
            )
        }
    )

    def rows(tried: lmfit.Parameters) -> Array:
        return objective.rows(np.array([parameter.value for parameter in tried.values()]))

    def slopes(tried: lmfit.Parameters) -> Array:
        jacobian = objective.jacobian(np.array([parameter.value for parameter in tried.values()]))
        return jacobian[:, [parameter.vary for parameter in tried.values()]]

    return lmfit.Minimizer(rows, parameters, scale_covar=False, Dfun=slopes)


def multi_start(case_problem: Posed, starts: Array) -> tuple[pypesto.Problem, pypesto.Result]:
    """Set pyPESTO up, and fit."""
    objective = Objective(case_problem)

    def half_square_sum(x: Array) -> float:
        rows = objective.rows(x)
        return 0.5 * float(rows @ rows)

    # Functions, for pyPESTO copies whatever else it is given, all that belongs to it and deeply.
    problem = pypesto.Problem(
        pypesto.Objective(
            fun=half_square_sum,
            grad=lambda x: objective.jacobian(x).T @ objective.rows(x),
            res=lambda x: objective.rows(x),
            sres=lambda x: objective.jacobian(x),
        ),
        lb=case_problem.low,
        ub=case_problem.high,
        x_guesses=starts,
        x_scales=["log"] * len(case_problem.low),
    )
    result = optimize.minimize(
        problem, optimizer=_trust_region(), n_starts=len(starts), progress_bar=False
    )
    return problem, result


def lmfit_limits(
    fit: lmfit.Minimizer, best: lmfit.minimizer.MinimizerResult, which: Sequence[int]
) -> Array:
    """Find 95 % limits of some log-parameters by `lmfit.conf_interval`, (n, 2).

    Its F test would take the condensed rows for samples; chi-squared knows the noise. As in
    ours, the prior is no part of it.
    """
    names = [f"x{index}" for index in which]

    def chi2(fit: lmfit.minimizer.MinimizerResult) -> float:
        told = fit.residual[: -len(fit.params)]
        return float(told @ told)

    found = lmfit.conf_interval(
        fit,
        best,
        p_names=names,
        sigmas=[0.95],
        prob_func=lambda best, held: chdtr(1, chi2(held) - chi2(best)),
    )
    return np.array([[found[name][0][1], found[name][-1][1]] for name in names])


def pypesto_limits(
    problem: pypesto.Problem,
    result: pypesto.Result,
    which: Sequence[int],
    deviations: Sequence[float] | None = None,
) -> Array:
    """Find 95 % limits of some log-parameters by profiles of pyPESTO, (n, 2).

    Parameters
    ----------
    problem, result
        As of `multi_start`.
    which
        Indices of the parameters.
    deviations
        Their standard deviations, if these are to be the measure of its steps;
        by default it goes by shares of the search range.
    """
    ratio, found = profile.chi2_quantile_to_ratio(0.95), []
    for place, index in enumerate(which):
        options = profile.ProfileOptions(step_size_precheck_mode="off")
        if deviations is not None:
            first, smallest, largest = (step * deviations[place] for step in _STEPS)
            options.update(
                default_step_size_relative=0.0,
                default_step_size_absolute=first,
                min_step_size_absolute=smallest,
                max_step_size_absolute=largest,
            )
        own = pypesto.Result(problem=problem, optimize_result=result.optimize_result)
        profile.parameter_profile(
            problem,
            own,
            _trust_region(),
            profile_index=[index],
            profile_options=options,
            progress_bar=False,
        )
        path = own.profile_result.list[0][index]
        found.append(profile.calculate_approximate_ci(path.x_path[index], path.ratio_path, ratio))
    return np.array(found)


def _trust_region() -> optimize.ScipyOptimizer:
    return optimize.ScipyOptimizer(method="ls_trf")
