"""Stage 3: identifications by the genetic algorithm under other interpretations of the paper."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from biogrip.experiment.noise import add_noise, rms
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sample import SINGLE_BRANCH
from biogrip.fit.answer import Identification
from biogrip.fit.genetic import identify_many
from biogrip.progress import Progress
from biogrip.records.interpretations import INTERPRETATIONS
from biogrip.records.traces import read_target
from biogrip.stages.groups import groups
from biogrip.study.study import Case


def read(case: Case, target: Path, rows: Path) -> None:
    """Identify every noisy trace of a case under every interpretation by the genetic algorithm.

    Random streams are those of the study, so a interpretation that changes nothing reproduces the
    study's results.
    """
    INTERPRETATIONS.write(rows, _rows(case, target))


def _rows(case: Case, target: Path) -> Iterator[tuple[str | int, ...]]:
    time_s, _, rotation = read_target(target)
    progress = Progress(f"{case.name}, interpretations", len(case.interpretations) * case.seeds)
    for name, interpretation in case.interpretations.items():
        case_problem = interpretation.problem
        for seeds in groups(range(case.seeds)):
            streams = {
                purpose: [stream(case.study.study_seed, case.name, seed, purpose) for seed in seeds]
                for purpose in ("noise", "genetic")
            }
            traces = [
                add_noise(rotation, interpretation.noise, rng, time_s) for rng in streams["noise"]
            ]
            problems = [case_problem.of(time_s, trace) for trace in traces]
            found = identify_many(problems, interpretation.genetic, streams["genetic"])
            for seed, trace, answer in zip(seeds, traces, found, strict=True):
                names = case_problem.searched.names
                values = {**case_problem.fixed, **dict(zip(names, answer.parameters, strict=True))}
                yield (
                    case.name,
                    name,
                    seed,
                    *(f"{values.get(p.name, 0.0):.6g}" for p in SINGLE_BRANCH),
                    f"{answer.misfit_rad:.6e}",
                    f"{rms(trace - rotation):.6e}",
                    _last_improvement(answer),
                )
            progress.done(len(seeds))


def _last_improvement(answer: Identification) -> int:
    """Return the last generation in which the best misfit fell."""
    falls = np.flatnonzero(np.diff(answer.history.best_misfit) < 0)
    return int(falls[-1]) + 1 if len(falls) else 0
