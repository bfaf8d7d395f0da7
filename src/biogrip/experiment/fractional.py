"""Fractional (power-law) models: a springpot with a parallel spring, or a damper in series.

A springpot (`biogrip.experiment.springpot`) has a modulus k_alpha (N/m, at 1 rad/s) and an
exponent alpha. Both models are represented by Maxwell branches, as a `Network` like all other
models.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from biogrip.experiment.network import Network, columns_of
from biogrip.experiment.sample_model import K_P, C, Parameter, SampleModel
from biogrip.experiment.springpot import BRANCH_RATES_PER_S, ladder
from biogrip.interlacing import interlaced_zeros


def fractional_kelvin_voigt(parameters: ArrayLike) -> Network:
    r"""Return fractional Kelvin-Voigt solids; columns k_p, k_alpha, alpha.

    Their creep compliance is t^alpha/k_alpha E_(alpha,1+alpha)(-(k_p/k_alpha) t^alpha); with
    k_p = 0 it is that of a springpot, the power law of creeping cells. The spring makes them
    recover.

    ::

              +------/\/\/-------+
        B o---+       k_p        +---o C
              +-------<  >-------+
                 k_alpha, alpha
    """
    k_p, modulus, exponent = columns_of(parameters)
    springpot = ladder(modulus, exponent)
    return Network(
        k_p=k_p + springpot.spring,
        c_p=springpot.damper,
        k=springpot.springs.T,
        c=(springpot.springs / BRANCH_RATES_PER_S[:, None]).T,
    )


def fractional_maxwell(parameters: ArrayLike) -> Network:
    r"""Return fractional Maxwell liquids, springpot and damper in series; k_alpha, alpha, c.

    Cells follow a power law at short times and flow at long ones, as with a damper in series
    with the springpot [1]. A spring in series would show before the power law, where none has
    been observed in cells. The creep compliance is t^alpha/(k_alpha Gamma(1+alpha)) + t/c, the
    relaxation modulus k_alpha t^-alpha E_(1-alpha,1-alpha)(-(k_alpha/c) t^(1-alpha)).

    With L the springpot's impedance, the model's is c s - (c s)^2 / (c s + L), so its branches
    relax at the zeros of c s + L.

    ::

        B o---<  >------[==]---o C
         k_alpha, alpha   c

    References
    ----------
    .. [1] A. Bonfanti, J. Fouchard, N. Khalilgharibi, G. Charras and A. Kabla, A unified
       rheological model for cells and cellularised materials, Royal Society Open Science 7
       (2020), 190920: a springpot and a damper in series, with a spring beside both.
    """
    modulus, exponent, c = columns_of(parameters)
    springpot = ladder(modulus, exponent)
    weights = np.concatenate((springpot.spring[None], springpot.springs))
    poles = np.append(0.0, BRANCH_RATES_PER_S)[:, None] * np.ones(len(c))
    zeros = interlaced_zeros(weights, poles, springpot.damper + c)
    steepness = np.zeros_like(zeros.beyond)
    for weight, pole in zip(weights, poles, strict=True):
        steepness = steepness + weight / zeros.from_pole(pole) ** 2
    k = c**2 / steepness
    return Network(
        k_p=np.zeros_like(c),
        c_p=c * springpot.damper / (c + springpot.damper),
        k=k.T,
        c=(k / zeros.values).T,
    )


_K_ALPHA = Parameter("k_alpha", "springpot", "springpot, modulus at 1 rad/s", "k")
_ALPHA = Parameter("alpha", "exponent", "exponent of the springpot", "alpha", below=1.0)

FRACTIONAL_KELVIN_VOIGT = SampleModel(
    "fractional_kelvin_voigt",
    "fractional Kelvin-Voigt solid",
    (replace(K_P, meaning="parallel spring"), _K_ALPHA, _ALPHA),
    fractional_kelvin_voigt,
    example=(0.3, 10.0, 0.4),
    contains={"kelvin_voigt": lambda k_p, c_p: (k_p, c_p, 1.0)},
)
FRACTIONAL_MAXWELL = SampleModel(
    "fractional_maxwell",
    "fractional Maxwell liquid",
    (_K_ALPHA, _ALPHA, replace(C, meaning="series damper")),
    fractional_maxwell,
    example=(10.0, 0.3, 300.0),
    contains={"maxwell": lambda k, c: (k, 0.0, c)},
)
