"""Stage 4: how often the intervals hold the truth, and how the estimates scatter."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.files import written_whole
from biogrip.identifiability.document import read_verdicts
from biogrip.identifiability.fisher import covariance
from biogrip.identifiability.profile import likelihood_of, limits_near
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identifiability.verdicts import DETERMINED
from biogrip.identify.answer import silent
from biogrip.identify.local_fit import local_fit, settled
from biogrip.identify.methods import identifier
from biogrip.measurement import Noise, add_noise, standard_deviation
from biogrip.progress import Progress
from biogrip.random_streams import stream
from biogrip.sample import with_fixed
from biogrip.study.case_problem import case_problem
from biogrip.traces import read_target

COLUMNS = ("case", "quantity", "seed", "estimate", "low", "high", "estimate_rest_known")


def run(
    settings: dict[str, Any],
    seeds: list[int],
    target: Path,
    expected: Path,
    output: Path,
    calibrated: Path | None = None,
) -> None:
    """Identify a batch of seeds by least squares, with intervals for what should be determined.

    The noise of a seed is the same as in its measurement. A second estimate has
    the parameters of which the trace carries no information at their true values,
    as the Cramer-Rao bound has them.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``confidence``, ``noise``, ``parameters`` (the
        true ones), what `case_problem` needs, and ``least_squares``.
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
    truth = posed.logs(settings["parameters"])
    _, sensitivity = posed.of(time_s, rotation).residuals(truth)
    spread = np.diag(covariance(sensitivity, standard_deviation(rotation, noise)))
    told = np.flatnonzero(np.isfinite(spread))
    names = posed.searched.names
    given = {name: settings["parameters"][name] for i, name in enumerate(names) if i not in told}
    rest_known = with_fixed(posed.searched, given)
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
            simpler = posed.of(time_s, trace, rest_known)
            bottom = settled(simpler, local_fit(simpler, truth[told]))
            known = truth.copy()
            known[told] = bottom.log_parameters
            for quantity in quantities:
                limits = limits_near(likelihood, quantity)
                numbers = (quantity.log(likelihood.best), *limits, quantity.log(known))
                texts = ["" if u is None else f"{math.exp(u):.5g}" for u in numbers]
                writer.writerow((case, quantity.label, seed, *texts))
            progress.done()


def _determined(expected: Path) -> set[str]:
    found = read_verdicts(expected)["quantities"]
    return {item["quantity"] for item in found if item["verdict"] == DETERMINED}
