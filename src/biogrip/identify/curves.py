"""Few numbers of a trace from which a page draws it: its fit, its residuals and its profiles."""

from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from biogrip.arrays import Array, IntArray
from biogrip.digits import significant, with_unit
from biogrip.figures.results import Fit, fit_of
from biogrip.figures.style import (
    HIGHEST_INCREASE,
    is_over_decades,
    is_wide,
    profile_limits,
    scale_of_fit,
)
from biogrip.identify.one_trace import Identified
from biogrip.judging.likelihood import CERTAIN

_DIGITS = 4
# Points of a trace: some evenly, and the most extreme residuals on either side.
_EVENLY, _EXTREME = 160, 15
_BLOCKS, _LAGS, _QUANTILES = 40, 40, 100
_TWO_SIDED = 1.96
# Most points of the line of a fit, the share of its range that it may miss, and candidates.
_LINE, _MISSED, _CANDIDATES = 200, 5e-4, 2000
_LARGEST_INCREASE = 1e6


def curves_of(identified: Identified) -> dict[str, Any]:
    """Return the numbers of a trace's drawings as plain data, four digits each."""
    data, problem = identified.data, identified.problem
    found = {item["quantity"]: item["value"] for item in data["quantities"]}
    values = {name: found[name] for name in problem.searched.names}
    fit = fit_of(problem, {**problem.fixed, **values}, identified.recorded, 0)
    return {
        **_trace(fit),
        "profiles": [_profile(item) for item in data["quantities"]],
        "levels": [
            [_short(data["threshold"]), f"{100 * data['confidence']:g} %"],
            [_short(data["certainty"]), f"{100 * CERTAIN:g} %, to close a side"],
        ],
    }


def normal_quantiles(count: int) -> list[float]:
    """Return the quantiles of a standard normal against which those of residuals are drawn."""
    from scipy.special import ndtri

    return _linear(ndtri(_shares(count)))


def _trace(fit: Fit) -> dict[str, Any]:
    factor, unit = scale_of_fit(fit)
    read, fitted = factor * fit.measured_rad, factor * fit.fitted_rad
    over_decades = is_over_decades(fit.time_s)
    log_read = bool(over_decades and np.min(fit.measured_rad) > 0 and np.min(fit.fitted_rad) > 0)
    times = _relative if over_decades else _linear
    reads = _relative if log_read else _linear
    left = read - fitted if fit.sd_rad is None else (fit.measured_rad - fit.fitted_rad) / fit.sd_rad
    deviation = float(np.std(left)) or 1.0
    shown = _few(read, left)
    line = _corners(
        np.log(fit.time_s) if over_decades else fit.time_s,
        np.log(fitted) if log_read else fitted,
    )
    return {
        "samples": len(read),
        "log": [over_decades, log_read],
        "reads": with_unit(fit.read.title, unit),
        "time": times(fit.time_s[shown]),
        "read": reads(read[shown]),
        "fit": [times(fit.time_s[line]), reads(fitted[line])],
        "left": _linear(left[shown] / deviation),
        "deviation": _short(deviation),
        "leaves": with_unit("residual", unit) if fit.sd_rad is None else "residual / sd",
        **_diagnosis(fit.time_s, left / deviation, times),
    }


