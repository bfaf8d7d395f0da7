"""A line in the spectrum of what a fit leaves: hum of the mains, a vibration.

The largest ordinate of the periodogram of white noise has Fisher's distribution [1]_. A sine of
many periods, fitted to the residuals near the frequency of an ordinate that is larger, is a line.

References
----------
.. [1] R. A. Fisher, Tests of significance in harmonic analysis, Proceedings of the Royal Society
   of London A 125 (1929), 54-59.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array

# Fewest periods in a trace: what is slower may be a misfit of the model.
_PERIODS = 10
# Largest difference of intervals, as a share, that has no effect on a frequency.
_EVEN = 0.01
# Frequencies tried around the largest ordinate, within one of its intervals on either side.
_TRIED = np.linspace(-1.0, 1.0, 81)


@dataclass(frozen=True)
class Line:
    """A sine in the residuals of a fit."""

    frequency_Hz: float
    """Its frequency."""
    amplitude: float
    """Its amplitude in the unit of the residuals."""
    chance: float
    """Chance of as much in white noise, at any frequency."""
    left: Array
    """Residuals without it, (n_samples,)."""
    basis: Array
    """Cosine and sine as orthonormal rows, (2, n_samples)."""


def find_line(residual: Array, time_s: Array) -> Line | None:
    """Return the strongest sine in residuals, (n_samples,), of evenly spaced times; else None."""
    n, apart = len(residual), np.diff(time_s)
    if n < 4 * _PERIODS or np.ptp(apart) > _EVEN * np.median(apart):
        return None
    power = np.abs(np.fft.rfft(residual)[1 : (n + 1) // 2]) ** 2
    strongest = _PERIODS - 1 + int(np.argmax(power[_PERIODS - 1 :]))
    share = power[strongest] / np.sum(power)
    lasts_s = n * float(np.mean(apart))
    best: tuple[float, float, Array] = (-1.0, 0.0, np.zeros((2, n)))
    for frequency in ((strongest + 1 + _TRIED) / lasts_s).tolist():
        angle = 2 * np.pi * frequency * time_s
        basis = np.linalg.qr(np.stack((np.cos(angle), np.sin(angle)), axis=1))[0].T
        best = max(best, (float(np.sum((basis @ residual) ** 2)), frequency, basis), key=_first)
    taken, frequency, basis = best
    amplitude = float(np.sqrt(2 * taken / n))
    chance = min(len(power) * float((1 - share) ** (len(power) - 1)), 1.0)
    return Line(frequency, amplitude, chance, residual - (basis @ residual) @ basis, basis)


def _first(pair: tuple[float, float, Array]) -> float:
    return pair[0]
