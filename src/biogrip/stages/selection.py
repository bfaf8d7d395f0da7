"""Stage 4: every trace fitted with every sample model, for the choice of the simplest adequate."""

import csv
from pathlib import Path
from typing import Any

from biogrip.files import written_whole
from biogrip.identify.answer import silent
from biogrip.identify.methods import identifier
from biogrip.progress import Progress
from biogrip.random_streams import stream
from biogrip.sample import MODELS
from biogrip.study.case_problem import case_problem
from biogrip.traces import read_measurements

COLUMNS = ("case", "model", "seed", "parameters", "samples", "misfit_rad")


def run(
    settings: dict[str, Any],
    seeds: list[int],
    measurements: Path,
    output: Path,
    calibrated: Path | None = None,
) -> None:
    """Fit a batch of seeds by least squares with each model.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``models``, what `case_problem` needs, and
        ``least_squares``.
    seeds
        The batch.
    measurements
        Noisy traces, Parquet.
    output
        A row per model and seed, CSV.
    calibrated
        A calibration, YAML, whose arms replace the gripper's.
    """
    posed = case_problem(settings, calibrated)
    identify = identifier("least_squares", settings)
    recorded = read_measurements(measurements, seeds)
    case = settings["case"]
    progress = Progress(f"{case}, models", len(settings["models"]) * len(seeds))
    with written_whole(output) as scratch, scratch.open("w", newline="") as sink:
        writer = csv.writer(sink, lineterminator="\n")
        writer.writerow(COLUMNS)
        for name in settings["models"]:
            model = MODELS[name]
            for seed in seeds:
                problem = posed.of(recorded.time_s, recorded.rotation_rad[seed], model)
                rng = stream(settings["study_seed"], case, seed, f"model {name}")
                found = identify(problem, rng, silent)
                writer.writerow(
                    (
                        case,
                        name,
                        seed,
                        len(model.names),
                        len(recorded.time_s),
                        f"{found.misfit_rad:.8e}",
                    )
                )
                progress.done()
