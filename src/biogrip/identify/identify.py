"""From a recording and an experiment to a diagnosis.

1. The trace is prepared: clock, impossible readings, search ranges (`biogrip.identify.prepare`).
2. It is fitted by least squares, with the model of its noise, and judged by profile likelihoods.
3. Other sample models, another start of the protocol, an offset and a drift of the instrument are
   held against it (`biogrip.identify.other_fits`, `biogrip.judging.onset`).

The command, the library and the rules of a study all do this. Traces of the same model and budget
are fitted together; the result of a trace is the same, to the last bit, in any batch and alone.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace

import numpy as np

from biogrip.digits import counted
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import Progress, silent
from biogrip.fit.trace_fit import TraceFit
from biogrip.identify.other_fits import (
    Trace,
    fits_of,
    judge_again,
    models_tried,
    note_flow,
    note_saturated,
    second_opinions,
)
from biogrip.identify.prepare import prepare
from biogrip.judging.diagnosis import Diagnosis, diagnose_all, with_times
from biogrip.judging.doubts import DOUBT, HARMLESS, ROUNDED, Note, find_slow_misfit, name_suspects
from biogrip.judging.onset import notes_on_start, profile_over_onset
from biogrip.traces.reader import Recording

STEPS = 4
"""Number of steps of an identification that `identify_alike` reports."""


def identify(recording: Recording, experiment: Experiment) -> Diagnosis:
    """Identify the sample of a recorded trace.

    Parameters
    ----------
    recording
        What was read, from a file or of arrays.
    experiment
        What was done: instrument, protocol, sample model, noise.

    Raises
    ------
    BiogripError
        If the trace is impossible with instrument and protocol; it has line or index, and column.
    """
    return identify_alike([prepare(recording, experiment)])[0]


def budget(experiment: Experiment) -> Hashable:
    """Return what traces that are fitted together have in common: model, fits and confidence."""
    return experiment.searched, experiment.least_squares, experiment.confidence


def identify_alike(
    traces: Sequence[Trace],
    *,
    progress: Progress = silent,
    doing: Callable[[str], None] = lambda step: None,
    valley: bool = False,
) -> list[Diagnosis]:
    """Identify prepared traces of the same `budget`, each as if it were alone.

    `doing` is told of each of the `STEPS`. If `valley` is true, chi^2 is mapped over exchangeable
    parameters. A `BiogripError` says that one of the traces cannot be fitted.
    """
    experiments = [experiment for _, experiment in traces]
    first, count = experiments[0], sum(len(recording.time_s) for recording, _ in traces)
    doing(f"fitting {counted(count, 'sample')}")
    fits = fits_of(traces, progress)
    doing("finding confidence limits")
    judged = diagnose_all(
        [fit.problem for fit in fits],
        first.searched,
        [fit.found for fit in fits],
        confidence=first.confidence,
        noise_sd=[experiment.noise_sd for experiment in experiments],
        valley=valley,
    )
    if not first.simulated:
        doing("trying other sample models")
        judged = _compared(traces, fits, judged, valley=valley)
    for index, (recording, experiment) in enumerate(traces):
        if experiment.fit_start:
            judged[index] = profile_over_onset(judged[index], recording.time_s)
    if not first.instrument.sweeps:
        doing("trying an offset and a drift")
    notes = [_notes_on_fit(*pair) for pair in zip(fits, experiments, strict=True)]
    if not first.simulated:
        notes = _notes_on_traces(traces, judged, notes)
    return [
        replace(
            judged[index],
            notes=[*judged[index].notes, *notes[index]],
            recording=recording,
            experiment=experiment,
            fit=fits[index],
        )
        for index, (recording, experiment) in enumerate(traces)
    ]


def _compared(
    traces: Sequence[Trace], fits: Sequence[TraceFit], judged: Sequence[Diagnosis], *, valley: bool
) -> list[Diagnosis]:
    """Return diagnoses with other models, again where their own was fitted better, and times."""
    models = models_tried(traces, fits, judged)
    again = [
        replace(judge_again(experiment, fit, diagnosis, tried, valley=valley), models=tried)
        for (_, experiment), fit, diagnosis, tried in zip(traces, fits, judged, models, strict=True)
    ]
    return with_times(again, traces[0][1].searched)


def _notes_on_traces(
    traces: Sequence[Trace], judged: Sequence[Diagnosis], on_fits: Sequence[list[Note]]
) -> list[list[Note]]:
    """Return notes on the reading of each trace, its fit, its start, and terms not declared."""
    opinions = second_opinions(traces, judged)
    notes = []
    for index, (recording, experiment) in enumerate(traces):
        said = [Note(HARMLESS, text) for text in recording.remarks()]
        if experiment.fixed:
            fixed = (
                f"{' and '.join(experiment.fixed)} {'were' if len(experiment.fixed) > 1 else 'was'}"
            )
            said.append(Note(HARMLESS, f"Other models are not compared, because {fixed} fixed."))
        said += on_fits[index]
        if experiment.instrument.sweeps:
            notes.append(said)
            continue
        given = recording.time_s, recording.readings, judged[index]
        start = notes_on_start(experiment, *given)
        said += start
        own = judged[index].notes
        rounded = any(note.about == ROUNDED and note.weight == DOUBT for note in own)
        # Beside another start, or errors of rounding, an offset and a drift mean nothing.
        if not rounded and all(note.weight == HARMLESS for note in start):
            said += opinions[index]
        said += note_flow(recording, experiment)
        said += [] if rounded else note_saturated(recording, experiment)
        notes.append(said)
    return notes


def _notes_on_fit(fit: TraceFit, experiment: Experiment) -> list[Note]:
    """Return notes on the noise model of a fit; one that may hold misfit makes it doubtful."""
    notes = [Note(HARMLESS, text) for text in fit.notes()]
    if fit.noise_model is None:
        return notes
    residuals = fit.problem.residuals
    peak = np.max(np.abs(residuals.response(np.log(fit.found.parameters))))
    slow = fit.noise_model.ar1 + fit.noise_model.walk
    share = float(fit.found.misfit * np.sqrt(slow) / peak)

    def suspects() -> str:
        # A slow noise model would take misfit for noise again.
        trace = residuals.trace
        white = experiment.to_identify().of(trace.time_s, trace.readings).residuals
        return name_suspects(white, fit.found.misfit / white.noise_scale, white.noise_scale)

    given = fit.noise_model, fit.errors, residuals.duration_s, share
    misfit = find_slow_misfit(*given, suspects)
    return [misfit, *notes] if misfit else notes
