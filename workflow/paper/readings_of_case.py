"""Identifications of a case by the genetic algorithm under every reading of the paper."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.config.source import overlaid
from biogrip.keys import built
from biogrip.physics.noise import add_noise, rms, stream
from biogrip.physics.sample_model import SINGLE_BRANCH
from biogrip.terminal import Progress
from biogrip_study.config.case_blocks import CaseBlock
from biogrip_study.config.study import Case
from biogrip_study.methods.genetic import identify_many
from biogrip_study.records.identifications import READINGS
from biogrip_study.records.traces import read_target
from biogrip_study.stages.identification import groups
from biogrip_study.stages.job import arguments, logged
from biogrip_study.stages.targets import response

if TYPE_CHECKING:
    snakemake: Any


def identify_readings(case: Case, target: Path, rows: Path) -> None:
    """Identify every noisy trace of a case under every reading by the genetic algorithm.

    Random streams are those of the study, so a reading that changes nothing reproduces the
    study's results.
    """
    READINGS.write(rows, _reading_rows(case, target))


def _reading_rows(case: Case, target: Path) -> Iterator[tuple[str | int, ...]]:
    time_s, _, rotation = read_target(target, case.times_s)
    readings = case.study.config.readings
    progress = Progress(f"{case.name}, readings", len(readings) * case.seeds)
    for name, reading in readings.items():
        block = built(CaseBlock, overlaid(case.plain, reading.changes))
        read = replace(case, block=block)
        experiment, at, clean = read.experiment, time_s, rotation
        if len(read.times_s) != len(time_s):
            at, (clean, _) = read.times_s, response(read, read.times_s)
        for seeds in groups(range(case.seeds)):
            noises, searches = (
                [stream(case.study.config.study_seed, case.name, seed, purpose) for seed in seeds]
                for purpose in ("noise", "genetic")
            )
            traces = [add_noise(clean, read.noise, rng, at) for rng in noises]
            problems = experiment.of_each(at, traces)
            answers = identify_many(problems, block.method("genetic"), searches)
            for seed, trace, answer in zip(seeds, traces, answers, strict=True):
                names = experiment.searched.names
                values = {**experiment.fixed, **dict(zip(names, answer.parameters, strict=True))}
                falls = np.flatnonzero(np.diff(answer.history.best_misfit) < 0)
                yield (
                    *(case.name, name, seed),
                    *(f"{values.get(p.name, 0.0):.6g}" for p in SINGLE_BRANCH),
                    *(f"{answer.misfit:.6e}", f"{rms(trace - clean):.6e}", answer.generations),
                    int(falls[-1]) + 1 if len(falls) else 0,
                )
            progress.done(len(seeds))


if __name__ == "__main__":
    with logged(snakemake):
        identify_readings(**arguments(snakemake, identify_readings))
