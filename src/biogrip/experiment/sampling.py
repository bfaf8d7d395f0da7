"""Sampling times of the rotation."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import sample_times
from biogrip.keys import Key


@dataclass(frozen=True)
class Burst:
    """Successive readings at a rate of their own."""

    from_s: Annotated[float, Key("Time of its first reading.", "s", low=0, high=1e9)]
    rate_Hz: Annotated[float, Key("Rate within the burst.", "Hz", low=1e-9, high=1e9)]
    samples: Annotated[int, Key("Number of readings.", low=1, high=10_000_000)]

    @property
    def times_s(self) -> Array:
        """Sampling times in s, (n_samples,)."""
        return self.from_s + np.arange(self.samples) / self.rate_Hz


@dataclass(frozen=True)
class Sampling:
    """Sampling of the rotation: a uniform rate, listed times, or bursts.

    Parameters
    ----------
    rate_Hz
        Uniform rate, from 0 to the end of the protocol.
    times_s
        Sampling times, instead of a rate.
    bursts
        Bursts, instead of a rate.
    """

    rate_Hz: float = 0.0
    times_s: tuple[float, ...] = ()
    bursts: tuple[Burst, ...] = ()

    def over(self, end_s: float) -> Array:
        """Return the sampling times in s, (n_samples,), of a protocol that ends at `end_s`."""
        if self.bursts:
            return np.concatenate([burst.times_s for burst in self.bursts])
        if self.times_s:
            return np.array(self.times_s, dtype=float)
        return sample_times(end_s, self.rate_Hz)
