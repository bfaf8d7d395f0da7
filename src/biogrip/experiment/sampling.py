"""Sampling times of the rotation."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.experiment.protocol import sample_times
from biogrip.keys import Block


@dataclass(frozen=True)
class Burst(Block):
    """Successive readings at a rate of their own."""

    from_s: Annotated[float, Field(ge=0, le=1e9)]
    """Time of its first reading."""
    rate_Hz: Annotated[float, Field(ge=1e-9, le=1e9)]
    """Rate within the burst."""
    samples: Annotated[int, Field(ge=1, le=10_000_000)]
    """Number of readings."""

    @property
    def times_s(self) -> Array:
        """Sampling times in s, (n_samples,)."""
        return self.from_s + np.arange(self.samples) / self.rate_Hz


@dataclass(frozen=True)
class Sampling:
    """Sampling of the rotation: a uniform rate, listed times, or bursts."""

    rate_Hz: float = 0.0
    """Uniform rate, from 0 to the end of the protocol."""
    times_s: tuple[float, ...] = ()
    """Sampling times, instead of a rate."""
    bursts: tuple[Burst, ...] = ()
    """Bursts, instead of a rate."""

    def over(self, end_s: float) -> Array:
        """Return the sampling times in s, (n_samples,), of a protocol that ends at `end_s`."""
        if self.bursts:
            return np.concatenate([burst.times_s for burst in self.bursts])
        if self.times_s:
            return np.array(self.times_s, dtype=float)
        return sample_times(end_s, self.rate_Hz)
