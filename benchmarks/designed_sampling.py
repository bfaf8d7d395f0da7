"""The best sampling of a designed torque, against convex solvers on the same linear problem."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from benchmarks.sampling_gap import feasible, gap_of, typical_bound
from benchmarks.sampling_peers import by_cvxpy
from benchmarks.section import Row, Section, number, times_ours
from benchmarks.setup import CONFIG
from benchmarks.timing import alternate
from biogrip.arrays import Array
from biogrip.design.criteria import Criterion
from biogrip.design.sampling import FINE, best_sampling
from biogrip.design.schedule import SamplingProblem, sampling_problem
from biogrip.study.design_inputs import make_design_inputs
from biogrip.study.load import load_study, read_configs

OURS, CLOSER = "biogrip, as it designs", "biogrip, to 0.001 %"
CLARABEL = "CVXPY with Clarabel"
CRITERIA = ("D", "A")

_CASE, _ROUNDS = "endothelial_cell", 5
_MOST = 2000

_TEXT = """\
When to look, for the designed torque of Table 5's sample (`config/designed.yaml`): its readings
are spread over cells of time, at most as many in each as the camera is fast, so that the Fisher
information of the four log-parameters is the best by a criterion, D its determinant, A the trace
of its inverse. All start from the same sensitivities and capacities; what is timed is from these
arrays to the answer. CVXPY poses it with `log_det` and `matrix_frac`, in parameters for which even
readings have the unit matrix as information, and builds it anew each time, as it must for every
torque; beside it stands the time that Clarabel itself reports. The gap is that of the equivalence
theorem, computed from each answer in the same way: by how much its typical relative bound may
exceed that of the best sampling. The excess is over the lowest of all answers. SCS, CVXPY's
first-order solver, is left out: it takes minutes and stops far from the optimum. Pyomo.DoE is,
too: it differentiates a model by finite differences in copies of it, and is made for Ipopt, which
PyPI does not have for it; with ripopt, which it has, a hundredth of these cells took it minutes
without an answer."""


def sampling_section() -> Section:
    """Time every solver, and measure how good its sampling is."""
    rows = compared(designed_problem(), _ROUNDS)
    columns: dict[str, Callable[[Row], str]] = {
        "criterion": lambda row: row["criterion"],
        "solver": lambda row: row["library"],
        "cells": lambda row: f"{row['cells']:,}",
        "time (ms)": lambda row: number(row["time_ms"]),
        "solver alone (ms)": lambda row: (
            number(row["solver_ms"]) if row["solver_ms"] is not None else "–"
        ),
        "times ours (lowest to highest)": times_ours,
        "times ours to 0.001 %": lambda row: number(row["times_closer"]),
        "gap": lambda row: f"{100 * row['gap']:.2g} %",
        "excess": lambda row: f"{100 * row['excess']:.2g} %",
    }
    return Section("sampling", "When to look", _TEXT, columns, rows)


def designed_problem() -> tuple[SamplingProblem, int]:
    """Return the problem of the designed torque, and how many readings there are."""
    folder = CONFIG.parent
    files = [CONFIG, folder / "design.yaml", folder / "designed.yaml"]
    case = load_study(read_configs(files), files).cases[_CASE]
    inputs = make_design_inputs(case)
    return sampling_problem(inputs, case.phases), inputs.samples


def compared(problem: tuple[SamplingProblem, int], rounds: int) -> list[Row]:
    """Find the best samplings by every solver.

    Parameters
    ----------
    problem
        With the sensitivities of one plausible sample, and how many readings there are.
    rounds
        How often each is timed.
    """
    (cells, samples), rows = problem, []
    sensitivity, capacity = cells.sensitivity[0], cells.capacity
    for name in CRITERIA:
        criterion = Criterion(name, "worst", tuple(range(len(sensitivity))))
        alone: list[float] = []

        def ours(gap: float, criterion: Criterion = criterion) -> Array:
            return best_sampling(
                sensitivity[None], capacity, samples, criterion, gap=gap, most=_MOST, mixing=FINE
            ).samples

        def peer(name: str = name, alone: list[float] = alone) -> Array:
            found, spent_s = by_cvxpy(sensitivity, capacity, samples, name)
            alone.append(spent_s)
            return found

        ways: Mapping[str, Callable[[], Array]] = {
            OURS: partial(ours, 1e-4),
            CLOSER: partial(ours, 1e-5),
            CLARABEL: peer,
        }
        timed = alternate(ways, rounds)
        found = {way: feasible(solve(), capacity, samples) for way, solve in ways.items()}
        bounds = {way: typical_bound(sensitivity, one, name) for way, one in found.items()}
        for way, one in found.items():
            rows.append(
                {
                    "criterion": name,
                    "library": way,
                    "cells": len(capacity),
                    **timed.against(way, OURS),
                    "times_closer": timed.against(way, CLOSER)["times_ours"],
                    "solver_ms": 1e3 * float(np.median(alone)) if way == CLARABEL else None,
                    "gap": gap_of(sensitivity, capacity, one, name),
                    "excess": bounds[way] / min(bounds.values()) - 1,
                }
            )
    return rows
