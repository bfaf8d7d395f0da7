"""Other fits that are held against that of a trace: sample models, an offset and a drift.

Several sample models are fitted with the noise model of the trace's fit, and ranked by AIC and BIC;
with fixed parameters none are. If the own model fits better than it was diagnosed, the trace is
diagnosed again.

An offset and a drift that the user did not declare are fitted along. The test is a likelihood
ratio: if neither is in the trace, the decrease of chi^2 follows a chi-squared distribution with as
many degrees of freedom as terms are added (Wilks 1938).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import chdtrc

from biogrip.digits import plain
from biogrip.fit.fitted_onset import OnsetFits
from biogrip.fit.least_squares import LeastSquaresSettings
from biogrip.fit.nested_fits import (
    FittedModel,
    advice,
    fit_models,
    fits_far_better,
    is_within,
    one_branch_more,
    preferred,
    ranked,
    within_range,
)
from biogrip.fit.noise_model_fit import absorbed, compare_extremes, compute_growth
from biogrip.fit.problem import Fit, Progress, TraceProblem
from biogrip.fit.trace_fit import TraceFit
from biogrip.identify.trace_case import TraceCase, flow_of
from biogrip.judging.diagnosis import Diagnosis, diagnose
from biogrip.judging.doubts import (
    CLEARLY,
    DOUBT,
    FALSE_ALARM,
    HARMLESS,
    REJECTED,
    REJECTION,
    Note,
    compute_status,
    examine_residuals,
    one_in,
)
from biogrip.judging.likelihood import MISSED, compute_fall, make_likelihood
from biogrip.judging.verdicts import Finding
from biogrip.physics.fractional import LONGEST_S
from biogrip.physics.models import CANDIDATES
from biogrip.physics.noise import stream
from biogrip.physics.protocol import is_held
from biogrip.physics.whitening import drift_is_flow, without
from biogrip.stages.judgement import fits_judged

_MOST_SAMPLES = 50_000
# Difference of BIC by which a model is far better than another (Kass and Raftery).
_FAR_BETTER = 10.0
# Most terms of the instrument that are fitted along: an offset and a drift.
_TERMS = 2
# Each of the others would take half a second to five; they are tried where the config names them.
_POWER_LAWS = ["fractional_kelvin_voigt", "fractional_maxwell"]


def fits_of(traces: Sequence[TraceCase], progress: Progress) -> list[TraceFit]:
    """Return the command's fits of traces with the same model and budget."""
    cases, problems = [own.case for own in traces], [own.problem for own in traces]
    return fits_judged(cases, problems, [own.readings for own in traces], 0, progress)


def _diagnosed(trace: TraceCase, fit: TraceFit, found: Fit) -> Diagnosis:
    known = trace.case.confidence, trace.problem.noise_sd
    searched = trace.problem.searched
    return diagnose(fit.problem, searched, found, confidence=known[0], noise_sd=known[1])


@dataclass(frozen=True)
class FittedModels:
    """Best fits of sample models to a trace."""

    chosen: str
    """Sample model that the trace was identified with."""
    tried: list[FittedModel] = field(default_factory=list)
    """Rank of each model."""
    answers: dict[str, Fit] = field(default_factory=dict)
    """Fit of each by its name, in the same order."""
    adequate: bool = True
    """False if that of the model which BIC prefers is rejected for what it leaves."""

    @property
    def lead(self) -> float:
        """How much lower than that of the chosen model the BIC of another is."""
        return max(
            (own.delta_bic for own in self.tried if own.candidate == self.chosen), default=0.0
        )

    def data(self, *, rejected: bool) -> dict[str, Any]:
        """Return one row per model, and advice in words, as plain data.

        If the fit of the chosen model is rejected, advice is only another model, simpler or richer,
        that may suit the trace.
        """
        rows = [
            {
                "model": each.candidate,
                "title": each.model.title,
                "parameters": len(each.model.names),
                "misfit_rad": self.answers[each.candidate].misfit,
                "vanished": _vanished(each.candidate, self.answers[each.candidate]),
                "converged": self.answers[each.candidate].converged,
                "delta_aic": each.delta_aic,
                "delta_bic": each.delta_bic,
            }
            for each in self.tried
        ]
        said = rows and (not rejected or fits_far_better(self.tried, self.chosen))
        words = advice(self.tried, self.chosen, adequate=self.adequate) if said else None
        best = preferred(self.tried, self.chosen) if rows and self.adequate else None
        return {"models": rows, "preferred_model": best, "advice": words}


