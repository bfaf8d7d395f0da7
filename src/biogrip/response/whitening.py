"""Noise that remembers made white: sums of squares that weigh each frequency by its noise.

The correlation of noise is taken for a sum of exponentials of the time between two
samples, beside what is white: one of any relaxation time, and a geometric series of
them, which is 1/f noise. Its matrix C then has a Cholesky factor L that is found, and
solved with, in as many steps as there are samples [1]_. What is L^-1 r of residuals r
is as large as r in the mean, and white, so that all that fits and judges white
residuals does it with these: generalised least squares [2]_.

References
----------
.. [1] D. Foreman-Mackey, E. Agol, S. Ambikasaran and R. Angus, Fast and scalable Gaussian
   process modeling with applications to astronomical time series, The Astronomical Journal 154
   (2017), 220: celerite.
.. [2] A. C. Aitken, On least squares and linear combination of observations, Proceedings of the
   Royal Society of Edinburgh 55 (1936), 42-48.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.noise_parts import flicker_rates
from biogrip.response.nuisance import with_uncertain, without

MOST_SAMPLES = 50_000
"""In coloured noise each sample weighs differently, and few cannot stand for all."""


@dataclass(frozen=True)
class Colour:
    """What share of a noise's variance remembers, and how long.

    Parameters
    ----------
    relaxing
        Share that is forgotten with one time constant.
    time_s
        That time.
    flicker
        Share of spectrum 1/f. The rest is white.
    """

    relaxing: float
    time_s: float
    flicker: float

    @property
    def white(self) -> float:
        """Share that is white."""
        return 1 - self.relaxing - self.flicker


class Whitening:
    """Turns noise of a colour into white noise of the same variance, and takes a nuisance out.

    Parameters
    ----------
    time_s : (n_samples,)
        Ascending sampling times.
    colour
        Of the noise.
    nuisance : (n_functions, n_samples)
        What the instrument may have added, with whatever amplitude.
    uncertain : (n_functions, n_samples), optional
        What is added with an amplitude that is known about, see `with_uncertain`.
    """

    def __init__(
        self, time_s: Array, colour: Colour, nuisance: Array, uncertain: Array | None = None
    ) -> None:
        # Celerite has taken a tenth of a second to load.
        from celerite2 import driver

        flicker = flicker_rates(time_s)
        rates = np.append(1 / colour.time_s, flicker)
        shares = np.append(colour.relaxing, np.full(len(flicker), colour.flicker / len(flicker)))
        self._solve = driver.solve_lower
        self._time_s, self._rates = np.ascontiguousarray(time_s, float), rates
        self._left = np.tile(shares, (len(time_s), 1))
        ones = np.ones_like(self._left)
        # What is white keeps the matrix regular, however little of it there is.
        diagonal = np.full(len(time_s), 1.0)
        pivots, self._right = driver.factor(
            self._time_s, rates, diagonal, self._left, ones, np.empty_like(diagonal), ones.copy()
        )
        self._deviations = np.sqrt(pivots)
        self.log_determinant = float(np.sum(np.log(pivots)))
        """Of the correlation matrix."""
        self.nuisance = self._white(nuisance, uncertain)
        """What is taken out, white, (n_functions, n_samples)."""

    def __call__(self, rows: Array) -> Array:
        """Whiten functions of time, shape (..., n_samples), and take the nuisance out."""
        return without(self.nuisance, self._whitened(rows))

    def _white(self, nuisance: Array, uncertain: Array | None) -> Array:
        if not len(nuisance) and uncertain is None:
            return nuisance
        basis = np.linalg.qr(self._whitened(nuisance).T)[0].T
        known = nuisance[:0] if uncertain is None else self._whitened(uncertain)
        return with_uncertain(basis, known)

    def _whitened(self, rows: Array) -> Array:
        columns = np.ascontiguousarray(rows.reshape(-1, rows.shape[-1]).T)
        solved = self._solve(
            self._time_s, self._rates, self._left, self._right, columns, np.empty_like(columns)
        )
        white: Array = (solved / self._deviations[:, None]).T.reshape(rows.shape)
        return white
