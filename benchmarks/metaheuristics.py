"""Which metaheuristic: every method on the same traces, with one budget of model evaluations."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem as Minimised
from pymoo.optimize import minimize as minimize_by_pymoo
from scipy.optimize import differential_evolution, least_squares, minimize

from benchmarks.batch import BATCH
from benchmarks.budget import Search, Spent, evaluations_99
from benchmarks.fit_peers import Objective
from benchmarks.identification import GENERATIONS
from benchmarks.section import Row, Section, number
from benchmarks.setup import CONFIG, POPULATION
from biogrip.arrays import Array
from biogrip.experiment.noise import add_noise, rms
from biogrip.experiment.random_streams import stream
from biogrip.identify.answer import silent
from biogrip.identify.genome import make_genome
from biogrip.identify.identifier import identifier
from biogrip.identify.least_squares import LeastSquaresSettings
from biogrip.identify.methods import METHODS as OURS
from biogrip.response.linear import rotation, step_response
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Case, Study

Generators = Sequence[np.random.Generator]
Method = Callable[[Sequence[Search], Generators], None]
"""Goes on with searches, each with its own generator, until all are over."""

CASES = ("endothelial_cell", "liquid_drop_1", "liquid_drop_2")
SEEDS = 500
# Section 4 taken otherwise; those that only change where or how long is searched are left out.
READINGS = (
    "three_digits",
    "early_mutation",
    "early_mutation_three_digits",
    "mutating_survivors",
    "by_rank",
)
AIMS = ("near_noise", "optimum")
SHOWN = "k"
# The paper's population, and half of it anew in each generation.
BUDGET = POPULATION + GENERATIONS * POPULATION // 2
_REFERENCE = LeastSquaresSettings(candidates=4000, starts=64)

_TEXT = f"""\
Every method on the first {SEEDS} noisy traces of every case, each with the budget of the paper's
population for {GENERATIONS} generations: {BUDGET:,} evaluations of the model. All search the same
ranges by the same misfit of whole batches. The first {len(OURS)} methods are the study's own, with
its settings, and so are the readings of section 4 (`config/interpretations.yaml`), which follow the
algorithm as printed; a chromosome of two digits a parameter cannot reach the cell's optimum. The
others are as they come from pymoo and SciPy; they search the logarithms of the parameters, and see
the misfit as a share of the trace's RMS. Their Nelder-Mead and least squares start from random
points. A method that stops starts again, until the budget is spent or it is at the optimum; one run
of the paper's algorithm takes nearly all of it, so that some are not polished in time. A response
with its derivatives, as least squares has it, counts as one evaluation.
Near the noise is a misfit at most 2 % above the noise; at the optimum is one whose chi^2 = n
(m/m_best)^2, n the samples, is at most 1 above its smallest value, with the m_best of
{_REFERENCE.starts} local fits. t_99 is the number of evaluations after which 99 % of the runs are
there; where fewer are with the whole budget, those of repeated runs: the budget times ln 0.01/ln(1
- p), p their share. The spread of k, in N/m, is what noise makes of the optimum and what the method
adds. A share of {SEEDS} runs is good to 2.3 % or better."""


def side_by_side(searches: Sequence[Search], rngs: Generators, *, case: Case, name: str) -> None:
    """Search by a method of the study, all traces together, with a case's settings and digits."""
    identify = identifier(name, case.method(name))
    genome = make_genome(case.searched, case.ranges)
    left = list(zip(searches, rngs, strict=True))
    while left:
        problems = [replace(search.problem, genome=genome) for search, _ in left]
        for (search, _), answer in zip(
            left, identify(problems, [rng for _, rng in left], silent), strict=True
        ):
            search.add_run(answer)
        left = [(search, rng) for search, rng in left if not search.over]


def one_by_one(
    searches: Sequence[Search],
    rngs: Generators,
    *,
    run: Callable[[Search, np.random.Generator], object],
) -> None:
    """Search by runs of a method from elsewhere, one trace after the other."""
    for search, rng in zip(searches, rngs, strict=True):
        while not search.over:
            try:
                run(search, rng)
            except Spent:
                break


