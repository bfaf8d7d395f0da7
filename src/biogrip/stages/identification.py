"""Stage 3: the sample's parameters from each noisy trace."""

from pathlib import Path
from typing import Any

from biogrip.calibrated_gripper import read_calibrated_arms
from biogrip.identify.genetic import genetic
from biogrip.identify.genome import genome_of
from biogrip.identify.records import Record, write_histories, write_identifications
from biogrip.measurement import rms
from biogrip.random_streams import stream
from biogrip.response.misfit import misfit_of
from biogrip.sample import with_fixed
from biogrip.study import build
from biogrip.traces import read_measurements


def run(
    settings: dict[str, Any],
    seeds: list[int],
    measurements: Path,
    output: Path,
    history: Path,
    calibrated: Path | None = None,
) -> None:
    """Identify a batch of seeds with the genetic algorithm.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``gripper``, ``protocol`` (and ``actuator``, if
        that is in volts), ``model``, ``branches``, ``nonlinear``, ``fixed``,
        ``search_range``, ``genetic_algorithm``.
    seeds
        The batch.
    measurements
        Noisy traces, Parquet.
    output, history
        Identified parameters, CSV, and the way to them, Parquet.
    calibrated
        A calibration, YAML, whose arms replace the gripper's.
    """
    case, fixed = settings["case"], settings["fixed"]
    model = build.sample_model(settings)
    searched = with_fixed(model, fixed)
    gripper = build.gripper(settings["gripper"])
    if calibrated is not None:
        gripper = read_calibrated_arms(calibrated, gripper)
    torque = build.torque(settings)
    genome = genome_of(searched, build.gene_ranges(settings["search_range"]))
    genetic_settings = build.genetic_settings(settings["genetic_algorithm"])
    recorded = read_measurements(measurements, seeds)
    records = []
    for seed in seeds:
        trace = recorded.rotation_rad[seed]
        misfit = misfit_of(
            gripper, searched, torque, recorded.time_s, trace, nonlinear=settings["nonlinear"]
        )
        rng = stream(settings["study_seed"], case, seed, "genetic")
        answer = genetic(misfit, genome, genetic_settings, rng)
        noise_rms_rad = rms(trace - recorded.target_rad)
        records.append(Record(case, "genetic", seed, model, searched, fixed, answer, noise_rms_rad))
        if settings["nonlinear"]:
            # Seconds each: say so. The linear model's take hundredths.
            print(f"{case}: {len(records)} of {len(seeds)} seeds identified", flush=True)
    write_identifications(output, records)
    write_histories(history, records)
