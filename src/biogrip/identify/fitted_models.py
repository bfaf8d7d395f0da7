"""Model selection for one trace: fits of other sample models, ranked by AIC and BIC."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from biogrip.fit.nested_fits import (
    FittedModel,
    advice,
    asks_for_more,
    fit_models,
    is_within,
    preferred_simpler,
    ranked,
)
from biogrip.fit.problem import Identification
from biogrip.fit.trace_fit import TraceFit
from biogrip.identify.trace_case import TraceCase
from biogrip.judging.diagnosis import Diagnosis, diagnose
from biogrip.judging.doubts import DOUBT, Note
from biogrip.judging.likelihood import MISSED
from biogrip.judging.verdicts import Finding
from biogrip.physics.models import CANDIDATES, as_richer, contained
from biogrip.physics.noise import stream
from biogrip.physics.springpot import LONGEST_S

_MOST_SAMPLES = 50_000
# Each of the others would take half a second to five; they are tried where the config names them.
_POWER_LAWS = ["fractional_kelvin_voigt", "fractional_maxwell"]


@dataclass(frozen=True)
class FittedModels:
    """Best fits of sample models to a trace.

    Parameters
    ----------
    tried, answers
        Rank and fit of each model, in the same order.
    chosen
        Sample model that the trace was identified with.
    """

    chosen: str
    tried: list[FittedModel] = field(default_factory=list)
    answers: list[Identification] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """Names of the models."""
        return [each.candidate for each in self.tried]

    @property
    def own(self) -> Identification | None:
        """Best fit of the chosen model, if it is among those tried."""
        pairs = zip(self.tried, self.answers, strict=True)
        return next((answer for each, answer in pairs if each.candidate == self.chosen), None)

    def data(self, findings: Sequence[Finding] | None) -> dict[str, Any]:
        """Return one row per model, and advice in words, as plain data.

        Parameters
        ----------
        findings
            Findings on the quantities of the chosen model; None if its fit is rejected. Advice is
            then only another model that may be the reason.
        """
        if not self.tried:
            return {"models": [], "advice": None}
        rows = [
            {
                "model": each.candidate,
                "title": each.model.title,
                "parameters": len(each.model.names),
                "misfit_rad": each.misfit_rad,
                "vanished": vanished(each.candidate, answer),
                "converged": answer.converged,
                "delta_aic": each.delta_aic,
                "delta_bic": each.delta_bic,
            }
            for each, answer in zip(self.tried, self.answers, strict=True)
        ]
        words = advice(self.tried, self.chosen)
        if findings is not None:
            return {"models": rows, "advice": f"{words} {self._compared(findings)}".rstrip()}
        more = asks_for_more(self.tried, self.chosen)
        return {"models": rows, "advice": words if more else None}

    def _compared(self, findings: Sequence[Finding]) -> str:
        """Return a sentence on where a preferred simpler model's values are, if it is nested."""
        simpler = preferred_simpler(self.tried, self.chosen)
        bounded = [each for each in findings if each.is_bounded]
        if simpler is None or simpler not in contained(self.chosen) or not bounded:
            return ""
        answers = dict(zip((each.candidate for each in self.tried), self.answers, strict=True))
        with np.errstate(divide="ignore", invalid="ignore"):
            x = np.log(as_richer(self.chosen, simpler, answers[simpler].parameters))
            outside = [
                f"{each.quantity.label}, {np.exp(each.quantity.log(x)):.3g} {each.quantity.unit}"
                for each in bounded
                if not each.allows(x)
            ]
        if not outside:
            return "Its values lie within the limits."
        return f"Outside the limits lies its {' and its '.join(outside)}."


def vanished(candidate: str, answer: Identification) -> list[str]:
    """Name the elements that vanish in the best fit: parameters that are zero or infinite."""
    elements = CANDIDATES[candidate].model.parameters
    gone = (answer.parameters == 0) | np.isinf(answer.parameters)
    return [
        element.name
        for element, is_gone in zip(elements, gone, strict=True)
        if is_gone and element.kind != "exponent"
    ]


