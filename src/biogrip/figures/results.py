"""Inputs of result figures: one run of each basin, its trace and its fit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.physics.instruments import ROTATION, Channel
from biogrip.physics.noise import within
from biogrip.physics.simulation import simulated_response
from biogrip.records.identifications import read_histories, read_identifications
from biogrip.records.rows import seeds_of
from biogrip.records.success import ALL, basins
from biogrip.records.traces import Measurements, read_measurements
from biogrip.stages.judgement import experiment_for
from biogrip.study.study import Case

SHOWN_SEEDS = 100
"""Most seeds drawn individually; figures show the first ones."""


@dataclass(frozen=True)
class Fit:
    """A trace and the response that was fitted to it."""

    time_s: Array
    """Sampling times, (n_samples,)."""
    target: Array | None
    """Noise-free rotation, (n_samples,); None if the trace was recorded."""
    measured: Array
    """Noisy rotation, (n_samples,)."""
    fitted: Array
    """Fitted rotation, (n_samples,)."""
    sd: Array | None = None
    """Standard deviations of the readings, (n_samples,), where they are known."""
    read: Channel = ROTATION
    """What is read."""


def first_of_basins(found: pd.DataFrame, tolerance: float) -> dict[str, pd.Series]:
    """Return the first run of each of the `basins`, by what it is called in a legend."""
    if len(found) == 1:
        return {"the only trace": found.iloc[0]}
    return {
        f"seed {runs['seed'].iloc[0]}" + f", {name}" * (name != ALL): runs.iloc[0]
        for name, runs in basins(found, tolerance).items()
    }


def fits_of_basins(
    case: Case, identifications: Path, measurements: list[Path], calibrated: list[Path]
) -> dict[str, Fit]:
    """Return the fit of the first run of each basin, by label, from files of a case."""
    found = read_identifications(identifications, case, case.study.shown)
    fits = {}
    for words, run in first_of_basins(found, case.study.near_noise_tolerance).items():
        seed = int(run["seed"])
        values = {p.name: float(run[p.column]) for p in case.sample.model.parameters}
        recorded = read_measurements(_holding(seed, measurements), [seed])
        experiment = experiment_for(case.experiment, recorded, calibrated)
        fits[f"fit ({words})"] = fit_of(experiment, values, recorded, seed)
    return fits


def fit_of(
    problem: Experiment, parameters: Mapping[str, float], recorded: Measurements, seed: int
) -> Fit:
    """Return the trace of a seed, and the response of parameters with nuisance terms fitted."""
    network = problem.model.sample(parameters)
    simulated = simulated_response(
        problem.gripper, network, problem.torque, recorded.time_s, nonlinear=False
    )[0]
    measured = recorded.readings[seed]
    nuisance = problem.nuisance(recorded.time_s)
    fitted = simulated + within(nuisance, measured - simulated, recorded.sd)
    target, read = recorded.target, problem.instrument.read
    return Fit(recorded.time_s, target, measured, fitted, recorded.sd, read)


def first_seeds(found: pd.DataFrame) -> pd.DataFrame:
    """Return the identifications of seeds that are drawn individually."""
    return found[found["seed"] < SHOWN_SEEDS]


def seeds_in_words(count: int) -> str:
    """Return in words how many seeds are drawn individually."""
    if count == 1:
        return "the only trace"
    return f"all {count} seeds" if count <= SHOWN_SEEDS else f"first {SHOWN_SEEDS} of {count} seeds"


def read_history(
    path: Path, method: str, shown: Sequence[int], values: Sequence[str] = ("best_misfit",)
) -> pd.DataFrame:
    """Read one method's histories of the seeds drawn individually and of those shown."""
    found = read_histories(path, method, values)
    return found[found["seed"].isin({*range(SHOWN_SEEDS), *shown})]


def scale_of(values: Array, unit: str) -> tuple[float, str]:
    """Return factor and unit that put values between 1 and 1000, e.g. ``(1e6, "µrad")``."""
    largest = float(np.max(np.abs(values)))
    for factor, prefix in ((1.0, ""), (1e3, "m"), (1e6, "µ")):
        if largest * factor >= 1:
            return factor, prefix + unit
    return 1e9, f"n{unit}"


def scale_of_fit(fit: Fit) -> tuple[float, str]:
    """Return factor and unit with a prefix, where the unit of the readings may have one."""
    plain = fit.read.unit.isalpha()
    return scale_of(fit.fitted, fit.read.unit) if plain else (1.0, fit.read.unit)


def _holding(seed: int, measurements: list[Path]) -> Path:
    for path in measurements:
        if seed in seeds_of(path.stem):
            return path
    raise BiogripError(f"no measurement file holds seed {seed}.")
