"""Profiles with as many points as it takes to draw them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, IntArray

HIGHEST = 16.0
"""Rise up to which a profile has dense points: what a figure shows of it."""

# Between neighbours the square root of the rise, nearly linear, changes by so much at most.
_STEP = 0.3
_MOST_ROUNDS = 8


@dataclass
class Points:
    """Points of one profile, ascending.

    Parameters
    ----------
    values, rises : (n_points,)
        Logarithms of the quantity, and rises of chi^2.
    x : (n_points, n_parameters)
        Log-parameters fitted there.
    """

    values: Array
    rises: Array
    x: Array


Fit = Callable[[IntArray, Array, Array], tuple[Array, Array]]
"""Of profiles by index, targets and starting points (n, n_parameters), the rises and fits."""


def smoothed(points: Sequence[Points], limits: Sequence[Sequence[float]], fit: Fit) -> None:
    """Add points in place: the limits, then halfway wherever two neighbours are far apart.

    Parameters
    ----------
    points
        The profiles.
    limits
        Of each, the logarithms of those limits that it has.
    fit
        Fits with the quantity held.
    """
    _add(
        points,
        [np.setdiff1d(own, each.values) for own, each in zip(limits, points, strict=True)],
        fit,
    )
    for _ in range(_MOST_ROUNDS):
        middles = [_too_far_apart(each) for each in points]
        if not any(len(values) for values in middles):
            break
        _add(points, middles, fit)


def _too_far_apart(points: Points) -> Array:
    roots = np.sqrt(np.clip(points.rises, 0.0, HIGHEST))
    left = np.flatnonzero(np.abs(np.diff(roots)) > _STEP)
    middles: Array = 0.5 * (points.values[left] + points.values[left + 1])
    return middles


def _add(points: Sequence[Points], wanted: Sequence[Array], fit: Fit) -> None:
    """Fit new values of every profile from the fits of both neighbours; the lower one counts."""
    which = np.repeat(np.arange(len(points)), [len(values) for values in wanted])
    if not len(which):
        return
    targets = np.concatenate(wanted)
    places = [np.searchsorted(p.values, v) for p, v in zip(points, wanted, strict=True)]
    at = np.concatenate(places)
    sides = [
        np.stack(
            [
                points[p].x[min(max(i - back, 0), len(points[p].x) - 1)]
                for p, i in zip(which.tolist(), at.tolist(), strict=True)
            ]
        )
        for back in (1, 0)
    ]
    rises, x = fit(np.tile(which, 2), np.tile(targets, 2), np.concatenate(sides))
    both = rises.reshape(2, -1)
    lower = np.argmin(both, axis=0)
    new = np.arange(len(which))
    rises, x = both[lower, new], x.reshape(2, len(which), -1)[lower, new]
    for index, (each, place) in enumerate(zip(points, places, strict=True)):
        mine = which == index
        each.values = np.insert(each.values, place, targets[mine])
        each.rises = np.insert(each.rises, place, rises[mine])
        each.x = np.insert(each.x, place, x[mine], axis=0)
