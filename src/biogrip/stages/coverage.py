"""Stage 4: how often the intervals hold the truth, and how the estimates scatter."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.files import written_whole
from biogrip.identifiability.document import read_verdicts
from biogrip.identifiability.profile import likelihood_of, limits_near
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identifiability.verdicts import DETERMINED
from biogrip.identify.answer import silent
from biogrip.identify.methods import identifier
from biogrip.measurement import Noise, add_noise
from biogrip.progress import Progress
from biogrip.random_streams import stream
from biogrip.study.case_problem import case_problem
from biogrip.traces import read_target

COLUMNS = ("case", "quantity", "seed", "estimate", "low", "high")


def run(
    settings: dict[str, Any],
    seeds: list[int],
    target: Path,
    expected: Path,
    output: Path,
    calibrated: Path | None = None,
) -> None:
    """Identify a batch of seeds by least squares, with intervals for what should be determined.

    The noise of a seed is the same as in its measurement.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``confidence``, ``noise``, what `case_problem`
        needs, and ``least_squares``.
    seeds
        The batch.
    target
        A target, CSV.
    expected
        Which quantities its traces should determine, JSON.
    output
        A row per quantity and seed, CSV.
    calibrated
        A calibration, YAML, whose arms replace the gripper's.

    Raises
    ------
    BiogripError
        If an input cannot be read.
    """
    posed = case_problem(settings, calibrated)
    identify = identifier("least_squares", settings)
    time_s, _, rotation = read_target(target)
    wanted = _determined(expected)
    quantities = [q for q in parameters_and_sum(posed.searched) if q.label in wanted]
    noise, case = Noise(**settings["noise"]), settings["case"]
    progress = Progress(f"{case}, intervals", len(seeds))
    with written_whole(output) as scratch, scratch.open("w", newline="") as sink:
        writer = csv.writer(sink, lineterminator="\n")
        writer.writerow(COLUMNS)
        for seed in seeds:
            trace = add_noise(rotation, noise, stream(settings["study_seed"], case, seed, "noise"))
            problem = posed.of(time_s, trace)
            rng = stream(settings["study_seed"], case, seed, "coverage")
            found = identify(problem, rng, silent)
            likelihood = likelihood_of(
                problem,
                np.log(found.parameters),
                found.misfit_rad,
                confidence=settings["confidence"],
            )
            for quantity in quantities:
                limits = limits_near(likelihood, quantity)
                numbers = (quantity.log(likelihood.best), *limits)
                texts = ["" if u is None else f"{math.exp(u):.5g}" for u in numbers]
                writer.writerow((case, quantity.label, seed, *texts))
            progress.done()


def _determined(expected: Path) -> set[str]:
    found = read_verdicts(expected)["quantities"]
    return {item["quantity"] for item in found if item["verdict"] == DETERMINED}
