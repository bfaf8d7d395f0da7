"""What samples of a posterior say of single quantities, beside their profile likelihoods."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.identifiability.quantities import Quantity

AGREES, PRIOR, DIFFERS = "agrees", "prior", "differs"
"""With a profile: the same interval; an end is what the prior leaves; another interval."""

# Of the width of a profile's interval, by which ends may differ: its own error, as the normal
# distribution that it supposes is one of many samples only, and that of some thousand samples.
_ALLOWED = 0.15
_INNER = 0.5


@dataclass(frozen=True)
class Marginal:
    """A quantity's posterior, in SI units.

    Parameters
    ----------
    quantity
        Which one.
    median
        Half of the samples are above.
    inner, outer
        Ends of the intervals that leave as many samples below as above: of 50 %, and of the
        confidence that was asked for.
    share
        Of the samples, those in which what the quantity takes for granted holds; the others
        do not count.
    """

    quantity: Quantity
    median: float
    inner: tuple[float, float]
    outer: tuple[float, float]
    share: float

    def words(self) -> str:
        """Say it, e.g. ``34.6 N/m (31.6 to 38; half of it 33.5 to 35.7)``."""
        (low, high), (start, end) = self.outer, self.inner
        provided = f", provided {self.quantity.provided}" if self.quantity.provided else ""
        return (
            f"{self.median:.3g} {self.quantity.unit} ({low:.3g} to {high:.3g}; half of it "
            f"{start:.3g} to {end:.3g}){provided}"
        )

    def against(self, low: float | None, high: float | None) -> str:
        """Compare with the limits of a profile likelihood, of the same confidence."""
        if low is None or high is None:
            return PRIOR
        width = np.log(high / low)
        shifts = np.abs(np.log(np.divide(self.outer, (low, high))))
        return AGREES if np.max(shifts) <= _ALLOWED * width else DIFFERS

    def why(self, low: float | None, high: float | None) -> str:
        """Say in a sentence how the interval and a profile's limits go together."""
        label, verdict = self.quantity.label, self.against(low, high)
        if verdict == AGREES:
            return f"{label}: the interval is that of the profile."
        if verdict == DIFFERS:
            return (
                f"{label}: the profile has {low:.3g} to {high:.3g}. It takes the best fit at every "
                "value; the posterior counts how much of the prior fits, and much of it does "
                "where other parameters are free."
            )
        ends = {"lower": low, "upper": high}
        free = " and ".join(name for name, limit in ends.items() if limit is None)
        told = [f"{name} {limit:.2g}" for name, limit in ends.items() if limit is not None]
        limit = f" (its {told[0]})" if told else ""
        return (
            f"{label}: the profile has no {free} limit{limit}. There the interval ends where the "
            "prior does, and another search range or prior would give another one."
        )


def marginals_of(
    log_parameters: Array, quantities: Sequence[Quantity], duration_s: float, confidence: float
) -> list[Marginal]:
    """Return the posteriors of quantities.

    Parameters
    ----------
    log_parameters : (n, n_parameters)
        Samples.
    quantities
        Of which.
    duration_s
        Length of the experiment, within which branches have to relax where a quantity says so.
    confidence
        Of the outer intervals.
    """
    levels = [0.5, *(0.5 * (1 + way * share) for share in (_INNER, confidence) for way in (-1, 1))]
    found, (count, size) = [], log_parameters.shape
    for quantity in quantities:
        late = [log_parameters @ h.form(size) - h.allowed(duration_s) for h in quantity.hinges]
        holds = np.all(np.less_equal(late, 0.0).reshape(-1, count), axis=0)
        # Where it hardly ever holds, there is nothing better to say.
        counted = log_parameters[holds] if np.any(holds) else log_parameters
        median, a, b, c, d = np.exp(np.quantile(quantity.logs(counted), levels)).tolist()
        found.append(Marginal(quantity, median, (a, b), (c, d), float(np.mean(holds))))
    return found
