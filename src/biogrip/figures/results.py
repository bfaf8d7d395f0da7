"""What the figures of results read: a case's best seed, its trace and its fit."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.protocol import torque_steps
from biogrip.response.linear import rotation, step_response
from biogrip.sample import MODELS
from biogrip.study import build
from biogrip.study.batches import parse_batch
from biogrip.tables.errors import read_identifications
from biogrip.traces import read_measurements

SYMBOLS = {"k": "$k$", "k_p": "$k_p$", "c": "$c$", "c_p": "$c_p$"}


@dataclass(frozen=True)
class Fit:
    """The identification of lowest misfit and what it was made from.

    Parameters
    ----------
    seed, generations
        Which one it is and when it stopped.
    time_s, target_rad, measured_rad, fitted_rad : (n_samples,)
        The traces.
    """

    seed: int
    generations: int
    time_s: Array
    target_rad: Array
    measured_rad: Array
    fitted_rad: Array


def best_fit(settings: dict[str, Any], identifications: Path, measurements: list[Path]) -> Fit:
    """Read the seed of lowest misfit and simulate its answer.

    Parameters
    ----------
    settings
        ``model``, ``gripper``, ``protocol``.
    identifications
        Identifications of the case, CSV.
    measurements
        Its noisy traces, Parquet; named after their batch of seeds.
    """
    found = read_identifications(identifications)
    best = found.loc[found["misfit_rad"].idxmin()]
    seed = int(best["seed"])
    recorded = read_measurements(_holding(seed, measurements), [seed])
    model = MODELS[settings["model"]]
    parameters = [float(best[parameter.column]) for parameter in model.parameters]
    steps = torque_steps(build.phases(settings["protocol"]))
    response = step_response(
        build.gripper(settings["gripper"]),
        model.network(np.array([parameters])),
        symmetric_torque=steps.symmetric,
    )
    fitted = rotation(response, steps, recorded.time_s)[0]
    return Fit(
        seed,
        int(best["generations"]),
        recorded.time_s,
        recorded.target_rad,
        recorded.rotation_rad[seed],
        fitted,
    )


def read_history(path: Path) -> pd.DataFrame:
    """Read the histories of a case.

    Raises
    ------
    BiogripError
        If the file cannot be read.
    """
    try:
        return pd.read_parquet(path)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as histories: {error}.") from error


def scale_of(values: Array, unit: str) -> tuple[float, str]:
    """Return factor and unit that put values between 1 and 1000, e.g. ``(1e6, "µrad")``."""
    largest = float(np.max(np.abs(values)))
    for factor, prefix in ((1.0, ""), (1e3, "m"), (1e6, "µ")):
        if largest * factor >= 1:
            return factor, prefix + unit
    return 1e9, f"n{unit}"


def _holding(seed: int, measurements: list[Path]) -> Path:
    for path in measurements:
        batch = parse_batch(path.stem)
        if batch and batch.first <= seed <= batch.last:
            return path
    raise BiogripError(f"no measurement file holds seed {seed}.")
