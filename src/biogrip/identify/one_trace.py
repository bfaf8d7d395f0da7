"""Identification of recorded traces from CSV files to verdicts, alone or in batches.

Each trace is fitted by least squares and diagnosed by profile likelihoods; other sample models, and
an offset and a drift of the instrument, are held against it. Traces of the same model and budget
are fitted together. The result of a trace is the same, to the last bit, in any batch and alone, and
one that fails costs no other its result.
"""

import json
import os
import sys
import traceback
from collections import defaultdict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from biogrip import __version__
from biogrip.arrays import Array
from biogrip.digits import counted, rounded_numbers
from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.fit.experiment import Experiment
from biogrip.fit.trace_fit import TraceFit
from biogrip.identify.other_fits import (
    FittedModels,
    fits_of,
    judge_again,
    models_tried,
    note_flow,
    second_opinions,
)
from biogrip.identify.outputs import WRITTEN_BY, Outcome, in_own_units
from biogrip.identify.settings import Asked
from biogrip.identify.trace_case import TraceCase, note_saturated, read_trace
from biogrip.judging.diagnosis import Diagnosis, diagnose_all, with_times
from biogrip.judging.doubts import HARMLESS, REJECTED, Note
from biogrip.judging.onset import notes_on_start, profile_over_onset
from biogrip.keys import plain
from biogrip.physics.simulation import simulated_response
from biogrip.physics.whitening import within
from biogrip.processes import worker_processes
from biogrip.records.identifications import exact_data
from biogrip.records.traces import Measurements
from biogrip.stages import recording
from biogrip.stages.judgement import notes_on_fit
from biogrip.study.study import Case
from biogrip.terminal import Progress, visible
from biogrip.traces.reader import form_in_words, is_usual

# Most traces of a batch, and most readings that are fitted together, of short traces.
_MOST_IN_BATCH, _MOST_READINGS = 25, 200_000

T = TypeVar("T")


@dataclass(frozen=True)
class Identified:
    """Results of one trace."""

    data: dict[str, Any]
    """Content of the JSON file; numbers of the diagnosis are not rounded."""
    problem: Experiment
    """Assumptions of the fit."""
    recorded: Measurements
    """The trace."""


