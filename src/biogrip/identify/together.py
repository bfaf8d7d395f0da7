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
from biogrip.fit.joint import of_one_kind, stack, with_free_start
from biogrip.fit.least_squares import identify_many
from biogrip.fit.nested_fits import FittedModels
from biogrip.identify.data import judged_data, moduli_between
from biogrip.judging.agreement import Agreement, compare_traces, shared_freedom
from biogrip.judging.diagnosis import Diagnosis, lower_fit, profile_all, with_notes, with_times
from biogrip.judging.doubts import DOUBT, OK, REJECTED, REJECTION, Note, find_reasons, order_notes
from biogrip.judging.likelihood import Likelihood, find_thresholds
from biogrip.judging.without_model import KINDS, WithoutModel, tell_without_model
from biogrip.physics.protocol import largest_load

# What two explanations leave open.
_NOT_TOLD = ": repeat the first trace at the end to tell which"
# Freedom of variances from which on they count as known.
_KNOWN = 1e8


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
        residuals, _ = of_one_kind(self.likelihood.problem.residuals)
        kinds = kinds if self.agreement.holds else ()
        confidence = self.likelihood.confidence
        return tell_without_model(residuals, confidence=confidence, at_s=at_s, kinds=kinds)

    def data(self) -> dict[str, Any]:
        """Return what is said of the sample and not of one trace, as plain data."""
        agreement, rejected, experiment = self.agreement, self.status == REJECTED, self.experiment
        assert experiment is not None
        spread_s = self.likelihood.problem.residuals.covered_s
        return {
            **judged_data(self),
            "noise_model": None,
            **FittedModels(experiment.sample.candidate).data(rejected=rejected),
            "limits": "Limits are of the joint likelihood: each trace counts by its own noise.",
            "moduli": None if rejected else moduli_between(*spread_s, self),
            "agreement": {
                "holds": agreement.holds,
                "p": agreement.chance,
                "increase": agreement.increase,
                "degrees_of_freedom": agreement.freedom,
                "odd": agreement.odd,
                "stiffness_over_mean": agreement.ratios.tolist(),
            },
        }


def sample_of(names: Sequence[str], diagnoses: Sequence[Diagnosis]) -> Together:
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
    for what in ("sample", "fixed", "confidence"):
        every = [getattr(experiment, what) for experiment in experiments]
        for name, value in zip(names, every, strict=True):
            if value != every[0]:
                text = f"{name}: found another {what} than of {names[0]}, {value} and {every[0]}"
                raise BiogripError(f"{text}; allowed is one for all traces of a sample.")
    singles = [_single(diagnosis) for diagnosis in diagnoses]
    problem = stack([one.problem for one in singles], np.array([one.noise_sd for one in singles]))
    for number, one in enumerate(singles):
        within = replace(one.problem, low=problem.low, high=problem.high)
        singles[number] = replace(one, problem=within)
    rng, starts = experiments[0].stream("together"), np.array([one.best for one in singles])
    (fit,) = identify_many([problem], experiments[0].least_squares, [rng], further=[starts])
    while True:
        likelihood = _joint(np.log(fit.parameters), fit.misfit, singles)
        (judged,) = profile_all([likelihood])
        lower = lower_fit(judged, fit)
        if lower is None:
            break
        fit = lower
    agreement = compare_traces(likelihood, singles)
    notes = [*_notes_on_traces(names, diagnoses)]
    if not agreement.holds:
        notes.append(Note(REJECTION, _differences(names, diagnoses, agreement)))
    judged = with_notes(replace(judged, converged=fit.converged), notes)
    (judged,) = with_times([judged])
    given = {**vars(judged), "experiment": experiments[0]}
    return Together(**given, names=tuple(names), traces=tuple(diagnoses), agreement=agreement)


def _single(diagnosis: Diagnosis) -> Likelihood:
    """Return the likelihood of a trace, with a free start if that was fitted along."""
    likelihood = diagnosis.likelihood
    if not diagnosis.identified[1].fit_start:
        return likelihood
    return replace(likelihood, problem=with_free_start(likelihood.problem, likelihood.best))


def _joint(best: Any, misfit: float, singles: Sequence[Likelihood]) -> Likelihood:
    """Return the joint likelihood, with thresholds for noise that is known as well as it is."""
    noise_sd, confidence = np.array([one.noise_sd for one in singles]), singles[0].confidence
    freedom = shared_freedom(best, singles)
    freedom = freedom if freedom < _KNOWN else np.inf
    problem = stack([one.problem for one in singles], noise_sd, freedom)
    thresholds = find_thresholds(confidence, freedom)
    return Likelihood(problem, best, misfit, 1.0, *thresholds, freedom, confidence)


def _notes_on_traces(names: Sequence[str], diagnoses: Sequence[Diagnosis]) -> list[Note]:
    """Return doubts about the joint fit by the status of each trace's own."""
    return [
        Note(
            REJECTION if diagnosis.status == REJECTED else DOUBT,
            f"{name}, by itself {diagnosis.status}: "
            f"{' '.join(find_reasons(order_notes(diagnosis.notes)))}",
        )
        for name, diagnosis in zip(names, diagnoses, strict=True)
        if diagnosis.status != OK
    ]


def _differences(names: Sequence[str], diagnoses: Sequence[Diagnosis], agreement: Agreement) -> str:
    """Say that traces do not agree, which differs, and whether that follows load or order."""
    rise = f"χ² rises by {plain(agreement.increase)} with {agreement.freedom} degrees of freedom"
    said = f"The traces are not of one linear sample ({p_value(agreement.chance)}; {rise}). "
    told = [
        f"{name} {with_limits(*ratio)} times"
        for name, ratio in zip(names[1:], agreement.to_first[1:], strict=True)
    ]
    said += f"As stiff as {names[0]}: {', '.join(told)}. "
    if agreement.odd is not None:
        said += f"Without {names[agreement.odd]} the others agree. "
    if not agreement.in_stiffness:
        said += "They differ in more than stiffness, as in times or shape. "
    ways = [*_ways(diagnoses, agreement)]
    if not ways:
        return f"{said}The differences follow neither load nor order."
    return f"{said}Stiffness {' and '.join(ways)}{_NOT_TOLD if len(ways) > 1 else ''}."


def _ways(diagnoses: Sequence[Diagnosis], agreement: Agreement) -> Iterator[str]:
    """Yield clauses on what the ratio of stiffness rises or falls with."""
    experiments = [diagnosis.identified[1] for diagnosis in diagnoses]
    controlled = {one.instrument.controlled.name for one in experiments}
    loads = [abs(largest_load(one.phases)) for one in experiments]
    if len(controlled) == 1 and not experiments[0].instrument.sweeps:
        way = agreement.rises_with(loads)
        if way:
            words = "rises with the {} (stiffening)" if way > 0 else "falls with the {} (softening)"
            yield words.format(*controlled)
    if way := agreement.rises_with(range(len(loads))):
        yield f"{'rises' if way > 0 else 'falls'} in the order of the traces (ageing or damage)"
