"""One identification at the paper's budget, against other libraries driving the same misfit."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.genetic_peers import Task, by_deap, by_pygad, by_pymoo
from benchmarks.misfit import by_lsim
from benchmarks.section import Row, Section, number, times_ours
from benchmarks.setup import NOISE_FLOOR, problem
from benchmarks.timing import Timed, clocked
from biogrip.arrays import Array, IntArray
from biogrip.identify.genetic import evolve

OURS, DEAP, PYGAD, PYMOO = "biogrip", "DEAP", "PyGAD", "pymoo"
FIRST = "DEAP and scipy.signal.lsim, one by one"
GENERATIONS = 80
_SEEDS = 15
_FIRST_GENERATIONS = 2

_TEXT = f"""\
The paper's genetic algorithm, 500 individuals for {GENERATIONS} generations, on one trace of Table
5's sample, {_SEEDS} seeds. DEAP, PyGAD and pymoo run the same operators as nearly and as fast as
their interfaces allow (`benchmarks/genetic_peers.py`), on the same misfit of whole batches. In the
rows below these they do what they do unless told otherwise: DEAP copies deeply, PyGAD mates
neighbours in rank and mutates every child, pymoo replaces children that are there already. PyGAD
does not evaluate children that equal a parent. The last row is what one would write first, measured
for {_FIRST_GENERATIONS} generations and scaled by the number of evaluations. At the noise floor are
misfits at most 2 % above the noise; a share of {_SEEDS} seeds is good to 13 %."""

Identifier = Callable[[Task, int], tuple[IntArray | Array, float]]


def by_biogrip(task: Task, seed: int) -> tuple[Array, float]:
    """Run this project's algorithm; parameters in place of a chromosome."""
    answer = evolve(
        task.misfit, task.genome, task.settings, np.random.default_rng(seed)
    ).identification
    return answer.parameters, answer.misfit_rad


IDENTIFIERS: Mapping[str, Identifier] = {
    OURS: by_biogrip,
    DEAP: by_deap,
    PYGAD: by_pygad,
    PYMOO: by_pymoo,
    "DEAP, deep copies": partial(by_deap, plain=True),
    "PyGAD, its own operators": partial(by_pygad, plain=True),
    "pymoo, unique children": partial(by_pymoo, plain=True),
}


@dataclass
class Counted:
    """A misfit that counts its evaluations."""

    misfit: Callable[[Array], Array]
    evaluations: int = 0

    def __call__(self, parameters: Array) -> Array:
        """Misfit of parameters of shape (n, n_parameters)."""
        self.evaluations += len(parameters)
        return self.misfit(parameters)


def identification_section() -> Section:
    """Time every library, and report the misfit that each reached."""
    p = problem()
    settings = replace(
        p.genetic,
        patience=GENERATIONS,
        min_generations=GENERATIONS,
        max_generations=GENERATIONS,
    )
    warm_up = Task(p.misfit(), p.genome, replace(settings, max_generations=1))
    for identifier in IDENTIFIERS.values():
        identifier(warm_up, 0)
    counted = {name: Counted(p.misfit()) for name in IDENTIFIERS}
    seconds: dict[str, list[float]] = {name: [] for name in IDENTIFIERS}
    reached: dict[str, list[float]] = {name: [] for name in IDENTIFIERS}
    for seed in range(_SEEDS):
        for name, identifier in IDENTIFIERS.items():
            task = Task(counted[name], p.genome, settings)
            spent, (_, misfit) = clocked(partial(identifier, task, seed))
            seconds[name].append(spent)
            reached[name].append(misfit)
    timed = Timed({name: np.array(spent) for name, spent in seconds.items()})
    rows: list[Row] = []
    for name in IDENTIFIERS:
        above_noise = np.array(reached[name]) / p.noise_rms_rad - 1
        rows.append(
            {
                "library": name,
                **timed.against(name, OURS),
                "evaluations": counted[name].evaluations // _SEEDS,
                "lowest_misfit_above_noise": float(above_noise.min()),
                "seeds_at_noise_floor": int(np.sum(above_noise <= NOISE_FLOOR)),
            }
        )
    evaluations = rows[0]["evaluations"]
    first = Counted(lambda samples: by_lsim(p, samples))
    few = Task(first, p.genome, replace(settings, max_generations=_FIRST_GENERATIONS))
    spent, _ = clocked(lambda: by_deap(few, 0))
    once = Timed({OURS: timed.seconds[OURS], FIRST: np.full(_SEEDS, spent)})
    scaled = once.against(FIRST, OURS, evaluations / first.evaluations)
    rows.append({"library": FIRST, **scaled, "evaluations": evaluations})
    columns: dict[str, Callable[[Row], str]] = {
        "library": lambda row: row["library"],
        "time (ms)": lambda row: number(row["time_ms"]),
        "times ours (lowest to highest)": times_ours,
        "evaluations": lambda row: f"{row['evaluations']:,}",
        "lowest misfit above the noise": lambda row: (
            f"{100 * row['lowest_misfit_above_noise']:.2f} %"
            if "lowest_misfit_above_noise" in row
            else ""
        ),
        "seeds at the noise floor": lambda row: (
            f"{row['seeds_at_noise_floor']} of {_SEEDS}" if "seeds_at_noise_floor" in row else ""
        ),
    }
    title = "One identification at the paper's budget"
    return Section("identification", title, _TEXT, columns, rows)
