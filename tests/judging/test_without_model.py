"""Limits over all linear samples: held against fits written out here, and known samples."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.stats import chi2

from biogrip.arrays import Array
from biogrip.fit.any_sample import fit_any_sample
from biogrip.judging.profiles import BOUNDED_ABOVE, BOUNDED_BELOW, DETERMINED, NOT_DETERMINED
from biogrip.judging.without_model import (
    _ADDED,
    LEVEL,
    LinearLimits,
    WithoutModel,
    _Excess,
    _Functional,
    _next_trial,
    tell_without_model,
    times_told,
)
from biogrip.library import Sample, set_up
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import Phase, hold, ramp
from tests.helpers.problems import GRIPPER

TIMES = np.geomspace(0.1, 100.0, 80)
EVEN = np.arange(0.25, 100.0, 0.5)
HELD = (hold(101.0, 1.0),)


def tell(
    time_s: Array,
    readings: Array,
    phases: tuple[Phase, ...] = HELD,
    reads: str = "stress",
    gripper: Gripper | None = None,
    at_s: Sequence[float] = (),
    **known: Any,
) -> WithoutModel:
    """What a trace tells without a model."""
    posed = replace(set_up(gripper or INSTRUMENTS[reads], phases, Sample("maxwell")), **known)
    residuals = posed.of(time_s, readings).residuals
    return tell_without_model(residuals, confidence=0.95, at_s=at_s)


def by_name(found: WithoutModel) -> dict[str, LinearLimits]:
    return {each.quantity: each for each in found.told}


def between(told: LinearLimits) -> tuple[float, float]:
    assert told.low is not None
    assert told.high is not None
    return told.low, told.high


def noise(size: float, seed: int = 0, count: int = len(TIMES)) -> Array:
    return size * np.random.default_rng(seed).standard_normal(count)


def zener(time_s: Array) -> Array:
    return 100 + 80 * np.exp(-time_s / 20)


def fitted(rows: Array, readings: Array) -> tuple[float, int]:
    """Least sum of squares of non-negative combinations, and how many rates these have."""
    amplitudes, norm = nnls(rows, readings, maxiter=10**5)
    own = np.append(False, amplitudes > 0)
    return float(norm**2), int(np.sum(own[1:] & ~own[:-1]))


RATES = np.append(0.0, np.geomspace(1e-4, 200.0, 400))
# Springs and dampers of a solid beside one another, and behind one another under a load; an offset.
RELAXED = np.exp(-np.outer(TIMES, RATES))
YIELDED = np.column_stack((1 - RELAXED[:, 1:], TIMES))


@pytest.mark.parametrize("seed", [0, 1])
def test_a_limit_is_where_chi_squared_has_risen(seed: int) -> None:
    """By plain fits on a grid ten times as fine, to the accuracy of limits.

    It rises further for each rate by which a fit has fewer than the best.
    """
    readings = zener(TIMES) + noise(3.6, seed)
    found = by_name(tell(TIMES, readings, noise_sd=3.6))
    tiny = by_name(tell(TIMES, 1e-9 * readings, noise_sd=3.6e-9))
    assert {n: it.verdict for n, it in tiny.items()} == {n: it.verdict for n, it in found.items()}
    least, best = fitted(RELAXED, readings)
    left = np.exp(-RATES * 10)
    slope, omega = 10 * RATES * left, 0.1
    shown = omega / (omega**2 + RATES**2) * (RATES * TIMES[0] <= 1)
    lossy, elastic = RATES * shown, omega * shown
    for quantity, above, below in (
        ("G(10 s)", left, 0 * left),
        ("G at rest", (RATES == 0) * 1.0, 0 * left),
        ("exponent(10 s)", slope, left),
        ("G'(0.1 rad/s)", elastic, 0 * left),
        ("tan delta(0.1 rad/s)", lossy, elastic),
    ):
        for end in (found[quantity].low, found[quantity].high):
            if end is not None:
                held = above - end * below
                value = np.append(readings, 0.0 if below.any() else 1e4 * end)
                squares, rates = fitted(np.vstack((RELAXED, 1e4 * held)), value)
                wanted = chi2.isf(0.05, 1 + max(best - rates, 0))
                risen = (squares - least) / 3.6**2
                assert risen == pytest.approx(wanted, abs=0.05), quantity


def test_a_liquid_under_a_ramp_has_no_exponent() -> None:
    """Its modulus at 1 s, which the slope is divided by, is zero but for the noise."""
    readings = np.where(EVEN < 5, 0.2, 0.0) + noise(0.004, 1, len(EVEN))
    found = by_name(tell(EVEN, readings, (ramp(5.0, 0.0, 1.0), hold(95.0, 1.0))))
    assert found["exponent(1 s)"].verdict == NOT_DETERMINED


def test_limits_of_creep_with_an_offset() -> None:
    """A constant of either sign is two columns; increments do not feel it."""
    clean = 2 + 1 / 3 + 0.5 * (1 - np.exp(-TIMES / 20)) + TIMES / 200
    readings = clean + noise(0.02)
    found = by_name(tell(TIMES, readings, reads="strain", noise_sd=0.02, offset=True))
    rows = np.column_stack((YIELDED, np.ones_like(TIMES), -np.ones_like(TIMES)))
    least, _ = fitted(rows, readings)
    rise = found["J(10 s) - J(1 s)"]
    held = np.append(np.exp(-RATES[1:]) - np.exp(-10 * RATES[1:]), [9.0, 0.0, 0.0])
    for end in between(rise):
        squares, _ = fitted(np.vstack((rows, 1e4 * held)), np.append(readings, 1e4 * end))
        assert (squares - least) / 0.02**2 == pytest.approx(3.841, abs=0.05)
    assert found["J(10 s)"].high is None


def test_a_gripper_tells_the_stiffness_beside_its_arms() -> None:
    """A Maxwell liquid between arms lets them turn from 1/(k_g + 2 b^2 k) to 1/k_g per torque."""
    k, c, k_g = 0.2, 3.0, GRIPPER.left.stiffness_Nm_per_rad
    area = 2 * GRIPPER.lever_m**2
    rate = k_g * k / (c * (k_g + area * k))

    def turned(time_s: Array) -> Array:
        left = 1 / k_g - (1 / k_g - 1 / (k_g + area * k)) * np.exp(-rate * time_s)
        return np.where(time_s > 0, left, 0.0)

    clean = 1.6e-9 * turned(EVEN) - 1.28e-9 * turned(EVEN - 50)
    size = 1e-3 * float(clean.max())
    phases = hold(50.0, 1.6e-9), hold(50.0, 0.32e-9)
    found = by_name(tell(EVEN, clean + noise(size, 0, len(EVEN)), phases, gripper=GRIPPER))
    for at in (1.0, 10.0):
        value = (1 / turned(np.array([at]))[0] - k_g) / area
        told = found[f"K({at:g} s)"]
        assert told.unit == "N/m"
        low, high = between(told)
        assert low < value < high < 1.1 * low
    assert found["K at once"].verdict == BOUNDED_BELOW
    assert 0.9 * k < (found["K at once"].low or 0.0) < k
    assert found["K at rest"].low is None


def test_limits_beyond_the_readings_are_one_sided() -> None:
    found = by_name(tell(TIMES, zener(TIMES) + noise(3.6), at_s=[0.01, 1.0, 1000.0]))
    ends = {"G at once": BOUNDED_BELOW, "G at rest": BOUNDED_ABOVE, "G(1 s)": DETERMINED}
    ends |= {"G(0.01 s)": BOUNDED_BELOW, "G(1000 s)": BOUNDED_ABOVE}
    assert {name: found[name].verdict for name in ends} == ends
    assert not {"exponent(0.01 s)", "G'(100 rad/s)", "G'(0.001 rad/s)"} & set(found)
    assert {"exponent(1 s)", "G'(1 rad/s)"} < set(found)
    compliance = 1 / 3 + TIMES / 200
    flows = by_name(tell(TIMES, compliance + noise(0.01), reads="strain", at_s=[0.01, 1.0, 1000.0]))
    ends = {"J(0.01 s)": BOUNDED_ABOVE, "J(1000 s)": BOUNDED_BELOW, "viscosity": BOUNDED_BELOW}
    assert {name: flows[name].verdict for name in ends} == ends
    assert flows["viscosity"].low == pytest.approx(200, rel=0.1)


@pytest.mark.parametrize("seed", range(8))
def test_a_creep_that_ends_says_how_viscous_a_flow_could_be(seed: int) -> None:
    """Whether the best fit has a slow flow or none, one that shows at the end is excluded.

    A flow of 1/viscosity reaches 100/viscosity, which has to be below ten times the noise of 0.01.
    """
    times = np.arange(0.5, 100.1, 0.5)
    compliance = 1 / 2 + (1 - np.exp(-times / 5)) / 3 + noise(0.01, seed, 200)
    found = by_name(tell(times, compliance, (hold(100.0, 1.0),), reads="strain"))
    viscosity = found["viscosity"]
    assert viscosity.verdict == BOUNDED_BELOW
    assert (viscosity.low or 0.0) > 1000


def test_a_ramp_shows_what_a_step_hides() -> None:
    """Of a damper beside a spring the force under a step is the spring's alone."""
    hidden = by_name(tell(TIMES, 100 + noise(1.0)))
    for quantity, most in (("G''(1 rad/s)", 1.0), ("exponent(1 s)", 0.01)):
        assert hidden[quantity].low is None
        assert (hidden[quantity].high or np.inf) < most
    force = 20 * EVEN + 200 * (EVEN < 5)
    force[EVEN > 5] = 100
    phases = ramp(5.0, 0.0, 1.0), hold(95.0, 1.0)
    found = tell(EVEN, force + noise(1.0, 0, len(EVEN)), phases)
    loss = by_name(found)["G''(1 rad/s)"]
    low, high = between(loss)
    assert low < 1000 < high < 1.2 * low


