"""Whether what a fit leaves of a trace is white noise, and in words why not."""

from collections.abc import Iterator

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import counted
from biogrip.identify.outliers import FAR, outliers_of

FALSE_ALARM = 0.003
"""Share of traces with white noise of which something else is suspected, by any one test."""

# Correlation of neighbouring residuals, in standard deviations of that of white noise.
_CORRELATED = 5.0
# Stretches over which residuals are averaged, and samples in the shortest.
_STRETCHES, _SHORTEST = 20, 5


def doubts_about_noise(residual: Array) -> Iterator[str]:
    """Say in sentences why a residual is not white noise.

    Parameters
    ----------
    residual : (n_samples,)
        What a fit leaves of a trace.
    """
    correlation = float(np.dot(residual[1:], residual[:-1]) / np.dot(residual, residual))
    chance = uneven(residual)
    if abs(correlation) > _CORRELATED / np.sqrt(len(residual)):
        yield (
            f"Neighbouring residuals are correlated ({correlation:.2f}; white noise would give "
            f"0 ± {1 / np.sqrt(len(residual)):.2f}): the intervals are too narrow, or the model, "
            "the protocol or the gripper is not the right one."
        )
    elif chance < FALSE_ALARM:
        yield (
            "The residual has more of some frequencies than of others, as white noise would "
            f"{one_in(chance)} traces: the intervals are not the right ones, or the model, the "
            "protocol or the gripper is not."
        )
    chance = wandering(residual)
    if chance < FALSE_ALARM:
        yield (
            "The residual wanders: its means over stretches of the trace scatter as those of white "
            f"noise would {one_in(chance)} traces. Something slow is in it that the model does not "
            "have, a drift of the instrument perhaps: the intervals are too narrow."
        )
    far = int(np.count_nonzero(outliers_of(residual)))
    chance = _chance_of_far(far, len(residual))
    if chance < FALSE_ALARM:
        yield (
            f"Beyond {FAR:g} standard deviations from the samples around: "
            f"{counted(far, 'outlier')}, as of Gaussian noise {one_in(chance)} traces. What lies "
            "so far off weighs too much."
        )


def one_in(chance: float) -> str:
    """Say how rare something is, e.g. ``"once in 2e+03"``."""
    return f"once in {1 / max(chance, 1e-300):.1g}"


def wandering(residual: Array) -> float:
    """Return the probability that means of white noise over stretches scatter as much.

    The sum of n_i m_i^2 / sigma^2 over stretches of n_i samples and mean m_i is
    chi-squared for white noise, with a degree of freedom each; what a fit has
    taken from it only lowers it. Parts of a spectrum below some ten periods a trace
    show in it, however little they are beside the noise of single samples. The residual is
    that of `doubts_about_noise`.
    """
    from scipy.special import chdtrc

    stretches = min(_STRETCHES, len(residual) // _SHORTEST)
    if stretches < 2:
        return 1.0
    parts = np.array_split(residual, stretches)
    scatter = sum(len(part) * float(np.mean(part)) ** 2 for part in parts)
    return float(chdtrc(stretches, scatter / float(np.mean(np.square(residual)))))


def uneven(residual: Array) -> float:
    """Return the probability that the periodogram of white noise is as uneven.

    By the largest distance between the cumulative periodogram and a straight line, which is
    Kolmogorov's [1]_. Parts that are forgotten within some samples show in it where neighbours
    are hardly correlated yet. The residual is that of `doubts_about_noise`.

    References
    ----------
    .. [1] J. Durbin, Tests for serial correlation in regression analysis based on the periodogram
       of least-squares residuals, Biometrika 56 (1969), 1-15.
    """
    from scipy.fft import prev_fast_len
    from scipy.special import kolmogorov

    # Of a length that has no small factors, a transform takes many times the memory.
    residual = residual[: prev_fast_len(len(residual))]
    power = np.abs(np.fft.rfft(residual)[1 : (len(residual) + 1) // 2]) ** 2
    if len(power) < 2:
        return 1.0
    reached = np.cumsum(power)[:-1] / np.sum(power)
    shares = np.arange(1, len(power)) / len(power)
    return float(kolmogorov(np.sqrt(len(power)) * np.max(np.abs(reached - shares))))


def _chance_of_far(far: int, samples: int) -> float:
    """Probability of as many samples of Gaussian noise that far out (Poisson's)."""
    from scipy.special import ndtr, pdtrc

    return float(pdtrc(far - 1, 2 * samples * ndtr(-FAR))) if far else 1.0
