"""Power-law samples: a springpot with a spring beside it, or a damper behind it.

A springpot (`biogrip.experiment.springpot`) has a modulus k_alpha (N/m, at 1 rad/s) and an
exponent alpha. Both models come out as Maxwell branches, as all others, so that whatever
follows from a `Network` holds for them.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from biogrip.experiment.network import Network, columns_of
from biogrip.experiment.sample_model import K_P, C, Parameter, SampleModel
from biogrip.experiment.springpot import BRANCH_RATES_PER_S, ladder
from biogrip.interlacing import interlaced_zeros


def fractional_kelvin_voigt(parameters: ArrayLike) -> Network:
    r"""Fractional Kelvin-Voigt solid; columns k_p, k_alpha, alpha.

    Its creep compliance is t^alpha/k_alpha E_(alpha,1+alpha)(-(k_p/k_alpha) t^alpha); with k_p
    = 0 it is a springpot, the power law that cells creep by. The spring is what brings
    them back.

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
    r"""Fractional Maxwell liquid, a springpot and a damper in series; columns k_alpha, alpha, c.

    Of the two elements that may stand behind a springpot cells ask for the damper [1]: they
    follow a power law for short, and flow in the end. A spring there would show before the
    power law does, where no cell was seen to have one. The creep compliance is
    t^alpha/(k_alpha Gamma(1+alpha)) + t/c, the modulus that relaxes k_alpha t^-alpha
    E_(1-alpha,1-alpha)(-(k_alpha/c) t^(1-alpha)).

    With L the springpot's impedance this one's is c s - (c s)^2 / (c s + L), so its branches
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
