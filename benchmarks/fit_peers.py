"""Local fits and confidence limits in the libraries of others.

All see the residuals that our own fits see, condensed to some fifty rows in units of
the noise, with exact derivatives by the log-parameters, as in `Objective`: what has
been computed at a point is kept there for them. Each is set up as its documentation shows.
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
from biogrip.identify.local_fit import ROUGH, Objective, local_fit
from biogrip.identify.multi_start import FINISHED
from biogrip.identify.problem import Problem as Posed

# Of pyPESTO's steps along a profile, in standard deviations: first, smallest and largest.
_STEPS = (0.5, 0.1, 1.0)


def by_scipy(trace: Started) -> Array:
    """Fit by SciPy's bounded trust region from every start; log-parameters of the best."""
    posed, objective = trace.posed, Objective(trace.posed)
    bounds = posed.low, posed.high
    found = [
        least_squares(objective.rows, start, objective.jacobian, bounds) for start in trace.starts
    ]
    best: Array = min(found, key=lambda fit: fit.cost).x
    return best


def by_scipy_in_two_turns(trace: Started) -> Array:
    """Fit by the same roughly from every start, and only the best of these to the end."""
    rough = [local_fit(trace.posed, start, ROUGH) for start in trace.starts]
    rough.sort(key=lambda fit: fit.misfit_rad)
    fine = [local_fit(trace.posed, fit.log_parameters) for fit in rough[:FINISHED]]
    return min(fine, key=lambda fit: fit.misfit_rad).log_parameters


def by_lmfit(trace: Started) -> Array:
    """Fit by lmfit's Levenberg-Marquardt from every start; log-parameters of the best."""
    found = [minimizer(trace.posed, start).minimize() for start in trace.starts]
    best = min(found, key=lambda fit: fit.chisqr)
    return np.array([parameter.value for parameter in best.params.values()])


def by_pypesto(trace: Started) -> Array:
    """Fit by pyPESTO's multi-start of a trust region; log-parameters of the best."""
    _, result = multi_start(trace.posed, trace.starts)
    best: Array = result.optimize_result.x[0]
    return best


def minimizer(posed: Posed, start: Array) -> lmfit.Minimizer:
    """Set lmfit up."""
    objective = Objective(posed)
    parameters = lmfit.create_params(
        **{
            f"x{index}": {"value": value, "min": low, "max": high}
            for index, (value, low, high) in enumerate(
                zip(start, posed.low, posed.high, strict=True)
            )
        }
    )

    def rows(tried: lmfit.Parameters) -> Array:
        return objective.rows(np.array([parameter.value for parameter in tried.values()]))

    def slopes(tried: lmfit.Parameters) -> Array:
        jacobian = objective.jacobian(np.array([parameter.value for parameter in tried.values()]))
        return jacobian[:, [parameter.vary for parameter in tried.values()]]

    return lmfit.Minimizer(rows, parameters, scale_covar=False, Dfun=slopes)


def multi_start(posed: Posed, starts: Array) -> tuple[pypesto.Problem, pypesto.Result]:
    """Set pyPESTO up, and fit."""
    objective = Objective(posed)

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
        lb=posed.low,
        ub=posed.high,
        x_guesses=starts,
        x_scales=["log"] * len(posed.low),
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
