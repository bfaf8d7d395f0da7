"""Fractional (power-law) models: springpots, alone and with springs, dampers or one another.

A springpot (`biogrip.physics.springpot`) has a modulus k_alpha (N/m, at 1 rad/s) and an exponent
alpha; with a second one, k_beta and beta < alpha. All models are represented by Maxwell branches,
as a `Network` like all other models. J is the creep compliance, G the relaxation modulus (N/m), t
in seconds, E_(a,b) the Mittag-Leffler function, a = alpha - beta [1]_. What they are for, and their
names in other programs, is in `docs/model.md`.

`springpot`, the power law of creeping cells: --<>--
    J = t^alpha/(k_alpha Gamma(1+alpha)), G = k_alpha t^-alpha/Gamma(1-alpha)
`fractional_kelvin_voigt`, a solid that recovers: --<>-- beside a spring k_p
    J = t^alpha/k_alpha E_(alpha,1+alpha)(-(k_p/k_alpha) t^alpha)
`springpot_beside_damper`, slowed where it is fast as by a liquid around it: --<>-- beside c_p
    J = t/c_p E_(1-alpha,2)(-(k_alpha/c_p) t^(1-alpha)), G that of the springpot
`springpots_in_parallel`, alpha at short times and beta at long ones: --<>-- beside --<>--
    J = t^alpha/k_alpha E_(a,1+alpha)(-(k_beta/k_alpha) t^a), G the sum of both
`springpots_in_series`, beta at short times and alpha at long ones: --<>---<>--
    G = k_beta t^-beta E_(a,1-beta)(-(k_beta/k_alpha) t^a), J the sum of both
`fractional_maxwell`, a power law that flows at long times, as cells do [2]_: --<>---[==]-- c
    J = t^alpha/(k_alpha Gamma(1+alpha)) + t/c,
    G = k_alpha t^-alpha E_(1-alpha,1-alpha)(-(k_alpha/c) t^(1-alpha))
`fractional_maxwell_gel`: a spring k in series with --<>--
    J = 1/k + t^alpha/(k_alpha Gamma(1+alpha)), G = k E_alpha(-(k/k_alpha) t^alpha)
`fractional_zener`, elastic at once and in the end: the gel beside a spring k_p
    G = k_p + k E_alpha(-(k/k_alpha) t^alpha),
    J = 1/k_p - (1/k_p - 1/(k+k_p)) E_alpha(-(t/tau)^alpha), tau^alpha = k_alpha (1/k + 1/k_p)
`fractional_solid`, which flows until the spring bears the load [2]_: the liquid beside k_p
    G = k_p and that of `fractional_maxwell`
`fractional_jeffreys`: the liquid `fractional_maxwell` beside a damper c_p
    J = t/(c+c_p) + t (1/c_p - 1/(c+c_p)) E_(1-alpha,2)(-(k_alpha (1/c + 1/c_p)) t^(1-alpha)),
    G that of the liquid

References
----------
.. [1] A. Bonfanti, J. L. Kaplan, G. Charras and A. Kabla, Fractional viscoelastic models for
   power-law materials, Soft Matter 16 (2020), 6002-6020.
.. [2] A. Bonfanti, J. Fouchard, N. Khalilgharibi, G. Charras and A. Kabla, A unified rheological
   model for cells and cellularised materials, Royal Society Open Science 7 (2020), 190920: a
   springpot and a damper in series, with a spring beside both.
"""

from dataclasses import replace
from math import inf

from biogrip.arrays import Array
from biogrip.physics.sample_model import C_P, K_P, C, K, Network, Parameter, SampleModel, of_columns
from biogrip.physics.springpot import damper, ladder, series, spring


def _liquid(k_alpha: Array, alpha: Array, c: Array) -> Network:
    return series(damper(c), ladder(k_alpha, alpha))


def _gel(k: Array, k_alpha: Array, alpha: Array) -> Network:
    return series(spring(k), ladder(k_alpha, alpha))


def _zener(k: Array, k_p: Array, k_alpha: Array, alpha: Array) -> Network:
    gel = _gel(k, k_alpha, alpha)
    return replace(gel, k_p=gel.k_p + k_p)


def _solid(k_p: Array, k_alpha: Array, alpha: Array, c: Array) -> Network:
    liquid = _liquid(k_alpha, alpha, c)
    return replace(liquid, k_p=liquid.k_p + k_p)


def _jeffreys(k_alpha: Array, alpha: Array, c: Array, c_p: Array) -> Network:
    liquid = _liquid(k_alpha, alpha, c)
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

