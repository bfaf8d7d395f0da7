"""Verdicts on quantities: determined, bounded on one side, or not determined by a trace.

The verdict is which of the two confidence limits a quantity's profile has (`Profile.low`, `high`):
both, one, or none. A profile has a limit on a side if it exceeds `Likelihood.certainty` (99.9 %) at
that end of the search range; the limit is where it crosses `Likelihood.threshold` (95 %, or the
confidence asked for). `Finding.words` has the words of each.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain, with_limits, within_limits
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.profiles import Profile, compute_profiles
from biogrip.judging.quantities import Quantity, find_combinations

DETERMINED = "determined"
BOUNDED_BELOW = "bounded below"
BOUNDED_ABOVE = "bounded above"
NOT_DETERMINED = "not determined"
FIT_REJECTED = "fit rejected"
"""Verdict on every quantity of a fit that is rejected."""


def verdict_of(low: float | None, high: float | None) -> str:
    """Return the verdict on a quantity with these limits."""
    if low is None:
        return NOT_DETERMINED if high is None else BOUNDED_ABOVE
    return BOUNDED_BELOW if high is None else DETERMINED


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
        return verdict_of(self.profile.low, self.profile.high)

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

    @property
    def is_wide(self) -> bool:
        """True if its two limits tell little more than an order of magnitude: see `WIDE`."""
        low, high = self.low, self.high
        return low is not None and high is not None and high > levels.WIDE**2 * low

    def allows(self, log_parameters: Array) -> bool:
        """Return True if parameters, (n_parameters,), lie within the limits; NaN does."""
        value = self.quantity.log(log_parameters)
        low, high = self.profile.low, self.profile.high
        beyond = (low is not None and value < low) or (high is not None and value > high)
        return not (beyond or any(start < value < end for start, end in self.profile.gaps))

    def words(self) -> str:
        """Return the verdict in words, e.g. ``determined: 34.1 N/m (31.2 to 37.3)``."""
        words, unit = self._limits_in_words(), self._unit
        if self.gaps:
            ends = (end for gap in self.gaps for end in gap)
            gaps = within_limits(self.value, self.low or 0.0, self.high or 0.0, *ends)[3:]
            but = " and ".join(map(" to ".join, zip(gaps[::2], gaps[1::2], strict=True)))
            words += f", except {but}{unit}"
        if self.quantity.provided and self.is_bounded:
            words += f", provided {self.quantity.provided}"
        return words

    def _limits_in_words(self) -> str:
        low, high, unit = self.low, self.high, self._unit
        if low is not None and high is not None:
            decades = plain(math.log10(high / low), 2)
            how = f" only to {decades} decades" if self.is_wide else ""
            return f"determined{how}: {with_limits(self.value, low, high, self.quantity.unit)}"
        if low is not None:
            return f"only bounded below: at least {plain(low, 2)}{unit}"
        if high is not None:
            return f"only bounded above: at most {plain(high, 2)}{unit}"
        if self.profile.slowest_s is not None:
            slowest = f"a branch of the best fit relaxes in {plain(self.profile.slowest_s, 2)} s,"
            return f"not stated: {slowest} longer than the trace lasts"
        if self.profile.certainty is None:
            return "not determined: the trace sets no limit within the search range"
        increase = max(self.profile.increases[[0, -1]])
        return (
            "not determined: towards an end of the search range the fit is worse, but not clearly "
            f"(χ² is higher by {increase:.2g}, and a limit takes {self.profile.certainty:.3g})"
        )

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
    likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity], *, smooth: bool = True
) -> list[list[Finding]]:
    """Profile quantities in each of several traces, and reach a verdict on each of them."""
    findings = []
    every = compute_profiles(likelihoods, quantities, smooth=smooth)
    for likelihood, profiles in zip(likelihoods, every, strict=True):
        deviations = map(likelihood.deviation, quantities)
        findings.append(list(map(Finding, quantities, profiles, deviations)))
    return findings


def find_trade_offs(likelihood: Likelihood, findings: Sequence[Finding]) -> list[Trade]:
    """Find determined combinations of undetermined parameters.

    Combinations among the findings come first. Of other pairs, the combination known best to first
    order is profiled, if it is worth a look.
    """
    model, trades = likelihood.problem.residuals.model, list[tuple[tuple[int, ...], Finding]]()
    left = [
        finding.quantity.members[0]
        for finding in findings
        if len(finding.quantity.members) == 1 and finding.verdict != DETERMINED
    ]
    for finding in findings:
        members = tuple(index for index in finding.quantity.members if index in left)
        if len(members) > 1:
            trades.append((members, finding))
            left = [index for index in left if index not in members]
    for pair in combinations(left, 2):
        candidates = find_combinations(model, list(pair))
        best = min(candidates, key=likelihood.deviation, default=None)
        if best is not None and likelihood.deviation(best) < levels.WORTH_A_PROFILE:
            ((finding,),) = compute_findings([likelihood], [best])
            trades.append((pair, finding))
    return [
        Trade(tuple(model.parameters[index].name for index in members), finding)
        for members, finding in trades
        if finding.verdict == DETERMINED
    ]
