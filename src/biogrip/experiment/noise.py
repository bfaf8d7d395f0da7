"""What the instrument records: the rotation with noise on it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.noise_parts import (
    Drift,
    Flicker,
    Outliers,
    Relaxing,
    flicker_rates,
    remembering,
)
from biogrip.keys import Key, Problem

_HALF_WIDTH = np.sqrt(3.0)

KINDS: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "gaussian": lambda rng, count: rng.standard_normal(count),
    "uniform": lambda rng, count: rng.uniform(-_HALF_WIDTH, _HALF_WIDTH, count),
}
"""Distributions that white noise may have: of each, what draws numbers of unit variance."""


@dataclass(frozen=True)
class Noise:
    """Noise added to the noise-free rotation; what it has beside white noise can be combined."""

    kind: Annotated[str, Key("Distribution of what is white of the noise.", choices=tuple(KINDS))]
    level: Annotated[
        float,
        Key("Standard deviation of the noise, as a share of the reference.", low=0, high=10),
    ]
    reference: Annotated[
        str,
        Key(
            "What `level` is a share of. `peak`: the largest rotation of the noise-free trace, the "
            "same noise everywhere; `signal`: the noise-free rotation at each instant.",
            choices=("peak", "signal"),
        ),
    ]
    level_rad: Annotated[
        float | None,
        Key(
            "Standard deviation of the noise as an instrument has it, the same whatever the "
            "sample, e.g. 3.0e-6. Where it is given, `level` does not count.",
            "rad",
            low=0,
            high=10,
        ),
    ] = None
    relaxing: Annotated[
        Relaxing | None, Key("A part that remembers, AR(1); Gaussian. By default none.")
    ] = None
    flicker: Annotated[
        Flicker | None, Key("A part of spectrum 1/f; Gaussian. By default none.")
    ] = None
    drift: Annotated[Drift | None, Key("A drift in addition. By default none.")] = None
    outliers: Annotated[Outliers | None, Key("Outliers in addition. By default none.")] = None

    def problems(self) -> Iterator[Problem]:
        """Find parts that are more than the whole."""
        shares = [part.share for part in (self.relaxing, self.flicker) if part is not None]
        if sum(shares) > 1:
            text = f"found {sum(shares):g} with that of relaxing, allowed is at most 1 together."
            yield ("flicker", "share"), text

    @property
    def white(self) -> bool:
        """Whether samples are independent and alike in distribution."""
        return not (self.relaxing or self.flicker or self.drift or self.outliers)

    @property
    def absent(self) -> bool:
        """Whether there is none."""
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
        What to add.
    rng
        The stream to draw from.
    time_s : (n_samples,), optional
        Sampling times, ascending, which only noise that is not white asks for.

    Returns
    -------
    (n_samples,)

    Raises
    ------
    ValueError
        If the times are needed.
    """
    unit = KINDS[noise.kind](rng, len(rotation_rad))
    if not noise.white:
        if time_s is None:
            raise ValueError("noise with parts that are not white needs the sampling times")
        unit = _with_parts(unit, time_s, noise, rng)
    noisy: Array = rotation_rad + standard_deviation(rotation_rad, noise) * unit
    return noisy


def _with_parts(unit: Array, time_s: Array, noise: Noise, rng: np.random.Generator) -> Array:
    """Let parts that remember take the place of white noise, and add drift and outliers."""
    shares = [part.share for part in (noise.relaxing, noise.flicker) if part is not None]
    unit = np.sqrt(max(0.0, 1 - sum(shares))) * unit
    if noise.relaxing is not None:
        weight, rate = np.array([noise.relaxing.share]), np.array([1 / noise.relaxing.time_s])
        unit += remembering(time_s, weight, rate, rng)
    if noise.flicker is not None:
        rates = flicker_rates(time_s)
        unit += remembering(
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
    """Return the noise's standard deviation in rad at every sample of a noise-free trace.

    Without what drift and outliers add.

    Parameters
    ----------
    rotation_rad : (n_samples,)
        Noise-free rotation.
    noise
        What is added to it.

    Returns
    -------
    (n_samples,)
    """
    magnitude = np.abs(rotation_rad)
    if noise.level_rad is not None:
        return np.full_like(magnitude, noise.level_rad)
    scale = magnitude if noise.reference == "signal" else np.full_like(magnitude, magnitude.max())
    deviation: Array = noise.level * scale
    return deviation


def rms(values: Array) -> float:
    """Root mean square over the samples."""
    return float(np.sqrt(np.mean(np.square(values))))