def _vanished(candidate: str, answer: Fit) -> list[str]:
    """Name the elements that vanish in the best fit: parameters that are zero or infinite."""
    gone = (answer.parameters == 0) | np.isinf(answer.parameters)
    elements = zip(CANDIDATES[candidate].model.parameters, gone, strict=True)
    return [each.name for each, is_gone in elements if is_gone and each.kind != "exponent"]


def models_tried(
    traces: Sequence[TraceCase], fits: Sequence[TraceFit], diagnoses: Sequence[Diagnosis]
) -> list[FittedModels]:
    """Fit several sample models to each trace, all of the same chosen model and budget.

    Best fits so far are among the starts.
    """
    chosen, budget = traces[0].case.sample.candidate, traces[0].case.block.least_squares
    candidates = [_candidates(*pair) for pair in zip(traces, fits, strict=True)]
    every = [FittedModels(chosen) for _ in traces]
    for names in filter(None, dict.fromkeys(candidates)):
        which = [index for index, own in enumerate(candidates) if own == names]
        own = [(traces[index], fits[index], diagnoses[index]) for index in which]
        found = _tried(own, names, budget)
        # Branches are added until a further one does not help.
        while more := {_one_branch_more(*each) for each in zip(own, found, strict=True)} - {None}:
            names = (*names, *sorted(name for name in more if name))
            found = _tried(own, names, budget)
        for index, models in zip(which, found, strict=True):
            every[index] = models
    return every


_Own = tuple[TraceCase, TraceFit, Diagnosis]


def _one_branch_more(own: _Own, models: FittedModels) -> str | None:
    """Return the model with one branch more than the best one, if it was not tried and may be."""
    trace, fit, _ = own
    name = None if trace.names_models else one_branch_more(models.tried)
    return name if name and len(CANDIDATES[name].model.names) <= _most(trace, fit) else None


def _tried(
    own: Sequence[_Own], names: Sequence[str], budget: LeastSquaresSettings
) -> list[FittedModels]:
    """Fit sample models to traces, each with its fit and diagnosis by the chosen model."""
    chosen = own[0][0].case.sample.candidate
    problems = {
        name: [
            trace.problem.for_model(fit.problem, CANDIDATES[name].model) for trace, fit, _ in own
        ]
        for name in names
    }
    streams = {
        name: [
            stream(trace.case.study.study_seed, trace.case.name, 0, f"model {name}")
            for trace, _, _ in own
        ]
        for name in names
    }
    near = {chosen: np.array([diagnosis.likelihood.best for _, _, diagnosis in own])}
    found = fit_models(problems, budget, streams, lambda: None, near=near)
    every = []
    for place, (trace, fit, diagnosis) in enumerate(own):
        posed = {name: problems[name][place] for name in names}
        answers = {name: found[name][place] for name in names}
        if trace.problem.fit_start and not trace.problem.coloured:
            answers = {
                name: _at_own_onset(trace, name, posed[name], answer)
                for name, answer in answers.items()
            }
        misfits = _misfits(diagnosis, posed, answers)
        tried = ranked(list(names), misfits, fit.problem.residuals.samples)
        best = preferred(tried, chosen)
        adequate = best is None or _leaves_noise(trace, posed[best], answers[best])
        every.append(FittedModels(chosen, tried, answers, adequate))
    return every


def _leaves_noise(trace: TraceCase, problem: TraceProblem, answer: Fit) -> bool:
    """Return True if what a model's fit leaves does not reject it."""
    likelihood = make_likelihood(
        problem,
        within_range(answer.parameters, problem),
        answer.misfit,
        confidence=trace.case.confidence,
        noise_sd=trace.problem.noise_sd,
    )
    return compute_status(examine_residuals(likelihood).notes) != REJECTED


def _misfits(
    diagnosis: Diagnosis, problems: Mapping[str, TraceProblem], answers: Mapping[str, Fit]
) -> list[float]:
    """Return misfits of models; in noise that clearly grows those of weighted fits, to first order.

    Noise that grows by a rejected fit is its misfit.
    """
    misfits = [answer.misfit for answer in answers.values()]
    residuals, best = diagnosis.likelihood.problem.residuals, diagnosis.likelihood.best
    if diagnosis.status == REJECTED:
        return misfits
    growth = compute_growth(residuals.left(best), residuals.response(best), residuals.rounding)
    if compare_extremes(growth) <= CLEARLY:
        return misfits
    for place, (name, problem) in enumerate(problems.items()):
        left, slopes = problem.residuals(within_range(answers[name].parameters, problem))
        weighted = without(absorbed(slopes / growth), left / growth)
        misfits[place] = float(np.sqrt(np.mean(weighted**2)))
    return misfits