def scipy_differential_evolution(search: Search, rng: np.random.Generator) -> None:
    """Run SciPy's differential evolution, vectorised."""
    differential_evolution(
        lambda x: search.misfit(x.T), _bounds(search), vectorized=True, updating="deferred", rng=rng
    )


def scipy_nelder_mead(search: Search, rng: np.random.Generator) -> None:
    """Run SciPy's simplex search from a random point."""
    minimize(
        lambda x: search.misfit(x[None])[0],
        rng.uniform(search.problem.low, search.problem.high),
        method="Nelder-Mead",
        bounds=_bounds(search),
    )


def scipy_least_squares(search: Search, rng: np.random.Generator) -> None:
    """Run SciPy's trust region from a random point."""
    objective = Objective(search.problem)

    def rows(x: Array) -> Array:
        found = objective.rows(x)
        search.add(np.array([objective.misfit_rad(x)]), np.exp(x)[None], np.ones(1, dtype=int))
        if search.over:
            raise Spent
        return found

    low, high = search.problem.low, search.problem.high
    least_squares(rows, rng.uniform(low, high), objective.jacobian, (low, high))


def pymoo(search: Search, rng: np.random.Generator, *, algorithm: Callable[[], Algorithm]) -> None:
    """Run an algorithm of pymoo."""

    class LogParameters(Minimised):  # type: ignore[misc]
        def _evaluate(self, x: Array, out: dict[str, Array], *args: Any, **kwargs: Any) -> None:
            out["F"] = search.misfit(x)

    low, high = search.problem.low, search.problem.high
    searched = LogParameters(n_var=len(low), n_obj=1, xl=low, xu=high)
    minimize_by_pymoo(searched, algorithm(), seed=int(rng.integers(2**31)))


PEERS: Mapping[str, Method] = {
    name: partial(one_by_one, run=run)
    for name, run in (
        ("SciPy differential evolution", scipy_differential_evolution),
        ("SciPy Nelder-Mead, many starts", scipy_nelder_mead),
        ("SciPy least squares, many starts", scipy_least_squares),
        ("pymoo differential evolution", partial(pymoo, algorithm=DE)),
        ("pymoo CMA-ES", partial(pymoo, algorithm=CMAES)),
        ("pymoo particle swarm", partial(pymoo, algorithm=PSO)),
    )
}


def methods_of(case: Case) -> Iterator[tuple[str, str, Method]]:
    """Yield titles, names of random streams, and methods: the study's, readings, others'."""
    for name, method in OURS.items():
        yield method.title, name, partial(side_by_side, case=case, name=name)
        if name == "genetic":
            for reading in READINGS:
                title = f"{method.title}, {case.study.interpretation_titles[reading]}"
                interpreted = case.interpretations[reading]
                yield title, name, partial(side_by_side, case=interpreted, name=name)
    for title, peer in PEERS.items():
        yield title, title, peer


def metaheuristics_section() -> Section:
    """Run every method on the same traces."""
    runs = [run for case in CASES for run in runs_of(case, range(SEEDS))]
    return section_of(runs)


def section_of(runs: Sequence[Row]) -> Section:
    """Return the section that summarises runs."""
    columns: dict[str, Callable[[Row], str]] = {
        "case": lambda row: row["case"].replace("_", " "),
        "method": lambda row: row["method"],
        "runs": lambda row: str(row["seeds"]),
        "near the noise": lambda row: f"{100 * row['near_noise_share']:.1f} %",
        "t_99 to near the noise": lambda row: _count(row["near_noise_t99"]),
        "at the optimum": lambda row: f"{100 * row['optimum_share']:.1f} %",
        "t_99 to the optimum": lambda row: _count(row["optimum_t99"]),
        "k, 5 to 95 % of runs": lambda row: f"{number(row['k_low'])} to {number(row['k_high'])}",
        "processor time of 1000 evaluations (ms)": lambda row: number(row["ms_per_1000"], 2),
    }
    by_method = pd.DataFrame(runs).groupby(["case", "method"], sort=False)
    rows = [_row(case, method, some) for (case, method), some in by_method]
    return Section("metaheuristics", "Which metaheuristic?", _TEXT, columns, rows)


