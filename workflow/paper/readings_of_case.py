"""Identifications of a case by the genetic algorithm under a reading of the paper."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import biogrip_study.records.identifications as records
from biogrip.arrays import Array
from biogrip.config.source import overlaid
from biogrip.files import write_rows
from biogrip.fit.least_squares import refit
from biogrip.fit.problem import Fit, TraceProblem
from biogrip.keys import built
from biogrip.physics.noise import add_noise, rms, stream
from biogrip.terminal import Progress
from biogrip_study.config.study import Case
from biogrip_study.config.study_blocks import CaseBlock
from biogrip_study.methods.genetic import identify_many
from biogrip_study.records.traces import read_target
from biogrip_study.stages.identification import seed_groups
from biogrip_study.stages.job import arguments, logged
from biogrip_study.stages.targets import response

if TYPE_CHECKING:
    snakemake: Any


def identify_reading(case: Case, reading: str, target: Path, rows: Path) -> None:
    """Identify every noisy trace of a case under a reading by the genetic algorithm.

    Random streams are those of the study, so a reading that changes nothing reproduces the
    study's results.
    """
    changes = case.study.config.readings[reading].changes
    read = replace(case, block=built(CaseBlock, overlaid(case.plain, changes)))
    time_s, _, clean = read_target(target, case.times_s)
    if (read.gripper, len(read.times_s)) != (case.gripper, len(time_s)):
        time_s, (clean, _) = read.times_s, response(read, read.times_s)
    header = *records.identification_columns(read.sample.model), records.LAST_IMPROVEMENT
    write_rows(rows, header, _rows(read, reading, time_s, clean))


def _rows(case: Case, name: str, time_s: Array, clean: Array) -> Iterator[tuple[str | int, ...]]:
    progress, experiment = Progress(f"{case.name}, {name}", case.seeds), case.experiment
    for seeds in seed_groups(range(case.seeds)):
        rngs = _streams(case, seeds, "noise")
        traces = [add_noise(clean, case.noise, rng, time_s) for rng in rngs]
        answers = _best(case, name, seeds, experiment.of_each(time_s, traces))
        for seed, trace, answer in zip(seeds, traces, answers, strict=True):
            falls = np.flatnonzero(np.diff(answer.history.best_misfit) < 0)
            found = records.row_of(experiment, answer, rms(trace - clean))
            yield case.name, name, seed, *found, int(falls[-1]) + 1 if len(falls) else 0
        progress.done(len(seeds))


def _streams(case: Case, seeds: Sequence[int], purpose: str) -> list[np.random.Generator]:
    return [stream(case.study.config.study_seed, case.name, seed, purpose) for seed in seeds]


def _best(case: Case, name: str, seeds: Sequence[int], problems: list[TraceProblem]) -> list[Fit]:
    """Return the best run on each trace, with the local fit that follows if there is one."""
    reading, runs = case.study.config.readings[name], list[list[Fit]]()
    for number in range(reading.runs):
        rngs = _streams(case, seeds, f"genetic {number}" if number else "genetic")
        runs.append(identify_many(problems, case.block.method("genetic"), rngs))
    best = [min(of_trace, key=attrgetter("misfit")) for of_trace in zip(*runs, strict=True)]
    if not reading.polished:
        return best
    # A gene's zero has no logarithm.
    starts = [np.log(np.maximum(fit.parameters, 1e-300)) for fit in best]
    starts = np.clip(starts, problems[0].low, problems[0].high)
    return [
        refit(fit, problem, start)
        for fit, problem, start in zip(best, problems, starts, strict=True)
    ]


if __name__ == "__main__":
    with logged(snakemake):
        identify_reading(**arguments(snakemake, identify_reading))
