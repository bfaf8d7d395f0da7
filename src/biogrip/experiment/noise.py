"""Noise that is added to simulated rotations."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.experiment.noise_parts import (
    AR1,
    Drift,
    Flicker,
    Outliers,
    draw_ornstein_uhlenbeck,
    flicker_rates,
)
from biogrip.keys import Block, OneOf, Problem

_HALF_WIDTH = np.sqrt(3.0)

KINDS: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "gaussian": lambda rng, count: rng.standard_normal(count),
    "uniform": lambda rng, count: rng.uniform(-_HALF_WIDTH, _HALF_WIDTH, count),
}
"""Distributions of white noise: functions that draw numbers of unit variance."""


@dataclass(frozen=True)
class Noise(Block):
    """Noise added to the noise-free rotation; components beside white noise can be combined."""

    kind: Annotated[str, OneOf(KINDS)]
    """Distribution of what is white of the noise."""
    level: Annotated[float, Field(ge=0, le=10)]
    """Standard deviation of the noise, as a share of the reference."""
    reference: Annotated[str, OneOf(("peak", "signal"))]
    """Reference of `level`. `peak`: the largest rotation of the noise-free trace, the same noise
    everywhere; `signal`: the noise-free rotation at each instant."""
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

    def problems(self) -> Iterator[Problem]:
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
    rotation_rad: Array, noise: Noise, rng: np.random.Generator, time_s: Array | None = None
) -> Array:
    """Return a noisy copy of a trace.

    Parameters
    ----------
    rotation_rad : (n_samples,)
        Noise-free rotation.
    noise
        Noise to add.
    rng
        Random generator.
    time_s : (n_samples,), optional
        Ascending sampling times, required unless the noise is white.

    Returns
    -------
    (n_samples,)

    Raises
    ------
    ValueError
        If the times are required and missing.
    """
    unit = KINDS[noise.kind](rng, len(rotation_rad))
    if not noise.white:
        if time_s is None:
            raise ValueError("noise with parts that are not white needs the sampling times")
        unit = _with_parts(unit, time_s, noise, rng)
    noisy: Array = rotation_rad + standard_deviation(rotation_rad, noise) * unit
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


def standard_deviation(rotation_rad: Array, noise: Noise) -> Array:
    """Return the noise's standard deviation in rad at every reading of a noise-free trace.

    Drift and outliers are not included.
    """
    magnitude = np.abs(rotation_rad)
    if noise.level_rad is not None:
        return np.full_like(magnitude, noise.level_rad)
    scale = magnitude if noise.reference == "signal" else np.full_like(magnitude, magnitude.max())
    return noise.level * scale


def rms(values: Array) -> float:
    """Return the root mean square of values."""
    return float(np.sqrt(np.mean(np.square(values))))
