"""Limits are those of lmfit's `conf_interval`, of curves that are written down here.

lmfit 1.3.4 gave the numbers for the same readings, from `TRUTH` as start, with `min=1e-6`:

    fit = lmfit.Model(creep).fit(readings, parameters, t=times)
    lmfit.conf_interval(fit, fit, p_names=["k_s", "k_v", "c_v"], sigmas=[0.95])

Where the noise is given, with `weights=1 / sd, scale_covar=False` and with
`prob_func=lambda best, other: chi2.cdf(other.chisqr - best.chisqr, 1)`. An offset is one parameter
more, beside which nothing is told of k_s.
"""

from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from tests.helpers.identified import told

TRUTH = {"k_s": 300.0, "k_v": 200.0, "c_v": 900.0}
MANY, FEW = np.arange(0.2, 60.0, 0.2), np.arange(0.2, 60.0, 5.0)
TWO_HALVES = np.where(MANY < 30, 2e-4, 8e-4)
OFFSET, NOISE, SD = {"offset": True}, {"noise": 2e-4}, {"sd": TWO_HALVES}


def creep(t: Array, k_s: float, k_v: float, c_v: float) -> Array:
    """The strain under 5 Pa of a spring and a Kelvin-Voigt element in series."""
    return 5 / k_s + 5 / k_v * (1 - np.exp(-t * k_v / c_v))


@pytest.mark.parametrize(
    ("times", "sd", "given", "limits"),
    [
        (FEW, 2e-4, {}, [(292.896, 307.1144), (196.9109, 203.4328), (855.9672, 938.3086)]),
        (MANY, 2e-3, {}, [(283.2269, 356.3802), (182.0501, 209.4245), (703.1652, 963.0288)]),
        (MANY, 2e-4, OFFSET, [(198.0489, 200.8776), (876.6844, 905.8058)]),
        (FEW, 2e-4, NOISE, [(292.4137, 307.6482), (196.6858, 203.6733), (853.1522, 941.3754)]),
        (MANY, TWO_HALVES, SD, [(298.1084, 304.6402), (198.088, 200.8429), (877.5449, 907.939)]),
    ],
    ids=["few", "noisy", "offset", "noise", "sd"],
)
def test_limits_are_lmfits(
    times: Array, sd: float | Array, given: dict[str, Any], limits: list[tuple[float, float]]
) -> None:
    """To a relative 3e-5: lmfit's root search ends within some 1e-5."""
    readings = creep(times, **TRUTH) + 3e-3 * (given is OFFSET)
    readings += sd * np.random.default_rng(0).standard_normal(len(times))
    held: dict[str, Any] = {"reads": "strain", "hold": 5.0, "model": "zener_kelvin", "start": 0.0}
    found = told(times, readings, **held, **given).to_frame()
    if given is OFFSET:
        assert np.isnan(found.loc["k_s", ["low", "high"]].astype(float)).all()
    for name, ends in zip(list(TRUTH)[-len(limits) :], limits, strict=True):
        assert found.loc[name, ["low", "high"]].tolist() == pytest.approx(ends, rel=3e-5)
