"""One recorded trace from file to verdicts, without a workflow."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from biogrip.arrays import Array
from biogrip.errors import BiogripError, nearest
from biogrip.files import write_text
from biogrip.identifiability.diagnosis import diagnose
from biogrip.identifiability.document import diagnosis_data, rounded
from biogrip.identify.methods import identifier
from biogrip.progress import Progress
from biogrip.random_streams import stream
from biogrip.response.nuisance import nuisance_basis, within
from biogrip.response.simulation import simulated_rotation
from biogrip.sample import MODELS
from biogrip.stages.recording import read_checked
from biogrip.study.case_problem import CaseProblem, case_problem
from biogrip.study.config import load_study, overlaid
from biogrip.study.defaults import default_config
from biogrip.study.plan import Plan
from biogrip.study.source import read_places
from biogrip.traces import Measurements


@dataclass(frozen=True)
class Wanted:
    """What to identify.

    Parameters
    ----------
    trace
        CSV file.
    model
        Name of the sample model.
    measurement
        Keys of the config's ``measurement`` block that concern the file.
    config
        YAML file laid over the default study: gripper, protocol, search range.
    """

    trace: Path
    model: str
    measurement: dict[str, Any]
    config: Path | None


def identify_trace(wanted: Wanted, output: Path) -> dict[str, Any]:
    """Identify the sample in a recorded trace by least squares, and judge what is identified.

    Parameters
    ----------
    wanted
        What to identify.
    output
        Is written with what is returned, JSON.

    Raises
    ------
    BiogripError
        With file, line and column or key, if trace or config cannot be used.
    """
    plan = _plan(wanted)
    (case,) = plan.study.cases
    recorded = read_checked(json.loads(plan.recording(case)), wanted.trace)
    settings = json.loads(plan.identifiability(case))
    posed = case_problem(settings)
    problem = posed.of(recorded.time_s, recorded.rotation_rad[0])
    progress = Progress(str(wanted.trace), 1)
    rng = stream(settings["study_seed"], case, 0, "identifiability")
    found = identifier("least_squares", settings)(problem, rng, progress.within)
    confidence = settings["confidence"]
    told = diagnose(
        problem, posed.searched, found, confidence=confidence, noise_rad=posed.noise_rad
    )
    data = {
        "trace": str(wanted.trace),
        "model": posed.model.name,
        "model_title": posed.model.title,
        "confidence": confidence,
        **_instrument(posed, recorded, np.exp(told.likelihood.best)),
        **diagnosis_data(told),
    }
    write_text(output, json.dumps(data, indent=1) + "\n")
    return data


def in_words(found: dict[str, Any]) -> str:
    """Return what `identify_trace` found as text to read."""
    width = max(len(item["quantity"]) for item in found["quantities"])
    lines = [
        f"{found['trace']}: {found['samples']} samples, noise {found['noise_rad']:.3g} rad, "
        f"misfit {found['misfit_rad']:.3g} rad",
        f"{found['model_title']}, {100 * found['confidence']:g} % limits:",
        *(f"  {item['quantity']:<{width}}  {item['in_words']}" for item in found["quantities"]),
    ]
    lines += [
        f"{' and '.join(trade['members'])} trade against each other: only {trade['quantity']} is "
        f"{trade['in_words']}"
        for trade in found["trades"]
    ]
    if "offset_rad" in found:
        lines.append(f"Offset of the instrument: {found['offset_rad']:.3g} rad")
    if "drift_rad_per_s" in found:
        lines.append(f"Drift of the instrument: {found['drift_rad_per_s']:.3g} rad/s")
    lines += [f"Note: {note}" for note in found["notes"]]
    return "\n".join(lines)


def _plan(wanted: Wanted) -> Plan:
    if not wanted.trace.is_file():
        beside = [str(file) for file in wanted.trace.parent.glob("*") if file.is_file()]
        raise BiogripError(
            f"{wanted.trace}: there is no such file.{nearest(str(wanted.trace), beside)}"
        )
    if wanted.model not in MODELS:
        hint = nearest(wanted.model, MODELS)
        raise BiogripError(f"--model: found '{wanted.model}'.{hint} Allowed: {', '.join(MODELS)}.")
    files = [default_config(), *([wanted.config] if wanted.config else [])]
    # Places first: they name a file that is missing or no YAML.
    read_places(files)
    merged: dict[str, Any] = {}
    for file in files:
        loaded = yaml.safe_load(file.read_text(encoding="utf-8"))
        if loaded is not None and not isinstance(loaded, dict):
            raise BiogripError(f"{file}: found no keys, allowed is a config in YAML.")
        merged = overlaid(merged, loaded or {})
    name = re.sub(r"[^A-Za-z0-9_-]", "_", wanted.trace.stem)[:60]
    case = name if re.match("[A-Za-z]", name) else f"trace_{name}"
    measurement = {**wanted.measurement, "file": str(wanted.trace)}
    merged["cases"] = {case: {"sample": {"model": wanted.model}, "measurement": measurement}}
    return Plan(load_study(merged, files, command_line=["cases"]), Path("results"))


def _instrument(posed: CaseProblem, recorded: Measurements, parameters: Array) -> dict[str, Any]:
    """Offset and drift that the best fit leaves to the instrument."""
    if not (posed.offset or posed.drift):
        return {}
    time_s, measured = recorded.time_s, recorded.rotation_rad[0]
    network = posed.searched.network(parameters)
    simulated = simulated_rotation(
        posed.gripper, network, posed.torque, time_s, nonlinear=posed.nonlinear
    )[0]
    basis = nuisance_basis(time_s, offset=posed.offset, drift=posed.drift)
    added = within(basis, measured - simulated)
    slope = float((added[-1] - added[0]) / (time_s[-1] - time_s[0]))
    start = float(added[0] - slope * time_s[0])
    return ({"offset_rad": rounded(start)} if posed.offset else {}) | (
        {"drift_rad_per_s": rounded(slope)} if posed.drift else {}
    )