FRACTIONAL_MODELS = (
    SampleModel(
        "springpot",
        "springpot",
        _ONE,
        of_columns(lambda k_alpha, alpha: ladder(k_alpha, alpha).network),
        example=(10.0, 0.4),
        contains={"damper": lambda c_p: (c_p, 1.0)},
    ),
    SampleModel(
        "fractional_kelvin_voigt",
        "fractional Kelvin-Voigt solid",
        (_K_BESIDE, *_ONE),
        of_columns(lambda k_p, k_alpha, alpha: (ladder(k_alpha, alpha) + spring(k_p)).network),
        example=(0.3, 10.0, 0.4),
        contains={
            "kelvin_voigt": lambda k_p, c_p: (k_p, c_p, 1.0),
            "springpot": lambda k_alpha, alpha: (0.0, k_alpha, alpha),
        },
    ),
    SampleModel(
        "springpot_beside_damper",
        "springpot and damper in parallel",
        (*_ONE, C_P),
        of_columns(lambda k_alpha, alpha, c_p: (ladder(k_alpha, alpha) + damper(c_p)).network),
        example=(10.0, 0.3, 20.0),
        contains={
            "springpot": lambda k_alpha, alpha: (k_alpha, alpha, 0.0),
            "kelvin_voigt": lambda k_p, c_p: (k_p, 0.0, c_p),
        },
    ),
    SampleModel(
        "springpots_in_parallel",
        "two springpots in parallel",
        _TWO,
        of_columns(lambda *both: (ladder(*both[:2]) + ladder(*both[2:])).network),
        example=(20.0, 0.8, 5.0, 0.2),
        branches=_IN_ORDER,
        contains={
            "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (k_alpha, alpha, k_p, 0.0),
            "springpot_beside_damper": lambda k_alpha, alpha, c_p: (c_p, 1.0, k_alpha, alpha),
        },
    ),
    SampleModel(
        "fractional_maxwell",
        "fractional Maxwell liquid",
        (*_ONE, _C_BEHIND),
        of_columns(_liquid),
        example=(10.0, 0.3, 300.0),
        contains={
            "maxwell": lambda k, c: (k, 0.0, c),
            "springpot": lambda k_alpha, alpha: (k_alpha, alpha, inf),
        },
    ),
    SampleModel(
        "fractional_maxwell_gel",
        "fractional Maxwell gel",
        (replace(K, meaning="series spring"), *_ONE),
        of_columns(_gel),
        example=(8.0, 20.0, 0.4),
        contains={
            "maxwell": lambda k, c: (k, c, 1.0),
            "springpot": lambda k_alpha, alpha: (inf, k_alpha, alpha),
        },
    ),
    SampleModel(
        "springpots_in_series",
        "two springpots in series",
        _TWO,
        of_columns(lambda *both: series(ladder(*both[:2]), ladder(*both[2:]))),
        example=(60.0, 0.8, 10.0, 0.2),
        branches=_IN_ORDER,
        contains={
            "fractional_maxwell": lambda k_alpha, alpha, c: (c, 1.0, k_alpha, alpha),
            "fractional_maxwell_gel": lambda k, k_alpha, alpha: (k_alpha, alpha, k, 0.0),
        },
    ),
    SampleModel(
        "fractional_zener",
        "fractional Zener solid",
        (replace(K, meaning="series spring"), _K_BESIDE, *_ONE),
        of_columns(_zener),
        example=(8.0, 1.0, 20.0, 0.4),
        contains={
            "zener_maxwell": lambda k, k_p, c: (k, k_p, c, 1.0),
            "fractional_maxwell_gel": lambda k, k_alpha, alpha: (k, 0.0, k_alpha, alpha),
            "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (inf, k_p, k_alpha, alpha),
        },
    ),
    SampleModel(
        "fractional_solid",
        "fractional Maxwell liquid and spring in parallel",
        (_K_BESIDE, *_ONE, _C_BEHIND),
        of_columns(_solid),
        example=(1.0, 10.0, 0.3, 300.0),
        contains={
            "zener_maxwell": lambda k, k_p, c: (k_p, k, 0.0, c),
            "fractional_maxwell": lambda k_alpha, alpha, c: (0.0, k_alpha, alpha, c),
            "fractional_kelvin_voigt": lambda k_p, k_alpha, alpha: (k_p, k_alpha, alpha, inf),
        },
    ),
    SampleModel(
        "fractional_jeffreys",
        "fractional Jeffreys liquid",
        (*_ONE, _C_BEHIND, C_P),
        of_columns(_jeffreys),
        example=(10.0, 0.3, 300.0, 20.0),
        contains={
            "fractional_maxwell": lambda k_alpha, alpha, c: (k_alpha, alpha, c, 0.0),
            "springpot_beside_damper": lambda k_alpha, alpha, c_p: (k_alpha, alpha, inf, c_p),
        },
    ),
)
