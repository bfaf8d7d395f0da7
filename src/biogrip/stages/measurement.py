"""Stage 2: the response as an instrument records it, one noisy trace a seed."""

from pathlib import Path
from typing import Any

from biogrip.measurement import Noise, add_noise
from biogrip.random_streams import stream
from biogrip.traces import Measurements, read_target, write_measurements


def run(settings: dict[str, Any], seeds: list[int], target: Path, output: Path) -> None:
    """Add the noise of a batch of seeds to a target.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``noise``.
    seeds
        The batch.
    target
        A target, CSV.
    output
        The measurements, Parquet.
    """
    time_s, _, rotation = read_target(target)
    noise = Noise(**settings["noise"])
    traces = {
        seed: add_noise(
            rotation,
            noise,
            stream(settings["study_seed"], settings["case"], seed, "noise"),
        )
        for seed in seeds
    }
    write_measurements(output, Measurements(time_s, rotation, traces))
