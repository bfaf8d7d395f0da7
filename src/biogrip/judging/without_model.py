"""What any linear sample would show, whatever its model: quantities with limits, and a test.

A linear passive sample has a spectrum of relaxation times that is nowhere negative. Its relaxation
modulus G, its compliance J and what they are at a frequency are linear functionals of it, or ratios
of two. Their limits are the ends over all spectra whose sum of squares exceeds the least by no more
than a quantile of F, or of chi-squared if the noise is known [1]_, [2]_. Its degrees of freedom are
one, and one more for each lag by which the fit that holds the quantity has fewer than the best: at
the edge of what is not negative one is too few [3]_, [4]_. In each fit for a limit
one more row, of great weight, holds the quantity at a value v: f at v, or the ratio f/g by f - v g
at zero. The root of the excess is nearly linear in v: Newton's method takes two or three fits. What
the best fit leaves tells the noise.

In relaxation nothing is told of what relaxes before the first reading after a step. G' and G'' are
then those of what relaxes later, to which the rest would add. Between arms that yield, a load is
shared by arms and sample. Of a gripper, K is the force over the shortening at a time after a step
of the torque: at once and at rest it is the sample's stiffness.

References
----------
.. [1] B. W. Rust and W. R. Burrus, Mathematical Programming and the Numerical Solution of Linear
   Equations, Elsevier, 1972: limits of linear functionals of what is not negative.
.. [2] P. B. Stark, Journal of Geophysical Research 97 (1992), 14055-14082: duality.
.. [3] P. Batlle et al., arXiv:2310.02461 (2023): limits of functionals under constraints.
.. [4] E. Susko, Biometrika 100 (2013), 1019-1023: degrees of freedom that depend on the data.
"""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.special import chdtrc

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray
from biogrip.digits import plain, with_limits
from biogrip.fit.any_sample import AnySampleFit, Lags, count_lags, fit_any_sample
from biogrip.judging.likelihood import increase_at
from biogrip.judging.profiles import verdict_of
from biogrip.judging.what_moves import Move, as_moves, find_mistakes
from biogrip.judging.whiteness import as_correlated, correlated
from biogrip.physics.residuals import Residuals
from biogrip.physics.sample_model import inverse_of, per_second_of

# First digits of the times at which quantities are told and, where these are too few, of more.
_FIRST_DIGITS, _FEWEST_TIMES = ((1,), (1, 2, 5)), 2
# Weight of the row that holds a quantity, over its standard deviation or, if less, a share of it;
# accuracies of the threshold's root, and of ends at which the excess jumps; share of the root that
# is flat; most fits; growth of steps; most grids.
_SHARE_HELD = 0.1
_WEIGHT_HELD, _ROUGH_ROOT, _ACCURATE_ROOT, _JUMP_WIDTH, _FLAT_SHARE = 300.0, 0.3, 0.02, 1e-3, 0.03
_MOST_TRIALS, _TRIAL_GROWTH, _MOST_GRIDS = 25, 4.0, 4
# Least ratio of a time to the first, and of the last to it, for slopes and moduli.
_INNER = 2.0
# Standard deviation of a quantity that counts as none, over the largest that a noise of one lag
# makes; and a quantity that does, over its standard deviation.
_LEAST_DEVIATION, _NO_VALUE = 1e-3, 1e-15

LEVEL, EXPONENT, LOSS, BEYOND, FLOW = "level", "exponent", "loss", "beyond", "flow"
KINDS = (LEVEL, EXPONENT, LOSS, BEYOND, FLOW, "storage", "loss tangent", "increment", "slope")
"""Kinds of quantities. A level is a modulus, a stiffness or a compliance at a time; beyond is what
it is at once and at rest."""

# What lags of unit amplitude add, (n_rates,), by a time in s and their rates in 1/s, (n_rates,).
_Added = Callable[[float, Array], Array]
_ADDED: dict[str, _Added] = {
    "left": lambda time_s, rates: np.exp(-rates * time_s),
    "yielded": lambda time_s, rates: -np.expm1(-rates * time_s),
    "per second": lambda time_s, rates: rates * np.exp(-rates * time_s),
    "per e-fold": lambda time_s, rates: time_s * rates * np.exp(-rates * time_s),
    "lasting": lambda _, rates: np.eye(1, len(rates))[0],
    "flowing": lambda _, rates: rates * np.eye(1, len(rates))[0],
    "all": lambda _, rates: np.ones_like(rates),
    # At the angular frequency that is the inverse of the time.
    "slow": lambda time_s, rates: 1 / (1 + (rates * time_s) ** 2),
    "fast": lambda time_s, rates: (rates * time_s) ** 2 / (1 + (rates * time_s) ** 2),
    "lost": lambda time_s, rates: rates * time_s / (1 + (rates * time_s) ** 2),
}