def _at_own_onset(trace: TraceCase, name: str, problem: TraceProblem, found: Fit) -> Fit:
    """Return a model's fit with the onset that it fits best with, from that of the chosen model."""
    if name == trace.case.sample.candidate:
        return found
    fits = OnsetFits(replace(trace.problem, sample=CANDIDATES[name], fixed={}), *trace.readings)
    best = fits.near(fits.at(0.0, within_range(found.parameters, problem)))
    if best.misfit >= found.misfit:
        return found
    return found.replaced(np.exp(best.log_parameters), best.misfit, converged=found.converged)


def _candidates(trace: TraceCase, fit: TraceFit) -> tuple[str, ...]:
    """Return the names of the models to fit to a trace, none if nothing is compared."""
    if trace.problem.fixed:
        return ()
    residuals, chosen = fit.problem.residuals, trace.case.sample.candidate
    every = dict.fromkeys(trace.case.models)
    # With very many samples the dozens of modes of a springpot would take gigabytes.
    few = residuals.samples <= _MOST_SAMPLES and trace.problem.torque.end_s <= LONGEST_S
    if few and not trace.names_models:
        every |= dict.fromkeys(_POWER_LAWS)
    most = _most(trace, fit)
    names = (it for it in every if len(CANDIDATES[it].model.names) <= most or it == chosen)
    found = tuple(names)
    return found if len(found) > 1 else ()


def _most(trace: TraceCase, fit: TraceFit) -> int:
    """Return the most parameters of a model: one a reading leaves nothing to tell noise by."""
    return fit.problem.residuals.free - trace.problem.fit_start - 1


def judge_again(
    trace: TraceCase, fit: TraceFit, diagnosis: Diagnosis, models: FittedModels
) -> tuple[Diagnosis, list[Note]]:
    """Diagnose a trace again if its own model was fitted better, within the search range, since.

    Return the new diagnosis, or the one so far, and a note if the lower chi^2 is outside the range.
    """
    own = models.answers.get(models.chosen)
    if own is None or (increase := diagnosis.likelihood.increase(own.misfit)) > -MISSED:
        return diagnosis, []
    if is_within(own.parameters, fit.problem):
        return _diagnosed(trace, fit, own), []
    gone = _vanished(models.chosen, own)
    where = f", without {' and '.join(gone)}" if gone else ""
    text = (
        f"Outside the search range{where}, the model fits better: χ² is lower by "
        f"{plain(-increase)}. The limits hold for samples within the range."
    )
    return diagnosis, [Note(DOUBT, text)]


def second_opinions(
    traces: Sequence[TraceCase],
    diagnoses: Sequence[Diagnosis],
    progress: Progress,
    leads: Sequence[float],
) -> list[list[Note]]:
    """Fit an offset and a drift along, and warn if chi^2 falls more than by chance (`FALSE_ALARM`).

    If an offset alone explains as much, it is that; fits are those that the command would make if
    it were declared. Each trace gets at most one note; with a rejected fit, only if the other is
    not rejected. None are tried if both are declared already, or if the noise model is coloured,
    which fits both. Nor is it said if BIC prefers another model by far more: by its `leads`.
    """
    notes: list[list[Note]] = [[] for _ in traces]
    which = [
        index
        for index, trace in enumerate(traces)
        if not (trace.problem.coloured or (trace.problem.offset and trace.problem.drift))
        and len(trace.readings[0]) > trace.problem.unknowns + _TERMS
    ]
    both = _better(traces, diagnoses, which, progress, drift=True)
    alone = [index for index in both if both[index].added > 1]
    offsets = _better(traces, diagnoses, alone, progress, drift=False)
    for index, other in both.items():
        one = offsets.get(index)
        if one and chdtrc(1, max(other.fall - one.fall, 0.0)) >= FALSE_ALARM:
            other = one
        judged = _diagnosed(other.trace, other.fit, other.fit.found)
        terms = np.log(len(traces[index].readings[0])) * other.added
        led = leads[index] > other.fall - terms + _FAR_BETTER
        if not (led or diagnoses[index].status == judged.status == REJECTED):
            notes[index].append(_note(traces[index], diagnoses[index], other, judged))
    return notes


