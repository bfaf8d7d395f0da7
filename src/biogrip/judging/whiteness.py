"""Tests of whether the residuals of a fit are white noise, with their results in words."""

from collections.abc import Iterator

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import counted
from biogrip.fit.outliers import FAR, outliers_of
from biogrip.instrument.instrument import Instrument

FALSE_ALARM = 0.003
"""Significance level of each test: share of traces with white noise that fail it."""

# Largest correlation of neighbouring residuals, in standard deviations of that of white noise.
_CORRELATED = 5.0
# Stretches over which residuals are averaged, and readings in the shortest.
_STRETCHES, _SHORTEST = 20, 5


def doubts_about_noise(
    residual: Array, growth: Array, instrument: Instrument, rounding_rad: float = 0.0
) -> Iterator[str]:
    """Yield a sentence for each test of white noise that the residuals of a fit fail.

    Parameters
    ----------
    residual : (n_samples,)
        Residuals of the fit.
    growth : (n_samples,)
        Growth of the noise with the rotation, see `compute_growth`. All other tests are of what
        it leaves.
    instrument
        The instrument, for its words.
    rounding_rad
        Step of the readings.
    """
    read, wrong = instrument.read.name, instrument.suspects()
    many = f"{read}s" if instrument.has_jaws else "readings"
    if np.ptp(growth):
        low, high = np.quantile(growth, (0.05, 0.95))
        yield (
            f"The noise grows with the {read}: it is {high / low:.2g} times as large for the "
            f"largest tenth of the {many} as for the smallest, and neither the weights of the "
            "readings nor the intervals allow for that."
        )
        residual = residual / growth
    correlation = float(np.dot(residual[1:], residual[:-1]) / np.dot(residual, residual))
    chance = uneven(residual)
    if abs(correlation) > _CORRELATED / np.sqrt(len(residual)):
        yield (
            f"Neighbouring residuals are correlated ({correlation:.2f}; white noise would give "
            f"0 ± {1 / np.sqrt(len(residual)):.2f}): the intervals are too narrow, or {wrong} "
            "is not the right one."
        )
    elif chance < FALSE_ALARM:
        yield (
            "The residual has more of some frequencies than of others, as white noise has only "
            f"{one_in(chance)} traces: the intervals are wrong, or {wrong} is."
        )
    chance = wandering(residual)
    if chance < FALSE_ALARM:
        yield (
            "The residual wanders: its means over stretches of the trace scatter as much as those "
            f"of white noise do only {one_in(chance)} traces. It contains something slow that the "
            "model lacks, perhaps a drift of the instrument: the intervals are too narrow."
        )
    far = int(np.count_nonzero(outliers_of(residual, rounding_rad)))
    chance = _chance_of_far(far, len(residual))
    if chance < FALSE_ALARM:
        yield (
            f"Beyond {FAR:g} standard deviations from the samples around: "
            f"{counted(far, 'outlier')}, as of Gaussian noise only {one_in(chance)} traces. "
            "Outliers distort the fit."
        )


def one_in(chance: float) -> str:
    """Return a probability in words, e.g. ``"once in 2e+03"``."""
    return f"once in {1 / max(chance, 1e-300):.1g}"


def wandering(residual: Array) -> float:
    """Return the p-value of a chi-squared test of means over stretches of white noise.

    The statistic is the sum of n_i m_i^2 / sigma^2 over stretches of n_i readings and mean
    m_i, with a degree of freedom each; a fit only lowers it. The test detects parts of the
    spectrum below some ten periods a trace, however small they are beside the noise of
    single readings. The residual is that of `doubts_about_noise`.
    """
    from scipy.special import chdtrc

    stretches = min(_STRETCHES, len(residual) // _SHORTEST)
    if stretches < 2:
        return 1.0
    parts = np.array_split(residual, stretches)
    scatter = sum(len(part) * float(np.mean(part)) ** 2 for part in parts)
    return float(chdtrc(stretches, scatter / float(np.mean(np.square(residual)))))


def uneven(residual: Array) -> float:
    """Return the p-value of the cumulative periodogram test of white noise [1]_.

    The statistic is the largest distance between the cumulative periodogram and a straight
    line, with Kolmogorov's distribution. The test detects noise with a correlation time of some
    readings and too small a share to correlate neighbours. `residual` as in `doubts_about_noise`.

    References
    ----------
    .. [1] J. Durbin, Tests for serial correlation in regression analysis based on the periodogram
       of least-squares residuals, Biometrika 56 (1969), 1-15.
    """
    from scipy.fft import prev_fast_len
    from scipy.special import kolmogorov

    # A transform takes many times the memory if its length has no small factors.
    residual = residual[: prev_fast_len(len(residual))]
    power = np.abs(np.fft.rfft(residual)[1 : (len(residual) + 1) // 2]) ** 2
    if len(power) < 2:
        return 1.0
    reached = np.cumsum(power)[:-1] / np.sum(power)
    shares = np.arange(1, len(power)) / len(power)
    return float(kolmogorov(np.sqrt(len(power)) * np.max(np.abs(reached - shares))))


def _chance_of_far(far: int, samples: int) -> float:
    """Return the probability of as many outliers in Gaussian noise, by Poisson's distribution."""
    from scipy.special import ndtr, pdtrc

    return float(pdtrc(far - 1, 2 * samples * ndtr(-FAR))) if far else 1.0
