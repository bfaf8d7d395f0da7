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

from biogrip.arrays import Array
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.local_fit import Objective

_MOST_STEPS = 200
# In e-folds, along each axis of the curvature.
_LONGEST_STEP, _SHORTEST_STEP = 2.0, 1e-8
_ON_TARGET = 1e-12


@dataclass(frozen=True)
class HeldFit:
    """An optimum with one quantity held.

    Parameters
    ----------
    log_parameters : (n_parameters,)
        Where it is.
    chi2
        Sum of squares there, in units of the noise; infinite where the model has no answer.
    bend : (n_parameters, n_parameters)
        What second derivatives of residuals and quantity add to the curvature
        there, as far as the steps have told. A fit nearby is the faster for it.
    """

    log_parameters: Array
    chi2: float
    bend: Array


@dataclass(frozen=True)
class _Here:
    """The objective at a point, and what holding the quantity costs to first order."""

    x: Array
    rows: Array
    jacobian: Array
    slope: Array

    @property
    def cost(self) -> float:
        return 0.5 * float(self.rows @ self.rows)

    @property
    def gradient(self) -> Array:
        return self.jacobian.T @ self.rows


def held_fit(
    objective: Objective,
    quantity: Quantity,
    target: float,
    start: Array,
    bend: Array,
    tolerance: float,
) -> HeldFit:
    """Fit with a quantity held, by steps of limited length within the bounds.

    The curvature is that of Gauss and Newton, and what the steps before have
    told of the rest of it: along a valley the first is next to nothing.

    Parameters
    ----------
    objective
        What is fitted.
    quantity, target
        What is held, and its logarithm.
    start : (n_parameters,)
        Log-parameters, anywhere.
    bend : (n_parameters, n_parameters)
        Of a fit nearby, or zero.
    tolerance
        Ends when no step is expected to lower the cost by more than this share.
    """
    low, high = objective.low, objective.high

    def at(x: Array) -> _Here:
        moved = brought_to(quantity, target, x, low, high)
        return _Here(moved, *objective.both(moved), quantity.gradient(moved))

    here, longest, nothing = at(start), _LONGEST_STEP, np.zeros_like(bend)
    told, doubted = bend, False
    if not np.isfinite(here.cost):
        return HeldFit(here.x, np.inf, bend)
    for _ in range(_MOST_STEPS):
        step, price, expected = _step(here, told, longest, low, high)
        if not expected > tolerance * here.cost or longest < _SHORTEST_STEP:
            if doubted or not np.any(told):
                break
            # What was told elsewhere may make a slope look like the bottom of a gorge.
            told, longest, doubted = nothing, _LONGEST_STEP, True
            continue
        there = at(here.x + step)
        lowered = here.cost - there.cost
        if lowered > 0.75 * expected:
            longest = min(2 * longest, _LONGEST_STEP)
        elif not lowered > 0.25 * expected:
            longest = 0.25 * min(longest, float(np.max(np.abs(step))))
        doubted = doubted and not lowered > tolerance * here.cost
        if lowered > 0:
            # A step too long tells of the curvature somewhere else.
            told = bend = _told(told, here, there, price)
            here = there
    return HeldFit(here.x, objective.chi2(here.rows), bend)


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
        from scipy.optimize import brentq

        aim = float(brentq(beyond, first, last, xtol=_ON_TARGET, rtol=1e-15))
    return np.clip(quantity.moved(inside, aim), low, high)


def _step(
    here: _Here, bend: Array, longest: float, low: Array, high: Array
) -> tuple[Array, float, float]:
    """Step along the surface, the quantity's price, and by how much the cost should fall.

    Parameters that push against a bound stay on it.
    """
    gradient = here.gradient
    curvature = here.jacobian.T @ here.jacobian + bend
    at_low, at_high = here.x <= low, here.x >= high
    free = ~(at_low | at_high)
    while True:
        slope = here.slope[free]
        across = float(slope @ slope)
        price = float(slope @ gradient[free]) / across if across > 0 else 0.0
        push = price * here.slope - gradient
        blocked = ~free & ((at_low & (push > 0)) | (at_high & (push < 0)))
        if not np.any(blocked):
            break
        free[np.argmax(np.where(blocked, np.abs(push), 0.0))] = True
    along = _tangents(slope)
    bends, axes = np.linalg.eigh(along.T @ curvature[free][:, free] @ along)
    axes = along @ axes
    # Where it curves down, as far downhill as a mirrored curve would lead.
    bends, uphill = np.maximum(np.abs(bends), 1e-12), axes.T @ gradient[free]
    lengths = np.clip(-uphill / bends, -longest, longest)
    step = np.zeros_like(gradient)
    step[free] = axes @ lengths
    return step, price, -float(np.sum(lengths * (uphill + 0.5 * bends * lengths)))


def _tangents(slope: Array) -> Array:
    """Orthonormal directions, as columns, in which a quantity of a given slope is constant."""
    length = float(np.sqrt(slope @ slope))
    if length == 0:
        return np.eye(len(slope))
    # Householder's reflection of the slope onto the axis that it is closest to.
    mirror = slope / length
    axis = int(np.argmax(np.abs(mirror)))
    most = mirror[axis]
    mirror[axis] += np.copysign(1.0, most)
    turned = np.eye(len(slope)) - np.outer(mirror, mirror / (1 + abs(most)))
    return np.concatenate((turned[:, :axis], turned[:, axis + 1 :]), axis=1)


def _told(bend: Array, here: _Here, there: _Here, price: float) -> Array:
    """Bend that explains how the gradient has changed over a step, too (symmetric rank one)."""
    step = there.x - here.x
    change = (there.jacobian - here.jacobian).T @ there.rows - price * (there.slope - here.slope)
    left = change - bend @ step
    share = float(left @ step)
    if not abs(share) > 1e-6 * float(np.linalg.norm(left) * np.linalg.norm(step)):
        return bend
    return bend + np.outer(left, left) / share
