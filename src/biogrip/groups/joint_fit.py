"""Joint fit of one cell's traces: shared parameters, and a noise level for each trace.

Unknown noise levels have their maximum likelihood at each trace's RMS residual. Levels and best
fit are updated in turn until both converge (iteratively reweighted least squares). Profile
likelihoods then keep the levels fixed and use the F threshold of a single trace: with hundreds of
samples per trace the difference is negligible.

References
----------
.. [1] G. A. F. Seber and C. J. Wild, Nonlinear Regression, Wiley, 1989, section 2.8.8 and
   chapter 11: several responses, each with a variance of its own.
.. [2] S. S. Wilks, The large-sample distribution of the likelihood ratio for testing composite
   hypotheses, Annals of Mathematical Statistics 9 (1938), 60-62.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import log, sqrt

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.sample import SampleModel
from biogrip.groups.replicates import compute_common_noise, joint_problem
from biogrip.identifiability.diagnosis import Diagnosis, diagnose
from biogrip.identifiability.fit_status import DOUBT, REJECTED, REJECTION, Note
from biogrip.identifiability.whiteness import one_in
from biogrip.identify.answer import Identification
from biogrip.identify.multi_start import fit_from
from biogrip.identify.problem import Problem

# Relative convergence tolerance, far below the accuracy 1/sqrt(2 n) of a noise level.
_CONVERGED = 1e-9
_MOST_ROUNDS = 100
_MOST_OPTIMA = 5
# p value below which replicates count as traces of different samples.
_DISAGREE = 1e-3


@dataclass(frozen=True)
class JointFit:
    """Joint fit of all traces of a cell."""

    diagnosis: Diagnosis
    """Best fit and verdicts, as for one trace."""
    noise_rad: tuple[float, ...]
    """Standard deviation of the noise of each trace."""
    agreement: float | None
    """p value of the hypothesis that all traces have the same parameters; None for a single
    trace."""


def fitted_jointly(
    problems: Sequence[Problem],
    model: SampleModel,
    identify: Callable[[Problem], Identification],
    *,
    confidence: float,
    noise_rad: Sequence[float] | None = None,
) -> JointFit:
    """Fit all traces of a cell jointly, and compute confidence limits.

    Parameters
    ----------
    problems
        Fit problem of each trace.
    model
        Sample model, without fixed parameters.
    identify
        Function that finds the global optimum of a problem.
    confidence
        Confidence level of the limits, e.g. 0.95.
    noise_rad
        Standard deviation of the noise of each trace if it is known.
    """
    if len(problems) == 1:
        (problem,) = problems
        found = identify(problem)
        known = None if noise_rad is None else noise_rad[0]
        diagnosis = diagnose(problem, model, found, confidence=confidence, noise_rad=known)
        return JointFit(diagnosis, (diagnosis.likelihood.noise_rad,), None)
    levels = list(noise_rad or [problem.residuals.noise_scale_rad for problem in problems])
    joint = joint_problem(problems, levels)
    samples = [problem.residuals.samples for problem in problems]
    known = None if noise_rad is None else compute_common_noise(samples, noise_rad)
    found = identify(joint)
    for _ in range(_MOST_OPTIMA):
        if noise_rad is None:
            joint, found, levels = _reweighted(problems, joint, found, levels)
        diagnosis = diagnose(joint, model, found, confidence=confidence, noise_rad=known)
        best = np.exp(diagnosis.likelihood.best)
        if noise_rad is not None or np.array_equal(best, found.parameters):
            break
        # A profile found a lower optimum, which has other noise levels.
        found = replace(found, parameters=best, misfit_rad=diagnosis.likelihood.misfit_rad)
    agreement = _agreement(problems, diagnosis.likelihood.best, noise_rad)
    if agreement < _DISAGREE:
        rejected = diagnosis.status == REJECTED
        meaning = (
            "the cell changed" if rejected else "the cell changed, or the intervals are too narrow"
        )
        text = (
            "The traces do not tell of one and the same sample (replicates of one would differ as "
            f"much {one_in(agreement)}): {meaning}."
        )
        diagnosis.notes.append(Note(REJECTION if rejected else DOUBT, text))
    return JointFit(diagnosis, tuple(levels), agreement)


def _reweighted(
    problems: Sequence[Problem], joint: Problem, found: Identification, levels: list[float]
) -> tuple[Problem, Identification, list[float]]:
    """Alternate between fitting and weighting traces by their residuals, until both converge."""
    x = np.log(found.parameters)
    free, shared = joint.residuals.free, len(x)
    for _ in range(_MOST_ROUNDS):
        # The shared parameters take a share of each trace's degrees of freedom.
        left = [problem.residuals.free * (1 - shared / free) for problem in problems]
        sums = [_square_sum(problem, x) for problem in problems]
        before, levels = levels, [sqrt(s / own) for s, own in zip(sums, left, strict=True)]
        joint = joint_problem(problems, levels)
        found = found.at(fit := fit_from([joint], x))
        x = fit.x[0]
        if max(abs(log(now / then)) for now, then in zip(levels, before, strict=True)) < _CONVERGED:
            break
    return joint, found, levels


def _agreement(
    problems: Sequence[Problem], best: Array, noise_rad: Sequence[float] | None
) -> float:
    """Return the likelihood-ratio p value of shared against separate parameters (Wilks 1938)."""
    from scipy.special import chdtrc

    gained = 0.0
    for trace, problem in enumerate(problems):
        alone = fit_from([problem], best).x[0]
        joint, own = _square_sum(problem, best), _square_sum(problem, alone)
        if noise_rad is not None:
            gained += (joint - own) / noise_rad[trace] ** 2
        else:
            gained += problem.residuals.free * log(joint / own)
    return float(chdtrc((len(problems) - 1) * len(best), max(gained, 0.0)))


def _square_sum(problem: Problem, x: Array) -> float:
    residual = problem.residuals.left(x)
    return float(residual @ residual)
