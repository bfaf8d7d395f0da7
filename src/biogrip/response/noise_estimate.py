"""Noise of a trace, estimated without a model, and the rounding of its readings."""

import numpy as np

from biogrip.arrays import Array

ROOT_12 = np.sqrt(12.0)
"""Step of rounded readings over the standard deviation of the rounding errors."""

# Shares of equal neighbours from which on readings are rounded, and of second differences that are
# none of jumps; the error of the written digits, in steps.
_OFTEN, _ALL_BUT_JUMPS, _MULTIPLE = 0.05, 0.98, 0.05


def estimate_noise(rotation_rad: Array, rounding_rad: float | None = None) -> float:
    """Estimate the standard deviation of white noise on a smooth trace without a model.

    The median of second differences is used, on which slopes and jumps of a protocol have
    next to no effect. Where an instrument rounds so coarsely that neighbouring readings are often
    the same, it is their mean square without the largest, and no less than the rounding errors'
    [1]_. Of a trace without noise the estimate is tiny.

    Parameters
    ----------
    rotation_rad : (n_samples,)
        Trace, or what a fit leaves of it.
    rounding_rad
        Step of the readings; by default that of `rotation_rad`.

    References
    ----------
    .. [1] B. Widrow, I. Kollar and M.-C. Liu, Statistical theory of quantization, IEEE Transactions
       on Instrumentation and Measurement 45 (1996), 353-361: step over the root of 12.
    """
    second = np.abs(np.diff(rotation_rad, 2))
    # Gaussian: the median is 0.6745 standard deviations, and those of second differences sqrt 6.
    noise = float(np.median(second)) / (0.6745 * np.sqrt(6.0)) if len(second) else 0.0
    step = measure_rounding(rotation_rad) if rounding_rad is None else rounding_rad
    if len(second) and step:
        most = second[second <= np.quantile(second, _ALL_BUT_JUMPS)]
        noise = max(float(np.sqrt(np.mean(most**2) / 6)), step / ROOT_12)
    return max(noise, 1e-9 * float(np.max(np.abs(rotation_rad))))


def measure_rounding(rotation_rad: Array) -> float:
    """Return the step in rad that the readings of a trace are multiples of.

    It is zero if neighbouring readings are seldom the same: rounding is then not seen beside the
    noise.
    """
    same = np.count_nonzero(rotation_rad[1:] == rotation_rad[:-1])
    if same < max(1.0, _OFTEN * len(rotation_rad)):
        return 0.0
    apart = np.diff(np.unique(rotation_rad))
    step = float(apart.min()) if len(apart) else 0.0
    multiples = apart / step if step else apart
    return step if np.all(np.abs(multiples - np.rint(multiples)) < _MULTIPLE) else 0.0
