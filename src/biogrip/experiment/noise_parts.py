"""Components of noise beside white noise: autocorrelated noise, a drift, and outliers."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.keys import Block

# Relaxation times of flicker noise are so many e-folds apart, or less: its spectrum is 1/f to
# within 2 exp(-pi^2 / 1.5) = 0.3 %, as Poisson's summation has it.
_EFOLDS = 1.5
# Longest relaxation time over the length of the trace: slower processes are offsets.
_SLOWEST = 3.0


@dataclass(frozen=True)
class AR1(Block):
    """Ornstein-Uhlenbeck noise of one relaxation time, of spectrum 1/(1 + (2 pi f tau)^2)."""

    share: Annotated[float, Field(gt=0, le=1)]
    """Share of the noise's variance."""
    time_s: Annotated[float, Field(gt=0, le=1e9)]
    """Time after which its correlation has fallen to 1/e. Of samples an interval h apart it is an
    AR(1) process with the coefficient exp(-h / time_s)."""


@dataclass(frozen=True)
class Flicker(Block):
    """Noise of spectrum 1/f over all frequencies of the trace."""

    share: Annotated[float, Field(gt=0, le=1)]
    """Share of the noise's variance."""


@dataclass(frozen=True)
class Drift(Block):
    """A drift linear in time, upwards or downwards at random."""

    rise: Annotated[float, Field(gt=0, le=1000)]
    """Change from the first reading to the last, in standard deviations of the noise."""


@dataclass(frozen=True)
class Outliers(Block):
    """Readings with far more noise than others."""

    share: Annotated[float, Field(gt=0, le=0.5)]
    """Share of the samples, at random."""
    size: Annotated[float, Field(gt=0, le=1000)]
    """Standard deviation of their additional noise, in standard deviations of the noise."""


def draw_ornstein_uhlenbeck(
    time_s: Array, weights: Array, rates_per_s: Array, rng: np.random.Generator
) -> Array:
    """Draw a sum of independent Ornstein-Uhlenbeck processes, exactly, at any times, (n_times,).

    From reading to reading, each is an AR(1) process [1]_. Weights are the variance of each, rates
    the inverse of its relaxation time, (n_processes,).

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
    # One product per reading: the order of its sums does not depend on the number of readings.
    return (states[:, None] @ np.sqrt(weights)[:, None])[:, 0, 0]


def flicker_rates(time_s: Array) -> Array:
    """Return rates in 1/s of processes whose sum has the spectrum 1/f [1]_, (n_processes,).

    A geometric series for Ornstein-Uhlenbeck processes of the same variance, which cover all
    frequencies of ascending times.

    References
    ----------
    .. [1] E. Milotti, 1/f noise: a pedagogical review, arXiv:physics/0204033, 2002, section 3:
       a superposition of relaxation processes.
    """
    slowest = 1 / (_SLOWEST * (time_s[-1] - time_s[0]))
    fastest = 1 / float(np.diff(time_s).min())
    count = 2 + int(np.log(fastest / slowest) / _EFOLDS)
    return np.geomspace(slowest, fastest, count)
