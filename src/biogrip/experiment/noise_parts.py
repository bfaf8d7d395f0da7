"""What noise has beside white noise: parts that remember, a drift, and outliers."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from biogrip.arrays import Array
from biogrip.keys import Key

# Relaxation times of flicker noise are so many e-folds apart, or less: its spectrum is 1/f to
# within 2 exp(-pi^2 / 1.5) = 0.3 %, as Poisson's summation has it.
_EFOLDS = 1.5
# The slowest relaxes in so many times the trace: all that is slower is an offset.
_SLOWEST = 3.0


@dataclass(frozen=True)
class Relaxing:
    """Noise that is forgotten with one time constant, of spectrum 1/(1 + (2 pi f tau)^2)."""

    share: Annotated[float, Key("Share of the noise's variance.", above=0, high=1)]
    time_s: Annotated[
        float,
        Key(
            "Time after which its correlation has fallen to 1/e. Of samples an interval h apart "
            "it is an AR(1) process with the coefficient exp(-h / time_s).",
            "s",
            above=0,
            high=1e9,
        ),
    ]


@dataclass(frozen=True)
class Flicker:
    """Noise of spectrum 1/f, over all frequencies that the trace has."""

    share: Annotated[float, Key("Share of the noise's variance.", above=0, high=1)]


@dataclass(frozen=True)
class Drift:
    """A drift linear in time, upwards or downwards as chance has it."""

    rise: Annotated[
        float,
        Key(
            "By how much it changes from the first sample to the last, in standard deviations of "
            "the noise.",
            above=0,
            high=1000,
        ),
    ]


@dataclass(frozen=True)
class Outliers:
    """Samples with far more noise than others."""

    share: Annotated[float, Key("Share of the samples, at random.", above=0, high=0.5)]
    size: Annotated[
        float,
        Key(
            "Standard deviation of what they have in addition, in standard deviations of the "
            "noise.",
            above=0,
            high=1000,
        ),
    ]


def remembering(
    time_s: Array, weights: Array, rates_per_s: Array, rng: np.random.Generator
) -> Array:
    """Draw a sum of independent Ornstein-Uhlenbeck processes, exactly, at any times.

    Each goes from sample to sample as an AR(1) process [1]_.

    Parameters
    ----------
    time_s : (n_times,)
        Ascending times.
    weights, rates_per_s : (n_processes,)
        Variance of each, and the inverse of its relaxation time.
    rng
        The stream to draw from.

    Returns
    -------
    (n_times,)

    References
    ----------
    .. [1] D. T. Gillespie, Exact numerical simulation of the Ornstein-Uhlenbeck process and its
       integral, Physical Review E 54 (1996), 2084-2091.
    """
    states = rng.standard_normal((len(time_s), len(weights)))
    elapsed = np.outer(np.diff(time_s), rates_per_s)
    states[1:] *= np.sqrt(-np.expm1(-2 * elapsed))
    left = np.empty(len(weights))
    for before, kept, state in zip(states[:-1], np.exp(-elapsed), states[1:], strict=True):
        state += np.multiply(kept, before, out=left)
    # A product a sample, as whose sums the order does not depend on how many there are.
    total: Array = (states[:, None] @ np.sqrt(weights)[:, None])[:, 0, 0]
    return total


def flicker_rates(time_s: Array) -> Array:
    """Return relaxation rates whose processes, of equal variance, make noise of spectrum 1/f [1]_.

    Parameters
    ----------
    time_s : (n_times,)
        Ascending times, of which the processes take in all frequencies.

    Returns
    -------
    (n_processes,)
        In 1/s, geometric.

    References
    ----------
    .. [1] E. Milotti, 1/f noise: a pedagogical review, arXiv:physics/0204033, 2002, section 3:
       a superposition of relaxation processes.
    """
    slowest = 1 / (_SLOWEST * (time_s[-1] - time_s[0]))
    fastest = 1 / float(np.diff(time_s).min())
    count = 2 + int(np.log(fastest / slowest) / _EFOLDS)
    rates: Array = np.geomspace(slowest, fastest, count)
    return rates
