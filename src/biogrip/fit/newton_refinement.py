"""Newton refinement of optima to their last digits.

Descents compare sums of squares, and so find an optimum to half the digits. Its vanishing
gradient locates it to all of them. Gauss-Newton steps need not converge there: for an
element too weak to be seen, second derivatives of the residuals decide how the gradient
changes. So the steps are Newton's. The first are damped, and compared on condensed rows.
Each of the last is compared, on all readings, with the point before it, and kept only if
it fits no worse.

References
----------
.. [1] J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed., Springer, 2006, section
   3.4: Newton's method with the moduli of the curvatures.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.fit.levenberg_marquardt import Minima, Normal, bounded_step, minimize
from biogrip.fit.local_fits import LocalFits

# Tolerance and initial damping of the steps that approach a minimum along a curved valley.
_CLOSE, _DAMPING = 1e-10, 1e-6
_MOST_STEPS = 60
# Least damping after a rejected step, and the factor by which damping then changes.
_LITTLE, _MORE = 1e-9, 10.0
# E-folds; shorter steps are rounding, and every machine decides alike whether a step is shorter.
_STILL = 1e-9
# Steps longer than the first, in e-folds, end on a grid of the second.
_FAR, _SPACING = 1e-5, 2.0**-24
# A step with a smaller predicted decrease of chi^2 changes no digit that is written.
_NOTHING = 1e-8
# E-folds; a converged fit is nearer to its optimum.
_LONGEST_STEP = 1.0
# Least curvature of a direction, relative to single parameters; and of a single parameter.
_FLAT, _SMALLEST = 1e-12, 1e-150
# Accuracy of a misfit, relative to the largest rotation.
_ROUNDING = 1e-15


def refine_optima(fits: LocalFits, found: Minima, trace: IntArray) -> Minima:
    """Refine optima by Newton steps until they are stationary to the last digits.

    Parameters
    ----------
    fits
        The traces.
    found
        Optima, fitted with the finest tolerance.
    trace : (n,)
        Index of the trace that each was fitted to.

    Returns
    -------
    Minima
        Optima with their misfits on all readings, none above that of `found`, and the
        evaluations of the refinement; branches sorted by relaxation time. An optimum has
        converged if its next step would not change chi^2 noticeably.
    """

    def convex(x: Array, fit: IntArray) -> Normal:
        return _convex(fits, x, trace[fit])

    low, high = fits.low[trace], fits.high[trace]
    closer = minimize(convex, found.x, low, high, _CLOSE, None, _DAMPING, _MOST_STEPS)
    evaluations = closer.evaluations * (1 + 2 * found.x.shape[1])
    here, moving = fits.on_all_samples(found.x, trace), np.arange(len(found.x))
    rounding = _rounding(fits, here.misfit_rad, trace)
    state = _State(fits, trace, rounding, found.x.copy(), here)
    state.move(moving, closer.x)
    converged, damping = np.zeros(len(moving), dtype=bool), np.zeros(len(moving))
    for _ in range(_MOST_STEPS):
        if not len(moving):
            break
        x = state.x[moving]
        normal = _convex(fits, x, trace[moving])
        normal.gradient = state.here.gradient[moving]
        bounds = low[moving], high[moving]
        plain = _newton_step(*bounds, normal, x, np.zeros(len(x)))
        gain = -np.sum(plain * normal.gradient, axis=1)
        converged[moving] = gain <= np.maximum(_NOTHING, rounding[moving])
        step = _newton_step(*bounds, normal, x, damping[moving])
        step = np.where(damping[moving, None] > 0, np.log1p(np.maximum(step, -0.9)), step)
        on = np.max(np.abs(plain), axis=1) >= _STILL
        moving, step = moving[on], step[on]
        if not len(moving):
            break
        evaluations[moving] += 2 + 2 * x.shape[1]
        ahead = np.clip(_on_grid(state.x[moving] + step, step), low[moving], high[moving])
        kept = state.move(moving, ahead)
        more, less = _MORE * damping[moving], damping[moving] / _MORE
        less[less < _LITTLE] = 0.0
        damping[moving] = np.where(kept, less, np.maximum(more, _LITTLE))
        # A converged fit whose step is rejected differs from its optimum by rounding only.
        moving = moving[kept | ~converged[moving]]
    order = fits.problems[0].residuals.model.in_order(np.exp(state.x))
    x = np.take_along_axis(state.x, order, axis=1)
    return Minima(x, state.here.misfit_rad, evaluations, converged)


def _on_grid(x: Array, step: Array) -> Array:
    """Round the ends of long steps to a grid, for the reason given in `levenberg_marquardt`."""
    far = np.max(np.abs(step), axis=1, keepdims=True) > _FAR
    return np.where(far, np.rint(x / _SPACING) * _SPACING, x)


@dataclass
class _State:
    """Points of the fits, with their sums of squares and gradients from all readings."""

    fits: LocalFits
    trace: IntArray
    rounding: Array
    x: Array
    here: Normal

    def move(self, which: IntArray, x: Array) -> BoolArray:
        """Move fits to those points that are no worse on all readings; return their mask."""
        there = self.fits.on_all_samples(x, self.trace[which])
        kept = there.square_sum <= self.here.square_sum[which] + self.rounding[which]
        moved = which[kept]
        self.x[moved] = x[kept]
        for part, new in zip(self.here.parts, there.parts, strict=True):
            part[moved] = new[kept]
        return kept


def _rounding(fits: LocalFits, misfit_rad: Array, trace: IntArray) -> Array:
    """Estimate the rounding errors of sums of squares, (n,)."""
    residuals = [fits.problems[own].residuals for own in trace.tolist()]
    samples = np.array([each.samples for each in residuals])
    noise_rad = np.array([each.noise_scale_rad for each in residuals])
    more_rad = _ROUNDING * np.array([each.peak_rad for each in residuals])
    found: Array = samples * more_rad * (2 * misfit_rad + more_rad) / noise_rad**2
    return found


def _newton_step(low: Array, high: Array, normal: Normal, x: Array, damping: Array) -> Array:
    below = np.maximum(low - x, -_LONGEST_STEP)
    above = np.minimum(high - x, _LONGEST_STEP)
    return bounded_step(normal, damping, below, above)


def _convex(fits: LocalFits, x: Array, trace: IntArray) -> Normal:
    """Return normal equations with the moduli of the Hessian's eigenvalues."""
    normal = fits.curved(x, trace)
    # A parameter pushed against a bound does not move, whatever the curvature there.
    at_low, at_high = x <= fits.low[trace], x >= fits.high[trace]
    fixed = at_low & (normal.gradient > 0) | at_high & (normal.gradient < 0)
    free = (~fixed[:, :, None]) & (~fixed[:, None, :])
    second = np.where(free, normal.information, np.eye(x.shape[1]))
    scale = np.sqrt(np.abs(np.diagonal(second, axis1=1, axis2=2))) + _SMALLEST
    both = scale[:, :, None] * scale[:, None, :]
    curvatures, directions = np.linalg.eigh(second / both)
    moduli = np.maximum(np.abs(curvatures), _FLAT)
    convex = directions * moduli[:, None] @ directions.swapaxes(1, 2)
    normal.information = np.where(curvatures[:, :1, None] > _FLAT, second, convex * both)
    return normal