@dataclass(frozen=True)
class LinearLimits:
    """A quantity, and its limits over all linear samples."""

    quantity: str
    """Its name, such as ``G(10 s)``."""
    kind: str
    """One of the `KINDS`."""
    at_s: float | None
    """Time in s after a step, or the inverse of an angular frequency."""
    unit: str
    """SI unit; empty for a pure number."""
    value: float | None
    """Of the best fit; None unless there are both limits."""
    low: float | None
    """Lower limit, if there is one."""
    high: float | None
    """Upper limit, if there is one."""

    @property
    def verdict(self) -> str:
        """Verdict as on a model's quantities: determined, bounded below or above, or not."""
        return verdict_of(self.low, self.high)

    def words(self) -> str:
        """Return value and limits, or the only limit, in words."""
        unit = f" {self.unit}".rstrip()
        if self.value is not None and self.low is not None and self.high is not None:
            return with_limits(self.value, self.low, self.high, self.unit)
        if self.low is not None:
            return f"at least {plain(self.low)}{unit}"
        return "not determined" if self.high is None else f"at most {plain(self.high)}{unit}"


@dataclass(frozen=True)
class WithoutModel:
    """What a trace tells without a model."""

    told: list[LinearLimits]
    """Quantities with their limits."""
    misfit: float
    """RMS of what the linear sample that fits best leaves, in the unit of the readings."""
    times_noise: float
    """The same in the known noise or, if it is not, in the scatter of neighbouring readings."""
    is_linear: bool
    """False if no linear sample gives this trace, for what the best leaves is no noise."""
    covered_s: tuple[float, float]
    """From when to when after a step there are readings, and so limits on either side."""
    moves: list[Move] = field(default_factory=list)
    """What errors of the instrument do to quantities that have a value."""

    def widened(self, others: Sequence["WithoutModel"]) -> "WithoutModel":
        """Return it with limits that hold those of others, too, as of other starts."""
        told, also = [], [estimate for other in others for estimate in other.told]
        for estimate in self.told:
            every = [estimate, *(it for it in also if it.quantity == estimate.quantity)]
            lows, highs = np.array([(other.low, other.high) for other in every], dtype=float).T
            ends = [lows.min(), highs.max()] if len(every) > len(others) else [np.nan, np.nan]
            low, high = (None if np.isnan(end) else float(end) for end in ends)
            value = estimate.value if low and high else None
            told.append(replace(estimate, value=value, low=low, high=high))
        return replace(self, told=told)

    def data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "is_linear": self.is_linear,
            "times_noise": self.times_noise,
            "misfit_rad": self.misfit,
            "covered_s": list(self.covered_s),
            "moves": [asdict(move) for move in self.moves],
            "quantities": [
                {**asdict(estimate), "verdict": estimate.verdict, "in_words": estimate.words()}
                for estimate in self.told
            ],
        }


def tell_without_model(
    residuals: Residuals,
    *,
    confidence: float,
    at_s: Sequence[float] = (),
    kinds: Collection[str] = KINDS,
) -> WithoutModel:
    """Tell what a trace says of any linear sample, whatever its model.

    The model of the residuals is not used. The confidence, such as 0.95, is of two limits; a single
    limit is one of such a pair. Times in s after a step, whose inverses are angular frequencies,
    are by default one a decade. Of `KINDS`, some are told.
    """
    noise_sd = residuals.trace.known_noise
    fit = fit_any_sample(residuals)
    free, sd, left = fit.free, fit.sd, fit.left_of_readings()
    _, chance = correlated(*left)
    freedom, times = min(free, residuals.freedom), float(sd / (noise_sd or residuals.noise_scale))
    if noise_sd is not None:
        too_large = float(chdtrc(free, free * times**2))
        chance = min(chance, too_large)
        if too_large >= levels.CERTAIN_MISFIT:
            sd, freedom = noise_sd, math.inf
    elif residuals.free <= fit.taken:
        # It leaves nothing that tells the noise.
        sd = max(sd, residuals.noise_scale)
    is_linear = chance >= levels.CERTAIN_MISFIT or times <= levels.TOO_MUCH
    if not is_linear and kinds:
        independent, freedom = as_correlated(*left)
        sd = fit.sd * math.sqrt(free / independent)
    unit = float(sd / residuals.noise_scale)

    def root(more: int) -> float:
        """Return the root of the excess at limits, with more degrees of freedom than one."""
        return unit * math.sqrt(increase_at(confidence, freedom, 1 + more))

    times_s = at_s or times_told(*fit.lags.covered_s)
    chosen = [each for each in _quantities(residuals, fit.lags, times_s) if each.kind in kinds]
    told = [_find_limits(fit, each, root) for each in chosen]
    moves = _moves(fit, [own for own, it in zip(chosen, told, strict=True) if it.value])
    return WithoutModel(told, fit.misfit, times, is_linear, fit.lags.covered_s, moves)


