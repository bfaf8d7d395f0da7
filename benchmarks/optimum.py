"""Time to the global optimum with 99 % probability, method by method."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem as Minimised
from pymoo.optimize import minimize
from scipy.optimize import differential_evolution

from benchmarks.section import Row, Section, number
from benchmarks.setup import NEAR_NOISE, Problem, problem
from benchmarks.timing import clocked, time_to_success
from biogrip.arrays import Array
from biogrip.experiment.noise import rms
from biogrip.identify.answer import silent
from biogrip.identify.identifier import identifier
from biogrip.identify.methods import METHODS as OURS

Method = Callable[[Problem, np.random.Generator], Array]
"""Finds parameters of low misfit, from the trace on."""

_CASES = ("endothelial_cell", "liquid_drop_1", "liquid_drop_2")
_RUNS = 40

_TEXT = f"""\
Every method runs once on each of the same {_RUNS} noisy traces of every case, from the trace to
the answer. The optimum of a trace is the lowest misfit m_best that any of the methods found on it.
A run has reached it if its own misfit m is as good a fit as noise can tell: chi^2 = n
(m/m_best)^2, n the samples, is less than 1 above its smallest value. With p the share of runs that
reach it, repeating runs until one has done so with a probability of 99 % takes t_99 = t_run max(1,
ln 0.01/ln(1 - p)). A chromosome has two digits a parameter; where the trace determines a parameter
better than that, as for the cell, the genetic algorithm cannot reach the optimum however long it
runs. So the same is given for a weaker aim, a misfit at most 2 % above the noise.
The first {len(OURS)} methods are the study's own, with its settings. The others search the
logarithms of the parameters within the same range, with their own defaults, and see the misfit as
a share of the trace's RMS. A share of {_RUNS} runs is good to 8 % or better."""


def by_study(p: Problem, rng: np.random.Generator, *, name: str) -> Array:
    """Identify by a method of the study."""
    (found,) = identifier(name, p.settings.method(name))([p.case_problem()], [rng], silent)
    return found.parameters


def by_scipy(p: Problem, rng: np.random.Generator) -> Array:
    """SciPy's differential evolution, vectorised."""
    misfit = _relative(p)
    found = differential_evolution(
        lambda x: misfit(x.T), _bounds(p).T, vectorized=True, updating="deferred", rng=rng
    )
    return 10.0**found.x


def by_pymoo(p: Problem, rng: np.random.Generator, *, algorithm: Callable[[], Algorithm]) -> Array:
    """Run an algorithm of pymoo."""
    misfit, (low, high) = _relative(p), _bounds(p)

    class LogParameters(Minimised):  # type: ignore[misc]
        def _evaluate(self, x: Array, out: dict[str, Array], *args: Any, **kwargs: Any) -> None:
            out["F"] = misfit(x)

    searched = LogParameters(n_var=len(low), n_obj=1, xl=low, xu=high)
    found = minimize(searched, algorithm(), seed=int(rng.integers(2**31)))
    return 10.0**found.X


METHODS: Mapping[str, Method] = {
    **{method.title: partial(by_study, name=method.name) for method in OURS.values()},
    "SciPy differential evolution, defaults": by_scipy,
    "pymoo differential evolution": partial(by_pymoo, algorithm=DE),
    "pymoo CMA-ES": partial(by_pymoo, algorithm=CMAES),
}
"""Methods of the study are here by themselves; add another's to have it compared."""


def optimum_section() -> Section:
    """Run every method on the same traces, and turn shares and times into t_99."""
    columns: dict[str, Callable[[Row], str]] = {
        "case": lambda row: row["case"].replace("_", " "),
        "method": lambda row: row["method"],
        "time per run (s)": lambda row: number(row["time_per_run_s"], 2),
        "runs to the optimum": lambda row: f"{100 * row['share_at_optimum']:.0f} %",
        "t_99 to the optimum (s)": lambda row: _seconds(row["t99_to_optimum_s"]),
        "runs near the noise": lambda row: f"{100 * row['share_near_noise']:.0f} %",
        "t_99 to near the noise (s)": lambda row: _seconds(row["t99_to_near_noise_s"]),
    }
    rows = [row for case in _CASES for row in _case(case)]
    return Section("optimum", "Time to the global optimum", _TEXT, columns, rows)


def _case(case: str) -> list[Row]:
    problems = [problem(seed, case=case) for seed in range(_RUNS)]
    seconds, misfits = np.empty((2, len(METHODS), _RUNS))
    for method in METHODS.values():
        method(problems[0], np.random.default_rng(_RUNS))
    for run, p in enumerate(problems):
        misfit = p.misfit()
        for index, method in enumerate(METHODS.values()):
            rng = np.random.default_rng(run)
            seconds[index, run], found = clocked(partial(method, p, rng))
            misfits[index, run] = misfit(found[None])[0]
    noise = np.array([p.noise_rms_rad for p in problems])
    at_optimum = len(problems[0].time_s) * ((misfits / misfits.min(axis=0)) ** 2 - 1) < 1
    at_floor = misfits <= (1 + NEAR_NOISE) * noise
    rows: list[Row] = []
    for index, name in enumerate(METHODS):
        time_s = float(seconds[index].mean())
        optimum, floor = float(at_optimum[index].mean()), float(at_floor[index].mean())
        rows.append(
            {
                "case": case,
                "method": name,
                "runs": _RUNS,
                "time_per_run_s": time_s,
                "share_at_optimum": optimum,
                "t99_to_optimum_s": _finite(time_to_success(time_s, optimum)),
                "share_near_noise": floor,
                "t99_to_near_noise_s": _finite(time_to_success(time_s, floor)),
            }
        )
    return rows


def _bounds(p: Problem) -> Array:
    """Decimal logarithms of the ends of the study's search range, (2, n_parameters)."""
    ranges = [p.ranges[parameter.range_name] for parameter in p.model.parameters]
    return np.log10([[r.low for r in ranges], [r.high for r in ranges]])


def _relative(p: Problem) -> Callable[[Array], Array]:
    """Misfit over the trace's RMS: of order one, as tolerances of general methods expect."""
    misfit, scale = p.misfit(), rms(p.trace_rad)
    return lambda logs: misfit(10.0**logs) / scale


def _finite(time_s: float) -> float | None:
    """JSON has no infinity."""
    return time_s if math.isfinite(time_s) else None


def _seconds(time_s: float | None) -> str:
    return "never" if time_s is None else number(time_s, 2)
