"""Data for the explorer in the report: traces, fits and models."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import rounded, with_unit
from biogrip.experiment.noise import standard_deviation
from biogrip.experiment.sample import SampleModel
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.methods import Method
from biogrip.products.figures.results import read_history
from biogrip.products.files.identifications import read_identifications
from biogrip.products.files.traces import read_measurements, seeds_in
from biogrip.products.files.verdicts import read_verdicts
from biogrip.response.linear import is_symmetric
from biogrip.study.study import Case

if TYPE_CHECKING:
    import pandas as pd

MOST_SEEDS = 50
MOST_BYTES = 2_000_000
"""Bound on all traces in the report, so that phones can load it."""

_NUMBER_BYTES = 2
# Steps of the rotations on either side of zero: far finer than their noise.
_STEPS = 32767


@dataclass(frozen=True)
class CaseFiles:
    """Result files of one case."""

    identifications: Path
    histories: Path
    verdicts: Path
    measurements: Sequence[Path]
    calibrated: Sequence[Path]


def explorer_data(
    cases: Sequence[Case], files: Sequence[CaseFiles], methods: Sequence[Method]
) -> list[dict[str, Any]]:
    """Return the data for the explorer.

    Parameters
    ----------
    cases, files
        The cases, and their result files.
    methods
        Methods of identification.

    Raises
    ------
    BiogripError
        If a file cannot be read.
    """
    share = MOST_BYTES // max(len(cases), 1)
    return [_case(case, f, methods, share) for case, f in zip(cases, files, strict=True)]


def _case(
    case: Case, files: CaseFiles, methods: Sequence[Method], most_bytes: int
) -> dict[str, Any]:
    problem = case.problem.calibrated(files.calibrated)
    model = problem.model
    sampled = read_measurements(files.measurements[0], [])
    time_s, target = sampled.time_s, sampled.target_rad
    stride = 1 + _NUMBER_BYTES * len(time_s) // most_bytes
    room = most_bytes // (_NUMBER_BYTES * len(time_s[::stride]))
    files_by_seed = {seed: path for path in files.measurements for seed in seeds_in(path)}
    seeds = sorted(files_by_seed)[: max(1, min(MOST_SEEDS, room))]
    traces: dict[int, Array] = {}
    for path in files.measurements:
        own = [seed for seed in seeds if files_by_seed[seed] == path]
        traces |= read_measurements(path, own).rotation_rad if own else {}
    sigma = 0.0
    if target is not None:
        sigma = float(np.sqrt(np.mean(standard_deviation(target, case.noise) ** 2)))
    torque, gripper = problem.torque, problem.gripper
    verdicts = read_verdicts(files.verdicts)
    shown = next(iter(traces.values())) if target is None else target
    return {
        "name": case.name,
        "title": case.title,
        "model": model.title,
        "grips": case.instrument.has_jaws,
        "reads": with_unit(case.instrument.read.title, case.instrument.read.unit),
        "unit": case.instrument.read.unit,
        # What the page can compute: symmetric arms that do not ring, and readings of one weight.
        "closed_form": sampled.sd_rad is None
        and case.instrument.has_jaws
        and is_symmetric(case.problem.gripper, torque)
        and not case.problem.shows_inertia(time_s, shown, sigma),
        "nonlinear": problem.nonlinear or (not case.recorded and case.nonlinear_target),
        "truth": _network(model, case.parameters),
        "elements": _elements(problem),
        "gripper": {
            "k": gripper.left.stiffness_Nm_per_rad,
            "c": gripper.left.damping_Nms_per_rad,
            "lever": gripper.lever_m,
        },
        "torque": {
            "jumps": [[start, order, float(h[0])] for start, order, h in torque.jumps],
            "swings": [[t, omega, a[0].real, a[0].imag] for t, omega, a in torque.swings],
        },
        "end_s": torque.end_s,
        "offset": problem.offset,
        "drift": problem.drift,
        "noise": sigma,
        "time_s": _packed(time_s[::stride], "<f8"),
        "target": None if target is None else _stepped(target[::stride]),
        "seeds": seeds,
        "traces": [_stepped(traces[seed][::stride]) for seed in seeds],
        "methods": [_method(method, model, files, seeds) for method in methods],
        "threshold": verdicts["threshold"],
        "verdicts": {item["quantity"]: item["verdict"] for item in verdicts["quantities"]},
    }


def _elements(problem: CaseProblem) -> list[dict[str, Any]]:
    """Return the network's elements, and log bounds of their search ranges.

    Empty for power-law models, whose branches are not parameters.
    """
    model, ranges = problem.model, problem.ranges
    if model.power_law:
        return []
    network = model.network(np.ones((1, len(model.names))))
    branches = network.k.shape[1]
    found: list[dict[str, Any]] = []
    for kind, parallel, unit in (("k", network.k_p, "N/m"), ("c", network.c_p, "N s/m")):
        for branch in range(branches):
            name = kind if branches == 1 else f"{kind}_{branch + 1}"
            found.append({"name": name, "unit": unit, "at": [kind, branch]})
        if parallel[0] > 0:
            found.append({"name": f"{kind}_p", "unit": unit, "at": [f"{kind}_p", None]})
    for element in found:
        genes = ranges[element["at"][0]]
        element["low"], element["high"] = np.log(genes.low), np.log(genes.high)
    return found


def _network(model: SampleModel, parameters: Mapping[str, Any]) -> dict[str, Any] | None:
    if not set(model.names) <= set(parameters):
        return None
    network = model.sample(parameters)
    return {
        "k_p": rounded(float(network.k_p[0])),
        "c_p": rounded(float(network.c_p[0])),
        "k": [rounded(float(k)) for k in network.k[0]],
        "c": [rounded(float(c)) for c in network.c[0]],
    }


def _method(
    method: Method, model: SampleModel, files: CaseFiles, seeds: Sequence[int]
) -> dict[str, Any]:
    found = read_identifications(files.identifications, method.name)
    rows = found[found["seed"].isin(seeds)].sort_values("seed").to_dict("records")
    history = read_history(files.histories, method.name, seeds[0])
    by_seed = dict(iter(history.groupby("seed"))) if len(history) else {}
    return {
        "name": method.name,
        "title": method.title,
        "fits": [
            {
                "seed": int(row["seed"]),
                "sample": _network(model, {p.name: row[p.column] for p in model.parameters}),
                "words": _words(model, row),
                "misfit": rounded(float(row["misfit"])),
                "history": _history(by_seed.get(row["seed"])),
            }
            for row in rows
        ],
    }


def _words(model: SampleModel, row: Mapping[str, Any]) -> str:
    """Return identified parameters in words."""
    return ", ".join(f"{p.name} {row[p.column]:.3g} {p.unit}".rstrip() for p in model.parameters)


def _history(rows: "pd.DataFrame | None") -> list[list[Any]]:
    """Return generations and the lowest misfit in each."""
    if rows is None or len(rows) < 2:
        return []
    best = [rounded(float(misfit)) for misfit in rows["best_misfit"]]
    return [[int(generation) for generation in rows["generation"]], best]


def _stepped(values: Array) -> dict[str, Any]:
    """Return rotations as whole numbers of steps, and the step in rad."""
    step = max(float(np.max(np.abs(values))), 1e-300) / _STEPS
    return {"step": step, "counts": _packed(np.rint(values / step), "<i2")}


def _packed(values: Array, kind: str) -> str:
    """Return numbers as base64, little-endian."""
    return base64.b64encode(values.astype(kind).tobytes()).decode()
