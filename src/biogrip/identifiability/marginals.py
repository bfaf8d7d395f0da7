"""Marginal posteriors of single quantities, compared with their profile likelihoods."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.identifiability.quantities import Quantity

AGREES, PRIOR, DIFFERS = "agrees", "prior", "differs"
"""Comparison with a profile: the same interval; an end set by the prior; another interval."""

# Share of the width of a profile's interval by which ends may differ: the profile's own error, as
# its threshold is asymptotic in the number of readings, and that of some thousand samples.
_ALLOWED = 0.15
_INNER = 0.5


@dataclass(frozen=True)
class Marginal:
    """The marginal posterior of a quantity, in SI units."""

    quantity: Quantity
    """The quantity."""
    median: float
    """Median of the samples."""
    inner: tuple[float, float]
    """Equal-tailed credible interval of 50 %."""
    outer: tuple[float, float]
    """That of the confidence that was asked for."""
    share: float
    """Share of the samples that fulfil the conditions of the quantity, its `penalties`; the others
    do not count."""

    def words(self) -> str:
        """Describe it in words, e.g. ``34.6 N/m (31.6 to 38; half of it 33.5 to 35.7)``."""
        (low, high), (start, end) = self.outer, self.inner
        provided = f", provided {self.quantity.provided}" if self.quantity.provided else ""
        return (
            f"{self.median:.3g} {self.quantity.unit} ({low:.3g} to {high:.3g}; half of it "
            f"{start:.3g} to {end:.3g}){provided}"
        )

    def against(self, low: float | None, high: float | None) -> str:
        """Compare the outer interval with profile likelihood limits of the same confidence."""
        if low is None or high is None:
            return PRIOR
        width = np.log(high / low)
        shifts = np.abs(np.log(np.divide(self.outer, (low, high))))
        return AGREES if np.max(shifts) <= _ALLOWED * width else DIFFERS

    def why(self, low: float | None, high: float | None, *, exact_onset: bool) -> str:
        """Explain how the interval compares with a profile's limits.

        With an exact onset, the profile allows for the uncertainty of the onset, and the interval
        does not.
        """
        label, verdict = self.quantity.label, self.against(low, high)
        if verdict == AGREES:
            return f"{label}: the interval is that of the profile."
        if verdict == DIFFERS and exact_onset:
            return (
                f"{label}: the profile has {low:.3g} to {high:.3g}. It allows for the uncertainty "
                "of the fitted onset, which the posterior takes as exact."
            )
        if verdict == DIFFERS:
            return (
                f"{label}: the profile has {low:.3g} to {high:.3g}. It takes the best fit at every "
                "value; the posterior integrates over all other parameters, and so favours values "
                "at which more of them fit."
            )
        ends = {"lower": low, "upper": high}
        free = " and ".join(name for name, limit in ends.items() if limit is None)
        texts = [f"{name} {limit:.2g}" for name, limit in ends.items() if limit is not None]
        limit = f" (its {texts[0]})" if texts else ""
        return (
            f"{label}: the profile has no {free} limit{limit}. There the interval ends where the "
            "prior does, and another search range or prior would give another one."
        )


def compute_marginals(
    log_parameters: Array, quantities: Sequence[Quantity], duration_s: float, confidence: float
) -> list[Marginal]:
    """Compute the marginal posteriors of quantities from samples.

    Parameters
    ----------
    log_parameters : (n, n_parameters)
        Samples.
    quantities
        Quantities of interest.
    duration_s
        Length of the experiment, within which branches must relax if a quantity requires it.
    confidence
        Of the outer intervals.
    """
    levels = [0.5, *(0.5 * (1 + way * share) for share in (_INNER, confidence) for way in (-1, 1))]
    found = []
    for quantity in quantities:
        holds = fulfilled(quantity, log_parameters, duration_s)
        # If no sample fulfils the conditions, all count.
        counted = log_parameters[holds] if np.any(holds) else log_parameters
        median, a, b, c, d = np.exp(np.quantile(quantity.logs(counted), levels)).tolist()
        found.append(Marginal(quantity, median, (a, b), (c, d), float(np.mean(holds))))
    return found


def fulfilled(quantity: Quantity, log_parameters: Array, duration_s: float) -> BoolArray:
    """Return which samples, of (n, n_parameters), fulfil the conditions of a quantity; (n,)."""
    count, size = log_parameters.shape
    late = [log_parameters @ h.form(size) - h.allowed(duration_s) for h in quantity.penalties]
    holds: BoolArray = np.all(np.less_equal(late, 0.0).reshape(-1, count), axis=0)
    return holds
