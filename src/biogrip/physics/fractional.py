"""Fractional (power-law) models: springpots, alone and with springs, dampers or one another.

A springpot (`biogrip.physics.springpot`) has a modulus k_alpha (N/m, at 1 rad/s) and an
exponent alpha. All models are represented by Maxwell branches, as a `Network` like all other
models. J is the creep compliance, G the relaxation modulus (N/m), t in seconds. Names of other
programs, and what the models are for, are in [1] and in `docs/model.md`.

References
----------
.. [1] A. Bonfanti, J. L. Kaplan, G. Charras and A. Kabla, Fractional viscoelastic models for
   power-law materials, Soft Matter 16 (2020), 6002-6020.
"""

from dataclasses import replace
from math import inf

from numpy.typing import ArrayLike

from biogrip.physics.sample_model import C_P, K_P, C, K, Network, Parameter, SampleModel, columns_of
from biogrip.physics.springpot import damper, ladder, series, spring


def springpot(parameters: ArrayLike) -> Network:
    r"""Return springpots, the power law of creeping cells; columns k_alpha, alpha.

    J is t^alpha/(k_alpha Gamma(1+alpha)), G is k_alpha t^-alpha/Gamma(1-alpha).

    ::

        B o---<  >---o C
         k_alpha, alpha
    """
    return ladder(*columns_of(parameters)).network


def fractional_kelvin_voigt(parameters: ArrayLike) -> Network:
    r"""Return fractional Kelvin-Voigt solids; columns k_p, k_alpha, alpha.

    Their creep compliance is t^alpha/k_alpha E_(alpha,1+alpha)(-(k_p/k_alpha) t^alpha). The
    spring makes them recover.

    ::

              +------/\/\/-------+
        B o---+       k_p        +---o C
              +-------<  >-------+
                 k_alpha, alpha
    """
    k_p, modulus, exponent = columns_of(parameters)
    return (ladder(modulus, exponent) + spring(k_p)).network


def springpot_beside_damper(parameters: ArrayLike) -> Network:
    r"""Return springpots with a parallel damper; columns k_alpha, alpha, c_p.

    J is t/c_p E_(1-alpha,2)(-(k_alpha/c_p) t^(1-alpha)), G that of the springpot: the damper
    slows what is fast, as a liquid around the sample would.

    ::

                 k_alpha, alpha
              +-------<  >-------+
        B o---+                  +---o C
              +-------[==]-------+
                      c_p
    """
    modulus, exponent, c_p = columns_of(parameters)
    return (ladder(modulus, exponent) + damper(c_p)).network


def springpots_in_parallel(parameters: ArrayLike) -> Network:
    r"""Return springpots side by side; columns k_alpha, alpha, k_beta, beta with alpha > beta.

    With a = alpha - beta, J is t^alpha/k_alpha E_(a,1+alpha)(-(k_beta/k_alpha) t^a); G is the sum
    of both. The exponent alpha shows at short times, beta at long ones.

    ::

                 k_alpha, alpha
              +-------<  >-------+
        B o---+                  +---o C
              +-------<  >-------+
                  k_beta, beta
    """
    modulus, exponent, k_beta, beta = columns_of(parameters)
    return (ladder(modulus, exponent) + ladder(k_beta, beta)).network


def springpots_in_series(parameters: ArrayLike) -> Network:
    r"""Return springpots in series; columns k_alpha, alpha, k_beta, beta with alpha > beta.

    With a = alpha - beta, G is k_beta t^-beta E_(a,1-beta)(-(k_beta/k_alpha) t^a); J is the sum of
    both. The exponent beta shows at short times, alpha at long ones.

    ::

        B o---<  >------------<  >---o C
         k_alpha, alpha   k_beta, beta
    """
    modulus, exponent, k_beta, beta = columns_of(parameters)
    return series(ladder(modulus, exponent), ladder(k_beta, beta))


