"""Stage 2: noisy traces of a target, one per seed."""

from collections.abc import Iterable
from pathlib import Path

from biogrip.experiment.noise import add_noise
from biogrip.experiment.random_streams import stream
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Weight, the
from biogrip.products.uses import from_case
from biogrip.records.traces import (
    MEASUREMENTS,
    TARGETS,
    Measurements,
    read_target,
    write_measurements,
)
from biogrip.study.study import Case


def measure(case: Case, seeds: Iterable[int], target: Path, measurements: Path) -> None:
    """Add noise of each seed in a batch to a target, CSV, and write the traces, Parquet."""
    time_s, _, rotation = read_target(target)
    traces = {
        seed: add_noise(
            rotation,
            case.noise,
            stream(case.study.study_seed, case.name, seed, "noise"),
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
    from_case("name noise study.study_seed"),
    _jobs,
    message="Adding noise to {case}, {batch}",
    reads={"target": the(TARGETS)},
    weight=Weight(10, 1000, group="batch"),
)
