"""Map of chi^2 over two exchangeable parameters: the valley in which they trade off."""

from collections.abc import Callable
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import round_increase, rounded
from biogrip.fit.local_fits import FAIR
from biogrip.judging.constrained_fits import CLOSE, ConstrainedFits
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.profiles import keep_lower
from biogrip.physics.sample_model import SampleModel

# Shares of the first damper in the sum, dense where either is small, and sums relative to the best
# one, dense in the valley.
_SHARES = 1 / (1 + np.exp(-np.linspace(-8.0, 8.0, 31)))
_BESIDE = np.array([0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3])
_SUMS = np.concatenate((1 - _BESIDE[::-1], [1.0], 1 + _BESIDE))
# Second arm of the valley: if the branch is too weak to show, the second damper alone is the sum.
_FIRSTS = np.concatenate((np.arange(0.002, 0.1, 0.005), np.linspace(0.11, 1.2, 12)))
_SECONDS = np.concatenate((np.arange(0.9, 1.06, 0.005), [1.08, 1.12, 1.2]))


def compute_valley(
    likelihood: Likelihood, model: SampleModel
) -> tuple[dict[str, Any] | None, Array | None]:
    """Compute the increase of chi^2 over two exchangeable parameters, with the others fitted.

    The first returned has ``x`` and ``y``, names and units; ``best``; and under ``grids``, one
    along the valley of constant sum and one along its arm of constant second parameter,
    ``x_values``, ``y_values`` and ``increases``, nested lists. It is None unless exactly two
    exchangeable parameters were searched, among others. The second are log-parameters whose chi^2
    is clearly below that of the optimum, which is then not the global one, or None.
    """
    pair = [index for index, p in enumerate(model.parameters) if p.name in model.exchangeable]
    if len(pair) != 2 or len(model.parameters) == 2:
        return None, None
    best = np.exp(likelihood.best[pair])
    sums = best.sum() * _SUMS[:, None]
    arm = np.meshgrid(best.sum() * _FIRSTS, best.sum() * _SECONDS)
    grids, missed = [], None
    for x_values, y_values in ((sums * _SHARES, sums * (1 - _SHARES)), arm):
        increases, lower = _increases(likelihood, pair, x_values, y_values)
        grid = {"x_values": _listed(x_values, rounded), "y_values": _listed(y_values, rounded)}
        grids.append({**grid, "increases": _listed(increases, round_increase)})
        missed = missed if lower is None else lower
    both = [model.parameters[index] for index in pair]
    x, y = ({"name": p.name, "symbol": p.symbol, "unit": p.unit} for p in both)
    at_best = [rounded(float(value)) for value in best]
    return {"x": x, "y": y, "grids": grids, "best": at_best}, missed


def _listed(values: Array, rounding: Callable[[float], float | None]) -> list[list[float | None]]:
    return [[rounding(float(value)) for value in row] for row in values]


def _increases(
    likelihood: Likelihood, pair: list[int], x_values: Array, y_values: Array
) -> tuple[Array, Array | None]:
    """Compute the increase of chi^2 at every point of a grid, and find a missed optimum.

    All points are fitted from the optimum, then from neighbours as long as these improve.
    """
    fits = ConstrainedFits([likelihood], [])
    rows, columns = x_values.shape
    x = np.tile(likelihood.best, (rows * columns, 1))
    x[:, pair[0]], x[:, pair[1]] = np.log(x_values.ravel()), np.log(y_values.ravel())
    fixed = np.isin(np.arange(x.shape[1]), pair)
    increases = np.full(len(x), np.inf)
    points, start = np.arange(len(x)), x.copy()
    # A point, and its neighbours on the grid.
    beside = np.pad(points.reshape(rows, columns), 1, constant_values=-1)
    shifts = ((0, 1), (2, 1), (1, 0), (1, 2))
    neighbours = np.stack([beside[i : i + rows, j : j + columns].ravel() for i, j in shifts])
    tolerance = FAIR
    while len(points):
        found = fits.with_fixed(start, fixed, tolerance)
        news = keep_lower(increases, x, points, *found)
        origin = np.repeat(np.flatnonzero(news), 4)
        points = neighbours[:, news].T.ravel()
        origin, points = origin[points >= 0], points[points >= 0]
        start = x[origin].copy()
        start[:, pair] = x[points][:, pair]
        tolerance = CLOSE
    missed = fits.missed.get(0)
    return increases.reshape(rows, columns), None if missed is None else missed[1]
