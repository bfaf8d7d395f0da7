"""The problem that all benchmarks share, and how they are timed."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from biogrip.arrays import Array
from biogrip.gripper import Gripper
from biogrip.identify.genome import Genome, genome_of
from biogrip.measurement import Noise, add_noise
from biogrip.protocol import TorqueHistory, sample_times
from biogrip.response.linear import rotation, step_response
from biogrip.sample import MODELS, SampleModel
from biogrip.study import build
from biogrip.study.config import load_study

CONFIG = Path(__file__).parents[1] / "config" / "config.yaml"


@dataclass(frozen=True)
class Problem:
    """One noisy trace of Table 5, and what it takes to identify it."""

    gripper: Gripper
    model: SampleModel
    steps: TorqueHistory
    time_s: Array
    trace_rad: Array
    genome: Genome
    genetic: dict[str, Any]


def problem() -> Problem:
    """Return the default study's first case with the noise of a fixed seed."""
    study = load_study(yaml.safe_load(CONFIG.read_text()), [CONFIG])
    case = study.cases["endothelial_cell"]
    model = MODELS[case.model.name]
    gripper = build.gripper(case.blocks["gripper"])
    steps = build.torque({"protocol": case.blocks["protocol"]})
    time_s = sample_times(steps.end_s, case.blocks["measurement"]["rate_Hz"])
    truth = np.array([[case.parameters[name] for name in model.names]])
    clean = rotation(step_response(gripper, model.network(truth)), steps, time_s)[0]
    noise = Noise(**case.blocks["measurement"]["noise"])
    trace = add_noise(clean, noise, np.random.default_rng(0))
    genome = genome_of(model, build.gene_ranges(case.blocks["search_range"]))
    return Problem(gripper, model, steps, time_s, trace, genome, case.blocks["genetic_algorithm"])


def seconds(call: Callable[[], object], at_least_s: float = 0.5) -> float:
    """Return the median time of a call, repeated for a while after one warm-up."""
    call()
    times: list[float] = []
    while sum(times) < at_least_s or len(times) < 3:
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def markdown(rows: list[dict[str, str]]) -> str:
    """Return rows as a Markdown table."""
    return str(pd.DataFrame(rows).to_markdown(index=False, disable_numparse=True))
