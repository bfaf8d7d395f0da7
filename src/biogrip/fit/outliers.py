"""Outliers: readings of a trace with far more noise than the others."""

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.response.noise_estimate import ROOT_12

FAR = 4.5
"""Threshold in standard deviations of the noise, exceeded by one Gaussian reading in 150,000."""

GAUSSIAN = 0.6744897501960817
"""Median absolute deviation of a normal distribution, in standard deviations."""

# Width of the running median that follows slow noise.
_AROUND = 11


def outliers_of(residual: Array, rounding_rad: float = 0.0) -> BoolArray:
    """Find outliers among residuals by a Hampel filter [1]_.

    Parameters
    ----------
    residual : (n_samples,)
        Residuals of a fit, over the noise's standard deviation where that is not the same.
    rounding_rad
        Step of the readings: a reading on the next step is no outlier.

    Returns
    -------
    (n_samples,)
        True where a residual is further than `FAR` from the median of eleven, in standard
        deviations estimated from the median of all such distances, and no less than those of
        rounding errors.

    References
    ----------
    .. [1] F. R. Hampel, The influence curve and its role in robust estimation, Journal of the
       American Statistical Association 69 (1974), 383-393.
    """
    apart = measure_distances(residual)
    # One residual in eleven is that median itself.
    others = apart[apart > 0]
    if not len(others):
        return np.zeros(len(residual), dtype=bool)
    scale = max(float(np.median(others)) / GAUSSIAN, rounding_rad / ROOT_12)
    found: BoolArray = apart > FAR * scale
    return found


def measure_distances(residual: Array) -> Array:
    """Measure how far residuals are from the median of the eleven around, (n_samples,)."""
    from scipy.ndimage import median_filter

    apart: Array = np.abs(residual - median_filter(residual, _AROUND, mode="mirror"))
    return apart
