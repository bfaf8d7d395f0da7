"""Stage 3: the sample's parameters from each noisy trace."""

from pathlib import Path
from typing import Any

import numpy as np

from biogrip.identify.genetic import genetic
from biogrip.identify.genome import genome_of
from biogrip.identify.records import Record, write_histories, write_identifications
from biogrip.measurement import rms
from biogrip.protocol import torque_steps
from biogrip.random_streams import stream
from biogrip.response.misfit import PopulationMisfit
from biogrip.sample import MODELS
from biogrip.study import build
from biogrip.traces import read_measurements


def run(
    settings: dict[str, Any],
    seeds: list[int],
    measurements: Path,
    output: Path,
    history: Path,
) -> None:
    """Identify a batch of seeds with the genetic algorithm.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``gripper``, ``protocol``, ``model``,
        ``search_range``, ``genetic_algorithm``.
    seeds
        The batch.
    measurements
        Noisy traces, Parquet.
    output, history
        Identified parameters, CSV, and the way to them, Parquet.
    """
    case = settings["case"]
    model = MODELS[settings["model"]]
    gripper = build.gripper(settings["gripper"])
    steps = torque_steps(build.phases(settings["protocol"]))
    genome = genome_of(model, build.gene_ranges(settings["search_range"]))
    genetic_settings = build.genetic_settings(settings["genetic_algorithm"])
    recorded = read_measurements(measurements, seeds)
    interval_s = float(np.diff(recorded.time_s[[0, -1]])[0]) / (len(recorded.time_s) - 1)
    records = []
    for seed in seeds:
        trace = recorded.rotation_rad[seed]
        misfit = PopulationMisfit(gripper, model, steps, interval_s, trace)
        rng = stream(settings["study_seed"], case, seed, "genetic")
        answer = genetic(misfit, genome, genetic_settings, rng)
        noise_rms_rad = rms(trace - recorded.target_rad)
        records.append(Record(case, "genetic", seed, model, answer, noise_rms_rad))
    write_identifications(output, records)
    write_histories(history, records)