def fractional_maxwell(parameters: ArrayLike) -> Network:
    r"""Return fractional Maxwell liquids, springpot and damper in series; k_alpha, alpha, c.

    Cells follow a power law at short times and flow at long ones, as with a damper in series
    with the springpot [1]. A spring in series would show before the power law, where none has
    been observed in cells. The creep compliance is t^alpha/(k_alpha Gamma(1+alpha)) + t/c, the
    relaxation modulus k_alpha t^-alpha E_(1-alpha,1-alpha)(-(k_alpha/c) t^(1-alpha)).

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
    return series(damper(c), ladder(modulus, exponent))


def fractional_maxwell_gel(parameters: ArrayLike) -> Network:
    r"""Return fractional Maxwell gels, spring and springpot in series; k, k_alpha, alpha.

    J is 1/k + t^alpha/(k_alpha Gamma(1+alpha)), G is k E_alpha(-(k/k_alpha) t^alpha).

    ::

        B o---/\/\/-------<  >---o C
                k     k_alpha, alpha
    """
    k, modulus, exponent = columns_of(parameters)
    return series(spring(k), ladder(modulus, exponent))


def fractional_zener(parameters: ArrayLike) -> Network:
    r"""Return fractional Zener solids, gels with a parallel spring; k, k_p, k_alpha, alpha.

    G is k_p + k E_alpha(-(k/k_alpha) t^alpha) and J is 1/k_p - (1/k_p - 1/(k + k_p))
    E_alpha(-(t/tau)^alpha) with tau^alpha = k_alpha (1/k + 1/k_p): elastic at once and in the end.

    ::

              +---/\/\/-------<  >------+
        B o---+     k    k_alpha, alpha +---o C
              +---------/\/\/-----------+
                         k_p
    """
    k, k_p, modulus, exponent = columns_of(parameters)
    gel = series(spring(k), ladder(modulus, exponent))
    return replace(gel, k_p=gel.k_p + k_p)


def fractional_solid(parameters: ArrayLike) -> Network:
    r"""Return fractional Maxwell liquids with a parallel spring; columns k_p, k_alpha, alpha, c.

    The model of cells in [1] of `fractional_maxwell`: a power law, whose damper flows until the
    spring bears the load. G is k_p and that of the liquid; J has no form of one Mittag-Leffler
    function.

    ::

              +-----<  >--------[==]----+
        B o---+ k_alpha, alpha    c     +---o C
              +---------/\/\/-----------+
                         k_p
    """
    k_p, *of_liquid = columns_of(parameters)
    modulus, exponent, c = of_liquid
    liquid = series(damper(c), ladder(modulus, exponent))
    return replace(liquid, k_p=liquid.k_p + k_p)


def fractional_jeffreys(parameters: ArrayLike) -> Network:
    r"""Return fractional Maxwell liquids with a parallel damper; columns k_alpha, alpha, c, c_p.

    J is t/(c + c_p) + t (1/c_p - 1/(c + c_p)) E_(a,2)(-(k_alpha (1/c + 1/c_p)) t^a) with
    a = 1 - alpha; G is that of the liquid.

    ::

              +-----<  >--------[==]----+
        B o---+ k_alpha, alpha    c     +---o C
              +---------[==]------------+
                         c_p
    """
    modulus, exponent, c, c_p = columns_of(parameters)
    liquid = series(damper(c), ladder(modulus, exponent))
    return replace(liquid, c_p=liquid.c_p + c_p)


_K_ALPHA = Parameter("k_alpha", "springpot", "springpot, modulus at 1 rad/s", "k")
_ALPHA = Parameter("alpha", "exponent", "exponent of the springpot", "alpha", below=1.0)
_K_BESIDE = replace(K_P, meaning="parallel spring")
_C_BEHIND = replace(C, meaning="series damper")
_ONE = (_K_ALPHA, _ALPHA)
_TWO = (
    *_ONE,
    replace(_K_ALPHA, name="k_beta", meaning="other springpot, modulus at 1 rad/s"),
    replace(_ALPHA, name="beta", meaning="exponent of the other springpot, below alpha"),
)
_IN_ORDER = (("k_beta", "beta"), ("k_alpha", "alpha"))

SPRINGPOT = SampleModel(
    "springpot",
    "springpot",
    _ONE,
    springpot,
    example=(10.0, 0.4),
    contains={"damper": lambda c_p: (c_p, 1.0)},
)
FRACTIONAL_KELVIN_VOIGT = SampleModel(
    "fractional_kelvin_voigt",
    "fractional Kelvin-Voigt solid",
    (_K_BESIDE, *_ONE),
    fractional_kelvin_voigt,
    example=(0.3, 10.0, 0.4),
    contains={
        "kelvin_voigt": lambda k_p, c_p: (k_p, c_p, 1.0),
        "springpot": lambda k_alpha, alpha: (0.0, k_alpha, alpha),
    },
)
SPRINGPOT_BESIDE_DAMPER = SampleModel(
    "springpot_beside_damper",
    "springpot and damper in parallel",
    (*_ONE, C_P),
    springpot_beside_damper,
    example=(10.0, 0.3, 20.0),
    contains={
        "springpot": lambda k_alpha, alpha: (k_alpha, alpha, 0.0),
        "kelvin_voigt": lambda k_p, c_p: (k_p, 0.0, c_p),
    },
)
SPRINGPOTS_IN_PARALLEL = SampleModel(
    "springpots_in_parallel",
    "two springpots in parallel",
    _TWO,
    springpots_in_parallel,
    example=(20.0, 0.8, 5.0, 0.2),
    branches=_IN_ORDER,
    contains={
        "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (k_alpha, alpha, k_p, 0.0),
        "springpot_beside_damper": lambda k_alpha, alpha, c_p: (c_p, 1.0, k_alpha, alpha),
    },
)
FRACTIONAL_MAXWELL = SampleModel(
    "fractional_maxwell",
    "fractional Maxwell liquid",
    (*_ONE, _C_BEHIND),
    fractional_maxwell,
    example=(10.0, 0.3, 300.0),
    contains={
        "maxwell": lambda k, c: (k, 0.0, c),
        "springpot": lambda k_alpha, alpha: (k_alpha, alpha, inf),
    },
)
FRACTIONAL_MAXWELL_GEL = SampleModel(
    "fractional_maxwell_gel",
    "fractional Maxwell gel",
    (replace(K, meaning="series spring"), *_ONE),
    fractional_maxwell_gel,
    example=(8.0, 20.0, 0.4),
    contains={
        "maxwell": lambda k, c: (k, c, 1.0),
        "springpot": lambda k_alpha, alpha: (inf, k_alpha, alpha),
    },
)
SPRINGPOTS_IN_SERIES = SampleModel(
    "springpots_in_series",
    "two springpots in series",
    _TWO,
    springpots_in_series,
    example=(60.0, 0.8, 10.0, 0.2),
    branches=_IN_ORDER,
    contains={
        "fractional_maxwell": lambda k_alpha, alpha, c: (c, 1.0, k_alpha, alpha),
        "fractional_maxwell_gel": lambda k, k_alpha, alpha: (k_alpha, alpha, k, 0.0),
    },
)
FRACTIONAL_ZENER = SampleModel(
    "fractional_zener",
    "fractional Zener solid",
    (replace(K, meaning="series spring"), _K_BESIDE, *_ONE),
    fractional_zener,
    example=(8.0, 1.0, 20.0, 0.4),
    contains={
        "zener_maxwell": lambda k, k_p, c: (k, k_p, c, 1.0),
        "fractional_maxwell_gel": lambda k, k_alpha, alpha: (k, 0.0, k_alpha, alpha),
        "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (inf, k_p, k_alpha, alpha),
    },
)
FRACTIONAL_SOLID = SampleModel(
    "fractional_solid",
    "fractional Maxwell liquid and spring in parallel",
    (_K_BESIDE, *_ONE, _C_BEHIND),
    fractional_solid,
    example=(1.0, 10.0, 0.3, 300.0),
    contains={
        "zener_maxwell": lambda k, k_p, c: (k_p, k, 0.0, c),
        "fractional_maxwell": lambda k_alpha, alpha, c: (0.0, k_alpha, alpha, c),
        "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (k_p, k_alpha, alpha, inf),
    },
)
FRACTIONAL_JEFFREYS = SampleModel(
    "fractional_jeffreys",
    "fractional Jeffreys liquid",
    (*_ONE, _C_BEHIND, C_P),
    fractional_jeffreys,
    example=(10.0, 0.3, 300.0, 20.0),
    contains={
        "fractional_maxwell": lambda k_alpha, alpha, c: (k_alpha, alpha, c, 0.0),
        "springpot_beside_damper": lambda k_alpha, alpha, c_p: (k_alpha, alpha, inf, c_p),
    },
)
FRACTIONAL_MODELS = (
    SPRINGPOT,
    FRACTIONAL_KELVIN_VOIGT,
    SPRINGPOT_BESIDE_DAMPER,
    SPRINGPOTS_IN_PARALLEL,
    FRACTIONAL_MAXWELL,
    FRACTIONAL_MAXWELL_GEL,
    SPRINGPOTS_IN_SERIES,
    FRACTIONAL_ZENER,
    FRACTIONAL_SOLID,
    FRACTIONAL_JEFFREYS,
)