def _moves(fit: AnySampleFit, quantities: Sequence["_Functional"]) -> list[Move]:
    """Return what errors of the instrument do to quantities.

    It is half the difference of fits with the error added to the readings and taken off.
    """
    residuals = fit.lags.residuals
    trace, mistakes = residuals.trace, list(find_mistakes(residuals, fit.response))

    def values(added: Array) -> Array:
        changed = replace(trace, readings=trace.readings + added)
        other = fit_any_sample(replace(residuals, trace=changed))
        return np.array([quantity.of(other) for quantity in quantities])

    given = np.array([quantity.of(fit) for quantity in quantities])
    moved = (values(mistake.change) - values(-mistake.change) for mistake in mistakes)
    # To first order, changes of logarithms.
    changes = np.array([0.5 * each / given for each in moved]).T
    return as_moves(mistakes, [quantity.name for quantity in quantities], changes)


def times_told(first_s: float, last_s: float) -> list[float]:
    """Return powers of ten between two times or, of less than two, more round numbers."""
    powers = range(math.floor(math.log10(first_s)), math.floor(math.log10(last_s)) + 1)
    for digits in _FIRST_DIGITS:
        times = [float(f"{digit}e{power}") for power in powers for digit in digits]
        inside = [time_s for time_s in times if first_s <= time_s <= last_s]
        if len(inside) >= _FEWEST_TIMES:
            break
    return inside


def level_turned(residuals: Residuals) -> Callable[[Any], Any] | None:
    """Return the function of a response to a unit step that is told as the level, if not itself.

    Of a gripper, whose free arm turns by 1/k_2, and by 1/(k_2 + k_2 K/K_jaws) on a sample, it is
    the static K, force over shortening, from the left arm's rotation per torque.
    """
    if not residuals.instrument.has_jaws:
        return None
    gripper = residuals.gripper
    free, jaws = 1 / gripper.left.stiffness_Nm_per_rad, gripper.jaw_stiffness_N_per_m
    return lambda turned: jaws * (free / turned - 1)


@dataclass(frozen=True)
class _Functional:
    """A functional of the amplitudes of lags, or the ratio of two."""

    name: str
    kind: str
    at_s: float | None
    unit: str
    above: _Added
    below: _Added | None = None
    """What it is divided by."""
    sides: tuple[int, ...] = (-1, 1)
    """Sides on which it may have a limit, -1 or 1."""
    turned: Callable[[float], float] | None = None
    """Falling function of it that is told in its place."""
    fastest: float = math.inf
    """Rate in 1/s up to which lags count."""

    def added(self, lags: Lags) -> tuple[Array, Array]:
        """Return what amplitudes of rows add to it, or its numerator, and to its divisor."""
        at_s, shown = self.at_s or 0.0, (lags.rates <= self.fastest) / lags.sizes
        below = self.below(at_s, lags.rates) if self.below else np.zeros_like(shown)
        return self.above(at_s, lags.rates) * shown, below * shown

    def of(self, fit: AnySampleFit) -> float:
        """Return what is told of a fit, NaN where it has none."""
        above, below = (float(added @ fit.amplitudes) for added in self.added(fit.lags))
        value = above / below if below else above if self.below is None else math.nan
        return self.turned(value) if self.turned and value else value


