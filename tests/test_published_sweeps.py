"""Fits of frequency sweeps that programs of the field publish, beside ours of the same moduli.

Sums of squares are of relative deviations of both moduli, as these programs minimise them.
"""

from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from tests.helpers.identified import by_quantity, identified
from tests.helpers.laplace import IMPEDANCES

# Chia pudding and a metal-coordinating network, of pyRheo's demos (github.com/mirandi1/pyRheo):
# angular frequency, storage and loss modulus in Pa.
CHIA = """
100.0 178.11 228.46
67.2 162.94 150.62
45.2 141.52 111.45
30.4 126.71 89.679
20.4 114.69 71.74
13.7 102.99 58.214
9.24 93.067 47.552
6.21 84.661 39.135
4.18 77.922 32.367
2.81 72.247 26.874
1.89 67.459 22.624
1.27 63.488 19.183
0.853 60.003 16.489
0.574 57.062 14.478
0.386 54.359 12.787
0.259 51.938 11.575
0.174 49.803 10.606
0.117 47.783 10.035
0.0788 45.808 9.1633
0.053 44.263 9.4928
0.0356 42.635 9.5032
0.024 40.681 9.5656
0.0161 39.425 9.238
0.0108 37.572 10.513
0.00728 36.24 9.943
"""
NETWORK = """
0.10078333 8.276715041 27.79592048
0.147251525 12.40431387 39.08213171
0.228303587 18.79966975 55.90150607
0.325365944 26.57922404 75.61356229
0.475382499 39.61079143 100.930322
0.694567224 56.70422049 148.1410832
1.014811505 84.130539 183.0923759
1.482710894 116.9769468 251.8468325
2.166344769 165.3187694 332.0824472
3.165181882 229.7277616 416.6810306
4.633204891 319.7723981 563.3665848
6.694563404 437.6175359 749.0295159
9.894110222 596.4368666 898.4744074
14.56156975 816.9528657 1078.037908
21.91219557 1105.076786 1328.516217
31.09985081 1451.896696 1583.802186
46.96227955 1832.965951 1863.699129
65.35003841 2342.78117 2036.857689
99.41878208 2930.4823 2216.504857
"""


def of_zener() -> Array:
    """Those that RheoJAX's notebook on Zener's model simulates (github.com/imewei/rheojax)."""
    omega, rng = np.logspace(-2, 3, 40), np.random.RandomState(42)
    clean = 1e4 + 5e4 * 1j * omega * 0.02 / (1 + 1j * omega * 0.02)
    storage, loss = (part + rng.normal(0, 0.015 * part) for part in (clean.real, clean.imag))
    return np.stack((omega, storage, loss))


def parsed(text: str) -> Array:
    return np.array([line.split() for line in text.strip().splitlines()], float).T


@pytest.mark.parametrize(
    ("sweep", "model", "published", "square_sum"),
    [
        (
            parsed(CHIA),
            "springpots_in_parallel",
            {
                "k_alpha": 5.058804241414604,
                "alpha": 0.7952219412109002,
                "k_beta": 65.25716756871952,
                "beta": 0.1278221383939005,
            },
            0.32976417668768987,
        ),
        (
            parsed(NETWORK),
            "springpots_in_series",
            {
                "k_alpha": 233.63452702300728,
                "alpha": 0.8476073158280852,
                "k_beta": 1251.164628150201,
                "beta": 0.2851735344039053,
            },
            0.10245295559785982,
        ),
        (of_zener(), "zener_maxwell", {"k": 49888, "k_p": 9968, "c": 998.79}, 2 * 8.197498e-3),
    ],
    ids=["pyRheo's chia", "pyRheo's network", "RheoJAX's Zener solid"],
)
def test_a_published_fit_has_its_misfit_and_lies_within_limits_about_a_lower_one(
    tmp_path: Path, sweep: Array, model: str, published: dict[str, float], square_sum: float
) -> None:
    """Standard deviations are a share of each modulus as it was read, as in these programs."""
    omega, *moduli = sweep

    def square_sum_of(*parameters: float) -> float:
        whole = IMPEDANCES[model](1j * omega, *parameters)
        away = np.append(whole.real, whole.imag) / np.ravel(moduli) - 1
        return float(away @ away)

    assert square_sum_of(*published.values()) == pytest.approx(square_sum, rel=1e-6)
    sd = np.sqrt(square_sum / (2 * len(omega))) * np.array(moduli)
    file, header = tmp_path / "sweep.csv", "omega in rad/s,storage in Pa,loss in Pa,sd,loss_sd"
    np.savetxt(file, np.c_[omega, *moduli, *sd], delimiter=",", header=header, comments="")
    options = ["--reading=storage=storage in Pa", "--reading=loss=loss in Pa", "--model", model]
    options += ["--frequency=omega in rad/s", "--sd=sd", "--set=measurement.loss_sd=loss_sd"]
    found = by_quantity(identified(tmp_path, file, *options))
    assert square_sum_of(*(found[name]["value"] for name in published)) < square_sum * (1 + 1e-6)
    for name, value in published.items():
        assert found[name]["low"] < value < found[name]["high"]
