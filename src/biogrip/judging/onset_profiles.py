"""Profile likelihoods over an onset of the protocol that is fitted along.

A quantity's profile is the lowest of those for single onsets, each in its increase over the best
fit with the best onset. So a limit is the outermost of the limits for single onsets, with the
threshold less the increase that the onset itself costs. Onsets are taken all over their own
confidence interval, closer at its ends, as on a circle: with nine the limits of an elliptic region
are short by at most five per cent. Where a rotation jumps between two readings, sums of squares
have kinks as a function of the onset, on which a linear approximation fails.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from biogrip.arrays import Array
from biogrip.fit.fitted_onset import spacing_at
from biogrip.fit.least_squares import fit_from
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.profiles import Profile, compute_profiles
from biogrip.judging.verdicts import Finding

_SHARES = np.sin(np.pi * np.arange(1, 5) / 10)
# First change of the onset over how far readings are apart there, and most of it as a share of the
# trace.
_FIRST_STEP, _MOST = 1 / 64, 0.25
# Accuracy of an end of the onset's interval, as a share of its distance.
_ACCURACY = 0.01


def onset_limits(best: Likelihood, time_s: Array) -> tuple[float, float]:
    """Return the limits of an onset, in s from it, for times from it, (n_samples,)."""
    step_s = _FIRST_STEP * spacing_at(time_s, 0.0)
    return _end(best, -step_s), _end(best, step_s)


def profile_over_onset(
    diagnosis: Diagnosis, time_s: Array
) -> tuple[Diagnosis, tuple[float, float]]:
    """Return a diagnosis whose limits allow for the uncertainty of a fitted onset, and its limits.

    Parameters
    ----------
    diagnosis
        Diagnosis for the best onset.
    time_s : (n_samples,)
        Times from that onset, ascending.
    """
    best = diagnosis.likelihood
    ends = onset_limits(best, time_s)
    others = [_at(best, float(change_s)) for end in ends for change_s in end * _SHARES]
    others = [each for each in others if each.threshold > 0]
    trades = diagnosis.trades
    found = [*diagnosis.findings, *(trade.finding for trade in trades)]
    of_others = [
        compute_profiles([each], [finding.quantity for finding in found], smooth=False)[0]
        for each in others
    ]
    costs = [best.threshold - each.threshold for each in others]
    merged = [
        _merged(finding, [own[place] for own in of_others], costs)
        for place, finding in enumerate(found)
    ]
    kept = len(diagnosis.findings)
    again = [
        replace(trade, finding=finding)
        for trade, finding in zip(trades, merged[kept:], strict=True)
    ]
    return replace(diagnosis, findings=merged[:kept], trades=again), ends


def _at(best: Likelihood, change_s: float) -> Likelihood:
    """Return the likelihood of an onset that is later by some s, relative to that of the best."""
    problem = best.problem.later(change_s)
    fit = fit_from([problem], best.best)
    misfit_rad = float(fit.misfit_rad[0])
    cost = best.increase(misfit_rad)
    return replace(
        best,
        problem=problem,
        best=fit.x[0],
        misfit_rad=misfit_rad,
        threshold=best.threshold - cost,
        certainty=best.certainty - cost,
    )


def _end(best: Likelihood, step_s: float) -> float:
    """Return the end of the onset's confidence interval on the side of a first step."""
    inside, outside = 0.0, step_s
    most_s = _MOST * best.problem.residuals.duration_s
    while _at(best, outside).threshold > 0:
        if abs(outside) > most_s:
            return outside
        inside, outside = outside, 2 * outside
    accuracy = _ACCURACY * abs(outside)
    return float(brentq(lambda s: _at(best, s).threshold, inside, outside, xtol=accuracy))


def _merged(finding: Finding, profiles: list[Profile], costs: list[float]) -> Finding:
    """Return a finding with the lowest of its profile and of those of other onsets.

    It has no gaps: between two of the onsets nothing is known to be excluded.
    """
    own = finding.profile
    values: Array = np.unique(np.concatenate([p.log_values for p in (own, *profiles)]))
    rows = [
        np.interp(values, profile.log_values, profile.increases + cost)
        for profile, cost in zip((own, *profiles), (0.0, *costs), strict=True)
    ]
    increases: Array = np.min(rows, axis=0)
    ends = [(profile.low, profile.high) for profile in (own, *profiles)]
    lows, highs = ([end for end in side if end is not None] for side in zip(*ends, strict=True))
    return replace(
        finding,
        profile=replace(
            own,
            log_values=values,
            increases=increases,
            low=min(lows) if len(lows) == len(ends) else None,
            high=max(highs) if len(highs) == len(ends) else None,
            gaps=(),
        ),
    )
