"""The best fit with one quantity held, exactly.

A stiff row of least squares would hold a quantity only as well as its stiffness
is chosen: too soft, and the fit comes out elsewhere; too stiff, and it creeps
along the curve on which a sum is constant. Solving the quantity for one member
fails where that member is the negligible one. So every step is taken within the
surface on which the quantity is constant, to first order, and what it leaves
that surface by is put right by moving all members together: in which the
quantity is monotone, whatever their sizes.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from biogrip.arrays import Array
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.local_fit import Objective

_MOST_EVALUATIONS = 200
# Levenberg's and Marquardt's: shares of the curvature that are added to it.
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-7, 1e9
_LONGEST_STEP = 2.0
_ON_TARGET = 1e-12


@dataclass(frozen=True)
class HeldFit:
    """An optimum with one quantity held.

    Parameters
    ----------
    log_parameters : (n_parameters,)
        Where it is.
    chi2
        Sum of squares there, in units of the noise.
    """

    log_parameters: Array
    chi2: float


def held_fit(
    objective: Objective, quantity: Quantity, target: float, start: Array, tolerance: float
) -> HeldFit:
    """Fit with a quantity held, by damped least squares within the bounds.

    Parameters
    ----------
    objective
        What is fitted.
    quantity, target
        What is held, and its logarithm.
    start : (n_parameters,)
        Log-parameters, anywhere.
    tolerance
        Ends when a step lowers the cost by less than this share.
    """
    low, high = objective.low, objective.high
    x = brought_to(quantity, target, start, low, high)
    rows, jacobian = objective.both(x)
    cost, damping = float(rows @ rows), _FIRST_DAMPING
    for _ in range(_MOST_EVALUATIONS):
        step = _step(x, rows, jacobian, quantity.gradient(x), damping, low, high)
        # To first order in what it is told; a curve is what the damping is for.
        expected = cost - float(np.sum((rows + jacobian @ step) ** 2))
        if not expected > (tolerance * cost if damping <= _FIRST_DAMPING else 0.0):
            break
        trial = brought_to(quantity, target, x + step, low, high)
        trial_rows, trial_jacobian = objective.both(trial)
        lowered = cost - float(trial_rows @ trial_rows)
        if lowered > 0:
            x, rows, jacobian, cost = trial, trial_rows, trial_jacobian, cost - lowered
            damping = max(0.1 * damping, _LEAST_DAMPING)
            if lowered <= tolerance * cost and damping <= _FIRST_DAMPING:
                break
        elif damping > _MOST_DAMPING or abs(lowered) <= 1e-3 * tolerance * cost:
            break
        else:
            damping *= 10
    return HeldFit(x, objective.chi2(rows))


def brought_to(quantity: Quantity, target: float, x: Array, low: Array, high: Array) -> Array:
    """Move the members of a quantity together until it has a given logarithm, within bounds.

    Parameters
    ----------
    quantity, target
        The target must lie in the quantity's range.
    x, low, high : (n_parameters,)
        Log-parameters, and the bounds.
    """
    inside = np.clip(x, low, high)
    moved: Array = np.clip(quantity.moved(inside, target), low, high)
    if abs(quantity.log(moved) - target) <= _ON_TARGET:
        return moved
    # A member has come to a bound, and the others have to make up for it.

    def beyond(aim: float) -> float:
        return quantity.log(np.clip(quantity.moved(inside, aim), low, high)) - target

    most = len(quantity.members) * float(np.max(high - low))
    first, last = target - most, target + most
    if beyond(first) >= 0:
        aim = first
    elif beyond(last) <= 0:
        aim = last
    else:
        aim = float(brentq(beyond, first, last, xtol=_ON_TARGET, rtol=1e-15))
    return np.clip(quantity.moved(inside, aim), low, high)


def _step(
    x: Array, rows: Array, jacobian: Array, slope: Array, damping: float, low: Array, high: Array
) -> Array:
    """Damped step along the surface; parameters that push against a bound stay on it."""
    downhill = -(jacobian.T @ rows)
    curvature = jacobian.T @ jacobian
    curvature[np.diag_indices_from(curvature)] *= 1 + damping
    at_low, at_high = x <= low, x >= high
    free = ~(at_low | at_high)
    for _ in range(len(x) + 1):
        step, price = _within(curvature, downhill, slope, free)
        push = downhill - price * slope
        blocked = ~free & ((at_low & (push > 0)) | (at_high & (push < 0)))
        if not np.any(blocked):
            break
        free[np.argmax(np.where(blocked, np.abs(push), 0.0))] = True
    return step * min(1.0, _LONGEST_STEP / max(float(np.max(np.abs(step))), 1e-300))


def _within(
    curvature: Array, downhill: Array, slope: Array, free: Array
) -> tuple[Array, float]:
    """Step of some parameters that leaves the quantity as it is, and the quantity's price."""
    step, price = np.zeros_like(downhill), 0.0
    if np.any(free):
        solved = np.linalg.solve(
            curvature[np.ix_(free, free)], np.stack((downhill[free], slope[free]), axis=1)
        )
        across = float(slope[free] @ solved[:, 1])
        price = float(slope[free] @ solved[:, 0]) / across if across > 0 else 0.0
        step[free] = solved[:, 0] - price * solved[:, 1]
    return step, price