def _diagnosis(time_s: Array, scaled: Array, times: Any) -> dict[str, Any]:
    """Return means of standardised residuals over blocks, autocorrelation and quantiles."""
    blocks = np.array_split(np.arange(len(scaled)), min(_BLOCKS, max(1, len(scaled) // 5)))
    centred = scaled - scaled.mean()
    spectrum = np.abs(rfft(centred, next_fast_len(2 * len(centred)))) ** 2
    sums = irfft(spectrum, next_fast_len(2 * len(centred)))
    lags = np.arange(1, min(_LAGS, len(scaled) // 2) + 1)
    return {
        "blocks": [
            times(np.array([np.mean(time_s[block]) for block in blocks])),
            _linear(np.array([np.mean(scaled[block]) for block in blocks])),
        ],
        "correlation": _linear(sums[lags] / (sums[0] or 1.0)),
        "white": _short(_TWO_SIDED / np.sqrt(len(scaled))),
        "quantiles": _linear(np.quantile(scaled, _shares(len(scaled)))),
    }


def _shares(count: int) -> Array:
    few = min(_QUANTILES, count)
    shares: Array = (np.arange(few) + 0.5) / few
    return shares


def _few(read: Array, left: Array) -> IntArray:
    """Return indices of readings to draw: some evenly, and the extremes of trace and residual."""
    if len(read) <= _EVENLY + 2 * _EXTREME:
        return np.arange(len(read))
    order = np.argsort(left, kind="stable")
    evenly = np.linspace(0, len(read) - 1, _EVENLY).astype(int)
    ends = [int(np.argmin(read)), int(np.argmax(read))]
    return np.unique(np.concatenate([evenly, order[:_EXTREME], order[-_EXTREME:], ends]))


def _corners(x: Array, y: Array) -> IntArray:
    """Return indices between which a line is straight to less than can be drawn.

    The points farthest from the line so far are added to it (Ramer 1972; Douglas and Peucker 1973).
    """
    few = _candidates(y)
    x, y = x[few], y[few]
    tolerance = _MISSED * (float(np.ptp(y)) or 1.0)
    chosen = {0, len(x) - 1}
    stretches = [_farthest(x, y, 0, len(x) - 1)]
    while len(chosen) < _LINE:
        worst = max(stretches)
        missed, start, middle, end = worst
        if missed <= tolerance:
            break
        chosen.add(middle)
        stretches.remove(worst)
        stretches += [_farthest(x, y, start, middle), _farthest(x, y, middle, end)]
    return few[sorted(chosen)]


def _candidates(y: Array) -> IntArray:
    """Return all indices, or of very many those of the lowest and highest of each stretch."""
    if len(y) <= _CANDIDATES:
        return np.arange(len(y))
    stretches = np.array_split(np.arange(len(y)), _CANDIDATES // 2)
    ends = [(own[np.argmin(y[own])], own[np.argmax(y[own])]) for own in stretches]
    return np.unique(np.concatenate([[0, len(y) - 1], np.ravel(ends)]))


def _farthest(x: Array, y: Array, start: int, end: int) -> tuple[float, int, int, int]:
    """Return how far, and where, a curve is from the straight line between two of its points."""
    if end - start < 2:
        return 0.0, start, start, end
    inside = slice(start + 1, end)
    slope = (y[end] - y[start]) / (x[end] - x[start])
    away = np.abs(y[inside] - y[start] - slope * (x[inside] - x[start]))
    place = int(np.argmax(away))
    return float(away[place]), start, start + 1 + place, end


def _profile(item: dict[str, Any]) -> dict[str, Any]:
    values, increases = (np.array(item["profile"][key]) for key in ("values", "increases"))
    inside = np.concatenate([[False], increases < HIGHEST_INCREASE, [False]])
    # With those beside, so that the curve leaves the figure.
    near = inside[1:-1] | inside[:-2] | inside[2:]
    axis = profile_limits(item)
    limits = item["low"], item["high"]
    bounded = limits != (None, None)
    ends = [limits[0] or axis[0], *(end for gap in item["excluded"] for end in gap)]
    ends = [*ends, limits[1] or axis[1]] if bounded else []
    wide = is_wide(*axis)
    every = np.array([*axis, *ends, *values[near]])
    places = iter(_relative(every) if wide else _linear(every, axis[1] - axis[0]))
    return {
        "quantity": item["quantity"],
        "unit": item["unit"],
        "verdict": item["verdict"],
        "log": wide,
        "axis": [next(places), next(places)],
        "allowed": [next(places) for _ in ends],
        "closed": [limit is not None for limit in limits],
        "values": list(places),
        "increases": _relative(np.minimum(increases[near], _LARGEST_INCREASE)),
    }


def _relative(values: Array) -> list[float]:
    """Round each number by itself, for a logarithmic axis."""
    found: list[float] = significant(values, _DIGITS).tolist()
    return found


def _linear(values: Array, size: float = 0.0) -> list[float]:
    """Round numbers for a linear axis, of which they take four digits from end to end."""
    size = size or float(np.ptp(values)) or float(np.max(np.abs(values)))
    decimals = _DIGITS - 1 - int(np.floor(np.log10(size))) if size > 0 else 0
    # Adding zero makes -0 plain.
    found: list[float] = (np.round(values, decimals) + 0.0).tolist()
    return found


def _short(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
