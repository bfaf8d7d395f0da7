"""Confidence limits by profile likelihood, against other libraries driving the same residuals."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.optimize import brentq, least_squares

from benchmarks.fit_peers import Objective, lmfit_limits, minimizer, multi_start, pypesto_limits
from benchmarks.section import Row, Section, number, times_ours
from benchmarks.setup import Problem, problem
from benchmarks.starts import fitted, started
from benchmarks.timing import Timed, alternate
from biogrip.arrays import Array
from biogrip.identifiability.likelihood import Likelihood, make_likelihood
from biogrip.identifiability.limits import find_limits
from biogrip.identifiability.profiles import compute_profiles
from biogrip.identifiability.quantities import Quantity, parameters_and_sum

_BATCH, _ROUNDS = 10, 5
_PARAMETERS = ("k", "k_p", "c")

OURS, SIDE_BY_SIDE = "biogrip", f"biogrip, {_BATCH} traces side by side"
WHOLE = "biogrip, whole profiles"
LMFIT = "lmfit.conf_interval"
PYPESTO, PYPESTO_FINE = "pyPESTO, as documented", "pyPESTO, its steps in standard deviations"

_TEXT = f"""\
95 % confidence limits of {", ".join(_PARAMETERS)} from one trace of Table 5's sample, from its
optimum on, the noise being known. *biogrip* takes all parameters and both limits at once, and
*{_BATCH} traces side by side*, as the study counts how often intervals hold the truth, all of
theirs. *Whole profiles* go over all of the search range and follow other basins, too; the others
stop at the limits. All drive the same residuals and Jacobian in logarithms of the parameters
(`benchmarks/fit_peers.py`): lmfit's conf_interval with its Levenberg-Marquardt, pyPESTO's
parameter_profile with SciPy's trust region (ls_trf), its limits interpolated between the steps. As
documented, pyPESTO's steps are shares of the search range, wider than whole intervals; hence again
with steps of a tenth to one standard deviation. Errors are distances from limits that SciPy's
brentq finds with fits to the last digit, in standard deviations."""


def profiles_section() -> Section:
    """Time every library, and measure the errors of its limits."""
    rows = compared([problem(seed) for seed in range(_BATCH)], _ROUNDS)
    columns: dict[str, Callable[[Row], str]] = {
        "library": lambda row: row["library"],
        "time a trace (ms)": lambda row: number(row["time_ms"]),
        "times ours (lowest to highest)": times_ours,
        "times ours side by side": lambda row: number(row["times_side_by_side"]),
        "largest error": lambda row: f"{row['largest_error_deviations']:.1g}",
    }
    return Section("profiles", "Confidence limits", _TEXT, columns, rows)


def compared(problems: Sequence[Problem], rounds: int) -> list[Row]:
    """Find limits of the first trace by every library, and of all by ours side by side."""
    likelihoods = _likelihoods(problems)
    likelihood, case_problem = likelihoods[0], likelihoods[0].problem
    model = problems[0].model
    quantities = [q for q in parameters_and_sum(model) if q.label in _PARAMETERS]
    which = [model.names.index(name) for name in _PARAMETERS]
    deviations = [likelihood.deviation(quantity) for quantity in quantities]
    fit = minimizer(case_problem, likelihood.best)
    best = fit.minimize()
    from_optimum = multi_start(case_problem, likelihood.best[None])
    ways: dict[str, Callable[[], Array]] = {
        OURS: lambda: find_limits([likelihood], quantities)[0][0],
        SIDE_BY_SIDE: lambda: find_limits(likelihoods, quantities)[0][0],
        WHOLE: partial(_whole, likelihood, quantities),
        LMFIT: partial(lmfit_limits, fit, best, which),
        PYPESTO: partial(pypesto_limits, *from_optimum, which),
        PYPESTO_FINE: partial(pypesto_limits, *from_optimum, which, deviations),
    }
    timed = alternate(ways, rounds)
    a_trace = Timed(
        {
            name: spent / (len(likelihoods) if name == SIDE_BY_SIDE else 1)
            for name, spent in timed.seconds.items()
        }
    )
    exact = np.array(
        [
            [exact_limit(likelihood, index, sign * deviation) for sign in (-1, 1)]
            for index, deviation in zip(which, deviations, strict=True)
        ]
    )
    rows: list[Row] = []
    for name, way in ways.items():
        errors = np.abs(way() - exact) / np.array(deviations)[:, None]
        rows.append(
            {
                "library": name,
                **a_trace.against(name, OURS),
                "times_side_by_side": a_trace.against(name, SIDE_BY_SIDE)["times_ours"],
                "largest_error_deviations": float(errors.max()),
            }
        )
    return rows


def exact_limit(likelihood: Likelihood, index: int, step: float) -> float:
    """Find the limit of a log-parameter with a root-finder about fits of all others.

    Parameters
    ----------
    likelihood
        Of the trace.
    index
        Of the parameter.
    step
        Outwards, a third of the way to where the limit is certainly passed.
    """
    objective, best = Objective(likelihood.problem), likelihood.best
    others = np.delete(np.arange(len(best)), index)

    def increase(value: float) -> float:
        """Rise of chi^2 above the threshold."""

        def at(x: Array) -> Array:
            return np.insert(x, index, value)

        found = least_squares(
            lambda x: objective.rows(at(x)),
            best[others],
            lambda x: objective.jacobian(at(x))[:, others],
            (objective.low[others], objective.high[others]),
            ftol=1e-15,
            xtol=1e-15,
            gtol=1e-12,
        )
        return likelihood.increase(objective.misfit_rad(at(found.x))) - likelihood.threshold

    limit: float = brentq(increase, best[index], best[index] + 3 * step, rtol=1e-12)
    return limit


def _likelihoods(problems: Sequence[Problem]) -> list[Likelihood]:
    traces = started(problems)
    return [
        make_likelihood(
            trace.case_problem,
            best,
            float(trace.case_problem.misfit(np.exp(best)[None])[0]),
            confidence=0.95,
            noise_rad=trace.case_problem.residuals.noise_scale_rad,
        )
        for trace, best in zip(traces, fitted(traces), strict=True)
    ]


def _whole(likelihood: Likelihood, quantities: Sequence[Quantity]) -> Array:
    (profiles,) = compute_profiles([likelihood], quantities)
    return np.array([[profile.low, profile.high] for profile in profiles], dtype=float)
