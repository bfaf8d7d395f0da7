"""Difference between the populations of two dishes, as a ratio of medians (Welch's t test).

Means of logarithms with unequal variances are compared by Welch's t, with Satterthwaite's degrees
of freedom. If estimation errors are negligible this is Welch's test of the cells' logarithms.

References
----------
.. [1] F. E. Satterthwaite, An approximate distribution of estimates of variance components,
   Biometrics Bulletin 2 (1946), 110-114.
.. [2] B. L. Welch, The generalization of "Student's" problem when several different population
   variances are involved, Biometrika 34 (1947), 28-35.
.. [3] S. Holm, A simple sequentially rejective multiple test procedure, Scandinavian Journal of
   Statistics 6 (1979), 65-70.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, hypot

from biogrip.groups.population import Population


@dataclass(frozen=True)
class Difference:
    """Ratio of the medians of two populations."""

    log_ratio: float
    """Logarithm of the ratio."""
    deviation: float
    """Its standard deviation."""
    freedom: float
    """Degrees of freedom of the deviation; need not be an integer."""
    confidence: float
    """Confidence level of the interval, e.g. 0.95."""

    @property
    def ratio(self) -> float:
        """Ratio of the medians."""
        return exp(self.log_ratio)

    @property
    def low(self) -> float:
        """Lower confidence limit of the ratio."""
        return exp(self.log_ratio - self._reach)

    @property
    def high(self) -> float:
        """Upper confidence limit of the ratio."""
        return exp(self.log_ratio + self._reach)

    @property
    def p_value(self) -> float:
        """Two-sided p value of the hypothesis that the ratio is 1."""
        from scipy.special import stdtr

        return float(2 * stdtr(self.freedom, -abs(self.log_ratio) / self.deviation))

    @property
    def _reach(self) -> float:
        from scipy.special import stdtrit

        return float(stdtrit(self.freedom, (1 + self.confidence) / 2)) * self.deviation


def difference(one: Population, other: Population) -> Difference:
    """Return the difference of a population from another, whose median is the denominator."""
    first, second = one.deviation**2, other.deviation**2
    freedom = (first + second) ** 2 / (first**2 / one.freedom + second**2 / other.freedom)
    return Difference(
        one.centre - other.centre,
        hypot(one.deviation, other.deviation),
        freedom,
        one.confidence,
    )


def adjusted(p_values: Sequence[float]) -> list[float]:
    """Return p values adjusted for multiple comparisons by Holm's method."""
    from statsmodels.stats.multitest import multipletests

    return [float(p) for p in multipletests(p_values, method="holm")[1]]
