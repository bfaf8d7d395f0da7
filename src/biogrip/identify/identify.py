"""From a recording and an experiment to a diagnosis.

1. The trace is prepared: clock, impossible readings, search ranges (`biogrip.identify.prepare`).
2. It is fitted by least squares, with the model of its noise, and judged by profile likelihoods.
3. Other sample models, another start of the protocol, an offset and a drift of the instrument are
   held against it.

Several sample models are fitted with the noise model of the trace's fit, and ranked by AIC and BIC;
with fixed parameters none are. If the chosen model fits better than it was diagnosed, the trace is
diagnosed again.

An offset and a drift that the user did not declare are fitted along. The test is a likelihood
ratio: if neither is in the trace, the decrease of chi^2 follows a chi-squared distribution with as
many degrees of freedom as terms are added (Wilks 1938).

The command, the library and the rules of a study all do this. Traces of the same model and budget
are fitted together; the result of a trace is the same, to the last bit, in any batch and alone.
"""

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

import biogrip.fit.nested_fits as nested_fits
import biogrip.judging.doubts as doubts
import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import counted, p_value, plain
from biogrip.fit.any_sample import fit_any_sample
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import refit
from biogrip.fit.problem import Fit, ReportProgress, TraceProblem, silent
from biogrip.fit.trace_fit import TraceFit, fit_least_squares
from biogrip.fit.trace_noise import absorbed, compare_extremes, growth_left
from biogrip.identify.prepare import Trace, flow_of, for_trace, prepare
from biogrip.judging.diagnosis import Diagnosis, diagnose, diagnose_all, with_times
from biogrip.judging.doubts import DOUBT, HARMLESS, REJECTED, REJECTION, Note, notes_on_gains
from biogrip.judging.likelihood import compute_fall, make_likelihood
from biogrip.judging.onset import OnsetFits, notes_on_start, profile_over_onset
from biogrip.judging.profiles import Finding
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S
from biogrip.physics.models import CANDIDATES
from biogrip.physics.noise import drift_is_flow, rms, without
from biogrip.physics.protocol import is_held
from biogrip.traces.reader import Recording

STEPS = 4
"""Number of steps of an identification that `identify_alike` reports."""

_MOST_SAMPLES = 50_000
# Most terms of the instrument that are fitted along: an offset and a drift.
_TERMS = 2
# Accuracy, as a share, of the least misfit of any sample.
_ROUNDING = 1e-6
# Each of the others would take half a second to five; they are tried where the config names them.
_POWER_LAWS = ["fractional_kelvin_voigt", "fractional_maxwell"]
_SAME_NETWORK = "liquid_drop", "zener_maxwell"


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
    fits = _fits_of(traces, progress)
    doing("finding confidence limits")
    given = [fit.problem for fit in fits], [fit.found for fit in fits]
    judged = [
        replace(diagnosis, recording=recording, experiment=experiment, fit=fit)
        for diagnosis, (recording, experiment), fit in zip(
            diagnose_all(*given, confidence=first.confidence), traces, fits, strict=True
        )
    ]
    if not first.simulated:
        doing("trying other sample models")
        judged = with_times(_compare_models(judged))
    for index, (recording, experiment) in enumerate(traces):
        if experiment.fit_start:
            judged[index] = profile_over_onset(judged[index], recording.time_s)
    if not first.instrument.sweeps:
        doing("trying an offset and a drift")
    notes = [_notes_on_fit(*pair) for pair in zip(fits, experiments, strict=True)]
    if not first.simulated:
        opinions = _second_opinions(judged)
        every = zip(judged, notes, opinions, strict=True)
        notes = [[*_notes_on_trace(*of_trace)] for of_trace in every]
    pairs = zip(judged, notes, strict=True)
    return [replace(diagnosis, notes=[*diagnosis.notes, *more]) for diagnosis, more in pairs]


