"""Noise that is added to simulated traces: white, autocorrelated, a drift, and outliers."""

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.keys import Block, Complaint, OneOf

# Relaxation times of flicker noise are so many e-folds apart, or less: its spectrum is 1/f to
# within 2 exp(-pi^2 / 1.5) = 0.3 %, as Poisson's summation has it.
_EFOLDS_APART = 1.5
# Longest relaxation time over the length of the trace: slower processes are offsets.
_LONGEST_TIME = 3.0

_HALF_WIDTH = np.sqrt(3.0)

KINDS: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "gaussian": lambda rng, count: rng.standard_normal(count),
    "uniform": lambda rng, count: rng.uniform(-_HALF_WIDTH, _HALF_WIDTH, count),
}
"""Distributions of white noise: functions that draw numbers of unit variance."""


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


@dataclass(frozen=True)
class Noise(Block):
    """Noise added to the noise-free trace; components beside white noise can be combined."""

    kind: Annotated[str, OneOf(KINDS)]
    """Distribution of what is white of the noise."""
    level: Annotated[float, Field(ge=0, le=10)]
    """Standard deviation of the noise, as a share of the reference."""
    reference: Annotated[str, OneOf(("peak", "signal"))]
    """Reference of `level`. `peak`: the largest reading of the noise-free trace, the same noise
    everywhere; `signal`: the noise-free reading at each instant."""
    level_rad: Annotated[float | None, Field(ge=0, le=1e12)] = None
    """Standard deviation of the noise as an instrument has it, the same whatever the sample, e.g.
    3.0e-6. Where it is given, `level` does not count."""
    ar1: AR1 | None = None
    """Autocorrelated component, AR(1); Gaussian. By default none."""
    flicker: Flicker | None = None
    """Component of spectrum 1/f; Gaussian. By default none."""
    drift: Drift | None = None
    """A drift in addition. By default none."""
    outliers: Outliers | None = None
    """Outliers in addition. By default none."""

    def complaints(self) -> Iterator[Complaint]:
        """Find components whose shares exceed one together."""
        shares = [part.share for part in (self.ar1, self.flicker) if part is not None]
        if sum(shares) > 1:
            text = f"found {sum(shares):g} with that of ar1, allowed is at most 1 together."
            yield ("flicker", "share"), text

    @property
    def white(self) -> bool:
        """True if readings have independent noise without drift and outliers."""
        return not (self.ar1 or self.flicker or self.drift or self.outliers)

    @property
    def absent(self) -> bool:
        """True if the noise level is zero."""
        return not (self.level if self.level_rad is None else self.level_rad)


def add_noise(
    readings: Array, noise: Noise, rng: np.random.Generator, time_s: Array | None = None
) -> Array:
    """Return a noisy copy of a trace, (n_samples,).

    Ascending sampling times, (n_samples,), are required unless the noise is white.

    Raises
    ------
    ValueError
        If the times are required and missing.
    """
    unit = KINDS[noise.kind](rng, len(readings))
    if not noise.white:
        if time_s is None:
            raise ValueError("noise with parts that are not white needs the sampling times")
        unit = _with_parts(unit, time_s, noise, rng)
    noisy: Array = readings + standard_deviation(readings, noise) * unit
    return noisy


def _with_parts(unit: Array, time_s: Array, noise: Noise, rng: np.random.Generator) -> Array:
    """Replace shares of white noise by autocorrelated noise, and add drift and outliers."""
    shares = [part.share for part in (noise.ar1, noise.flicker) if part is not None]
    unit = np.sqrt(max(0.0, 1 - sum(shares))) * unit
    if noise.ar1 is not None:
        weight, rate = np.array([noise.ar1.share]), np.array([1 / noise.ar1.time_s])
        unit += draw_ornstein_uhlenbeck(time_s, weight, rate, rng)
    if noise.flicker is not None:
        rates = flicker_rates(time_s)
        unit += draw_ornstein_uhlenbeck(
            time_s, np.full(len(rates), noise.flicker.share / len(rates)), rates, rng
        )
    if noise.drift is not None:
        course = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
        unit += rng.choice((-1, 1)) * noise.drift.rise * course
    if noise.outliers is not None:
        struck = rng.random(len(time_s)) < noise.outliers.share
        unit += struck * noise.outliers.size * rng.standard_normal(len(time_s))
    return unit


def standard_deviation(readings: Array, noise: Noise) -> Array:
    """Return the noise's standard deviation at every reading of a noise-free trace.

    Drift and outliers are not included.
    """
    magnitude = np.abs(readings)
    if noise.level_rad is not None:
        return np.full_like(magnitude, noise.level_rad)
    scale = magnitude if noise.reference == "signal" else np.full_like(magnitude, magnitude.max())
    return noise.level * scale


def rms(values: Array) -> float:
    """Return the root mean square of values."""
    return float(np.sqrt(np.mean(np.square(values))))


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
    slowest = 1 / (_LONGEST_TIME * (time_s[-1] - time_s[0]))
    fastest = 1 / float(np.diff(time_s).min())
    count = 2 + int(np.log(fastest / slowest) / _EFOLDS_APART)
    return np.geomspace(slowest, fastest, count)


def stream(study_seed: int, case: str, seed: int, purpose: str) -> np.random.Generator:
    """Return the generator of one purpose, e.g. ``"noise"``, of one seed of one case.

    Its seed sequence is a child of the study's seed, with a spawn key made of the names
    and numbers alone: no other case or seed, and no order of jobs, can change it.
    """
    key = (*_words(case), seed, *_words(purpose))
    return np.random.default_rng(np.random.SeedSequence(study_seed, spawn_key=key))


def _words(name: str) -> tuple[int, ...]:
    digest = hashlib.sha256(name.encode()).digest()[:16]
    return tuple(int.from_bytes(digest[i : i + 4], "big") for i in range(0, 16, 4))
