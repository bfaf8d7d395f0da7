"""Stage 4: how often the intervals hold the truth, and how the estimates scatter."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.noise import Noise, add_noise, standard_deviation
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sample import with_fixed
from biogrip.identifiability.fisher import covariance
from biogrip.identifiability.many_limits import limits_of
from biogrip.identifiability.profile import likelihood_of
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identifiability.verdicts import DETERMINED
from biogrip.identify.answer import silent
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.many_starts import fitted_from
from biogrip.identify.methods import METHODS, identifier
from biogrip.products.files.intervals import INTERVALS
from biogrip.products.files.traces import TARGETS, read_target
from biogrip.products.files.verdicts import EXPECTED, read_verdicts
from biogrip.products.plan import Wildcards
from biogrip.products.product import Product, Weight, the
from biogrip.products.stages.calibrated import calibration_of
from biogrip.products.stages.groups import groups
from biogrip.progress import Progress
from biogrip.study.study import Study


@dataclass(frozen=True)
class Settings:
    """What intervals are made of.

    Parameters
    ----------
    study_seed, case
        Whose random streams.
    problem, least_squares
        What is identified, and by how many fits.
    parameters
        True values by name, SI units.
    noise
        What is added to the target.
    confidence
        Of the intervals.
    """

    study_seed: int
    case: str
    problem: CaseProblem
    least_squares: object
    parameters: Mapping[str, float]
    noise: Noise
    confidence: float


def settings(study: Study, job: Wildcards) -> Settings:
    """Choose what a case's intervals depend on."""
    case = study.case(job["case"])
    return Settings(
        study.study_seed,
        case.name,
        case.problem,
        case.method("least_squares"),
        case.parameters,
        case.noise,
        case.confidence,
    )


def estimate(
    settings: Settings,
    seeds: Sequence[int],
    target: Path,
    expected: Path,
    calibrated: list[Path],
    intervals: Path,
) -> None:
    """Identify a batch of seeds by least squares, with intervals for what should be determined.

    The noise of a seed is the same as in its measurement. A second estimate has
    the parameters of which the trace carries no information at their true values,
    as the Cramer-Rao bound has them.

    Parameters
    ----------
    settings
        How.
    seeds
        The batch.
    target
        A target, CSV.
    expected
        Which quantities its traces should determine, JSON.
    calibrated
        A calibration, YAML, whose arms replace the gripper's, if there is one.
    intervals
        A row per quantity and seed, CSV.
    """
    posed = settings.problem.calibrated(calibrated)
    time_s, _, rotation = read_target(target)
    INTERVALS.write(
        intervals, _rows(settings, posed, seeds, time_s, rotation, _determined(expected))
    )


def _rows(
    settings: Settings,
    posed: CaseProblem,
    seeds: Sequence[int],
    time_s: Array,
    rotation: Array,
    wanted: set[str],
) -> Iterator[tuple[str | int, ...]]:
    case, noise, parameters = settings.case, settings.noise, settings.parameters
    identify = identifier("least_squares", settings.least_squares)
    quantities = [q for q in parameters_and_sum(posed.searched) if q.label in wanted]
    truth = posed.logs(parameters)
    _, sensitivity = posed.of(time_s, rotation).residuals(truth)
    spread = np.diag(covariance(sensitivity, standard_deviation(rotation, noise)))
    told = np.flatnonzero(np.isfinite(spread))
    names = posed.searched.names
    given = {name: parameters[name] for i, name in enumerate(names) if i not in told}
    rest_known = with_fixed(posed.searched, given)
    progress = Progress(f"{case}, intervals", len(seeds))
    for group in groups(seeds):
        streams = {
            purpose: [stream(settings.study_seed, case, seed, purpose) for seed in group]
            for purpose in ("noise", "coverage")
        }
        traces = [add_noise(rotation, noise, rng) for rng in streams["noise"]]
        problems = [posed.of(time_s, trace) for trace in traces]
        found = identify(problems, streams["coverage"], silent)
        likelihoods = [
            likelihood_of(
                problem, np.log(each.parameters), each.misfit_rad, confidence=settings.confidence
            )
            for problem, each in zip(problems, found, strict=True)
        ]
        limits = limits_of(likelihoods, quantities)
        simpler = [posed.of(time_s, trace, rest_known) for trace in traces]
        known = np.tile(truth, (len(group), 1))
        known[:, told] = fitted_from(simpler, truth[told])
        for index, seed in enumerate(group):
            for which, quantity in enumerate(quantities):
                best, other = quantity.log(likelihoods[index].best), quantity.log(known[index])
                numbers = (best, *limits[index, which], other)
                texts = ["" if math.isnan(u) else f"{math.exp(u):.5g}" for u in numbers]
                yield case, quantity.label, seed, *texts
        progress.done(len(group))


def _determined(expected: Path) -> set[str]:
    found = read_verdicts(expected)["quantities"]
    return {item["quantity"] for item in found if item["verdict"] == DETERMINED}


INTERVAL = Product(
    "intervals",
    {"intervals": INTERVALS.batch_path},
    estimate,
    settings,
    lambda plan: plan.batch_jobs("coverage", plan.study.covered),
    message="Estimates and intervals of {case}, {batch}",
    reads={"target": the(TARGETS), "expected": the(EXPECTED), "calibrated": calibration_of()},
    weight=Weight(120, 1000),
    modules=lambda _: (METHODS["least_squares"].module,),
)