def _notes_on_trace(judged: Diagnosis, on_fit: list[Note], opinion: list[Note]) -> Iterator[Note]:
    """Yield notes on the reading of a trace, its fit, its start, and terms not declared."""
    recording, experiment = judged.identified
    differ = recording.form.get("repeats")
    for text in recording.remarks():
        yield Note(DOUBT if differ and differ in text else HARMLESS, text)
    if fixed := " and ".join(experiment.fixed):
        were = "were" if len(experiment.fixed) > 1 else "was"
        yield Note(HARMLESS, f"Other models are not compared, because {fixed} {were} fixed.")
    yield from on_fit
    if experiment.instrument.sweeps:
        return
    yield from (gains := [*notes_on_gains(judged.likelihood, judged.notes)])
    start: list[Note] = []
    if recording.read.has_tip:
        # Imported here: most traces are of no tip.
        from biogrip.identify.recorded_load import notes_on_contact

        start += notes_on_contact(judged)
    start = start or [*_notes_on_blocks(judged)] or notes_on_start(recording, experiment, judged)
    yield from (it if it.weight == HARMLESS else replace(it, about=doubts.SET_UP) for it in start)
    rounded = any(note.about == doubts.ROUNDED and note.weight == DOUBT for note in judged.notes)
    # Beside another start, errors of rounding or gains that reject a fit they mean nothing.
    other = *start, *(note for note in gains if note.weight == REJECTION)
    if not rounded and all(note.weight == HARMLESS for note in other):
        yield from opinion
    yield from _note_flow(recording, experiment)
    if not rounded:
        yield from _note_saturated(recording, experiment)


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
        return doubts.name_suspects(white, fit.found.misfit / white.noise_scale, white.noise_scale)

    given = fit.noise_model, fit.errors, residuals.duration_s, share
    misfit = doubts.find_slow_misfit(*given, suspects)
    return [misfit, *notes] if misfit else notes


def _fits_of(traces: Sequence[Trace], progress: ReportProgress) -> list[TraceFit]:
    """Return the fits that judgements of traces with the same model and budget are based on."""
    experiments = [experiment for _, experiment in traces]
    rngs = [experiment.stream("identifiability") for experiment in experiments]
    posed = [(recording.time_s, recording.readings) for recording, _ in traces]
    return fit_least_squares(experiments, posed, rngs, progress)


def _compare_models(diagnoses: Sequence[Diagnosis]) -> list[Diagnosis]:
    """Fit several sample models to each trace, all of the same chosen model and budget.

    Best fits so far are among the starts. Branches are added until a further one does not help. Of
    the usual models those are spared that cannot suit the trace better than one that is fitted.
    """
    models = nested_fits.FittedModels(diagnoses[0].identified[1].sample.candidate)
    compared = [replace(diagnosis, models=models) for diagnosis in diagnoses]
    names = [*map(_candidates, compared)]
    while which := [trace for trace, of_trace in enumerate(names) if of_trace]:
        tried = _tried([compared[trace] for trace in which], [names[trace] for trace in which])
        for trace, models in zip(which, tried, strict=True):
            compared[trace] = replace(compared[trace], models=models)
            more = _one_branch_more(compared[trace], models)
            names[trace] = (*names[trace], more) if more else ()
    return [*map(_judge_again, compared)]


def _one_branch_more(diagnosis: Diagnosis, models: nested_fits.FittedModels) -> str | None:
    """Return the model with one branch more than the best one, if it was not tried and may be."""
    name = models.one_branch_more()
    if not diagnosis.identified[1].usual_models or name is None or name in models.spared:
        return None
    return name if len(CANDIDATES[name].model.names) <= _most(diagnosis) else None