def identify_traces(asked: Sequence[Asked], outputs: Sequence[Path], *, drawn: bool) -> Outcome:
    """Identify traces in batches, several processes at once, and write a JSON file of each.

    Errors of those that fail are collected. If `drawn`, there are pictures of each.
    """
    if len(asked) <= 1:
        return identify_batch(asked, outputs, drawn=drawn)
    processors = len(os.sched_getaffinity(0))
    size = min(_MOST_IN_BATCH, -(-len(asked) // processors))
    batches = [slice(start, start + size) for start in range(0, len(asked), size)]
    every = Outcome([], {})
    with worker_processes(min(processors, len(batches))) as processes:
        jobs = [
            processes.submit(identify_batch, asked[own], outputs[own], drawn=drawn)
            for own in batches
        ]
        for own, job in zip(batches, jobs, strict=True):
            outcome = job.result()
            every.found.extend(outcome.found)
            every.refused.update(outcome.refused)
            every.pictures.update(outcome.pictures)
            for number, each in enumerate(asked[own], start=own.start + 1):
                print(f"{number} of {len(asked)}: {visible(each.trace)}", file=sys.stderr)
    return every


def identify_batch(
    asked: Sequence[Asked], outputs: Sequence[Path] | None, *, drawn: bool = False
) -> Outcome:
    """Identify the traces of one batch, see `identify_traces`; None to write no JSON files."""
    results: dict[int, Identified | BiogripError] = {}
    traces: dict[int, TraceCase] = {}
    alone = len(asked) == 1 and outputs is not None
    with Progress(str(asked[0].trace) if alone else "", 5, live=alone, quiet=not alone) as progress:
        for index, own in enumerate(asked):
            read = _tried(own, _read, own, progress)
            if isinstance(read, BiogripError):
                results[index] = read
            else:
                traces[index] = read
        progress.done()

        alike = defaultdict[Hashable, list[int]](list)
        for index, trace in traces.items():
            few = len(trace.readings[0]) * _MOST_IN_BATCH <= _MOST_READINGS
            alike[trace.budget, None if few else index].append(index)
        groups = [*alike.values()]
        # An error is of one of a group: it is then identified one by one.
        for group in groups:
            found = _tried(
                asked[group[0]],
                identify_alike,
                [asked[index].trace for index in group],
                [traces[index] for index in group],
                progress,
            )
            if not isinstance(found, BiogripError):
                results.update(zip(group, found, strict=True))
            elif len(group) == 1:
                results[group[0]] = found
            else:
                groups += ([index] for index in group)
    outcome = Outcome([], {})
    for index, own in enumerate(asked):
        result = results[index]
        if isinstance(result, BiogripError):
            outcome.refused[str(own.trace)] = str(result)
            continue
        outcome.found.append(result.data)
        if outputs is not None:
            # Assumptions, which must be repeatable, are not rounded.
            data = rounded_numbers(result.data) | {"assumed": result.data["assumed"]}
            data = in_own_units(data, result.problem.instrument.read)
            write_text(outputs[index], json.dumps(data, indent=1) + "\n")
        if drawn:
            # Imported here: loading Matplotlib takes long.
            from biogrip.identify.page import draw

            pictures = _tried(own, draw, result)
            if not isinstance(pictures, BiogripError):
                outcome.pictures[str(own.trace)] = pictures
    return outcome


def _read(asked: Asked, progress: Progress) -> TraceCase:
    """Read a trace, and tell what is recognised in an unusual file."""
    trace = read_trace(asked)
    if not is_usual(trace.recorded.form, trace.case.columns):
        progress.note(form_in_words(asked.trace, trace.recorded.form))
    return trace


def _tried(asked: Asked, work: Callable[..., T], *given: Any) -> T | BiogripError:
    """Return what work on a trace gives, or the error by which it fails, whatever that is."""
    try:
        return work(*given)
    except BiogripError as error:
        return error
    except BrokenPipeError:
        # Whoever reads the progress has gone.
        raise
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return BiogripError(
            f"{visible(asked.trace)}: the fit failed, which is a fault of biogrip and not of the "
            f"trace: {type(error).__name__}: {error} ({Path(where.filename).name}, line "
            f"{where.lineno}). Please report it, with the trace if it may be shared."
        )


def identify_alike(
    files: Sequence[Path], traces: Sequence[TraceCase], progress: Progress
) -> list[Identified]:
    """Identify traces of the same model, budget of fits and confidence, each as if it were alone.

    The counter's last four of five steps are made here. A `BiogripError` says that one of the
    traces cannot be fitted.
    """
    first = traces[0]
    progress.doing(f"fitting {counted(sum(len(own.readings[0]) for own in traces), 'sample')}")
    fits = fits_of(traces, progress.within)
    progress.done()
    progress.doing("finding confidence limits")
    diagnoses = diagnose_all(
        [fit.problem for fit in fits],
        first.problem.searched,
        [fit.found for fit in fits],
        confidence=first.case.confidence,
        noise_sd=[own.problem.noise_sd for own in traces],
    )
    progress.done()
    progress.doing("trying other sample models")
    models = models_tried(traces, fits, diagnoses)
    again = [judge_again(*each) for each in zip(traces, fits, diagnoses, models, strict=True)]
    diagnoses = with_times([diagnosis for diagnosis, _ in again], first.problem.searched)
    onsets_s = {}
    for index, own in enumerate(traces):
        if own.problem.fit_start:
            merged = profile_over_onset(diagnoses[index], own.recorded.time_s)
            diagnoses[index], onsets_s[index] = merged
    progress.done()
    progress.doing("trying an offset and a drift")
    starts = [
        notes_on_start(own.problem, *own.readings, told, may_be_late=own.case.may_start_late)
        for own, told in zip(traces, diagnoses, strict=True)
    ]
    opinions = second_opinions(traces, diagnoses, progress.within, [own.lead for own in models])
    found = []
    for index, own in enumerate(traces):
        # Beside another start, an offset and a drift mean nothing.
        opinions[index] *= not any(note.weight != HARMLESS for note in starts[index])
        notes = [*again[index][1], *starts[index], *opinions[index]]
        notes += [*note_flow(own), *note_saturated(own)]
        data = _data(own, fits[index], diagnoses[index], models[index], notes)
        if index in onsets_s:
            data["onset_limits_s"] = [data["onset_s"] + end_s for end_s in onsets_s[index]]
        data = {WRITTEN_BY: __version__, "trace": str(files[index]), **data}
        found.append(Identified(data, own.problem, own.recorded))
    return found


def _data(
    trace: TraceCase,
    fit: TraceFit,
    diagnosis: Diagnosis,
    models: FittedModels,
    notes: Sequence[Note],
) -> dict[str, Any]:
    """Return all that is said of a trace, as plain data; notes follow from other fits."""
    case, problem, recorded = trace.case, trace.problem, trace.recorded
    instrument = problem.instrument
    best = diagnosis.likelihood.best
    assumptions = []
    if problem.fixed:
        names, verb = " and ".join(problem.fixed), "were" if len(problem.fixed) > 1 else "was"
        text = f"Other models are not compared, because {names} {verb} fixed."
        assumptions.append(Note(HARMLESS, text))
    read = [Note(HARMLESS, text) for text in recording.notes_on_recording(recorded)]
    said = exact_data(diagnosis, [*assumptions, *notes_on_fit(fit), *notes], read)
    rejected, usual = said["fit"] == REJECTED, is_usual(recorded.form, case.columns)
    return {
        "model": problem.model.name,
        "model_title": problem.model.title,
        "confidence": case.confidence,
        "instrument": instrument.kind,
        "reads": {"quantity": instrument.read.name, "unit": instrument.read.unit},
        **({} if usual else {"read_as": recorded.form}),
        **_fixed(problem),
        "limits": _gripper_in_limits(problem),
        **_fitted_along(problem, recorded, np.exp(best)),
        **said,
        "noise_model": fit.noise_data(),
        **models.data(rejected=rejected),
        "moduli": None if rejected else _moduli(problem, recorded.time_s, best),
        "assumed": _assumed(case, list(models.answers or case.models)),
        "by_default": _by_default(trace.given) if instrument.has_jaws else [],
        "versions": {
            "biogrip": __version__,
            **{name: version(name) for name in ("numpy", "scipy")},
        },
    }


def _moduli(problem: Experiment, time_s: Array, logs: Array) -> dict[str, list[float]]:
    """Return moduli of the fit from one over the duration to one over the first interval."""
    first_s = np.diff(time_s)[np.searchsorted(time_s[:-2], 0.0)]
    ends = 1 / float(np.ptp(time_s)), 1 / float(first_s)
    values = dict(zip(problem.searched.names, np.exp(logs).tolist(), strict=True))
    table = problem.model.moduli({**problem.fixed, **values}, np.geomspace(*ends, 31))
    return {name: column.tolist() for name, column in table.items()}


def _fixed(problem: Experiment) -> dict[str, list[str]]:
    """Return values and units of fixed parameters in words, or nothing if there are none."""
    units = {p.name: p.unit for p in problem.model.parameters}
    words = [f"{name} = {value:g} {units[name]}".rstrip() for name, value in problem.fixed.items()]
    return {"fixed": words} if words else {}


def _gripper_in_limits(problem: Experiment) -> str:
    """Return a sentence on the part that the gripper's uncertainty has in the limits."""
    exact = "gripper" if problem.instrument.has_jaws else problem.instrument.controlled.name
    if not problem.uncertain or not problem.instrument.has_jaws:
        return f"Limits are statistical only: the {exact} is taken as exact."
    keys = ", ".join(f"{part}.{key}".removesuffix(".share") for part, key, _ in problem.uncertain)
    return f"Limits include uncertainties of the gripper: {keys}."


def _fitted_along(
    problem: Experiment, recorded: Measurements, parameters: Array
) -> dict[str, float]:
    """Return onset, offset and drift of the instrument in the best fit, as far as fitted."""
    found = {"onset_s": float(recorded.onset_s or 0.0)} if problem.fit_start else {}
    if not (problem.offset or problem.drift):
        return found
    time_s, measured = recorded.time_s, recorded.readings[0]
    network = problem.searched.network(parameters)
    simulated = simulated_response(
        problem.gripper, network, problem.torque, time_s, nonlinear=False
    )[0]
    added = within(problem.nuisance(time_s), measured - simulated, problem.sd)
    slope = float((added[-1] - added[0]) / (time_s[-1] - time_s[0]))
    if problem.offset:
        found["offset_rad"] = float(added[0] - slope * time_s[0])
    if problem.drift:
        found["drift_rad_per_s"] = slope
    return found


def _assumed(case: Case, tried: Sequence[str]) -> dict[str, Any]:
    """Return what an identification relies on: its model, and a config that repeats it."""
    blocks = ["instrument", "protocol", "search_range", "measurement", "models", "least_squares"]
    blocks += ["gripper"] if case.instrument.has_jaws else []
    return {
        "model": case.sample.candidate,
        **{name: plain(getattr(case.block, name)) for name in blocks},
        **({"actuator": plain(case.study.actuator)} if case.instrument.has_jaws else {}),
        "fixed": case.fixed,
        "identifiability": {"confidence": case.confidence},
        "model_selection": {"models": list(tried)},
        "study_seed": case.study.study_seed,
    }


def _by_default(given: Mapping[str, Any]) -> list[str]:
    """Return which of gripper and protocol the user does not set; uncertainties are no gripper."""
    blocks = ("gripper", "protocol")
    return [name for name in blocks if not set(given.get(name) or ()) - {"uncertainty"}]