@pytest.mark.parametrize("known", [None, 3.6])
def test_what_no_linear_sample_does_is_told(known: float | None) -> None:
    """Relaxation that rises again; and, in known noise, what is far too large for it."""
    assert tell(TIMES, zener(TIMES) + noise(3.6), noise_sd=known).is_linear
    risen = zener(TIMES) + 30 * (TIMES > 20)
    assert not tell(TIMES, risen + noise(3.6), noise_sd=known).is_linear
    assert tell(TIMES, zener(TIMES) + noise(20.0)).is_linear
    assert not tell(TIMES, zener(TIMES) + noise(20.0), noise_sd=3.6).is_linear


def test_a_misfit_of_any_sample_widens_limits() -> None:
    """Limits count as many independent residuals as a wave of ten periods has."""
    wave, rest = 3.6 * np.sin(2 * np.pi * EVEN / 10), noise(0.36, 0, len(EVEN))
    both = tell(EVEN, zener(EVEN) + rest), tell(EVEN, zener(EVEN) + wave + rest)
    clear, wavy = (np.ptp(between(by_name(each)["G(10 s)"])) for each in both)
    assert wavy > 10 * clear


def test_a_damper_has_a_loss_tangent_without_an_upper_limit() -> None:
    flows = by_name(tell(TIMES, TIMES / 200 + noise(0.01), reads="strain"))
    assert flows["tan delta(0.1 rad/s)"].verdict == BOUNDED_BELOW


