"""Test for an offset or drift of the instrument that the user did not declare."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.methods import identifier
from biogrip.fit.multi_start import fit_from
from biogrip.fit.problem import Identification, Problem, Progress
from biogrip.fit.trace_fit import TraceFit, fit_traces
from biogrip.identify.trace_case import TraceCase
from biogrip.judging.diagnosis import Diagnosis, diagnose_all
from biogrip.judging.doubts import DOUBT, FALSE_ALARM, HARMLESS, REJECTED, REJECTION, Note, one_in
from biogrip.judging.likelihood import compute_fall
from biogrip.judging.verdicts import Finding
from biogrip.physics.drift import drift_is_flow
from biogrip.physics.noise import stream


def second_opinions(
    traces: Sequence[TraceCase], diagnoses: Sequence[Diagnosis], progress: Progress
) -> list[list[Note]]:
    """Fit an offset and a drift along, and return a warning if they lower chi^2 significantly.

    The test is a likelihood ratio: if neither is in the trace, the decrease of chi^2 follows a
    chi-squared distribution with as many degrees of freedom as terms are added (Wilks 1938). A
    warning is due at a p-value below `FALSE_ALARM`.

    Parameters
    ----------
    traces
        Traces of the same model, budget and confidence.
    diagnoses
        Diagnosis of each without the added terms.
    progress
        Callback for progress.

    Returns
    -------
    list of list of Note
        By trace, at most one; with a rejected fit, only if that with both terms is not. None if
        both are declared already, or if the noise model is coloured, which fits
        both unless they are refused.
    """
    notes: list[list[Note]] = [[] for _ in traces]
    tried = [index for index, trace in enumerate(traces) if _may_have_more(trace.problem)]
    if not tried:
        return notes
    some = [traces[index] for index in tried]
    also = [replace(trace.problem, offset=True, drift=True) for trace in some]
    fits = _fitted(some, also, [diagnoses[index] for index in tried], progress)
    better = [
        (index, fit, decrease)
        for index, fit in zip(tried, fits, strict=True)
        if (decrease := _decrease(traces[index], diagnoses[index], fit)).chance < FALSE_ALARM
    ]
    others = diagnose_all(
        [fit.problem for _, fit, _ in better],
        also[0].searched,
        [fit.found for _, fit, _ in better],
        confidence=traces[0].case.confidence,
        noise_rad=[traces[index].problem.noise_rad for index, *_ in better],
    )
    for (index, _, decrease), other in zip(better, others, strict=True):
        rejected = diagnoses[index].status == REJECTED
        if not (rejected and other.status == REJECTED):
            notes[index].append(_note(traces[index], diagnoses[index], other, decrease))
    return notes


@dataclass(frozen=True)
class _Decrease:
    """Decrease of chi^2 by an offset and a drift, and the probability of as much by chance."""

    chi2: float
    chance: float


def _may_have_more(case_problem: CaseProblem) -> bool:
    both = case_problem.offset and case_problem.drift
    return not (both or case_problem.coloured)


def _fitted(
    traces: Sequence[TraceCase],
    also: Sequence[CaseProblem],
    diagnoses: Sequence[Diagnosis],
    progress: Progress,
) -> list[TraceFit]:
    """Fit traces with offset and drift, from random points and from the fits without these."""
    least_squares = identifier("least_squares", traces[0].case.method("least_squares"))

    def find(problems: Sequence[Problem], which: Sequence[int]) -> list[Identification]:
        cases = [traces[index].case for index in which]
        rngs = [stream(case.study.study_seed, case.name, 0, "instrument") for case in cases]
        return least_squares(problems, rngs, progress)

    fits = fit_traces(also, [trace.readings for trace in traces], find)
    # The fit without offset and drift is a start as well: with them, chi^2 cannot be higher.
    starts = np.array([diagnosis.likelihood.best for diagnosis in diagnoses])
    again = fit_from([fit.problem for fit in fits], starts)
    return [
        replace(fit, found=min(fit.found, fit.found.at(again, own), key=_single_precision))
        for own, fit in enumerate(fits)
    ]


def _single_precision(found: Identification) -> np.float32:
    return np.float32(found.misfit_rad)


def _decrease(trace: TraceCase, diagnosis: Diagnosis, fit: TraceFit) -> _Decrease:
    likelihood, case_problem = diagnosis.likelihood, trace.problem
    fall = compute_fall(
        fit.problem.residuals.samples,
        likelihood.misfit_rad,
        fit.found.misfit_rad,
        likelihood.noise_rad if case_problem.noise_rad is not None else None,
    )
    added = 2 - case_problem.offset - case_problem.drift
    return _Decrease(fall, float(chdtrc(added, max(fall, 0.0))))


def _note(trace: TraceCase, diagnosis: Diagnosis, other: Diagnosis, decrease: _Decrease) -> Note:
    """Return the warning, with the verdicts that an offset and a drift would change."""
    case_problem, rejected = trace.problem, diagnosis.status == REJECTED
    changed = [
        f"{after.quantity.label} would be {after.words().removeprefix('determined: ')}"
        for before, after in zip(diagnosis.findings, other.findings, strict=True)
        if _differ(before, after)
    ]
    changes = "with them it is not rejected" if rejected else "; ".join(changed)
    better = (
        "explain the trace far better "
        f"(χ² falls by {decrease.chi2:.3g}; by chance it would {one_in(decrease.chance)} traces)"
    )
    controlled = case_problem.instrument.controlled.name
    or_flows = (
        f" Or the sample flows: as long as the {controlled} is constant, a drift and a damper "
        "without a spring give the same line."
    )
    if case_problem.instrument.deforms:
        or_flows = ""
    if not case_problem.drift and drift_is_flow(case_problem.torque, trace.recorded.time_s):
        text = (
            f"A constant and a line in time, fitted along, {better}: the instrument drifts, or the "
            f"sample flows. Under this {controlled} both give the same line, and the trace cannot "
            f"tell which it is: a {controlled} that changes would."
        )
    else:
        text = (
            f"An offset and a drift of the instrument, fitted along, {better}: "
            f"{changes or 'no verdict changes'}. If the instrument may drift, identify the trace "
            f"with --offset --drift.{or_flows}"
        )
    weight = DOUBT if changed else HARMLESS
    return Note(REJECTION if rejected else weight, text)


def _differ(before: Finding, after: Finding) -> bool:
    """Return True if verdicts differ, or the estimate moved out of the earlier interval."""
    if before.verdict != after.verdict:
        return True
    low, high = before.low or 0.0, before.high or np.inf
    return bool(before.is_bounded and not low <= after.value <= high)
