"""Several traces of one sample: one fit with shared parameters, and whether they agree.

1. Each trace is identified by itself, with its noise and what its instrument may have added.
2. Residuals are stacked, each over its noise; parameters are fitted and profiled together.
3. Two tests tell whether one sample can have shown all traces (`biogrip.judging.agreement`). If
   not, the joint fit is rejected, and the results of the traces stand.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from typing import Any

import numpy as np

from biogrip.digits import p_value, plain, with_limits
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.fit.joint import of_one_kind, stack, with_uncertain_start
from biogrip.fit.least_squares import identify_many
from biogrip.fit.problem import Fit, TraceProblem
from biogrip.identify.data import judged_data, moduli_between
from biogrip.judging.agreement import Agreement, compare_traces, shared_freedom
from biogrip.judging.diagnosis import Diagnosis, lower_fit, profile_all, with_notes, with_times
from biogrip.judging.doubts import REJECTED, REJECTION, SET_UP, Note, find_reasons, order_notes
from biogrip.judging.likelihood import Likelihood, find_thresholds
from biogrip.judging.without_model import KINDS, WithoutModel, tell_without_model
from biogrip.physics.protocol import largest_load

# Least noise over the largest reading: traces without any are rounded.
_ROUNDING = 1e-9
# What a stiffness does, and what two explanations of that leave open.
_WAYS = {1: "rises", -1: "falls"}
_NOT_TOLD = ": repeat the first trace at the end to tell which"


@dataclass(frozen=True, repr=False)
class Together(Diagnosis):
    """The diagnosis of one sample of several traces: limits are of their joint likelihood."""

    _: KW_ONLY
    names: tuple[str, ...]
    """Of the traces."""
    traces: tuple[Diagnosis, ...]
    """The diagnosis of each trace by itself."""
    agreement: Agreement
    """Whether the traces are of one sample."""

    def without_model(
        self, at_s: Sequence[float] = (), kinds: Collection[str] = KINDS
    ) -> WithoutModel:
        """Tell what any linear sample would show, of all traces of one kind (`of_one_kind`).

        Of traces that do not agree it tells no more than their misfit.
        """
        residuals = of_one_kind(self.likelihood.problem.residuals)
        kinds = kinds if self.agreement.holds else ()
        confidence = self.likelihood.confidence
        return tell_without_model(residuals, confidence=confidence, at_s=at_s, kinds=kinds)

    def data(self) -> dict[str, Any]:
        """Return what is said of the sample and not of one trace, as plain data."""
        agreement, rejected, count = self.agreement, self.status == REJECTED, len(self.traces)
        covered_s = self.likelihood.problem.residuals.covered_s
        told: dict[str, Any] = {"holds": agreement.holds, "p": agreement.chance}
        told |= {"increase": agreement.increase, "degrees_of_freedom": agreement.freedom}
        ratios = agreement.ratios(np.full(count, 1 / count)).tolist()
        odd = None if agreement.odd is None else self.names[agreement.odd]
        said = _compared(self.names, agreement)
        told |= {"odd": odd, "stiffness_over_mean": ratios, "in_words": said}
        return {
            **judged_data(self),
            **{"noise_model": None, "preferred_model": None, "advice": None},
            **{"models": [], "models_spared": []},
            "limits": "Limits are of the joint likelihood: each trace counts by its own noise.",
            "moduli": None if rejected else moduli_between(*covered_s, self),
            "agreement": told,
        }


def identify_sample_of(names: Sequence[str], diagnoses: Sequence[Diagnosis]) -> Together:
    """Identify one sample from several traces that were identified by themselves.

    Parameters
    ----------
    names
        Of the traces, for messages.
    diagnoses
        Of each trace, by `biogrip.identify.identify.identify_alike`.

    Raises
    ------
    BiogripError
        If traces have not the same sample model, fixed parameters, unit of stiffness, confidence.
    """
    experiments = [diagnosis.identified[1] for diagnosis in diagnoses]
    first, said = experiments[0], [_taken(experiment) for experiment in experiments]
    for name, words in zip(names, said, strict=True):
        if words != said[0]:
            text = f"{name}: found {words}, allowed is as of {names[0]}"
            raise BiogripError(f"{text}, with which it is of one sample: {said[0]}.")
    singles = [_with_start(diagnosis) for diagnosis in diagnoses]
    parts, noise_sd = [one.problem for one in singles], np.array([one.noise_sd for one in singles])
    problem, starts = stack(parts, noise_sd), np.array([one.best for one in singles])
    ends = problem.low, problem.high
    parts = [TraceProblem(part.residuals, *ends, part.ranges) for part in parts]
    singles = [replace(one, problem=part) for one, part in zip(singles, parts, strict=True)]
    rngs = [first.stream("together")]
    (best_fit,) = identify_many([problem], first.least_squares, rngs, further=[starts])
    freedom = shared_freedom(np.log(best_fit.parameters), singles)
    problem = stack(parts, noise_sd, freedom)
    thresholds = find_thresholds(first.confidence, freedom)
    lower: Fit | None = best_fit
    while lower is not None:
        best_fit, best = lower, np.log(lower.parameters)
        given = problem, best, best_fit.misfit, 1.0, *thresholds, freedom, first.confidence
        (judged,) = profile_all([likelihood := Likelihood(*given)])
        lower = lower_fit(judged, best_fit)
    agreement, notes = compare_traces(likelihood, singles), list[Note]()
    if not agreement.holds:
        notes.append(Note(REJECTION, _differences(names, diagnoses, agreement)))
    for name, one in zip(names, diagnoses, strict=True):
        if why := find_reasons(heaviest := order_notes(one.notes)):
            text = f"{name}, by itself {one.status}: {' '.join(why)}"
            notes.append(Note(heaviest[0].weight, text))
    judged = with_notes(replace(judged, converged=best_fit.converged), notes)
    of_joint = {**vars(with_times([judged])[0]), "experiment": first}
    return Together(**of_joint, names=tuple(names), traces=tuple(diagnoses), agreement=agreement)


def _taken(experiment: Experiment) -> str:
    """Say what all traces of a sample have in common."""
    sample, fixed = experiment.sample, [f"{name} = {it:g}" for name, it in experiment.fixed.items()]
    level = f"{100 * experiment.confidence:g} % limits"
    return f"{sample.candidate} in {sample.stiffness or '1'}, {', '.join([*fixed, level])}"


def _with_start(diagnosis: Diagnosis) -> Likelihood:
    """Return the likelihood of a trace that allows for its start, if that was fitted along.

    Half the width of the start's limits counts as a standard deviation: twice what they tell, as
    they follow in part from what the trace tells of the sample.
    """
    likelihood, ends_s = diagnosis.likelihood, diagnosis.onset_limits_s
    least = _ROUNDING * likelihood.problem.residuals.peak
    likelihood = replace(likelihood, noise_sd=max(likelihood.noise_sd, least))
    if ends_s is None:
        return likelihood
    given = likelihood.problem, likelihood.best, (ends_s[1] - ends_s[0]) / 2
    return replace(likelihood, problem=with_uncertain_start(*given))


def _compared(names: Sequence[str], agreement: Agreement) -> str:
    """Say whether traces agree, by which test, and the ratios of stiffness."""
    verdict = f"The {len(names)} traces agree with" if agreement.holds else "The traces are not of"
    rise = f"χ² rises by {plain(agreement.increase)} with {agreement.freedom} degrees of freedom"
    of_two = f"{p_value(agreement.chance)}, twice the smaller of two tests, of all and of stiffness"
    ratios = zip(names, agreement.ratios(np.eye(len(names))[0]), strict=True)
    told = [f"{with_limits(*ratio)} for {name}" for name, ratio in ratios]
    stiffness = f"The stiffness over that of {names[0]} is {' and '.join(told[1:])}."
    return f"{verdict} one linear sample ({of_two}; {rise}). {stiffness}"


def _differences(names: Sequence[str], diagnoses: Sequence[Diagnosis], agreement: Agreement) -> str:
    """Say that traces do not agree, which differs, and whether that follows load or order.

    First comes what each by itself tells of its set-up, which may be why.
    """
    pairs = zip(names, diagnoses, strict=True)
    own = (f"{name}: {it.text} " for name, one in pairs for it in one.notes if it.about == SET_UP)
    said = f"{''.join(own)}{_compared(names, agreement)} "
    if agreement.odd is not None:
        said += f"Without {names[agreement.odd]} the others agree. "
    if not agreement.in_stiffness:
        said += "They differ in more than stiffness, as in times or shape. "
    ways = [*_ways([diagnosis.identified[1] for diagnosis in diagnoses], agreement)]
    told_apart = _NOT_TOLD if len(ways) > 1 else ""
    return f"{said}It {' and '.join(ways) or 'follows neither load nor order'}{told_apart}."


def _ways(experiments: Sequence[Experiment], agreement: Agreement) -> Iterator[str]:
    """Yield what the ratio of stiffness does, as far as it follows load or order."""
    first, loads = experiments[0].instrument, [largest_load(one.phases) for one in experiments]
    same = {one.instrument.controlled for one in experiments} == {first.controlled}
    if same and not first.sweeps and (way := agreement.rises_with(np.abs(loads).tolist())):
        yield f"{_WAYS[way]} with the {first.controlled.name}"
    if way := agreement.rises_with(range(len(loads))):
        yield f"{_WAYS[way]} in the order of the traces"
