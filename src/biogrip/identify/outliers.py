"""Samples of a trace that have far more noise than the others."""

import numpy as np

from biogrip.arrays import Array, BoolArray

FAR = 4.5
"""In standard deviations of the noise: of a Gaussian, one sample in 150,000."""

# Samples around, whose median is what slow noise has at a sample, and gaussian MAD.
_AROUND = 11
_GAUSSIAN = 0.6744897501960817


def outliers_of(residual: Array) -> BoolArray:
    """Find the samples that stand out from those around them [1]_.

    Parameters
    ----------
    residual : (n_samples,)
        What a fit leaves of a trace.

    Returns
    -------
    (n_samples,)
        Whether a sample is further than `FAR` from the median of eleven, in units of the
        median of all such distances.

    References
    ----------
    .. [1] F. R. Hampel, The influence curve and its role in robust estimation, Journal of the
       American Statistical Association 69 (1974), 383-393.
    """
    from scipy.ndimage import median_filter

    apart = np.abs(residual - median_filter(residual, _AROUND, mode="nearest"))
    # One sample in eleven is that median itself.
    others = apart[apart > 0]
    if not len(others):
        return np.zeros(len(residual), dtype=bool)
    found: BoolArray = apart > FAR * np.median(others) / _GAUSSIAN
    return found
