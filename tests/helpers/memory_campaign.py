"""What is left of the published designs where the noise has memory, with their readings and others.

``python -m tests.helpers.memory_campaign`` takes some minutes, and writes the table that
docs/design.md takes its numbers from. The test suite makes a row with few traces.

Half of the noise's variance is AR(1) noise, drawn step by step (`add_noise`); the bounds are from
whitened sensitivities. Traces are fitted by generalised least squares, Gauss-Newton steps from the
truth, where all bounds are far below one: it is the bound that is verified, not the search.
"""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.design.experiment import NO_BOUND, DesignInputs
from biogrip.design.noise import DesignNoise
from biogrip.design.schedule import sampled
from biogrip.experiment.noise import Noise, add_noise
from biogrip.experiment.noise_parts import AR1
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.random_streams import stream
from biogrip.response.sensitivity import linear_responses
from biogrip.study.design_inputs import make_design_inputs
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Study
from tests.helpers.groups_campaign import write
from tests.helpers.places import CONFIG, ROOT

TABLE = ROOT / "results" / "published" / "design_memory" / "tables" / "design_memory.csv"
CONFIGS = [CONFIG, ROOT / "config" / "design.yaml", ROOT / "config" / "designed.yaml"]
TRACES, SHARE = 500, 0.5

MEMORIES_S = (0.0, 0.01, 1.0)
READINGS = ("published", "spread")
"""Readings of the published designs, or others under their torques, spread for the noise."""

# Bound from which on steps from the truth need not end, traces fitted at once, and steps.
_FITTED, _AT_ONCE, _STEPS = 0.3, 25, 6


def compute_row(
    case_name: str, memory_s: float, along: bool, readings: str, traces: int
) -> pd.DataFrame:
    """Bounds of a case's published torque under noise of some memory, a row a quantity."""
    study = _study()
    case = study.cases[case_name]
    part = AR1(SHARE, memory_s) if memory_s else None
    noise = DesignNoise(ar1=part, offset=along, drift=along)
    inputs = replace(make_design_inputs(case), noise=noise)
    torque = inputs.history(case.phases)
    time_s = case.sampling.over(torque.end_s)
    if readings == "spread":
        time_s = sampled(inputs, case.phases).time_s
    bounds = inputs.bounds(inputs.information(torque, time_s))[0]
    spread = np.full(len(bounds), np.nan)
    if traces and bounds.max() < _FITTED:
        rng = stream(study.study_seed, f"{case_name} {memory_s:g} {readings}", 0, "memory")
        spread = _fit(inputs, torque, time_s, traces, rng).std(axis=0, ddof=1)
    return pd.DataFrame(
        {
            "case": case_name,
            "memory_s": memory_s,
            "along": along,
            "readings": readings,
            "quantity": inputs.model.names,
            "bound_percent": [100 * bound if bound < NO_BOUND else None for bound in bounds],
            "spread_over_bound": spread / bounds,
            "traces": traces if np.isfinite(spread).all() else 0,
        }
    )


def _fit(
    inputs: DesignInputs,
    torque: TorqueHistory,
    time_s: Array,
    traces: int,
    rng: np.random.Generator,
) -> Array:
    """Return errors of logarithms, (n_traces, n_parameters)."""
    level = inputs.noise_rad
    noise = Noise("gaussian", 0.0, "peak", level, ar1=inputs.noise.ar1)
    truth = inputs.parameters[0]

    def respond(logs: Array) -> Array:
        parameters = truth * np.exp(logs)
        rows = linear_responses(
            inputs.gripper, inputs.model, torque, time_s, parameters, inertia=True
        )
        return rows / level

    clean = respond(np.zeros((1, len(truth))))[0, 0] * level
    errors = []
    for count in np.diff([*range(0, traces, _AT_ONCE), traces]):
        noisy = np.stack([add_noise(clean, noise, rng, time_s) for _ in range(count)]) / level
        logs = np.zeros((count, len(truth)))
        for _ in range(_STEPS):
            rows = respond(logs)
            rows[:, 0] = noisy - rows[:, 0]
            white = inputs.noise.whiten(time_s, rows)
            slopes, left = white[:, 1:], white[:, 0]
            # Parameters differ by decades in what is told of them.
            size = np.sqrt(np.sum(slopes**2, axis=2))
            scaled = slopes / size[..., None]
            right = np.einsum("npt,nt->np", scaled, left)[..., None]
            steps = np.linalg.solve(scaled @ scaled.swapaxes(1, 2), right)[..., 0] / size
            logs = logs + np.clip(steps, -0.5, 0.5)
        errors.append(logs)
    return np.concatenate(errors)


def main(cases: Sequence[str]) -> None:
    """Write the table, and print it."""
    jobs = [
        (case, memory_s, along, readings, 0 if along else TRACES)
        for case in cases
        for memory_s in MEMORIES_S
        for along in (False, True)
        for readings in READINGS
    ]
    with ProcessPoolExecutor() as processes:
        tables = list(processes.map(compute_row, *zip(*jobs, strict=True)))
    found = pd.concat(tables)
    print(found.to_string(index=False))
    write(found, TABLE)


@cache
def _study() -> Study:
    return load_study(read_configs(CONFIGS), CONFIGS)


if __name__ == "__main__":
    main(list(_study().simulated))
