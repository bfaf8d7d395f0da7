"""When the rotation is sampled."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import sample_times


@dataclass(frozen=True)
class Sampling:
    """When the rotation is sampled.

    Parameters
    ----------
    rate_Hz
        Uniform rate, from 0 to the end of the protocol.
    times_s
        Instants, instead.
    """

    rate_Hz: float
    times_s: tuple[float, ...] = ()

    def over(self, end_s: float) -> Array:
        """Sampling instants in s, (n_samples,), of a protocol that ends then."""
        return (
            np.array(self.times_s, dtype=float)
            if self.times_s
            else sample_times(end_s, self.rate_Hz)
        )
