"""Residuals of a fit: over time, autocorrelation, distribution."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.products.figures.results import Fit
from biogrip.products.figures.style import FITTED, MEASURED, PAGE_IN, SHADE, TARGET, figure, panel

_BLOCKS, _LAGS, _QUANTILES = 40, 40, 200
_TWO_SIDED = 1.96


def draw_residuals(fit: Fit) -> Figure:
    """Draw standardised residuals over time, their autocorrelation and their quantiles."""
    residual = (fit.measured_rad - fit.fitted_rad) / (1 if fit.sd_rad is None else fit.sd_rad)
    scaled = residual / np.std(residual)
    drawn = figure(PAGE_IN, 2.4)
    over_time, correlation, quantiles = drawn.subplots(1, 3, width_ratios=[1.5, 1, 0.9])
    _over_time(over_time, fit.time_s, scaled)
    _correlation(correlation, scaled)
    _quantiles(quantiles, scaled)
    return drawn


def _over_time(axes: Axes, time_s: Array, scaled: Array) -> None:
    axes.plot(time_s, scaled, ".", color=MEASURED, markersize=1, rasterized=True)
    blocks = np.array_split(np.arange(len(scaled)), min(_BLOCKS, max(1, len(scaled) // 5)))
    middles = [float(np.mean(time_s[block])) for block in blocks]
    reach = [_TWO_SIDED / np.sqrt(len(block)) for block in blocks]
    axes.fill_between(middles, np.negative(reach), reach, color=SHADE, linewidth=0)
    axes.plot(middles, [float(np.mean(scaled[block])) for block in blocks], color=FITTED)
    axes.axhline(0, color=TARGET, linewidth=0.6)
    axes.set(xlabel="time (s)", ylabel="residual (standard deviations)")
    panel(axes, "a", "and its mean over a while")


def _correlation(axes: Axes, scaled: Array) -> None:
    from scipy.fft import irfft, next_fast_len, rfft

    lags = np.arange(1, min(_LAGS, len(scaled) // 2) + 1)
    centred = scaled - scaled.mean()
    spectrum = np.abs(rfft(centred, next_fast_len(2 * len(centred)))) ** 2
    sums = irfft(spectrum, next_fast_len(2 * len(centred)))
    axes.axhspan(*(sign * _TWO_SIDED / np.sqrt(len(scaled)) for sign in (-1, 1)), color=SHADE)
    axes.vlines(lags, 0, sums[lags] / sums[0], color=FITTED, linewidth=1.2)
    axes.axhline(0, color=TARGET, linewidth=0.6)
    axes.set(xlabel="lag (samples)", ylabel="autocorrelation")
    panel(axes, "b", "shaded: of white noise")


def _quantiles(axes: Axes, scaled: Array) -> None:
    from scipy.special import ndtri

    shares = (np.arange(min(_QUANTILES, len(scaled))) + 0.5) / min(_QUANTILES, len(scaled))
    expected = ndtri(shares)
    axes.plot(expected, expected, color=TARGET, linewidth=0.6)
    axes.plot(expected, np.quantile(scaled, shares), ".", color=FITTED, markersize=2.5)
    axes.set(xlabel="normal quantile", ylabel="residual quantile")
    panel(axes, "c", "line: normal")