def _find_limits(
    fit: AnySampleFit, quantity: _Functional, root: Callable[[int], float]
) -> LinearLimits:
    """Find the limits of a quantity that is not negative."""
    profile = _Excess(fit, quantity, root)
    value: float | None = profile.best
    ends = [profile.limit(side) if side in quantity.sides else None for side in (-1, 1)]
    if (turned := quantity.turned) is not None:
        value, *ends = (turned(end) if end else None for end in (value, *ends[::-1]))
    low, high = (float(end) if end is not None and end > 0 else None for end in ends)
    if quantity.below is not None and max(value or 0.0, high or 0.0) > levels.OF_THE_FASTEST:
        value, high = None, None
    # Of a flow that is hardly there the value is any.
    largest = max(value or 0.0, levels.LITTLE * (high or 0.0))
    little = 0.0 if quantity.kind == FLOW else levels.LITTLE * largest
    if low is not None and low < little:
        low = None
    value = None if low is None or high is None or value is None else float(value)
    return LinearLimits(
        quantity.name, quantity.kind, quantity.at_s, quantity.unit, value, low, high
    )


class _Excess:
    """The root of the least excess of the sum of squares, as a function of a quantity."""

    def __init__(
        self, fit: AnySampleFit, quantity: _Functional, root: Callable[[int], float]
    ) -> None:
        self._fit, self._quantity, self._root = fit, quantity, root
        self._least = float(fit.left @ fit.left)
        above, below = quantity.added(fit.lags)
        divisor = float(below @ fit.amplitudes) if quantity.below else 1.0
        self.best = float(above @ fit.amplitudes) / divisor if divisor else math.nan
        """The value of the best fit, NaN if it has none."""
        row, taken, faint = above - self.best * below, fit.amplitudes > 0, fit.lags.faint
        clearly = float(np.abs(row[~faint]).max())
        deviation = float(np.linalg.norm(np.linalg.lstsq(fit.lags.rows[taken], row[taken])[0]))
        deviation = deviation if deviation > _LEAST_DEVIATION * clearly else clearly
        stride = root(0) * deviation / (divisor or 1.0)
        # Of a liquid the modulus that another is divided by may vanish.
        self._stride = min(stride, levels.OF_THE_FASTEST) if quantity.below else stride
        self._deviation, self._divisor = deviation, divisor
        self._open = [
            side for side in (-1, 1) if np.any(side * row[faint] > levels.HANGS * clearly)
        ]

    def limit(self, side: int) -> float | None:
        """Find the limit on a side, -1 or 1, if there is one."""
        # Beside its standard deviation it may be rounding.
        nothing = side < 0 and self.best <= _NO_VALUE * self._stride
        if not 0 < self._stride < math.inf or side in self._open or nothing:
            return None
        limit, needed = self._closely(side, self.best + side * self._stride, self._root(0))
        more = count_lags(self._fit.amplitudes > 0) - count_lags(needed)
        if limit is not None and more > 0:
            limit, _ = self._closely(side, limit, self._root(more))
        return limit

    def _closely(self, side: int, value: float, root: float) -> tuple[float | None, BoolArray]:
        """Find a limit roughly, then with closer lags, beginning with a value; and its lags."""
        lags, accuracy = self._fit.lags, _ROUGH_ROOT
        for _ in range(_MOST_GRIDS):
            limit, needed = self._crossing(lags, side, value, root, accuracy)
            if limit is None or side * (limit - self.best) < 0:
                # Where the excess jumps, Newton's method may end on the other side.
                return None, needed
            if accuracy < _ROUGH_ROOT and lags.are_close(needed):
                break
            lags, value, accuracy = lags.divided(needed), limit, _ACCURATE_ROOT
        return limit, needed

    def _crossing(
        self, lags: Lags, side: int, value: float, root: float, accuracy: float
    ) -> tuple[float | None, BoolArray]:
        """Return the limit with certain lags, and which it needs, beginning with a value.

        Each value is held by one more row; Newton's step from there leads to the next, or, where
        that is not between the values known to be inside and outside, half of the way.
        """
        from scipy.optimize import nnls

        above, below = self._quantity.added(lags)
        seen: BoolArray = np.any(lags.rows, axis=1)
        rows, measured = np.column_stack((lags.rows, above)), np.append(self._fit.measured, 0.0)
        inner, outer = self.best, math.inf
        for _ in range(_MOST_TRIALS):
            value = value if side > 0 else max(value, 0.0)
            # Rounding of a row that is far heavier than its value takes would outweigh the trace.
            share = _SHARE_HELD * max(value, self.best) * self._divisor
            weight = _WEIGHT_HELD / min(self._deviation, share)
            is_ratio = self._quantity.below is not None
            rows[:, -1] = np.where(seen, weight * (above - value * below), 0.0)
            measured[-1] = 0.0 if is_ratio else weight * value
            amplitudes, norm = nnls(rows.T, measured, maxiter=100 * len(rows))
            # Half the slope of the sum of squares.
            slope = weight * float(measured[-1] - amplitudes @ rows[:, -1])
            slope *= float(below @ amplitudes) if is_ratio else 1.0
            reached = math.sqrt(max(norm**2 - self._least, 0.0))
            over = reached - root
            if over < 0 and value <= 0:
                break
            # Where the excess is flat, its slope says nothing.
            steep = side * slope > 0 and reached > _FLAT_SHARE * root
            step = -over * reached / slope if steep else side * math.inf
            if abs(over) < accuracy * root:
                return value + (step if steep and math.isfinite(step) else 0.0), amplitudes > 0
            inner, outer = (value, outer) if over < 0 else (inner, value)
            if abs(outer - inner) < _JUMP_WIDTH * abs(inner - self.best):
                return inner, amplitudes > 0
            far = outer if math.isfinite(outer) else self.best + _TRIAL_GROWTH * (value - self.best)
            if far == inner:
                break
            value = _next_trial(value + step, inner, far, halve=far == outer)
        return None, seen


