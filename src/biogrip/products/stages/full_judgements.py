"""What users are shown of a trace, for some of the seeds that intervals are tested with."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.identifiability.likelihood import MISSED, Likelihood, likelihood_of
from biogrip.identifiability.profiles import profiles_of
from biogrip.identifiability.quantities import Quantity
from biogrip.identifiability.verdicts import Finding
from biogrip.identify.multi_start import fit_from

EVERY = 10
"""A seed that is a multiple of this is judged in full: its whole profiles."""

_MOST_RESTARTS = 3


@dataclass(frozen=True)
class Shown:
    """Verdict on a quantity, and its limits."""

    verdict: str
    low: float | None
    high: float | None


def judged_in_full(seed: int) -> bool:
    """Whether a seed is, whatever its batch."""
    return seed % EVERY == 0


def refitted(likelihood: Likelihood, deeper: np.ndarray, confidence: float) -> Likelihood | None:
    """Fit again from where a trace's chi^2 was found to be below that of its optimum.

    Returns
    -------
    Likelihood or None
        Of the deeper optimum; None if there is none.
    """
    fit = fit_from([likelihood.problem], deeper)
    misfit_rad = float(fit.misfit_rad[0])
    if likelihood.rise(misfit_rad) > -MISSED:
        return None
    return likelihood_of(likelihood.problem, fit.x[0], misfit_rad, confidence=confidence)


def shown_of(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], confidence: float
) -> Iterator[list[Shown]]:
    """Judge traces as `diagnose` does, quantity by quantity; all at once where that is possible."""
    current = list(likelihoods)
    profiles = profiles_of(current, quantities, smooth=False)
    for _ in range(_MOST_RESTARTS):
        lowest = [min(own, key=lambda each: float(each.rises.min())) for own in profiles]
        again = {
            index: new
            for index, each in enumerate(lowest)
            if each.rises.min() < -MISSED
            and (new := refitted(current[index], each.lowest, confidence)) is not None
        }
        if not again:
            break
        renewed = profiles_of(list(again.values()), quantities, smooth=False)
        for (index, likelihood), own in zip(again.items(), renewed, strict=True):
            current[index], profiles[index] = likelihood, own
    for own in profiles:
        findings = [Finding(q, profile, 0.0) for q, profile in zip(quantities, own, strict=True)]
        yield [Shown(found.verdict, found.low, found.high) for found in findings]
