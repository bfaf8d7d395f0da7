"""Identification of one recorded trace from a CSV file to verdicts, without Snakemake."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from biogrip import __version__
from biogrip.arrays import Array
from biogrip.digits import rounded_numbers
from biogrip.errors import BiogripError, nearest
from biogrip.experiment.sample import CANDIDATES
from biogrip.files import write_text
from biogrip.identifiability.diagnosis import diagnose
from biogrip.identifiability.fit_status import HARMLESS, REJECTED, Note
from biogrip.identifiability.onset_profiles import profile_over_onset
from biogrip.identify.case_problem import CaseProblem
from biogrip.instrument.instruments import INSTRUMENTS
from biogrip.own_traces.assumed import (
    assumed,
    by_default,
    gripper_in_limits,
    names_models,
    versions,
)
from biogrip.own_traces.fitted_models import judge_again, models_tried
from biogrip.own_traces.instrument_of_trace import with_instrument
from biogrip.own_traces.outputs import SAMPLES, WRITTEN_BY, in_own_units
from biogrip.own_traces.read_as import ReadAs, read_trace
from biogrip.own_traces.second_opinion import second_opinion
from biogrip.products.files.posterior import limits_in, write_samples
from biogrip.products.files.traces import Measurements
from biogrip.products.files.verdicts import exact_data
from biogrip.products.stages import posterior, recording
from biogrip.products.stages.judgement import (
    fit_judged,
    notes_on_fit,
)
from biogrip.progress import Progress
from biogrip.response.nuisance import within
from biogrip.response.simulation import simulated_rotation
from biogrip.study.defaults import default_config
from biogrip.study.load import load_study, read_configs
from biogrip.study.sample_block import fixed_problems
from biogrip.study.source import dotted
from biogrip.study.study import Case, Study
from biogrip.study.trace_file import trace_file_problem
from biogrip.traces.late_onset import note_late_onset

_NOT_COMPARED = (
    "With fixed parameters no other sample models are tried: a value that is known in this model "
    "says nothing of theirs, and without it they would fit better for their freedom alone."
)


@dataclass(frozen=True)
class IdentifyOptions:
    """A recorded trace, and the options to identify it with.

    Parameters
    ----------
    trace
        CSV file.
    model
        Name of the sample model.
    read_as
        Columns of the file, and offset, drift and noise of the instrument.
    config
        YAML file laid over the default study: gripper, protocol, search range.
    posterior
        If true, sample the posterior even if the config does not say so.
    fixed
        Known parameters by name, SI units, beside those of the config.
    """

    trace: Path
    model: str
    read_as: ReadAs
    config: Path | None
    posterior: bool = False
    fixed: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Identified:
    """Results of one trace.

    Parameters
    ----------
    data
        Content of the JSON file; numbers of the diagnosis are not rounded.
    problem
        Assumptions of the fit.
    recorded
        The trace.
    samples : (n, n_parameters)
        Posterior samples, SI units, if the posterior was sampled.
    """

    data: dict[str, Any]
    problem: CaseProblem
    recorded: Measurements
    samples: Array | None = None


def identify_trace(options: IdentifyOptions, output: Path) -> Identified:
    """Identify the sample in a recorded trace by least squares, and compute confidence limits.

    Parameters
    ----------
    options
        The trace and the options.
    output
        JSON file to write; posterior samples are written beside it as Parquet.

    Raises
    ------
    BiogripError
        With file, line and column or key, if trace or config cannot be used.
    """
    study = study_of(options)
    (case,) = study.cases.values()
    pieces = 5 + (case.posterior is not None)
    with Progress(str(options.trace), pieces, live=True) as progress:
        recorded, case = read_trace(options.trace, case, options.config, progress.note)
        progress.done()
        progress.doing(f"fitting {len(recorded.time_s)} samples")
        case_problem = case.problem.weighted(recorded.sd_rad)
        fit = fit_judged(
            case, case_problem, recorded.time_s, recorded.rotation_rad[0], 0, progress.within
        )
        progress.done()
        progress.doing("finding confidence limits")
        confidence = case.confidence
        diagnosis = diagnose(
            fit.problem,
            case_problem.searched,
            fit.found,
            confidence=confidence,
            noise_rad=case_problem.noise_rad,
        )
        progress.done()
        progress.doing("trying other sample models")
        named = names_models(options.config)
        models = models_tried(study, case, fit, diagnosis, lambda: None, named=named)
        diagnosis, doubts = judge_again(fit, diagnosis, models, confidence, case_problem.noise_rad)
        if case_problem.fit_start:
            diagnosis = profile_over_onset(diagnosis, recorded.time_s)
        progress.done()
        progress.doing("trying an offset and a drift")
        doubts += second_opinion(study, case, recorded, diagnosis, progress.within)
        if case.may_start_late:
            near = diagnosis.likelihood.best
            doubts += note_late_onset(case_problem, recorded.time_s, recorded.rotation_rad[0], near)
        read = [Note(HARMLESS, text) for text in recording.notes_on_recording(recorded)]
        assumptions = [Note(HARMLESS, _NOT_COMPARED)] if case_problem.fixed else []
        instrument = case_problem.instrument
        said = exact_data(diagnosis, [*assumptions, *notes_on_fit(fit), *doubts], read)
        # Evidence is compared of fewer models than are tried where the config names none.
        unnamed = case.compared_models and not named
        tried = None if unnamed else models.names or list(case.models)
        data = {
            WRITTEN_BY: __version__,
            "trace": str(options.trace),
            "model": case_problem.model.name,
            "model_title": case_problem.model.title,
            "confidence": confidence,
            "instrument": instrument.kind,
            "reads": {"quantity": instrument.read.name, "unit": instrument.read.unit},
            **_read_as(case, recorded),
            **fixed_data(case_problem),
            "limits": gripper_in_limits(case_problem),
            **_instrument(case_problem, recorded, np.exp(diagnosis.likelihood.best)),
            **said,
            "noise_model": fit.noise_data(),
            **models.data(None if said["fit"] == REJECTED else diagnosis.findings),
            "assumed": assumed(case, tried),
            "by_default": by_default(options.config) if instrument.has_jaws else [],
            "versions": versions(),
        }
        samples = None
        if case.posterior is not None:
            progress.done()
            progress.doing("sampling the posterior")
            data["posterior"], drawn = posterior.posterior_of_trace(
                case,
                case_problem,
                partial(case_problem.for_model, fit.problem),
                limits_in(said),
                progress.within,
            )
            words = {WRITTEN_BY: __version__}
            write_samples(output.with_suffix(SAMPLES), case_problem.searched, drawn, words)
            samples = np.exp(drawn)
    write_text(output, json.dumps(_written(data), indent=1) + "\n")
    return Identified(data, case_problem, recorded, samples)


def _read_as(case: Case, recorded: Measurements) -> dict[str, Any]:
    """Return what was recognised in an unusual file, or nothing."""
    form = recorded.recognised
    return {"read_as": form.data()} if form and not form.is_usual(case.columns) else {}


def _written(data: dict[str, Any]) -> dict[str, Any]:
    """Round results; keep assumptions, which must be repeatable, and the posterior as they are."""
    kept = {name: data[name] for name in ("assumed", "posterior") if name in data}
    read = INSTRUMENTS[data["reads"]["quantity"]].read
    return in_own_units({**rounded_numbers(data), **kept}, read)


def check_trace_file(trace: Path) -> None:
    """Refuse a path at which there is no file.

    Raises
    ------
    BiogripError
        With the nearest name among the files beside it.
    """
    if problem := trace_file_problem(trace):
        raise BiogripError(f"TRACE: {problem}")


def study_of(options: IdentifyOptions) -> Study:
    """Return a study that has the trace as its only case.

    Raises
    ------
    BiogripError
        With option, or file, line and key, if options or config cannot be used for any trace.
    """
    check_trace_file(options.trace)
    options.read_as.check()
    if options.model not in CANDIDATES:
        hint, names = nearest(options.model, CANDIDATES), ", ".join(CANDIDATES)
        raise BiogripError(f"--model: found '{options.model}'.{hint} Allowed: {names}.")
    sample = CANDIDATES[options.model]
    for path, text in fixed_problems(sample.model, options.fixed):
        raise BiogripError(f"--fix: {dotted(path)}: {text}" if path else f"--fix: {text}")
    files = [default_config(), *([options.config] if options.config else [])]
    merged = read_configs(files)
    name = re.sub(r"[^A-Za-z0-9_-]", "_", options.trace.stem)[:60]
    case = name if re.match("[A-Za-z]", name) else f"trace_{name}"
    if isinstance(measured := merged.get("measurement"), dict):
        merged["measurement"] = options.read_as.over(measured) | {"file": str(options.trace)}
        given = read_configs([options.config]) if options.config else {}
        merged = with_instrument(merged, given, options.read_as, options.trace)
    # Cases of the config are meant for the workflow.
    merged.pop("only", None)
    if options.posterior:
        merged.setdefault("posterior", {})
    merged["cases"] = {
        case: {
            "sample": {"model": sample.name, "branches": sample.branches},
            "fixed": dict(options.fixed),
        }
    }
    return load_study(merged, files, command_line=["cases"], for_workflow=False)


def fixed_data(case_problem: CaseProblem) -> dict[str, Any]:
    """Return values and units of fixed parameters in words, or nothing if there are none."""
    fixed = case_problem.fixed
    units = {p.name: p.unit for p in case_problem.model.parameters}
    words = [f"{name} = {value:g} {units[name]}".rstrip() for name, value in fixed.items()]
    return {"fixed": words} if words else {}


def _instrument(
    case_problem: CaseProblem, recorded: Measurements, parameters: Array
) -> dict[str, Any]:
    """Return onset, offset and drift of the instrument in the best fit, as far as fitted."""
    onset = {"onset_s": recorded.onset_s} if case_problem.fit_start else {}
    if not (case_problem.offset or case_problem.drift):
        return onset
    time_s, measured = recorded.time_s, recorded.rotation_rad[0]
    network = case_problem.searched.network(parameters)
    simulated = simulated_rotation(
        case_problem.gripper, network, case_problem.torque, time_s, nonlinear=case_problem.nonlinear
    )[0]
    basis = case_problem.nuisance(time_s)
    added = within(basis, measured - simulated, case_problem.sd_rad)
    slope = float((added[-1] - added[0]) / (time_s[-1] - time_s[0]))
    start = float(added[0] - slope * time_s[0])
    return (
        onset
        | ({"offset_rad": start} if case_problem.offset else {})
        | ({"drift_rad_per_s": slope} if case_problem.drift else {})
    )
