"""Test for an offset or drift of the instrument that the user did not declare."""

from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from biogrip.experiment.random_streams import stream
from biogrip.identifiability.diagnosis import Diagnosis, diagnose
from biogrip.identifiability.fit_status import DOUBT, HARMLESS, REJECTED, REJECTION, Note
from biogrip.identifiability.likelihood import compute_fall
from biogrip.identifiability.verdicts import Finding
from biogrip.identifiability.whiteness import FALSE_ALARM, one_in
from biogrip.identify.answer import Identification, Progress
from biogrip.identify.identifier import best_fit
from biogrip.identify.multi_start import fit_from
from biogrip.identify.problem import Problem
from biogrip.identify.trace_fit import trace_fit
from biogrip.products.files.traces import Measurements
from biogrip.response.flow import drift_is_flow
from biogrip.study.study import Case, Study


def second_opinion(
    study: Study, case: Case, recorded: Measurements, diagnosis: Diagnosis, progress: Progress
) -> list[Note]:
    """Fit an offset and a drift along, and return a warning if they lower chi^2 significantly.

    The test is a likelihood ratio: if neither is in the trace, the decrease of chi^2 follows a
    chi-squared distribution with as many degrees of freedom as terms are added (Wilks 1938). A
    warning is due at a p-value below `FALSE_ALARM`.

    Parameters
    ----------
    study, case, recorded
        The trace and the case it is identified as.
    diagnosis
        Diagnosis without the added terms.
    progress
        Callback for progress.

    Returns
    -------
    list of Note
        At most one; with a rejected fit, only if that with both terms is not. Empty if both are
        declared already, if the model is nonlinear, or if the noise model is coloured, which fits
        both unless they are refused.
    """
    case_problem = case.problem.weighted(recorded.sd_rad)
    added = 2 - case_problem.offset - case_problem.drift
    if not added or case_problem.nonlinear or case_problem.coloured:
        return []
    also = replace(case_problem, offset=True, drift=True)

    def find(problem: Problem) -> Identification:
        rng = stream(study.study_seed, case.name, 0, "instrument")
        return best_fit(problem, case.method("least_squares"), rng, progress)

    fit = trace_fit(also, recorded.time_s, recorded.rotation_rad[0], find)
    problem, found, likelihood = fit.problem, fit.found, diagnosis.likelihood
    # The fit without offset and drift is a start as well: with them, chi^2 cannot be higher.
    from_there = found.at(fit_from([problem], likelihood.best))
    found = min(found, from_there, key=lambda each: np.float32(each.misfit_rad))
    fall = compute_fall(
        problem.residuals.samples,
        likelihood.misfit_rad,
        found.misfit_rad,
        likelihood.noise_rad if case_problem.noise_rad is not None else None,
    )
    chance = float(chdtrc(added, max(fall, 0.0)))
    if chance >= FALSE_ALARM:
        return []
    other = diagnose(
        problem, also.searched, found, confidence=case.confidence, noise_rad=case_problem.noise_rad
    )
    rejected = diagnosis.status == REJECTED
    if rejected and other.status == REJECTED:
        return []
    changed = [
        f"{after.quantity.label} would be {after.words().removeprefix('determined: ')}"
        for before, after in zip(diagnosis.findings, other.findings, strict=True)
        if _differ(before, after)
    ]
    changes = "with them it is not rejected" if rejected else "; ".join(changed)
    better = (
        "explain the trace far better "
        f"(χ² falls by {fall:.3g}; by chance it would {one_in(chance)} traces)"
    )
    controlled = case_problem.instrument.controlled.name
    or_flows = (
        f" Or the sample flows: as long as the {controlled} is constant, a drift and a damper "
        "without a spring give the same line."
    )
    if case_problem.instrument.deforms:
        or_flows = ""
    if not case_problem.drift and drift_is_flow(case_problem.torque, recorded.time_s):
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
    return [Note(REJECTION if rejected else weight, text)]


def _differ(before: Finding, after: Finding) -> bool:
    """Return True if verdicts differ, or the estimate moved out of the earlier interval."""
    if before.verdict != after.verdict:
        return True
    low, high = before.low or 0.0, before.high or np.inf
    return bool(before.is_bounded and not low <= after.value <= high)
