"""What the instrument records: the rotation with noise on it."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array


@dataclass(frozen=True)
class Noise:
    """Noise added to the noise-free rotation.

    Parameters
    ----------
    kind
        ``"gaussian"`` or ``"uniform"``.
    level
        Standard deviation as a share of the reference, for either kind.
    reference
        ``"peak"``: the largest noise-free rotation; ``"signal"``: the
        noise-free rotation at each instant.
    level_rad
        Standard deviation in rad, instead of the level: an instrument's, whatever the sample.
    """

    kind: str
    level: float | None
    reference: str
    level_rad: float | None = None

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
    if noise.level_rad is not None or noise.level is None:
        return np.full_like(magnitude, noise.level_rad or 0.0)
    scale = magnitude if noise.reference == "signal" else np.full_like(magnitude, magnitude.max())
    deviation: Array = noise.level * scale
    return deviation


def rms(values: Array) -> float:
    """Root mean square over the samples."""
    return float(np.sqrt(np.mean(np.square(values))))
