"""Stage 2: noisy traces of a target, one per seed."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from biogrip.experiment.noise import Noise, add_noise
from biogrip.experiment.random_streams import stream
from biogrip.products.files.traces import (
    MEASUREMENTS,
    TARGETS,
    Measurements,
    read_target,
    write_measurements,
)
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Weight, the
from biogrip.study.study import Study


@dataclass(frozen=True)
class Settings:
    """Noise of a case, and the origin of its random streams."""

    study_seed: int
    case: str
    noise: Noise


def settings(study: Study, job: Wildcards) -> Settings:
    """Return the settings that a case's noise depends on."""
    return Settings(study.study_seed, job["case"], study.case(job["case"]).noise)


def measure(settings: Settings, seeds: Iterable[int], target: Path, measurements: Path) -> None:
    """Add noise of each seed in a batch to a target, CSV, and write the traces, Parquet."""
    time_s, _, rotation = read_target(target)
    traces = {
        seed: add_noise(
            rotation,
            settings.noise,
            stream(settings.study_seed, settings.case, seed, "noise"),
            time_s,
        )
        for seed in seeds
    }
    write_measurements(measurements, Measurements(time_s, rotation, traces))


def _jobs(plan: Plan) -> list[Wildcards]:
    cases = [*plan.study.simulated, *plan.study.points]
    return [
        {"case": case, "batch": batch.name}
        for case in cases
        for batch in plan.batches("identifications", case, plan.study.shown)
    ]


MEASUREMENT = Product(
    "measurement",
    {"measurements": MEASUREMENTS},
    measure,
    settings,
    _jobs,
    message="Adding noise to {case}, {batch}",
    reads={"target": the(TARGETS)},
    weight=Weight(10, 1000, group="batch"),
)
