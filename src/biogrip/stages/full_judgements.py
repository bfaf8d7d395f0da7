"""Full verdicts, as users are shown them, for some seeds of the coverage test."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.fit.multi_start import fit_from
from biogrip.judging.likelihood import MISSED, Likelihood, make_likelihood
from biogrip.judging.profiles import compute_profiles
from biogrip.judging.quantities import Quantity
from biogrip.judging.verdicts import Finding

_MOST_RESTARTS = 3


@dataclass(frozen=True)
class Shown:
    """Verdict on a quantity, and its limits."""

    verdict: str
    low: float | None
    high: float | None


def refitted(likelihood: Likelihood, missed: np.ndarray, confidence: float) -> Likelihood | None:
    """Fit again, started at parameters of a chi^2 below the optimum's; None if it did not fall."""
    fit = fit_from([likelihood.problem], missed)
    misfit_rad = float(fit.misfit_rad[0])
    if likelihood.increase(misfit_rad) > -MISSED:
        return None
    return make_likelihood(likelihood.problem, fit.x[0], misfit_rad, confidence=confidence)


def shown_of(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], confidence: float
) -> Iterator[list[Shown]]:
    """Yield verdicts on each trace, as `diagnose` gives them, for all quantities."""
    current = list(likelihoods)
    profiles = compute_profiles(current, quantities, smooth=False)
    for _ in range(_MOST_RESTARTS):
        lowest = [min(own, key=lambda each: float(each.increases.min())) for own in profiles]
        again = {
            index: new
            for index, each in enumerate(lowest)
            if each.increases.min() < -MISSED
            and (new := refitted(current[index], each.lowest, confidence)) is not None
        }
        if not again:
            break
        renewed = compute_profiles(list(again.values()), quantities, smooth=False)
        for (index, likelihood), own in zip(again.items(), renewed, strict=True):
            current[index], profiles[index] = likelihood, own
    for own in profiles:
        findings = [Finding(q, profile, 0.0) for q, profile in zip(quantities, own, strict=True)]
        yield [Shown(found.verdict, found.low, found.high) for found in findings]
