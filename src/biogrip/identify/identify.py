"""From a recording and an experiment to a diagnosis.

1. The trace is prepared: clock, impossible readings, search ranges (`biogrip.identify.prepare`).
2. It is fitted by least squares, with the model of its noise, and judged by profile likelihoods.
3. Other sample models, another start of the protocol, an offset and a drift of the instrument are
   held against it (`biogrip.identify.other_fits`, `biogrip.judging.onset`).

The command, the library and the rules of a study all do this. Traces of the same model and budget
are fitted together; the result of a trace is the same, to the last bit, in any batch and alone.
"""

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from biogrip.digits import counted
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import ReportProgress, silent
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
from biogrip.judging.doubts import (
    DOUBT,
    HARMLESS,
    ROUNDED,
    Note,
    find_slow_misfit,
    name_suspects,
    notes_on_gains,
)
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
    progress: ReportProgress = silent,
    doing: Callable[[str], None] = lambda step: None,
) -> list[Diagnosis]:
    """Identify prepared traces of the same `budget`, each as if it were alone.

    `doing` is told of each of the `STEPS`. A `BiogripError` says that one of the traces cannot be
    fitted.
    """
    experiments = [experiment for _, experiment in traces]
    first, count = experiments[0], sum(len(recording.time_s) for recording, _ in traces)
    doing(f"fitting {counted(count, 'sample')}")
    fits = fits_of(traces, progress)
    doing("finding confidence limits")
    judged = diagnose_all(
        [fit.problem for fit in fits],
        [fit.found for fit in fits],
        confidence=first.confidence,
    )
    if not first.simulated:
        doing("trying other sample models")
        models = models_tried(traces, fits, judged)
        judged = [
            replace(judge_again(fit, own, tried), models=tried)
            for fit, own, tried in zip(fits, judged, models, strict=True)
        ]
        judged = with_times(judged)
    for index, (recording, experiment) in enumerate(traces):
        if experiment.fit_start:
            judged[index] = profile_over_onset(judged[index], recording.time_s)
    if not first.instrument.sweeps:
        doing("trying an offset and a drift")
    notes = [_notes_on_fit(*pair) for pair in zip(fits, experiments, strict=True)]
    if not first.simulated:
        given = zip(traces, judged, notes, second_opinions(traces, judged), strict=True)
        notes = [[*_notes_on_trace(*trace, own, *said)] for trace, own, *said in given]
    return [
        replace(own, notes=[*own.notes, *more], recording=recording, experiment=experiment, fit=fit)
        for (recording, experiment), fit, own, more in zip(traces, fits, judged, notes, strict=True)
    ]


def _notes_on_trace(
    recording: Recording,
    experiment: Experiment,
    judged: Diagnosis,
    on_fit: list[Note],
    opinion: list[Note],
) -> Iterator[Note]:
    """Yield notes on the reading of a trace, its fit, its start, and terms not declared."""
    for text in recording.remarks():
        yield Note(HARMLESS, text)
    if fixed := " and ".join(experiment.fixed):
        were = "were" if len(experiment.fixed) > 1 else "was"
        yield Note(HARMLESS, f"Other models are not compared, because {fixed} {were} fixed.")
    yield from on_fit
    if experiment.instrument.sweeps:
        return
    yield from notes_on_gains(judged.likelihood, judged.notes)
    start: list[Note] = []
    if recording.read.has_tip:
        # Imported here: most traces are of no tip.
        from biogrip.identify.contact import notes_on_contact

        start += notes_on_contact(replace(judged, recording=recording, experiment=experiment))
    start = start or notes_on_start(recording, experiment, judged)
    yield from start
    rounded = any(note.about == ROUNDED and note.weight == DOUBT for note in judged.notes)
    # Beside another start, or errors of rounding, an offset and a drift mean nothing.
    if not rounded and all(note.weight == HARMLESS for note in start):
        yield from opinion
    yield from note_flow(recording, experiment)
    if not rounded:
        yield from note_saturated(recording, experiment)


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
