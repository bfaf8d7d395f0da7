"""What the instrument records: the rotation with noise on it."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from biogrip.arrays import Array
from biogrip.keys import Key


@dataclass(frozen=True)
class Noise:
    """Noise added to the noise-free rotation."""

    kind: Annotated[str, Key("Distribution of the noise.", choices=("gaussian", "uniform"))]
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

    @property
    def absent(self) -> bool:
        """Whether there is none."""
        return not (self.level if self.level_rad is None else self.level_rad)


def add_noise(rotation_rad: Array, noise: Noise, rng: np.random.Generator) -> Array:
    """Return a noisy copy of a trace.

    Parameters
    ----------
    rotation_rad : (n_samples,)
        Noise-free rotation.
    noise
        What to add.
    rng
        The stream to draw from.

    Returns
    -------
    (n_samples,)
    """
    if noise.kind == "uniform":
        half_width = np.sqrt(3.0)
        unit = rng.uniform(-half_width, half_width, size=len(rotation_rad))
    else:
        unit = rng.standard_normal(len(rotation_rad))
    noisy: Array = rotation_rad + standard_deviation(rotation_rad, noise) * unit
    return noisy


def standard_deviation(rotation_rad: Array, noise: Noise) -> Array:
    """Return the noise's standard deviation in rad at every sample of a noise-free trace.

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