def _tried(
    diagnoses: Sequence[Diagnosis], names: Sequence[Sequence[str]]
) -> list[nested_fits.FittedModels]:
    """Fit sample models of some names to each of several traces, diagnosed by the chosen one."""
    first, problems, rngs, near = diagnoses[0].identified[1], [], [], []
    for diagnosis, of_trace in zip(diagnoses, names, strict=True):
        experiment, likelihood = diagnosis.identified[1], diagnosis.likelihood
        for_model = partial(experiment.for_model, likelihood.problem)
        problems.append({name: for_model(CANDIDATES[name].model) for name in of_trace})
        rngs.append({name: experiment.stream(f"model {name}") for name in of_trace})
        near.append({experiment.sample.candidate: likelihood.best})
    growths, budget = [*map(_growth, diagnoses)], first.least_squares
    worth = _worth(diagnoses, growths)
    fits = nested_fits.fit_models(problems, budget, rngs, near=near, worth=worth)
    fitted = []
    for diagnosis, posed, growth, answers in zip(diagnoses, problems, growths, fits, strict=True):
        experiment, residuals = diagnosis.identified[1], diagnosis.likelihood.problem.residuals
        if experiment.fit_start and not experiment.coloured:
            answers = _at_their_onsets(diagnosis, posed, answers)
        misfits = [_misfit(growth, posed[name], answer) for name, answer in answers.items()]
        tried = nested_fits.ranked([*answers], misfits, residuals.samples)
        spared = tuple(name for name in posed if name not in answers)
        chosen = experiment.sample.candidate
        compared = nested_fits.FittedModels(chosen, tried, answers, spared=spared)
        best = compared.preferred or chosen
        # What a fit leaves that is not rejected has been looked at.
        adequate = best == chosen and diagnosis.status != REJECTED
        adequate = adequate or _leaves_noise(posed[best], answers[best], diagnosis)
        fitted.append(replace(compared, adequate=adequate))
    return fitted


def _at_their_onsets(
    diagnosis: Diagnosis, problems: Mapping[str, TraceProblem], answers: Mapping[str, Fit]
) -> dict[str, Fit]:
    """Return fits of models with the onset that each fits best with; that of the chosen is known.

    No start makes up for what is far more than noise.
    """
    (recording, experiment), best = diagnosis.identified, dict(answers)
    most = levels.WHITE * min(answer.misfit for answer in answers.values())
    for name, answer in answers.items():
        if name == experiment.sample.candidate or answer.misfit >= most:
            continue
        other = replace(experiment, sample=CANDIDATES[name], fixed={})
        fits = OnsetFits(other, recording.time_s, recording.readings)
        start = nested_fits.within_range(answer.parameters, problems[name])
        fit = fits.near(fits.at(0.0, start))
        if fit.misfit < answer.misfit:
            best[name] = replace(answer, parameters=np.exp(fit.log_parameters), misfit=fit.misfit)
    return best


def _worth(diagnoses: Sequence[Diagnosis], growths: Sequence[Array | None]) -> nested_fits.Worth:
    """Return what tells if a model of so many parameters could have a BIC that is clearly lowest.

    No linear sample fits better than the best of any, see `fit_any_sample`, at the start that was
    fitted. That is not asked where the config names the models or misfits are weighted, nor
    believed where a model fits better.
    """
    least = [
        fit_any_sample(diagnosis.likelihood.problem.residuals).misfit
        if diagnosis.identified[1].usual_models and growth is None
        else np.inf
        for diagnosis, growth in zip(diagnoses, growths, strict=True)
    ]

    def worth(name: str, trace: int, fits: nested_fits.Fits) -> bool:
        likelihood, limit = diagnoses[trace].likelihood, least[trace]
        chosen = diagnoses[trace].identified[1].sample.candidate
        misfits = {chosen: likelihood.misfit}
        misfits |= {other: fit.misfit for other, fit in fits.items()}
        if name == chosen or limit > min(misfits.values()) * (1 + _ROUNDING):
            return True
        sizes = [len(CANDIDATES[tried].model.names) for tried in (name, *misfits)]
        samples = likelihood.problem.residuals.samples
        bic = nested_fits.aic_and_bic([limit, *misfits.values()], samples, sizes)[1]
        return bool(bic[0] < np.min(bic[1:]) - levels.WORTH_A_MENTION)

    return worth


def _leaves_noise(problem: TraceProblem, answer: Fit, diagnosis: Diagnosis) -> bool:
    """Return True if what a model's fit leaves does not reject it."""
    best, experiment = nested_fits.within_range(answer.parameters, problem), diagnosis.identified[1]
    confidence, noise_sd = experiment.confidence, experiment.noise_sd
    given = problem, best, answer.misfit
    likelihood = make_likelihood(*given, confidence=confidence, noise_sd=noise_sd)
    _, find_notes = doubts.examine_residuals(likelihood)
    return doubts.compute_status(find_notes()) != REJECTED


