"""Choice of the simplest adequate sample model by information criteria.

References
----------
.. [1] H. Akaike, A new look at the statistical model identification, IEEE Transactions on
   Automatic Control 19 (1974), 716-723.
.. [2] G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978), 461-464.
.. [3] R. E. Kass and A. E. Raftery, Bayes factors, Journal of the American Statistical
   Association 90 (1995), 773-795: which differences are worth a mention.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array
from biogrip.experiment.sample import CANDIDATES, SampleModel

WORTH_A_MENTION = 2.0
"""Difference of BIC below which neither of two models is preferred."""


@dataclass(frozen=True)
class FittedModel:
    """A sample model fitted to a trace."""

    candidate: str
    """Name of the model in `CANDIDATES`."""
    misfit_rad: float
    """RMS misfit of its best fit."""
    delta_aic: float
    """AIC minus the lowest of the models tried."""
    delta_bic: float
    """BIC, likewise."""

    @property
    def model(self) -> SampleModel:
        """The sample model of that name."""
        return CANDIDATES[self.candidate].model


def aic_and_bic(
    misfit_rad: ArrayLike, samples: ArrayLike, parameters: ArrayLike
) -> tuple[Array, Array]:
    """Compute AIC and BIC for Gaussian noise of unknown standard deviation.

    AIC = n ln(misfit^2) + 2 (p + 1) and BIC = n ln(misfit^2) + (p + 1) ln n, the
    noise being one parameter more.

    Parameters
    ----------
    misfit_rad, samples, parameters
        RMS misfit of the best fit, n and p; of any one shape.
    """
    counted = np.asarray(parameters) + 1
    square = np.asarray(samples) * 2 * np.log(misfit_rad)
    return square + 2 * counted, square + counted * np.log(samples)


def ranked(
    candidates: Sequence[str], misfits_rad: Sequence[float], samples: int
) -> list[FittedModel]:
    """Compare the best fits of several models to one trace by AIC and BIC, keeping their order."""
    counts = [len(CANDIDATES[name].model.names) for name in candidates]
    criteria = aic_and_bic(misfits_rad, samples, counts)
    aic, bic = (values - values.min() for values in criteria)
    return [
        FittedModel(name, misfit, float(a), float(b))
        for name, misfit, a, b in zip(candidates, misfits_rad, aic, bic, strict=True)
    ]


def preferred_simpler(tried: Sequence[FittedModel], chosen: str) -> str | None:
    """Return the candidate that BIC prefers, if it is simpler and fits about as well; else None."""
    own = next(each for each in tried if each.candidate == chosen)
    best = min(tried, key=lambda each: each.delta_bic)
    more = len(own.model.names) - len(best.model.names)
    # Difference of n ln(misfit^2), which leaves the number of parameters aside.
    worse = own.delta_aic - best.delta_aic - 2 * more
    worth_it = own.delta_bic >= WORTH_A_MENTION
    return best.candidate if worth_it and more > 0 and worse <= WORTH_A_MENTION else None


def asks_for_more(tried: Sequence[FittedModel], chosen: str) -> bool:
    """Return True if BIC prefers another model that is no simpler than the chosen one."""
    own = next(each for each in tried if each.candidate == chosen)
    best = min(tried, key=lambda each: each.delta_bic)
    return own.delta_bic >= WORTH_A_MENTION and len(best.model.names) >= len(own.model.names)


def advice(tried: Sequence[FittedModel], chosen: str) -> str:
    """State in a sentence whether BIC prefers another model to the chosen one.

    Parameters
    ----------
    tried
        All models tried, the chosen one among them.
    chosen
        Name of the chosen one.
    """
    own = next(each for each in tried if each.candidate == chosen)
    best = min(tried, key=lambda each: each.delta_bic)
    title = own.model.title[0].upper() + own.model.title[1:]
    if own.delta_bic < WORTH_A_MENTION:
        return f"{title}: none of the {len(tried)} models tried suits the trace better."
    lead = f"{best.model.title} is preferred, with a BIC lower by {own.delta_bic:.3g}."
    if preferred_simpler(tried, chosen):
        return f"{title} is richer than the trace asks for: {lead}"
    if len(best.model.names) == len(own.model.names):
        return f"{title} suits the trace less well: {lead}"
    return f"{title} is not adequate: {lead}"
