"""From near an optimum to its last digits, for many fits at once.

Descents compare sums of squares, and so find an optimum to half the digits; where
the gradient vanishes can be found to all of them. Gauss-Newton steps need not lead
there: of an element too weak to be seen, only second derivatives of the residuals
tell how the gradient changes. So the steps are Newton's, with second derivatives
from differences of exact gradients; the last ones, with gradients from all samples.

References
----------
.. [1] J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed., Springer, 2006, section
   3.4: Newton's method with the moduli of the curvatures.
"""

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.identify.levenberg_marquardt import Minima, Normal, bounded_step, minimized
from biogrip.identify.local_fit import on_all_samples
from biogrip.identify.many_fits import ManyFits

# Differences leave second derivatives an error of some 1e-6: of a step, so much is left to the
# next. Whether a step is below 1e-7 every machine sees alike, and what is left is rounding.
_DIFFERENCE = 1e-3
_NEARLY_SETTLED = 1e-7
_MOST_STEPS, _MOST_STEPS_ON_ALL_SAMPLES = 6, 3
# Along a curved valley a minimum must first be approached, with steps damped if need be.
_CLOSE, _DAMPING = 1e-12, 1e-6
# E-folds; what has converged has no further to go.
_LONGEST_STEP = 1.0
# Of a direction's curvature, over those of single parameters; and of the latter.
_FLAT, _SMALLEST = 1e-10, 1e-150
# Share of a sum of squares that may be rounding.
_ROUNDING = 1e-11


def settled(fits: ManyFits, found: Minima, trace: IntArray) -> Minima:
    """Take Newton's steps until optima stand still to the last digits.

    Parameters
    ----------
    fits
        The traces.
    found
        Optima, fitted with the finest tolerance.
    trace : (n,)
        Which trace each was fitted to.

    Returns
    -------
    Minima
        Optima with the misfits of all samples, and evaluations since they were found;
        branches named in the order in which they relax.
    """
    low, high = (np.broadcast_to(bound, found.x.shape) for bound in (fits.low, fits.high))
    closer = minimized(
        lambda x, fit: _curved(fits, x, trace[fit]), found.x, low, high, _CLOSE, damping=_DAMPING
    )
    by_differences = 1 + 2 * found.x.shape[1]
    x, evaluations = closer.x.copy(), closer.evaluations * by_differences
    moving = np.arange(len(x))
    for _ in range(_MOST_STEPS):
        here = x[moving]
        step = _newton_step(fits, _curved(fits, here, trace[moving]), here)
        x[moving] = np.clip(here + step, fits.low, fits.high)
        evaluations[moving] += by_differences
        moving = moving[np.max(np.abs(step), axis=1) >= _NEARLY_SETTLED]
        if not len(moving):
            break
    before, after = fits.normal(closer.x, trace), fits.normal(x, trace)
    lost = ~(after.square_sum <= before.square_sum * (1 + _ROUNDING))
    x[lost] = closer.x[lost]
    curved = _curved(fits, x, trace)
    evaluations += 2 + by_differences
    misfit_rad = np.empty(len(x))
    for fit in range(len(x)):
        own = curved.of(np.array([fit]))
        for _ in range(_MOST_STEPS_ON_ALL_SAMPLES):
            own.gradient[0], misfit_rad[fit] = on_all_samples(fits.problems[trace[fit]], x[fit])
            evaluations[fit] += 1
            step = _newton_step(fits, own, x[fit : fit + 1])[0]
            if lost[fit]:
                break
            x[fit] = np.clip(x[fit] + step, fits.low, fits.high)
            if np.max(np.abs(step)) < _NEARLY_SETTLED:
                break
    order = fits.problems[0].residuals.model.in_order(np.exp(x))
    return Minima(np.take_along_axis(x, order, axis=1), misfit_rad, evaluations)


def _newton_step(fits: ManyFits, curved: Normal, x: Array) -> Array:
    below = np.maximum(fits.low - x, -_LONGEST_STEP)
    above = np.minimum(fits.high - x, _LONGEST_STEP)
    return bounded_step(curved, np.zeros(len(x)), below, above)


def _curved(fits: ManyFits, x: Array, trace: IntArray) -> Normal:
    """Normal equations with the moduli of all curvatures, which are themselves at a minimum."""
    count, parameters = x.shape
    both_ways = _DIFFERENCE * np.concatenate((np.eye(parameters), -np.eye(parameters)))
    around = (x[:, None] + both_ways).reshape(-1, parameters)
    normal = fits.normal(x, trace)
    gradients = fits.normal(around, np.repeat(trace, len(both_ways))).gradient
    ahead, behind = gradients.reshape(count, 2, parameters, parameters).swapaxes(0, 1)
    slopes = (ahead - behind) / (2 * _DIFFERENCE)
    # What is pushed against a bound does not move, however the sum of squares is curved there.
    fixed = (x <= fits.low) & (normal.gradient > 0) | (x >= fits.high) & (normal.gradient < 0)
    free = (~fixed[:, :, None]) & (~fixed[:, None, :])
    second = np.where(free, 0.5 * (slopes + slopes.swapaxes(1, 2)), np.eye(parameters))
    scale = np.sqrt(np.abs(np.diagonal(second, axis1=1, axis2=2))) + _SMALLEST
    both = scale[:, :, None] * scale[:, None, :]
    curvatures, directions = np.linalg.eigh(second / both)
    convex = directions * np.maximum(np.abs(curvatures), _FLAT)[:, None] @ directions.swapaxes(1, 2)
    normal.information = np.where(curvatures[:, :1, None] > _FLAT, second, convex * both)
    return normal