def models_tried(
    traces: Sequence[TraceCase], fits: Sequence[TraceFit], diagnoses: Sequence[Diagnosis]
) -> list[FittedModels]:
    """Fit several sample models to each trace with the noise model of its fit.

    None are fitted with fixed parameters, or if there is only one model.

    Parameters
    ----------
    traces
        Traces of the same chosen model and budget.
    fits
        Fit of each with the chosen model.
    diagnoses
        Diagnosis of that fit; its best fit is one of the starts.
    """
    candidates = [_candidates(*pair) for pair in zip(traces, fits, strict=True)]
    found: dict[int, FittedModels] = {}
    for names in dict.fromkeys(candidates):
        same = [index for index, own in enumerate(candidates) if own == names]
        found.update(zip(same, _tried(names, traces, fits, diagnoses, same), strict=True))
    return [found[index] for index in range(len(traces))]


def _candidates(trace: TraceCase, fit: TraceFit) -> tuple[str, ...]:
    """Return the names of the models to fit to a trace, none if nothing is compared."""
    if trace.problem.fixed:
        return ()
    # With very many samples the dozens of modes of a springpot would take gigabytes.
    few = fit.problem.residuals.samples <= _MOST_SAMPLES
    power_laws = few and not trace.names_models
    others = _power_laws(trace.problem.torque.end_s) if power_laws else []
    names = tuple(dict.fromkeys((*trace.case.models, *others)))
    return names if len(names) > 1 else ()


def _tried(
    names: Sequence[str],
    traces: Sequence[TraceCase],
    fits: Sequence[TraceFit],
    diagnoses: Sequence[Diagnosis],
    which: Sequence[int],
) -> Iterator[FittedModels]:
    """Yield fits of the same models to some of the traces."""
    case = traces[0].case
    chosen = case.sample.candidate
    if not names:
        yield from [FittedModels(chosen)] * len(which)
        return
    found = fit_models(
        {
            name: [
                traces[index].problem.for_model(fits[index].problem, CANDIDATES[name].model)
                for index in which
            ]
            for name in names
        },
        case.least_squares,
        {
            name: [
                stream(own.study.study_seed, own.name, 0, f"model {name}")
                for own in (traces[index].case for index in which)
            ]
            for name in names
        },
        lambda: None,
        near={chosen: np.array([diagnoses[index].likelihood.best for index in which])},
    )
    for place, index in enumerate(which):
        answers = [found[name][place] for name in names]
        misfits = [answer.misfit_rad for answer in answers]
        samples = fits[index].problem.residuals.samples
        yield FittedModels(chosen, ranked(names, misfits, samples), answers)


def judge_again(
    trace: TraceCase, fit: TraceFit, diagnosis: Diagnosis, models: FittedModels
) -> tuple[Diagnosis, list[Note]]:
    """Diagnose a trace again if fits of other models found a lower chi^2 within the search range.

    Parameters
    ----------
    trace, fit, diagnosis
        Trace, and its fit and diagnosis so far.
    models
        Fits of all models.

    Returns
    -------
    diagnosis
        The new diagnosis, or the one so far.
    notes
        Notes; one if the lower chi^2 is outside the search range.
    """
    own = models.own
    if own is None or (increase := diagnosis.likelihood.increase(own.misfit_rad)) > -MISSED:
        return diagnosis, []
    if is_within(own.parameters, fit.problem):
        again = diagnose(
            fit.problem,
            fit.problem.residuals.model,
            own,
            confidence=trace.case.confidence,
            noise_rad=trace.problem.noise_rad,
        )
        return again, []
    gone = vanished(models.chosen, own)
    where = f", without {' and '.join(gone)}" if gone else ""
    text = (
        f"Outside the search range{where}, the model fits better: χ² is lower by {-increase:.3g}. "
        "The limits hold for samples within the range."
    )
    return diagnosis, [Note(DOUBT, text)]


def _power_laws(duration_s: float) -> list[str]:
    """Return power-law models, if the experiment is not longer than their range of validity."""
    return _POWER_LAWS if duration_s <= LONGEST_S else []
