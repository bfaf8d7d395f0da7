"""How far the populations of two dishes are apart, in logarithms: as a ratio of medians.

The difference of two means whose variances differ is judged by Welch's t, with the degrees of
freedom of Satterthwaite. Where cells are known exactly that is Welch's test of their logarithms.

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
    """One population's median over another's.

    Parameters
    ----------
    log_ratio, deviation
        Logarithm of the ratio, and its standard deviation.
    freedom
        Degrees of freedom of the deviation, no whole number.
    confidence
        Of the interval, e.g. 0.95.
    """

    log_ratio: float
    deviation: float
    freedom: float
    confidence: float

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
        """Probability of a ratio as far from 1, either way, if there is none."""
        from scipy.special import stdtr

        return float(2 * stdtr(self.freedom, -abs(self.log_ratio) / self.deviation))

    @property
    def _reach(self) -> float:
        from scipy.special import stdtrit

        return float(stdtrit(self.freedom, (1 + self.confidence) / 2)) * self.deviation


def difference(one: Population, other: Population) -> Difference:
    """Compare a population with another, whose median is the denominator."""
    first, second = one.deviation**2, other.deviation**2
    freedom = (first + second) ** 2 / (first**2 / one.freedom + second**2 / other.freedom)
    return Difference(
        one.centre - other.centre,
        hypot(one.deviation, other.deviation),
        freedom,
        one.confidence,
    )


def adjusted(p_values: Sequence[float]) -> list[float]:
    """Return p values of several comparisons such that none of them errs with more (Holm)."""
    from statsmodels.stats.multitest import multipletests

    return [float(p) for p in multipletests(p_values, method="holm")[1]]
