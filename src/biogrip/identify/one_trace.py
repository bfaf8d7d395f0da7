"""Identification of one recorded trace from a CSV file to verdicts, without Snakemake."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from biogrip import __version__
from biogrip.arrays import Array
from biogrip.digits import counted, rounded_numbers
from biogrip.errors import BiogripError, nearest
from biogrip.files import write_text
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.trace_fit import TraceFit
from biogrip.identify.assumed import (
    assumed,
    by_default,
    gripper_in_limits,
    names_models,
    versions,
)
from biogrip.identify.fitted_models import FittedModels, judge_again, models_tried
from biogrip.identify.instrument_of_trace import with_instrument
from biogrip.identify.outputs import WRITTEN_BY, in_own_units
from biogrip.identify.read_as import ReadAs, laid_over, read_trace
from biogrip.identify.second_opinion import second_opinions
from biogrip.identify.trace_case import TraceCase
from biogrip.judging.diagnosis import Diagnosis, diagnose_all
from biogrip.judging.doubts import HARMLESS, REJECTED, Note
from biogrip.judging.onset_profiles import profile_over_onset
from biogrip.physics.drift import within
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.models import CANDIDATES, Sample
from biogrip.physics.simulation import simulated_rotation
from biogrip.progress import Progress
from biogrip.records.traces import Measurements
from biogrip.records.verdicts import exact_data
from biogrip.stages import recording
from biogrip.stages.judgement import fits_judged, notes_on_fit
from biogrip.study.experiment_blocks import fixed_problems
from biogrip.study.load import load_study, read_configs
from biogrip.study.source import KeyPath, default_config, dotted, keys_in, overlaid, shown_path
from biogrip.study.study import Case, Study
from biogrip.terminal import visible
from biogrip.traces.columns import place
from biogrip.traces.late_onset import note_late_onset
from biogrip.traces.trace_file import trace_file_problem

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
    fixed
        Known parameters by name, SI units, beside those of the config.
    settings
        Blocks of a config with what a row of a table says of the trace, which goes before options
        and config.
    table, line
        The table and the line of the row, if there is one.
    """

    trace: Path
    model: str
    read_as: ReadAs
    config: Path | None
    fixed: Mapping[str, float] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    table: Path | None = None
    line: int = 0

    @property
    def configs(self) -> list[Path]:
        """The default study's config, and over it the user's if there is one."""
        return [default_config(), *([self.config] if self.config else [])]

    @property
    def given(self) -> dict[str, Any]:
        """Blocks of the user's: those of the config, and over them those of a row."""
        found: dict[str, Any] = overlaid(read_configs(self.configs[1:]), dict(self.settings))
        return found

    @property
    def place(self) -> str:
        """The trace, or the row that lists it, for messages."""
        return place(self.table, self.line) if self.table else visible(self.trace)

    def lines(self, case: str) -> list[tuple[str, dict[KeyPath, int]]]:
        """Return the table, with the row's line for each of its settings; nothing without one."""
        if self.table is None:
            return []
        paths = [
            ("cases", case, *path) if path[0] in ("sample", "fixed") else path
            for path in keys_in(self.settings)
            if len(path) > 1
        ]
        return [(shown_path(self.table), dict.fromkeys(paths, self.line))]


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
    """

    data: dict[str, Any]
    problem: CaseProblem
    recorded: Measurements


def identify_trace(options: IdentifyOptions, output: Path) -> Identified:
    """Identify the sample in a recorded trace by least squares, and compute confidence limits.

    Parameters
    ----------
    options
        The trace and the options.
    output
        JSON file to write.

    Raises
    ------
    BiogripError
        With file, line and column or key, if trace or config cannot be used.
    """
    case = case_of(options)
    with Progress(str(options.trace), 5, live=True) as progress:
        trace = read(options, case, progress)
        progress.done()
        (identified,) = identify_alike([options], [trace], [output], progress)
    return identified


def case_of(options: IdentifyOptions) -> Case:
    """Return the case that the trace of some options is, before its file is read.

    Raises
    ------
    BiogripError
        With option, or file, line and key, if options or config cannot be used for any trace.
    """
    (case,) = study_of(options).cases.values()
    return case


def read(options: IdentifyOptions, case: Case, progress: Progress) -> TraceCase:
    """Read the trace of some options as a case.

    Raises
    ------
    BiogripError
        With file, line and column, if the trace cannot be used.
    """
    recorded, case = read_trace(options.trace, case, options.given, progress.note)
    problem = case.problem.weighted(recorded.sd_rad)
    return TraceCase(case, recorded, problem, names_models(options.given))


def identify_alike(
    options: Sequence[IdentifyOptions],
    traces: Sequence[TraceCase],
    outputs: Sequence[Path] | None,
    progress: Progress,
) -> list[Identified]:
    """Identify several traces, each as if it were alone, and write the result of each.

    Parameters
    ----------
    options
        Options of each trace.
    traces
        The traces: of the same model, budget of fits and confidence.
    outputs
        JSON file of each; None to write nothing.
    progress
        Counter of the five steps.

    Raises
    ------
    BiogripError
        If one of the traces cannot be fitted; nothing is then written.
    """
    first = traces[0]
    progress.doing(f"fitting {counted(sum(len(own.readings[0]) for own in traces), 'sample')}")
    cases, problems = [own.case for own in traces], [own.problem for own in traces]
    fits = fits_judged(cases, problems, [own.readings for own in traces], 0, progress.within)
    progress.done()
    progress.doing("finding confidence limits")
    diagnoses = diagnose_all(
        [fit.problem for fit in fits],
        first.problem.searched,
        [fit.found for fit in fits],
        confidence=first.case.confidence,
        noise_rad=[problem.noise_rad for problem in problems],
    )
    progress.done()
    progress.doing("trying other sample models")
    models = models_tried(traces, fits, diagnoses)
    again = [judge_again(*each) for each in zip(traces, fits, diagnoses, models, strict=True)]
    diagnoses = [
        profile_over_onset(diagnosis, own.recorded.time_s) if own.problem.fit_start else diagnosis
        for own, (diagnosis, _) in zip(traces, again, strict=True)
    ]
    progress.done()
    progress.doing("trying an offset and a drift")
    opinions = second_opinions(traces, diagnoses, progress.within)
    judged = [
        Judged(fit, diagnosis, own_models, [*doubts, *opinion])
        for fit, diagnosis, own_models, (_, doubts), opinion in zip(
            fits, diagnoses, models, again, opinions, strict=True
        )
    ]
    data = [_data(*each) for each in zip(options, traces, judged, strict=True)]
    for of_trace, output in zip(data, outputs or (), strict=False):
        write_text(output, json.dumps(_written(of_trace), indent=1) + "\n")
    return [
        Identified(of_trace, own.problem, own.recorded)
        for own, of_trace in zip(traces, data, strict=True)
    ]


@dataclass(frozen=True)
class Judged:
    """The fit of a trace, its diagnosis, fits of other models, and notes that follow from these."""

    fit: TraceFit
    diagnosis: Diagnosis
    models: FittedModels
    notes: list[Note]


def _data(options: IdentifyOptions, trace: TraceCase, judged: Judged) -> dict[str, Any]:
    """Return all that is said of a trace, as plain data."""
    case, case_problem, recorded = trace.case, trace.problem, trace.recorded
    diagnosis, models, doubts = judged.diagnosis, judged.models, judged.notes
    if case.may_start_late:
        near = diagnosis.likelihood.best
        doubts = [*doubts, *note_late_onset(case_problem, *trace.readings, near)]
    read = [Note(HARMLESS, text) for text in recording.notes_on_recording(recorded)]
    assumptions = [Note(HARMLESS, _NOT_COMPARED)] if case_problem.fixed else []
    instrument = case_problem.instrument
    said = exact_data(diagnosis, [*assumptions, *notes_on_fit(judged.fit), *doubts], read)
    return {
        WRITTEN_BY: __version__,
        "trace": str(options.trace),
        "model": case_problem.model.name,
        "model_title": case_problem.model.title,
        "confidence": case.confidence,
        "instrument": instrument.kind,
        "reads": {"quantity": instrument.read.name, "unit": instrument.read.unit},
        **_read_as(case, recorded),
        **fixed_data(case_problem),
        "limits": gripper_in_limits(case_problem),
        **_instrument(case_problem, recorded, np.exp(diagnosis.likelihood.best)),
        **said,
        "noise_model": judged.fit.noise_data(),
        **models.data(None if said["fit"] == REJECTED else diagnosis.findings),
        "assumed": assumed(case, models.names or list(case.models)),
        "by_default": by_default(options.given) if instrument.has_jaws else [],
        "versions": versions(),
    }


def _read_as(case: Case, recorded: Measurements) -> dict[str, Any]:
    """Return what was recognised in an unusual file, or nothing."""
    form = recorded.recognised
    return {"read_as": form.data()} if form and not form.is_usual(case.columns) else {}


def _written(data: dict[str, Any]) -> dict[str, Any]:
    """Round results; keep assumptions, which must be repeatable, as they are."""
    read = INSTRUMENTS[data["reads"]["quantity"]].read
    return in_own_units({**rounded_numbers(data), "assumed": data["assumed"]}, read)


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
    merged = read_configs(options.configs)
    name = re.sub(r"[^A-Za-z0-9_-]", "_", options.trace.stem)[:60]
    case = name if re.match("[A-Za-z]", name) else f"trace_{name}"
    read_as, settings = options.read_as, dict(options.settings)
    of_sample = settings.pop("sample", {})
    own = settings.pop("measurement", {})
    merged = overlaid(merged, settings)
    if "protocol" in settings:
        read_as = replace(read_as, hold=None)
    if isinstance(measured := merged.get("measurement"), dict):
        measured = laid_over(read_as.over(measured), own)
        merged["measurement"] = measured | {"file": str(options.trace)}
        merged = with_instrument(merged, options.given, read_as, options.trace)
    # Cases and a table of the config are meant for the workflow.
    for name in ("only", "traces"):
        merged.pop(name, None)
    merged["cases"] = {
        case: {
            "sample": _sample(sample, of_sample),
            "fixed": {**options.fixed, **settings.get("fixed", {})},
        }
    }
    return load_study(
        merged,
        options.configs,
        {"cases": merged["cases"]},
        over=options.lines(case),
    )


def _sample(by_option: Sample, own: Mapping[str, Any]) -> dict[str, Any]:
    """Return the block of a sample: a row that names another model says its branches, too."""
    if "model" in own:
        return dict(own)
    return {"model": by_option.name, "branches": by_option.branches, **own}


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
        case_problem.gripper, network, case_problem.torque, time_s, nonlinear=False
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