def test_what_is_nothing_but_rounding_has_no_lower_limit() -> None:
    """The slope of a branch that was gone long before: 1e-309, beside what others could add."""
    posed = set_up(INSTRUMENTS["stress"], HELD, Sample("maxwell"))
    fit = fit_any_sample(posed.of(TIMES, zener(TIMES) + noise(0.1)).residuals)
    own = fit.lags.rates[fit.amplitudes > 0]

    def slope(_: float, rates: Array) -> Array:
        return np.where(np.isin(rates, own), 1e-311, 1.0)

    profile = _Excess(fit, _Functional("slope", LEVEL, 10.0, "", slope), lambda more: 2.0)
    assert 0 < profile.best < 1e-305
    assert profile.limit(-1) is None


@pytest.mark.parametrize("count", [4, 6, 10])
@pytest.mark.parametrize("size", [1e-7, 1e-3])
def test_few_readings_are_no_error(count: int, size: float) -> None:
    """As many lags as readings leave nothing to test; limits hold the best fit."""
    time_s = np.linspace(10.0, 100.0, count)
    creeps = (time_s / 100) ** 0.3 + noise(size, 0, count)
    for each in tell(time_s, creeps, reads="strain").told:
        if each.low is not None and each.high is not None:
            assert each.low <= (each.value or 0.0) <= each.high


