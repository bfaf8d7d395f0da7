"""Figures of fits: axes that suit the sampling, and residuals in the unit that was minimised."""

import numpy as np

from biogrip.arrays import Array
from biogrip.figures.fit import draw_fit
from biogrip.figures.results import Fit
from biogrip.physics.instruments import MODULUS


def relaxing(time_s: Array, sd_rad: Array | None = None) -> Fit:
    modulus = 100 / (1 + time_s)
    return Fit(time_s, None, 1.01 * modulus, modulus, sd_rad, MODULUS)


def test_readings_over_decades_are_drawn_on_logarithmic_axes() -> None:
    traces, residuals = draw_fit(relaxing(np.geomspace(0.01, 1000.0, 200)), "fit", "").axes
    assert (traces.get_xscale(), traces.get_yscale()) == ("log", "log")
    assert traces.get_ylabel() == "modulus (Pa)"
    assert residuals.get_yscale() == "linear"


def test_uniform_readings_are_drawn_on_linear_axes() -> None:
    traces, residuals = draw_fit(relaxing(np.linspace(0.0, 10.0, 200)), "fit", "").axes
    assert (traces.get_xscale(), traces.get_yscale()) == ("linear", "linear")
    assert residuals.get_ylabel() == "residual (Pa)"


def test_residuals_of_weighted_readings_are_in_standard_deviations() -> None:
    times = np.linspace(0.0, 10.0, 50)
    fit = relaxing(times, np.full(50, 0.5))
    _, residuals = draw_fit(fit, "fit", "").axes
    assert residuals.get_ylabel() == "residual / sd"
    points = np.asarray(residuals.lines[0].get_ydata(), dtype=float)
    np.testing.assert_allclose(points, (fit.measured_rad - fit.fitted_rad) / 0.5)