def _growth(diagnosis: Diagnosis) -> Array | None:
    """Return the growth of the noise with the response, of each reading, if it clearly grows.

    Noise that grows by a rejected fit is its misfit.
    """
    growth = growth_left(diagnosis.likelihood.problem.residuals, diagnosis.likelihood.best)
    grows = diagnosis.status != REJECTED and compare_extremes(growth) > levels.CLEARLY
    return growth if grows else None


def _misfit(growth: Array | None, problem: TraceProblem, answer: Fit) -> float:
    """Return the misfit of a model; in noise that grows, of a weighted fit, to first order."""
    if growth is None:
        return answer.misfit
    left, slopes = problem.residuals(nested_fits.within_range(answer.parameters, problem))
    return rms(without(absorbed(slopes / growth), left / growth))


def _candidates(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Return the names of the models to fit to a trace, none if nothing is compared."""
    experiment, residuals = diagnosis.identified[1], diagnosis.likelihood.problem.residuals
    if experiment.fixed:
        return ()
    chosen, usual = experiment.sample.candidate, experiment.instrument.has_jaws
    # One network has one name: that asked for, or else that which is usual for the instrument.
    network = chosen if chosen in _SAME_NETWORK else _SAME_NETWORK[0 if usual else 1]
    every = [network if name in _SAME_NETWORK else name for name in (*experiment.models, chosen)]
    # With very many samples the dozens of modes of a springpot would take gigabytes.
    shortest_s, longest_s = experiment.torque.spread_s(residuals.trace.time_s)
    few = residuals.samples <= _MOST_SAMPLES and longest_s <= LONGEST_S * experiment.unit_s
    if few and shortest_s >= SHORTEST_S * experiment.unit_s and experiment.usual_models:
        every += _POWER_LAWS
    most = {name: len(CANDIDATES[name].model.names) <= _most(diagnosis) for name in every}
    names = tuple(name for name, may_be in most.items() if may_be or name == chosen)
    return names if len(names) > 1 else ()


def _most(diagnosis: Diagnosis) -> int:
    """Return the most parameters of a model: one a reading leaves nothing to tell noise by."""
    fit_start = diagnosis.identified[1].fit_start
    return diagnosis.likelihood.problem.residuals.free - fit_start - 1


def _judge_again(diagnosis: Diagnosis) -> Diagnosis:
    """Diagnose a trace again if its model was fitted better, within the search range, since.

    Return the new diagnosis, or the one so far, with a note if the lower chi^2 is outside the
    range.
    """
    models, likelihood = diagnosis.models, diagnosis.likelihood
    assert models is not None
    answer = models.answers.get(models.chosen)
    if answer is None or (increase := likelihood.increase(answer.misfit)) > -levels.MISSED:
        return diagnosis
    if nested_fits.is_within(answer.parameters, likelihood.problem):
        # Models are compared by nine digits of their misfits: an optimum that is shown has all.
        answer = refit(answer, likelihood.problem, np.log(answer.parameters))
        again = diagnose(likelihood.problem, answer, confidence=likelihood.confidence)
        recording, experiment = diagnosis.identified
        judged = replace(again, recording=recording, experiment=experiment)
        return replace(judged, fit=diagnosis.fit, models=models)
    gone = nested_fits.vanished(models.chosen, answer)
    where = f", without {' and '.join(gone)}" if gone else ""
    text = (
        f"Outside the search range{where}, the model fits better: χ² is lower by "
        f"{plain(-increase)}. The limits hold for samples within the range."
    )
    return replace(diagnosis, notes=[*diagnosis.notes, Note(DOUBT, text)])


def _second_opinions(diagnoses: Sequence[Diagnosis]) -> list[list[Note]]:
    """Fit an offset and a drift along, and warn if chi^2 falls more than by chance (`FALSE_ALARM`).

    If an offset alone explains as much, it is that; fits are those that the command would make if
    it were declared. Each trace gets at most one note; with a rejected fit, only if the other is
    not rejected. None are tried if both are declared already, or if the noise model is coloured,
    which fits both. Nor is it said if BIC prefers another model by far more.
    """
    notes: list[list[Note]] = [[] for _ in diagnoses]
    which = []
    for index, (recording, experiment) in enumerate(one.identified for one in diagnoses):
        few = len(recording.time_s) <= experiment.unknowns + _TERMS
        declared = experiment.coloured or (experiment.offset and experiment.drift)
        if not (experiment.instrument.sweeps or declared or few):
            which.append(index)
    both = _better(diagnoses, which, drift=True)
    alone = [index for index, other in both.items() if other.added > 1]
    offsets = _better(diagnoses, alone, drift=False)
    for index, other in both.items():
        diagnosis, one = diagnoses[index], offsets.get(index)
        if one and chdtrc(1, max(other.fall - one.fall, 0.0)) >= levels.FALSE_ALARM:
            other = one
        confidence = diagnosis.likelihood.confidence
        judged = diagnose(other.fit.problem, other.fit.found, confidence=confidence)
        terms = np.log(len(diagnosis.identified[0].time_s)) * other.added
        assert diagnosis.models is not None
        led = diagnosis.models.lead > other.fall - terms + levels.FAR_BETTER
        if not (led or diagnosis.status == judged.status == REJECTED):
            notes[index].append(_note(diagnosis, other, judged))
    return notes


class _Other(NamedTuple):
    """A better fit with terms added: decrease of chi^2, its chance, and how many terms."""

    experiment: Experiment
    fit: TraceFit
    fall: float
    chance: float
    added: int


def _better(
    diagnoses: Sequence[Diagnosis], which: Sequence[int], *, drift: bool
) -> dict[int, _Other]:
    """Return fits with an offset, or a drift, too, by index, if they are better."""
    if not which:
        return {}
    also, better = [], {}
    for recording, experiment in (diagnoses[index].identified for index in which):
        # As if the user had declared them.
        declared = replace(experiment, offset=True, drift=drift or experiment.drift)
        also.append((recording, for_trace(declared, recording)))
    for index, (_, other), fit in zip(which, also, _fits_of(also, silent), strict=True):
        experiment, likelihood = diagnoses[index].identified[1], diagnoses[index].likelihood
        known = likelihood.noise_sd if experiment.noise_sd is not None else None
        misfits = likelihood.misfit, fit.found.misfit
        fall = compute_fall(fit.problem.residuals.samples, *misfits, known)
        added = other.offset_and_drift - experiment.offset_and_drift
        if (chance := float(chdtrc(added, max(fall, 0.0)))) < levels.FALSE_ALARM:
            better[index] = _Other(other, fit, fall, chance, added)
    return better


def _note(diagnosis: Diagnosis, other: _Other, judged: Diagnosis) -> Note:
    """Return the warning, with the verdicts that an offset and a drift would change."""
    (recording, experiment), rejected = diagnosis.identified, diagnosis.status == REJECTED
    # Characteristic times, at the end of the former, are not among the latter.
    changed = [
        f"{after.quantity.label} would be {after.words().removeprefix('determined: ')}"
        for before, after in zip(diagnosis.findings, judged.findings, strict=False)
        if _differ(before, after)
    ]
    drifts = other.experiment.drift and not experiment.drift
    # A constant and a line, if not both are declared already.
    many = drifts and not experiment.offset
    better = f"fitted along, {'explain' if many else 'explains'} the trace far better (χ² falls by "
    better += f"{plain(other.fall)}, {p_value(other.chance)})"
    instrument, torque = experiment.instrument, experiment.torque
    controlled = instrument.controlled.name
    same = f"Under this {controlled} both give the same"
    if drifts and drift_is_flow(torque, recording.time_s):
        text = (
            f"A constant and a line in time, {better}: the instrument drifts, or the sample flows. "
            f"{same} line: a {controlled} that changes would tell them apart."
        )
    elif not drifts and is_held(torque, recording.time_s):
        yields = "holds a load" if instrument.deforms else "has an instantaneous compliance"
        text = (
            f"A constant, {better}: the instrument has an offset, or the sample {yields}. {same} "
            "constant: readings before loading would tell them apart."
        )
    else:
        terms = "An offset and a drift" if many else "A drift" if drifts else "An offset"
        changes = "it is not rejected then" if rejected else "; ".join(changed)
        options = " --offset" * other.experiment.offset + " --drift" * other.experiment.drift
        text = (
            f"{terms} of the instrument, {better}: {changes or 'no verdict changes'}. If the "
            f"instrument may have that, identify the trace with{options}."
        )
    weight = DOUBT if changed else HARMLESS
    return Note(REJECTION if rejected else weight, text)


def _notes_on_blocks(judged: Diagnosis) -> Iterator[Note]:
    """Yield a note if a constant for each block that was joined explains a trace, of any sample.

    So may an offset that was declared be one of a later block, but not what rows before the load
    tell. That a step came between two rows looks like a small one.
    """
    recording, experiment = judged.identified
    time_s, readings = recording.time_s, recording.readings
    blocks = np.searchsorted(recording.later_blocks, recording.lines, side="right")
    steps = np.array([blocks == block for block in np.unique(blocks)[1:]], np.float64)
    declared = experiment.offset and "offset" not in experiment.undeclared
    if not len(steps) or experiment.coloured or (judged.status == doubts.OK and not declared):
        return
    base = replace(experiment.to_identify(), offset=experiment.offset and not declared)
    # Of any size, as so many noises.
    rows = base.in_noise(time_s, uncertain=1e9 * steps)
    anew, whole, alone = (
        fit_any_sample(other.of(time_s, readings, condensed=condensed).residuals)
        for other, condensed in ((base, rows), (replace(base, offset=True), None), (base, None))
    )
    noise = levels.WHITE * anew.lags.residuals.noise_scale
    if not anew.sd < noise < alone.sd or alone.sd < levels.FAR_OFF * alone.lags.residuals.peak:
        return
    ends_s = time_s[:-1][np.diff(blocks) > 0] + (recording.onset_s or 0.0)
    so = " An offset throughout would do as well, with other values." if whole.sd < noise else ""
    yield Note(
        REJECTION if judged.status == REJECTED else DOUBT,
        f"Readings seem to begin anew at {' s and '.join(map(plain, ends_s))} s: with a constant "
        f"for each block, a linear sample explains the trace.{so} Add to each what was zeroed, or "
        f"identify the first alone: --block {recording.read.blocks[0]}.",
    )


def _note_flow(recording: Recording, experiment: Experiment) -> Iterator[Note]:
    """Say of a damper that lets the sample flow that a drift would look the same."""
    damper = flow_of(experiment)
    if damper and drift_is_flow(experiment.torque, recording.time_s):
        held = f"{damper} holds if the instrument does not drift"
        if experiment.drift:
            held = f"of {damper} and the drift that is fitted along, only the sum is determined"
        yield Note(
            HARMLESS,
            f"Under a constant {experiment.instrument.controlled.name} a drift of the instrument "
            f"and the flow of the sample are one line: {held}.",
        )


def _note_saturated(recording: Recording, experiment: Experiment) -> Iterator[Note]:
    """Yield a doubt if many readings after the start are exactly the largest, or the smallest.

    Readings that are only rounded have neighbouring values nearly as often.
    """
    values, counts = np.unique(recording.readings[recording.time_s > 0], return_counts=True)
    if len(values) < levels.FEWEST_VALUES:
        return
    unit = f" {experiment.instrument.read.unit}".rstrip()
    for end, at, near in (("largest", -1, counts[::-1]), ("smallest", 0, counts)):
        others = levels.MORE_OFTEN * np.max(near[1 : levels.FEWEST_VALUES])
        if counts[at] > max(levels.SATURATED * np.sum(counts), others):
            yield Note(
                DOUBT,
                f"{counts[at]} of {np.sum(counts)} readings are exactly the {end}, "
                f"{plain(values[at])}{unit}: the instrument looks saturated, and what it cut off "
                "is missing.",
            )


def _differ(before: Finding, after: Finding) -> bool:
    """Return True if verdicts differ, or the estimate moved out of the earlier interval."""
    if before.verdict != after.verdict:
        return True
    low, high = before.low or 0.0, before.high or np.inf
    return bool(before.is_bounded and not low <= after.value <= high)
