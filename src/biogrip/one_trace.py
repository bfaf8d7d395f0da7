"""One recorded trace from file to verdicts, without a workflow."""

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from biogrip import __version__
from biogrip.arrays import Array
from biogrip.digits import rounded
from biogrip.errors import BiogripError, nearest
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sample import MODELS
from biogrip.files import scratch_of, write_text
from biogrip.identifiability.diagnosis import diagnose
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.methods import identifier
from biogrip.products.files.traces import Measurements
from biogrip.products.files.verdicts import diagnosis_data
from biogrip.products.stages import judgement, recording
from biogrip.progress import Progress
from biogrip.response.nuisance import nuisance_basis, within
from biogrip.response.simulation import simulated_rotation
from biogrip.study.defaults import default_config
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Study
from biogrip.study.trace_file import trace_file_problem
from biogrip.study.validation import value_problem

_OPTIONS = {
    "time": "--time",
    "rotation": "--rotation",
    "time_unit": "--time-unit",
    "rotation_unit": "--rotation-unit",
    "noise_rad": "--noise",
    "offset": "--offset",
    "drift": "--drift",
}
"""By key of the ``measurement`` block, what gives it on the command line."""

WRITTEN_BY = "written_by_biogrip"
"""Tells our files from others, which are not replaced."""


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


def check_output(output: Path, *, force: bool) -> None:
    """Make sure that a file can be written, and is none of somebody else's.

    Parameters
    ----------
    output
        The file.
    force
        Whether to replace what `identify_trace` did not write.

    Raises
    ------
    BiogripError
        If it cannot be written or must not be replaced.
    """
    folder = output.parent
    if os.path.isdir(output) or not os.path.isdir(folder) or not os.access(folder, os.W_OK):
        raise BiogripError(
            f"{output}: cannot be written; allowed is a file in a folder that you may write to."
        )
    for place in (output, scratch_of(output)):
        try:
            os.lstat(place)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise BiogripError(f"{output}: cannot be written: {error.strerror}.") from error
    if os.path.lexists(output) and not force and not _is_ours(output):
        raise BiogripError(
            f"{output}: is there, and biogrip did not write it; allowed is another name, "
            "or --force to replace it."
        )


def _is_ours(output: Path) -> bool:
    try:
        return not output.is_symlink() and WRITTEN_BY in json.loads(output.read_bytes())
    except (OSError, ValueError, TypeError, RecursionError):
        return False


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
    study = study_of(wanted)
    (case,) = study.cases.values()
    progress = Progress(str(wanted.trace), 3)
    recorded = recording.read_checked(recording.settings_of(case), wanted.trace)
    progress.done()
    progress.doing(f"fitting {len(recorded.time_s)} samples")
    settings, posed = judgement.settings_of(study, case), case.problem
    problem = posed.of(recorded.time_s, recorded.rotation_rad[0])
    rng = stream(study.study_seed, case.name, 0, "identifiability")
    identify = identifier("least_squares", settings.least_squares)
    (found,) = identify([problem], [rng], progress.within)
    progress.done()
    progress.doing("finding confidence limits")
    confidence = case.confidence
    told = diagnose(
        problem, posed.searched, found, confidence=confidence, noise_rad=posed.noise_rad
    )
    data = {
        WRITTEN_BY: __version__,
        "trace": str(wanted.trace),
        "model": posed.model.name,
        "model_title": posed.model.title,
        "confidence": confidence,
        **_instrument(posed, recorded, np.exp(told.likelihood.best)),
        **diagnosis_data(told),
    }
    write_text(output, json.dumps(data, indent=1) + "\n")
    return data


def check_trace_file(trace: Path, name: str = "TRACE") -> None:
    """Refuse a path that leads to no file.

    Parameters
    ----------
    trace
        The path.
    name
        Of the argument that it was given as.

    Raises
    ------
    BiogripError
        With the file beside it that has the nearest name.
    """
    if problem := trace_file_problem(trace):
        raise BiogripError(f"{name}: {problem}")


def in_words(found: dict[str, Any]) -> str:
    """Return what `identify_trace` found as text to read."""
    width = max(len(item["quantity"]) for item in found["quantities"])
    lines = [
        f"{found['trace']}: {found['samples']} samples, noise {found['noise_rad']:.3g} rad, "
        f"misfit {found['misfit_rad']:.3g} rad",
        f"{found['model_title']}, {100 * found['confidence']:g} % limits:",
        *(f"  {item['quantity']:<{width}}  {item['in_words']}" for item in found["quantities"]),
    ]
    if any((item["low"] is None) != (item["high"] is None) for item in found["quantities"]):
        alone = f"{50 * (1 + found['confidence']):g} %"
        lines.append(f"A limit that stands alone is an end of an interval with two: {alone}")
    lines += [trade["words"] for trade in found["trades"]]
    if "offset_rad" in found:
        lines.append(f"Offset of the instrument: {found['offset_rad']:.3g} rad")
    if "drift_rad_per_s" in found:
        lines.append(f"Drift of the instrument: {found['drift_rad_per_s']:.3g} rad/s")
    lines += [f"Note: {note}" for note in found["notes"]]
    return "\n".join(lines)


def study_of(wanted: Wanted) -> Study:
    """Return a study whose only case is the recorded trace.

    Raises
    ------
    BiogripError
        If there is no such file, or an option or the config cannot be used.
    """
    check_trace_file(wanted.trace)
    for key, value in wanted.measurement.items():
        if problem := value_problem(("measurement", key), value):
            raise BiogripError(f"{_OPTIONS[key]}: {problem}")
    if wanted.model not in MODELS:
        hint = nearest(wanted.model, MODELS)
        raise BiogripError(f"--model: found '{wanted.model}'.{hint} Allowed: {', '.join(MODELS)}.")
    files = [default_config(), *([wanted.config] if wanted.config else [])]
    merged = read_configs(files)
    name = re.sub(r"[^A-Za-z0-9_-]", "_", wanted.trace.stem)[:60]
    case = name if re.match("[A-Za-z]", name) else f"trace_{name}"
    measurement = {**wanted.measurement, "file": str(wanted.trace)}
    merged["cases"] = {case: {"sample": {"model": wanted.model}, "measurement": measurement}}
    return load_study(merged, files, command_line=["cases"], for_workflow=False)


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
