"""Verdicts on quantities: determined, bounded on one side, or not determined by a trace."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from biogrip.arrays import Array
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.profiles import Profile, compute_profiles
from biogrip.judging.quantities import Quantity, find_combinations
from biogrip.physics.sample_model import SampleModel

DETERMINED = "determined"
BOUNDED_BELOW = "bounded below"
BOUNDED_ABOVE = "bounded above"
NOT_DETERMINED = "not determined"

WIDE = 3.0
"""Limits further than this factor from their middle tell little more than an order of magnitude:
moduli of cells of one kind scatter by a factor of about 2 to 3."""

# A combination of undetermined parameters is profiled if the first-order standard
# deviation of its logarithm is below this.
_WORTH_A_LOOK = 0.5


@dataclass(frozen=True)
class Finding:
    """A quantity, its profile, and the verdict on it."""

    quantity: Quantity
    profile: Profile
    """Its profile likelihood."""
    deviation: float
    """Standard deviation of its logarithm to first order, see `Likelihood.deviation`."""

    @property
    def verdict(self) -> str:
        """Verdict: determined, bounded below or above, or not determined."""
        below, above = self.profile.low is not None, self.profile.high is not None
        if below and above:
            return DETERMINED
        if below:
            return BOUNDED_BELOW
        return BOUNDED_ABOVE if above else NOT_DETERMINED

    @property
    def value(self) -> float:
        """Best estimate in SI units, meaningful only if the quantity is determined."""
        return math.exp(self.profile.best)

    @property
    def low(self) -> float | None:
        """Lower confidence limit in SI units."""
        return None if self.profile.low is None else math.exp(self.profile.low)

    @property
    def high(self) -> float | None:
        """Upper confidence limit in SI units."""
        return None if self.profile.high is None else math.exp(self.profile.high)

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Stretches between the limits that are excluded, in SI units."""
        return [(math.exp(start), math.exp(end)) for start, end in self.profile.gaps]

    @property
    def is_bounded(self) -> bool:
        """True if the trace bounds the quantity on at least one side."""
        return self.verdict != NOT_DETERMINED

    def allows(self, log_parameters: Array) -> bool:
        """Return True if parameters, (n_parameters,), lie within the limits; NaN does."""
        value = self.quantity.log(log_parameters)
        low, high = self.profile.low, self.profile.high
        beyond = (low is not None and value < low) or (high is not None and value > high)
        return not (beyond or any(start < value < end for start, end in self.profile.gaps))

    def words(self) -> str:
        """Return the verdict in words, e.g. ``determined: 34.1 N/m (31.2 to 37.3)``."""
        but = " and ".join(f"{start:.3g} to {end:.3g}" for start, end in self.gaps)
        words = self._limits_in_words() + (f", except {but}{self._unit}" if but else "")
        provided = self.quantity.provided
        return (
            f"{words}, provided {provided}"
            if provided and self.verdict != NOT_DETERMINED
            else words
        )

    def _limits_in_words(self) -> str:
        unit = self._unit
        if self.verdict == DETERMINED:
            assert self.low is not None
            assert self.high is not None
            factor = math.sqrt(self.high / self.low)
            how = f" only within a factor of {factor:.2g}" if factor > WIDE else ""
            return f"determined{how}: {self.value:.3g}{unit} ({self.low:.3g} to {self.high:.3g})"
        if self.verdict == BOUNDED_BELOW:
            return f"only bounded below: at least {self.low:.2g}{unit}"
        if self.verdict == BOUNDED_ABOVE:
            return f"only bounded above: at most {self.high:.2g}{unit}"
        certainty = self.profile.certainty
        if certainty is None:
            return "not determined: the trace sets no limit within the search range"
        increase = max(self.profile.increases[[0, -1]])
        return (
            "not determined: towards an end of the search range the fit is worse, but not clearly "
            f"(χ² is higher by {increase:.2g}, and a limit takes {certainty:.3g})"
        )

    @property
    def best_in_words(self) -> str:
        """Best estimate with its unit."""
        return f"{self.value:.3g}{self._unit}"

    @property
    def _unit(self) -> str:
        return f" {self.quantity.unit}" if self.quantity.unit else ""


@dataclass(frozen=True)
class Trade:
    """Parameters of which only a combination is determined."""

    members: tuple[str, ...]
    """Names of parameters that trade against each other."""
    finding: Finding
    """The combination that is determined."""

    def words(self) -> str:
        """Return the trade as a sentence."""
        names = " and ".join(self.members)
        what = self.finding.words().partition(": ")[2]
        return (
            f"{names} trade against each other; determined is {self.finding.quantity.label}: {what}"
        )


def compute_findings(
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]
) -> list[list[Finding]]:
    """Profile quantities in each of several traces, and reach a verdict on each of them."""
    return [
        [
            Finding(quantity, profile, likelihood.deviation(quantity))
            for quantity, profile in zip(quantities, profiles, strict=True)
        ]
        for likelihood, profiles in zip(
            likelihoods, compute_profiles(likelihoods, quantities), strict=True
        )
    ]


def find_trade_offs(
    likelihoods: Sequence[Likelihood], model: SampleModel, findings: Sequence[list[Finding]]
) -> list[list[Trade]]:
    """Find determined combinations of parameters that are not determined themselves.

    Parameters
    ----------
    likelihoods
        One per trace.
    model
        Their model.
    findings
        Findings of each trace.

    Returns
    -------
    list of list of Trade
        By trace.
    """
    pairs = zip(likelihoods, findings, strict=True)
    candidates = [_pairs_that_may_trade(*pair, model) for pair in pairs]
    # Traces with the same combination are profiled together.
    traces: dict[Quantity, list[int]] = {}
    for trace, (_, of_pairs) in enumerate(candidates):
        for quantity in of_pairs.values():
            traces.setdefault(quantity, []).append(trace)
    profiled = {
        (trace, quantity): finding
        for quantity, own in traces.items()
        for trace, (finding,) in zip(
            own, compute_findings([likelihoods[t] for t in own], [quantity]), strict=True
        )
    }
    names = [parameter.name for parameter in model.parameters]
    return [
        [
            Trade(tuple(names[index] for index in members), finding)
            for members, finding in (
                *known.items(),
                *((pair, profiled[trace, quantity]) for pair, quantity in of_pairs.items()),
            )
            if finding.verdict == DETERMINED
        ]
        for trace, (known, of_pairs) in enumerate(candidates)
    ]


def _pairs_that_may_trade(
    likelihood: Likelihood, findings: Sequence[Finding], model: SampleModel
) -> tuple[dict[tuple[int, ...], Finding], dict[tuple[int, ...], Quantity]]:
    """Return combinations of undetermined parameters: those profiled, and others worth a look."""
    open_ones = [
        finding.quantity.members[0]
        for finding in findings
        if len(finding.quantity.members) == 1 and finding.verdict != DETERMINED
    ]
    known: dict[tuple[int, ...], Finding] = {}
    for finding in findings:
        members = tuple(index for index in finding.quantity.members if index in open_ones)
        if len(members) > 1:
            known[members] = finding
            open_ones = [index for index in open_ones if index not in members]
    others: dict[tuple[int, ...], Quantity] = {}
    for pair in combinations(open_ones, 2):
        candidates = find_combinations(model, list(pair))
        deviations = [likelihood.deviation(quantity) for quantity in candidates]
        if min(deviations, default=np.inf) < _WORTH_A_LOOK:
            others[pair] = candidates[int(np.argmin(deviations))]
    return known, others