class _Other(NamedTuple):
    """A better fit with terms added: decrease of chi^2, its chance, and how many terms."""

    trace: TraceCase
    fit: TraceFit
    fall: float
    chance: float
    added: int


def _better(
    traces: Sequence[TraceCase],
    diagnoses: Sequence[Diagnosis],
    which: Sequence[int],
    progress: Progress,
    *,
    drift: bool,
) -> dict[int, _Other]:
    """Return the command's fits with an offset, or a drift, too, by index, if they are better."""
    if not which:
        return {}
    also = [traces[index].with_terms(drift=drift) for index in which]
    found = {}
    for index, own, fit in zip(which, also, fits_of(also, progress), strict=True):
        problem, likelihood = traces[index].problem, diagnoses[index].likelihood
        fall = compute_fall(
            fit.problem.residuals.samples,
            likelihood.misfit,
            fit.found.misfit,
            likelihood.noise_sd if problem.noise_sd is not None else None,
        )
        added = own.problem.offset + own.problem.drift - problem.offset - problem.drift
        if (chance := float(chdtrc(added, max(fall, 0.0)))) < FALSE_ALARM:
            found[index] = _Other(own, fit, fall, chance, added)
    return found


def _note(trace: TraceCase, diagnosis: Diagnosis, other: _Other, judged: Diagnosis) -> Note:
    """Return the warning, with the verdicts that an offset and a drift would change."""
    experiment, rejected = trace.problem, diagnosis.status == REJECTED
    # Characteristic times, at the end of the former, are not among the latter.
    changed = [
        f"{after.quantity.label} would be {after.words().removeprefix('determined: ')}"
        for before, after in zip(diagnosis.findings, judged.findings, strict=False)
        if _differ(before, after)
    ]
    changes = "it is not rejected then" if rejected else "; ".join(changed)
    drifts = other.trace.problem.drift and not experiment.drift
    # A constant and a line, if not both are declared already.
    many = drifts and not experiment.offset
    better = f"{'explain' if many else 'explains'} the trace far better (χ² falls by "
    better += f"{plain(other.fall)}; by chance it would {one_in(other.chance)} traces)"
    instrument, torque = experiment.instrument, experiment.torque
    controlled = instrument.controlled.name
    if drifts and drift_is_flow(torque, trace.recorded.time_s):
        text = (
            f"A constant and a line in time, fitted along, {better}: the "
            f"instrument drifts, or the sample flows. Under this {controlled} both give the same "
            f"line, and the trace cannot tell which it is: a {controlled} that changes would."
        )
    elif not drifts and is_held(torque, trace.recorded.time_s):
        yields = "holds a load" if instrument.deforms else "yields at once"
        text = (
            f"A constant, fitted along, {better}: the instrument has an offset, or the sample "
            f"{yields}. Under this {controlled} both give the same constant: readings before the "
            "start would tell."
        )
    else:
        terms = "An offset and a drift" if many else "A drift" if drifts else "An offset"
        options = " --offset" * other.trace.problem.offset + " --drift" * other.trace.problem.drift
        text = (
            f"{terms} of the instrument, fitted along, {better}: {changes or 'no verdict changes'}."
            f" If the instrument may have that, identify the trace with{options}."
        )
        if drifts and not instrument.deforms:
            text += (
                f" Or the sample flows: as long as the {controlled} is constant, a drift and a "
                "damper without a spring give the same line."
            )
    weight = DOUBT if changed else HARMLESS
    return Note(REJECTION if rejected else weight, text)


def note_flow(trace: TraceCase) -> list[Note]:
    """Say of a damper that lets the sample flow that a drift would look the same."""
    problem, damper = trace.problem, flow_of(trace.problem)
    if not damper or not drift_is_flow(problem.torque, trace.recorded.time_s):
        return []
    held = f"{damper} holds if the instrument does not drift"
    if problem.drift:
        held = f"of {damper} and the drift that is fitted along, only the sum is determined"
    text = (
        f"Under a constant {problem.instrument.controlled.name} a drift of the instrument and the "
        f"flow of the sample are one line: {held}."
    )
    return [Note(HARMLESS, text)]


def _differ(before: Finding, after: Finding) -> bool:
    """Return True if verdicts differ, or the estimate moved out of the earlier interval."""
    if before.verdict != after.verdict:
        return True
    low, high = before.low or 0.0, before.high or np.inf
    return bool(before.is_bounded and not low <= after.value <= high)
