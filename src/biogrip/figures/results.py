"""Inputs of result figures: a case's typical seed, its trace and its fit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.methods import typical
from biogrip.physics.instruments import ROTATION, Quantity
from biogrip.physics.simulation import simulated_rotation
from biogrip.physics.whitening import within
from biogrip.records.identifications import read_histories, read_identifications
from biogrip.records.traces import Measurements, read_measurements
from biogrip.stages.job import seeds_of

SHOWN_SEEDS = 100
"""Most seeds drawn individually; figures show the first ones."""


@dataclass(frozen=True)
class Fit:
    """A trace and the response that was fitted to it."""

    time_s: Array
    """Sampling times, (n_samples,)."""
    target_rad: Array | None
    """Noise-free rotation, (n_samples,); None if the trace was recorded."""
    measured_rad: Array
    """Noisy rotation, (n_samples,)."""
    fitted_rad: Array
    """Fitted rotation, (n_samples,)."""
    sd_rad: Array | None = None
    """Standard deviations of the readings, (n_samples,), where they are known."""
    read: Quantity = ROTATION
    """What is read."""


@dataclass(frozen=True, kw_only=True)
class TypicalFit(Fit):
    """The identification of the typical seed, see `typical`."""

    seed: int
    generations: int
    """Number of generations that it took."""


def typical_fit(
    problem: CaseProblem, method: str, identifications: Path, measurements: list[Path]
) -> TypicalFit:
    """Return the trace of the typical seed and its fit, from files of a case."""
    found = read_identifications(identifications, method)
    shown = typical(found)
    seed = int(shown["seed"])
    values = {p.name: float(shown[p.column]) for p in problem.model.parameters}
    recorded = read_measurements(_holding(seed, measurements), [seed])
    fit = fit_of(problem, values, recorded, seed)
    return TypicalFit(**vars(fit), seed=seed, generations=int(shown["generations"]))


def fit_of(
    problem: CaseProblem, parameters: Mapping[str, float], recorded: Measurements, seed: int
) -> Fit:
    """Return the trace of a seed, and the response of parameters with nuisance terms fitted."""
    network = problem.model.sample(parameters)
    simulated = simulated_rotation(
        problem.gripper, network, problem.torque, recorded.time_s, nonlinear=False
    )[0]
    measured = recorded.rotation_rad[seed]
    nuisance = problem.nuisance(recorded.time_s)
    fitted = simulated + within(nuisance, measured - simulated, recorded.sd_rad)
    target, read = recorded.target_rad, problem.instrument.read
    return Fit(recorded.time_s, target, measured, fitted, recorded.sd_rad, read)


def first_seeds(found: pd.DataFrame) -> pd.DataFrame:
    """Return the identifications of seeds that are drawn individually."""
    return found[found["seed"] < SHOWN_SEEDS]


def seeds_in_words(count: int) -> str:
    """Return in words how many seeds are drawn individually."""
    if count == 1:
        return "the only trace"
    return f"all {count} seeds" if count <= SHOWN_SEEDS else f"first {SHOWN_SEEDS} of {count} seeds"


def typical_in_words(found: pd.DataFrame) -> str:
    """Return the label of the typical seed."""
    return f"seed {int(typical(found)['seed'])}, typical" if len(found) > 1 else "the only trace"


def read_history(
    path: Path, method: str, shown: int, values: Sequence[str] = ("best_misfit",)
) -> pd.DataFrame:
    """Read one method's histories of the seeds drawn individually and of the one shown, Parquet."""
    return read_histories(path, method, values, lambda seed: (seed < SHOWN_SEEDS) | (seed == shown))


def scale_of(values: Array, unit: str) -> tuple[float, str]:
    """Return factor and unit that put values between 1 and 1000, e.g. ``(1e6, "µrad")``."""
    largest = float(np.max(np.abs(values)))
    for factor, prefix in ((1.0, ""), (1e3, "m"), (1e6, "µ")):
        if largest * factor >= 1:
            return factor, prefix + unit
    return 1e9, f"n{unit}"


def _holding(seed: int, measurements: list[Path]) -> Path:
    for path in measurements:
        if seed in seeds_of(path.stem):
            return path
    raise BiogripError(f"no measurement file holds seed {seed}.")
