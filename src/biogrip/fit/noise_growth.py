"""Noise that grows with the rotation: a test for it, and its standard deviation.

The test ranks the sizes of residuals against those of the rotation, so that outliers count no
more than other readings [1]_. The standard deviation is that of two independent parts, one the
same everywhere and one proportional to the rotation. Their shares are those of highest
likelihood under Student's t distribution, which bounds the influence of outliers [2]_.

References
----------
.. [1] C. Spearman, The proof and measurement of association between two things, American Journal
   of Psychology 15 (1904), 72-101.
.. [2] K. L. Lange, R. J. A. Little and J. M. G. Taylor, Robust statistical modeling using the t
   distribution, Journal of the American Statistical Association 84 (1989), 881-896.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.outliers import GAUSSIAN, measure_distances

# Significance level: share of traces with the same noise everywhere in which it seems to grow.
_FALSE_ALARM = 0.003
# Degrees of freedom of Student's t; logarithms of least and largest odds of the growing part.
_TAILS, _LEAST, _MOST = 4.0, -9.0, 20.0


def compute_growth(residual: Array, rotation_rad: Array) -> Array:
    """Compute how the noise grows with the rotation.

    Parameters
    ----------
    residual : (n_samples,)
        Residuals of a fit.
    rotation_rad : (n_samples,)
        Rotation of the fit.

    Returns
    -------
    (n_samples,)
        Standard deviation of the noise over its root mean square; ones if it does not grow.
    """
    from scipy.optimize import minimize_scalar

    apart, size = measure_distances(residual), np.abs(rotation_rad)
    if not _grows(apart, size):
        return np.ones(len(residual))
    found = minimize_scalar(
        lambda odds: _deviance(apart, _growth(odds, size)), bounds=(_LEAST, _MOST)
    )
    return _growth(float(found.x), size)


def _grows(apart: Array, size: Array) -> bool:
    from scipy.stats import spearmanr

    if np.ptp(apart) == 0 or np.ptp(size) == 0:
        return False
    return bool(spearmanr(size, apart, alternative="greater").pvalue < _FALSE_ALARM)


def _growth(log_odds: float, size: Array) -> Array:
    share = 1 / (1 + np.exp(-log_odds))
    growth: Array = np.sqrt(1 - share + share * size**2 / np.mean(size**2))
    return growth


def _deviance(apart: Array, growth: Array) -> float:
    """Return minus Student's log-likelihood, with the scale that the median tells."""
    standard = apart / growth
    scale = np.median(standard[standard > 0]) / GAUSSIAN
    kernel = 0.5 * (_TAILS + 1) * np.log1p((standard / scale) ** 2 / _TAILS)
    return float(np.sum(np.log(growth * scale) + kernel))
