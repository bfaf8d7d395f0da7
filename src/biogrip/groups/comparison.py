"""Difference between the populations of two dishes, as a ratio of medians (Welch's t test).

Means of logarithms with unequal variances are compared by Welch's t, with Satterthwaite's degrees
of freedom. If estimation errors are negligible this is Welch's test of the cells' logarithms. Where
the limits of a median are not symmetric, each side of the difference has the deviations of the
sides that it depends on.

References
----------
.. [1] F. E. Satterthwaite, An approximate distribution of estimates of variance components,
   Biometrics Bulletin 2 (1946), 110-114.
.. [2] B. L. Welch, The generalization of "Student's" problem when several different population
   variances are involved, Biometrika 34 (1947), 28-35.
.. [3] G. Y. Zou and A. Donner, Construction of confidence limits about effect measures: a general
   approach, Statistics in Medicine 27 (2008), 1693-1702: limits that are not symmetric.
.. [4] S. Holm, A simple sequentially rejective multiple test procedure, Scandinavian Journal of
   Statistics 6 (1979), 65-70.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, sqrt

from biogrip.groups.population import Population


@dataclass(frozen=True)
class Difference:
    """Ratio of the medians of two populations."""

    log_ratio: float
    """Logarithm of the ratio."""
    down: tuple[float, float]
    """Its standard deviation downwards, and the degrees of freedom, which need not be an
    integer."""
    up: tuple[float, float]
    """Both upwards."""
    confidence: float
    """Confidence level of the interval, e.g. 0.95."""

    @property
    def ratio(self) -> float:
        """Ratio of the medians."""
        return exp(self.log_ratio)

    @property
    def low(self) -> float:
        """Lower confidence limit of the ratio."""
        return exp(self.log_ratio - self._reach(*self.down))

    @property
    def high(self) -> float:
        """Upper confidence limit of the ratio."""
        return exp(self.log_ratio + self._reach(*self.up))

    @property
    def freedom(self) -> float:
        """Degrees of freedom towards a ratio of 1."""
        return self._towards_one[1]

    @property
    def p_value(self) -> float:
        """Two-sided p value of the hypothesis that the ratio is 1."""
        from scipy.special import stdtr

        deviation, freedom = self._towards_one
        return float(2 * stdtr(freedom, -abs(self.log_ratio) / deviation))

    @property
    def _towards_one(self) -> tuple[float, float]:
        return self.down if self.log_ratio > 0 else self.up

    def _reach(self, deviation: float, freedom: float) -> float:
        from scipy.special import stdtrit

        return float(stdtrit(freedom, (1 + self.confidence) / 2)) * deviation


def difference(one: Population, other: Population) -> Difference:
    """Return the difference of a population from another, whose median is the denominator."""
    freedoms = one.freedom, other.freedom
    return Difference(
        one.centre.centre - other.centre.centre,
        _side(one.deviations[0], other.deviations[1], *freedoms),
        _side(one.deviations[1], other.deviations[0], *freedoms),
        one.confidence,
    )


def _side(one: float, other: float, freedom: int, other_freedom: int) -> tuple[float, float]:
    """Return the deviation of a difference, and its degrees of freedom after Satterthwaite."""
    both = one**2 + other**2
    return sqrt(both), both**2 / (one**4 / freedom + other**4 / other_freedom)


def adjusted(p_values: Sequence[float]) -> list[float]:
    """Return p values adjusted for multiple comparisons by Holm's method."""
    from statsmodels.stats.multitest import multipletests

    return [float(p) for p in multipletests(p_values, method="holm")[1]]