def runs_of(name: str, seeds: Sequence[int], budget: int = BUDGET) -> list[Row]:
    """Run every method on some traces of a case; a row a method and a seed."""
    study = default_study()
    case = study.cases[name]
    rows = []
    for first in range(0, len(seeds), BATCH):
        chosen = seeds[first : first + BATCH]
        fresh = searches_of(case, chosen, budget)
        for title, streamed, method in methods_of(case):
            searches = [start() for start in fresh]
            rngs = [stream(study.study_seed, name, seed, streamed) for seed in chosen]
            start_s = time.process_time()
            method(searches, rngs)
            share_s = (time.process_time() - start_s) / len(chosen)
            place = case.searched.names.index(SHOWN)
            rows += [
                {
                    "case": name,
                    "method": title,
                    "seed": seed,
                    "budget": budget,
                    **{aim: search.reached.get(aim) for aim in AIMS},
                    SHOWN: float(search.parameters[place]),
                    "misfit_rad": search.lowest_rad,
                    "evaluations": search.evaluations,
                    "seconds": share_s,
                }
                for seed, search in zip(chosen, searches, strict=True)
            ]
    return rows


def _row(case: str, method: str, runs: pd.DataFrame) -> Row:
    budget = int(runs["budget"].iloc[0])
    found: Row = {"case": case, "method": method, "seeds": len(runs), "budget": budget}
    for aim in AIMS:
        reached = runs[aim].dropna().astype(int).tolist()
        found[f"{aim}_share"] = len(reached) / len(runs)
        found[f"{aim}_t99"] = evaluations_99(reached, len(runs), budget)
    found["k_low"], found["k_high"] = runs[SHOWN].quantile([0.05, 0.95]).tolist()
    found["ms_per_1000"] = 1e6 * float(runs["seconds"].sum() / runs["evaluations"].sum())
    return found


def default_study() -> Study:
    """Return the default study, with interpretations of the paper."""
    files = [CONFIG, CONFIG.with_name("interpretations.yaml")]
    return load_study(read_configs(files), files)


def searches_of(case: Case, seeds: Sequence[int], budget: int) -> list[Callable[[], Search]]:
    """Return functions that start the search for the sample of each trace anew."""
    time_s = case.sampling.over(case.problem.torque.end_s)
    truth = np.array([[case.parameters[name] for name in case.sample.model.names]])
    response = step_response(case.gripper, case.sample.model.network(truth))
    clean = rotation(response, case.problem.torque, time_s)[0]

    def streams(purpose: str) -> list[np.random.Generator]:
        return [stream(case.study.study_seed, case.name, seed, purpose) for seed in seeds]

    traces = [add_noise(clean, case.noise, rng, time_s) for rng in streams("noise")]
    problems = [case.problem.of(time_s, trace) for trace in traces]
    best = identifier("least_squares", _REFERENCE)(problems, streams("reference"), silent)

    def start(index: int) -> Search:
        near = (1 + case.study.near_noise_tolerance) * rms(traces[index] - clean)
        above = np.sqrt(1 + case.study.optimum_tolerance / len(time_s))
        aims = dict(zip(AIMS, (near, above * best[index].misfit_rad), strict=True))
        return Search(problems[index], rms(traces[index]), budget, aims)

    return [partial(start, index) for index in range(len(seeds))]


def _bounds(search: Search) -> list[tuple[float, float]]:
    return list(zip(search.problem.low.tolist(), search.problem.high.tolist(), strict=True))


def _count(evaluations: float | None) -> str:
    return "never" if evaluations is None else f"{evaluations:,.0f}"