def test_what_lags_add_at_4_s() -> None:
    """Of rates whose product with the time is 1 and 2."""
    one, two = np.exp([-1.0, -2.0])
    added = {name: of(4.0, np.array([0.25, 0.5])).tolist() for name, of in _ADDED.items()}
    assert added == {
        "left": pytest.approx([one, two]),
        "yielded": pytest.approx([1 - one, 1 - two]),
        "per second": pytest.approx([0.25 * one, 0.5 * two]),
        "per e-fold": pytest.approx([one, 2 * two]),
        "lasting": [1, 0],
        "flowing": [0.25, 0],
        "all": [1, 1],
        "slow": pytest.approx([0.5, 0.2]),
        "fast": pytest.approx([0.5, 0.8]),
        "lost": pytest.approx([0.5, 0.4]),
    }


def test_other_starts_widen_limits_of_what_all_of_them_tell() -> None:
    told, found = (
        LinearLimits("G(1 s)", LEVEL, 1.0, "Pa", 15.0, 14.0, 16.0),
        tell(TIMES, zener(TIMES)),
    )
    own, other, none = (
        replace(found, told=each) for each in ([told], [replace(told, low=13.0, high=15.5)], [])
    )
    assert own.widened([other]).told == [replace(told, low=13.0, high=16.0)]
    assert own.widened([other, none]).told == [replace(told, value=None, low=None, high=None)]


def test_times_at_which_it_is_told() -> None:
    assert times_told(0.3, 80.0) == [1.0, 10.0]
    assert times_told(3.0, 80.0) == [5.0, 10.0, 20.0, 50.0]
    assert times_told(12.0, 80.0) == [20.0, 50.0]


def test_words_are_those_of_a_verdict() -> None:
    ends = [(15.0, 14.0, 16.0), (None, 14.0, None), (None, None, 16.0), (None, None, None)]
    told = [LinearLimits("G(1 s)", LEVEL, 1.0, "Pa", *each) for each in ends]
    verdicts = [DETERMINED, BOUNDED_BELOW, BOUNDED_ABOVE, NOT_DETERMINED]
    assert [each.verdict for each in told] == verdicts
    words = ["15.0 Pa (14.0 to 16.0)", "at least 14 Pa", "at most 16 Pa", "not determined"]
    assert [each.words() for each in told] == words


@pytest.mark.parametrize(
    ("aim", "far", "halve", "tried"),
    [
        (3.0, 10.0, True, 3.0),
        # Beyond the far end, or at an end: halfway between 2 and 10, where the excess is known.
        (12.0, 10.0, True, 6.0),
        (2.0, 10.0, True, 6.0),
        # Where nothing is known beyond, no further than that.
        (12.0, 10.0, False, 10.0),
        (3.0, 10.0, False, 3.0),
    ],
)
def test_the_next_value_is_between_those_known(
    aim: float, far: float, halve: bool, tried: float
) -> None:
    assert _next_trial(aim, 2.0, far, halve=halve) == tried