def _next_trial(aim: float, inner: float, far: float, *, halve: bool) -> float:
    """Return the value aimed at if it is between an inner and a far one, or one between."""
    share = (aim - inner) / (far - inner)
    if halve and not _JUMP_WIDTH < share < 1 - _JUMP_WIDTH:
        share = 0.5
    return inner + min(share, 1.0) * (far - inner)


def _quantities(residuals: Residuals, lags: Lags, times: Sequence[float]) -> Iterator[_Functional]:
    """Yield what is told at times, and beyond the readings."""
    instrument, (first_s, last_s) = residuals.instrument, lags.covered_s
    deforms, jaws, turned = instrument.deforms, instrument.has_jaws, level_turned(residuals)
    inside = [time_s for time_s in times if first_s <= time_s <= last_s]
    # Slopes and moduli at an end of the trace are hardly known.
    inner = [time_s for time_s in inside if _INNER * first_s <= time_s <= last_s / _INNER]
    unit, viscosity = instrument.stiffness, per_second_of(instrument.stiffness)
    letter = "K" if "/" in unit else "G"
    if not (deforms or jaws):
        letter, unit = "J", inverse_of(unit)
    # What falls is not smaller before the first reading, and not larger after the last one.
    falls, level = (1, _ADDED["left"]) if deforms else (-1, _ADDED["yielded"])
    for at_s in times:
        sides = (-falls,) * (at_s <= last_s) + (falls,) * (at_s >= first_s)
        yield _Functional(f"{letter}({at_s:g} s)", LEVEL, at_s, unit, level, None, sides, turned)
    for at_s in inner if not jaws else ():
        yield _Functional(f"exponent({at_s:g} s)", EXPONENT, at_s, "", _ADDED["per e-fold"], level)
    yield _Functional(f"{letter} at once", BEYOND, first_s, unit, level, None, (-falls,), turned)
    if deforms or jaws:
        final = _ADDED["lasting" if deforms else "all"]
        yield _Functional(f"{letter} at rest", BEYOND, None, unit, final, None, (falls,), turned)
    if jaws:
        return
    if not deforms:
        for before_s, at_s in pairwise(inside):
            name = f"J({at_s:g} s) - J({before_s:g} s)"
            yield _Functional(name, "increment", at_s, unit, partial(_rise, before_s))
        per_s = inverse_of(viscosity)
        yield _Functional("slope at the end", "slope", last_s, per_s, _ADDED["per second"])
        flow = _ADDED["flowing"]
        yield _Functional(
            "viscosity", FLOW, None, viscosity, flow, None, (1,), lambda flow: 1 / flow
        )
    # Under a step of the deformation the fastest lag, of a damper, does not show.
    fastest = 1 / first_s if deforms and not lags.rows[-1].any() else math.inf
    stored, lost = _ADDED["slow" if deforms else "fast"], _ADDED["lost"]
    for at_s in reversed(inner):
        for name, kind, unit_of_it, above, below in (
            (f"{letter}'", "storage", unit, stored, None),
            (f"{letter}''", LOSS, unit, lost, None),
            ("tan delta", "loss tangent", "", lost, stored),
        ):
            name = f"{name}({1 / at_s:.3g} rad/s)"
            yield _Functional(name, kind, at_s, unit_of_it, above, below, fastest=fastest)


def _rise(before_s: float, time_s: float, rates: Array) -> Array:
    return np.exp(-rates * before_s) - np.exp(-rates * time_s)
