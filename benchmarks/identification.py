"""One identification, and how much of it is the misfit."""

import time

import numpy as np

from benchmarks.setup import problem, seconds
from biogrip.arrays import Array
from biogrip.identify.genetic import evolve
from biogrip.response.misfit import misfit_of
from biogrip.study import build


def identification_rows() -> list[dict[str, str]]:
    """Time an identification of a fixed seed on each model, and its misfit calls within it."""
    return [_row("linear", nonlinear=False), _row("nonlinear", nonlinear=True)]


def _row(name: str, *, nonlinear: bool) -> dict[str, str]:
    p = problem()
    settings = build.genetic_settings(p.genetic)
    misfit = misfit_of(p.gripper, p.model, p.steps, p.time_s, p.trace_rad, nonlinear=nonlinear)
    spent: list[float] = []

    def timed(parameters: Array) -> Array:
        start = time.perf_counter()
        found = misfit(parameters)
        spent[-1] += time.perf_counter() - start
        return found

    def identify() -> None:
        spent.append(0.0)
        evolve(timed, p.genome, settings, np.random.default_rng(0))

    whole = seconds(identify)
    answer = evolve(misfit, p.genome, settings, np.random.default_rng(0)).identification
    return {
        "model": name,
        "time (ms)": f"{1e3 * whole:.3g}",
        "generations": str(answer.generations),
        "evaluations": str(answer.evaluations),
        "share in the misfit": f"{100 * np.median(spent) / whole:.0f} %",
    }
