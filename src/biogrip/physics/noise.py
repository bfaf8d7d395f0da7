"""What an instrument adds to its readings, offset, drift and noise: simulated, or taken out.

An offset and a linear drift are nuisance functions. Their amplitudes are linear parameters and are
not searched: their span is projected out of trace and responses alike, which is the same as fitting
them (variable projection) [1]_. Functions whose amplitude has a known standard deviation are
projected out in part [2]_.

The size of white noise is estimated without a model; that of any other, and its colour, in
`biogrip.fit.trace_noise`.

References
----------
.. [1] G. H. Golub and V. Pereyra, SIAM Journal on Numerical Analysis 10 (1973), 413-432.
.. [2] A. M. Stuart, Acta Numerica 19 (2010), 451-559: a Gaussian uncertainty is noise.
"""

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.keys import Block, Complaint, OneOf
from biogrip.physics.modes import lag_course
from biogrip.physics.protocol import Course

# Relaxation times of flicker noise are so many e-folds apart, or less: its spectrum is 1/f to
# within 2 exp(-pi^2 / 1.5) = 0.3 %, as Poisson's summation has it.
_EFOLDS_APART = 1.5
# Longest relaxation time over the length of the trace: slower processes are offsets.
_LONGEST_TIME = 3.0

_HALF_WIDTH = np.sqrt(3.0)

KINDS: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "gaussian": lambda rng, count: rng.standard_normal(count),
    "uniform": lambda rng, count: rng.uniform(-_HALF_WIDTH, _HALF_WIDTH, count),
}
"""Distributions of white noise: functions that draw numbers of unit variance."""


@dataclass(frozen=True)
class AR1(Block):
    """Ornstein-Uhlenbeck noise of one relaxation time, of spectrum 1/(1 + (2 pi f tau)^2)."""

    share: Annotated[float, Field(gt=0, le=1)]
    """Share of the noise's variance."""
    time_s: Annotated[float, Field(gt=0, le=1e9)]
    """Time after which its correlation has fallen to 1/e. Of samples an interval h apart it is an
    AR(1) process with the coefficient exp(-h / time_s)."""


@dataclass(frozen=True)
class Flicker(Block):
    """Noise of spectrum 1/f over all frequencies of the trace."""

    share: Annotated[float, Field(gt=0, le=1)]
    """Share of the noise's variance."""


@dataclass(frozen=True)
class Drift(Block):
    """A drift linear in time, upwards or downwards at random."""

    rise: Annotated[float, Field(gt=0, le=1000)]
    """Change from the first reading to the last, in standard deviations of the noise."""


@dataclass(frozen=True)
class Outliers(Block):
    """Readings with far more noise than others."""

    share: Annotated[float, Field(gt=0, le=0.5)]
    """Share of the samples, at random."""
    size: Annotated[float, Field(gt=0, le=1000)]
    """Standard deviation of their additional noise, in standard deviations of the noise."""


@dataclass(frozen=True)
class Noise(Block):
    """Noise added to the noise-free trace; components beside white noise can be combined."""

    kind: Annotated[str, OneOf(KINDS)]
    """Distribution of what is white of the noise."""
    level: Annotated[float, Field(ge=0, le=10)]
    """Standard deviation of the noise, as a share of the reference."""
    reference: Annotated[str, OneOf(("peak", "signal"))]
    """Reference of `level`. `peak`: the largest reading of the noise-free trace, the same noise
    everywhere; `signal`: the noise-free reading at each instant."""
    level_rad: Annotated[float | None, Field(ge=0, le=1e12)] = None
    """Standard deviation of the noise as an instrument has it, the same whatever the sample, e.g.
    3.0e-6. Where it is given, `level` does not count."""
    ar1: AR1 | None = None
    """Autocorrelated component, AR(1); Gaussian. By default none."""
    flicker: Flicker | None = None
    """Component of spectrum 1/f; Gaussian. By default none."""
    drift: Drift | None = None
    """A drift in addition. By default none."""
    outliers: Outliers | None = None
    """Outliers in addition. By default none."""

    def complaints(self) -> Iterator[Complaint]:
        """Find components whose shares exceed one together."""
        shares = [part.share for part in (self.ar1, self.flicker) if part is not None]
        if sum(shares) > 1:
            text = f"found {sum(shares):g} with that of ar1, allowed is at most 1 together."
            yield ("flicker", "share"), text

    @property
    def white(self) -> bool:
        """True if readings have independent noise without drift and outliers."""
        return not (self.ar1 or self.flicker or self.drift or self.outliers)

    @property
    def absent(self) -> bool:
        """True if the noise level is zero."""
        return not (self.level if self.level_rad is None else self.level_rad)


def add_noise(
    readings: Array, noise: Noise, rng: np.random.Generator, time_s: Array | None = None
) -> Array:
    """Return a noisy copy of a trace, (n_samples,).

    Ascending sampling times, (n_samples,), are by default a second apart.
    """
    time_s = np.arange(len(readings), dtype=float) if time_s is None else time_s
    shares = [part.share for part in (noise.ar1, noise.flicker) if part is not None]
    unit = np.sqrt(max(0.0, 1 - sum(shares))) * KINDS[noise.kind](rng, len(readings))
    if noise.ar1 is not None:
        weight, rate = np.array([noise.ar1.share]), np.array([1 / noise.ar1.time_s])
        unit += draw_ornstein_uhlenbeck(time_s, weight, rate, rng)
    if noise.flicker is not None:
        rates = flicker_rates(time_s)
        unit += draw_ornstein_uhlenbeck(
            time_s, np.full(len(rates), noise.flicker.share / len(rates)), rates, rng
        )
    if noise.drift is not None:
        course = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
        unit += rng.choice((-1, 1)) * noise.drift.rise * course
    if noise.outliers is not None:
        struck = rng.random(len(time_s)) < noise.outliers.share
        unit += struck * noise.outliers.size * rng.standard_normal(len(time_s))
    return readings + standard_deviation(readings, noise) * unit


def standard_deviation(readings: Array, noise: Noise) -> Array:
    """Return the standard deviation of noise, but drift and outliers, at noise-free readings."""
    magnitude = np.abs(readings)
    if noise.level_rad is not None:
        return np.full_like(magnitude, noise.level_rad)
    scale = magnitude if noise.reference == "signal" else np.full_like(magnitude, magnitude.max())
    return noise.level * scale


def rms(values: Array) -> float:
    """Return the root mean square of values."""
    return float(np.sqrt(np.mean(np.square(values))))


def draw_ornstein_uhlenbeck(
    time_s: Array, weights: Array, rates_per_s: Array, rng: np.random.Generator
) -> Array:
    """Draw a sum of independent Ornstein-Uhlenbeck processes, exactly, at any times, (n_times,).

    From reading to reading, each is an AR(1) process (D. T. Gillespie, Physical Review E 54 (1996),
    2084-2091). Weights are the variance of each, rates the inverse of its relaxation time,
    (n_processes,).
    """
    states = rng.standard_normal((len(time_s), len(weights)))
    elapsed = np.outer(np.diff(time_s), rates_per_s)
    states[1:] *= np.sqrt(-np.expm1(-2 * elapsed))
    left = np.empty(len(weights))
    for before, kept, state in zip(states[:-1], np.exp(-elapsed), states[1:], strict=True):
        state += np.multiply(kept, before, out=left)
    # One product per reading: the order of its sums does not depend on the number of readings.
    return (states[:, None] @ np.sqrt(weights)[:, None])[:, 0, 0]


def flicker_rates(time_s: Array) -> Array:
    """Return rates in 1/s of processes whose sum has the spectrum 1/f, (n_processes,).

    They are a geometric series, for Ornstein-Uhlenbeck processes of the same variance, which cover
    all frequencies of ascending times (E. Milotti, arXiv:physics/0204033, 2002, section 3).
    """
    slowest = 1 / (_LONGEST_TIME * (time_s[-1] - time_s[0]))
    fastest = 1 / float(np.diff(time_s).min())
    count = 2 + int(np.log(fastest / slowest) / _EFOLDS_APART)
    return np.geomspace(slowest, fastest, count)


def stream(study_seed: int, case: str, seed: int, purpose: str) -> np.random.Generator:
    """Return the generator of one purpose, e.g. ``"noise"``, of one seed of one case.

    Its seed sequence is a child of the study's seed, with a spawn key made of the names and numbers
    alone: no other case or seed, and no order of jobs, can change it.
    """
    key = (*_words(case), seed, *_words(purpose))
    return np.random.default_rng(np.random.SeedSequence(study_seed, spawn_key=key))


def _words(name: str) -> tuple[int, ...]:
    digest = hashlib.sha256(name.encode()).digest()[:16]
    return tuple(int.from_bytes(digest[i : i + 4], "big") for i in range(0, 16, 4))


def nuisance_basis(time_s: Array, *, offset: bool, drift: bool) -> Array:
    """Return orthonormal functions of time, (n_functions, n_times), that span offset and drift."""
    functions = [np.ones_like(time_s)] * offset + [time_s] * drift
    return np.linalg.qr(np.reshape(functions, (-1, len(time_s))).T)[0].T


def without(basis: Array, rows: Array) -> Array:
    """Project the span of a basis out of functions of time, shape (..., n_times)."""
    return rows - (rows @ basis.T) @ basis if len(basis) else rows


def within(basis: Array, rows: Array, sd: Array | None = None) -> Array:
    """Project functions, (..., n_times), on the span of a basis, weighted by 1/sd^2, (n_times,)."""
    if sd is None or not len(basis):
        return (rows @ basis.T) @ basis
    weighted = np.linalg.qr((basis / sd).T)[0].T
    return within(weighted, rows / sd) * sd


def with_uncertain(basis: Array, functions: Array) -> Array:
    """Add functions of random amplitude to a basis, so that `without` whitens noise with them.

    The basis, (n_basis, n_times), is orthonormal; functions, (n_functions, n_times), are times the
    standard deviation of their amplitude, over that of white noise. Returns orthogonal functions,
    (n_basis + n_functions, n_times): with singular values s of the functions, `without` removes the
    part 1 - 1/sqrt(1 + s^2) of each direction.
    """
    rest = without(basis, functions)
    _, sizes, directions = np.linalg.svd(rest, full_matrices=False)
    shares = 1 - 1 / np.sqrt(1 + sizes**2)
    return np.vstack((basis, np.sqrt(shares)[:, None] * directions))


# A lag of so many protocols is an integral of the load.
_LAG = 1e6
# Share of a drift's variance that must be no flow: below it, lines differ by less than a tenth.
_LEAST_SHARE_OF_DRIFT = 0.01


def drift_is_flow(course: Course, time_s: Array) -> bool:
    """Return True if a drift looks like the flow of a damper without a spring.

    Under a constant load both are the same line. Under a deformation nothing flows on. Sampling
    times are (n_samples,).
    """
    if course.deforms:
        return False
    constant = nuisance_basis(time_s, offset=True, drift=False)
    flows = without(constant, _LAG * lag_course(course, (_LAG,), time_s))
    drift = without(constant, time_s / course.end_s)
    basis = np.linalg.qr(flows.T)[0].T
    return bool(np.sum(without(basis, drift) ** 2) < _LEAST_SHARE_OF_DRIFT * np.sum(drift**2))


ROOT_12 = np.sqrt(12.0)
"""Step of rounded readings over the standard deviation of the rounding errors."""

# Shares of equal neighbours from which on readings are rounded, and of second differences that are
# none of jumps; the error of the written digits, in steps.
_LEAST_EQUAL, _ALL_BUT_JUMPS, _LARGEST_REST = 0.05, 0.98, 0.05


def estimate_noise(readings: Array, rounding: float | None = None) -> float:
    """Estimate the standard deviation of white noise on a smooth trace without a model.

    The median of second differences is used, on which slopes and jumps of a protocol have next to
    no effect. Where an instrument rounds so coarsely that neighbouring readings are often the same,
    it is their mean square without the largest, and no less than the rounding errors' (B. Widrow,
    I. Kollar and M.-C. Liu, IEEE Transactions on Instrumentation and Measurement 45 (1996),
    353-361: step over the root of 12). Of a trace without noise the estimate is tiny.

    The trace is (n_samples,), or what a fit leaves of it; the step of its readings is by default
    measured.
    """
    second = np.abs(np.diff(readings, 2))
    # Gaussian: the median is 0.6745 standard deviations, and those of second differences sqrt 6.
    noise = float(np.median(second)) / (0.6745 * np.sqrt(6.0)) if len(second) else 0.0
    step = measure_rounding(readings) if rounding is None else rounding
    if len(second) and step:
        most = second[second <= np.quantile(second, _ALL_BUT_JUMPS)]
        noise = max(float(np.sqrt(np.mean(most**2) / 6)), step / ROOT_12)
    return max(noise, 1e-9 * float(np.max(np.abs(readings))))


def measure_rounding(readings: Array) -> float:
    """Return the step of which readings, (n_samples,), are multiples, 0 if not seen in noise."""
    same = np.count_nonzero(readings[1:] == readings[:-1])
    if same < max(1.0, _LEAST_EQUAL * len(readings)):
        return 0.0
    apart = np.diff(np.unique(readings))
    step = float(apart.min()) if len(apart) else 0.0
    multiples = apart / step if step else apart
    return step if np.all(np.abs(multiples - np.rint(multiples)) < _LARGEST_REST) else 0.0


MOST_SAMPLES = 50_000
"""Most readings with autocorrelated noise, which cannot be condensed to fewer nodes."""


def moduli_of(rows: Array, places: Array) -> Array:
    """Return moduli, (..., n_moduli, n_frequencies), of rows of a sweep, (..., n_samples).

    Frequencies ascend; of both moduli the storage modulus is the first.
    """
    lost = np.count_nonzero(places < 0)
    parts = rows[..., lost:], rows[..., lost - 1 :: -1] if lost else rows[..., :0]
    return np.stack([part for part in parts if part.shape[-1]], axis=-2)


def places_of(moduli: Array, places: Array) -> Array:
    """Return rows of a sweep, (..., n_samples), of moduli: the inverse of `moduli_of`."""
    stored, lost = moduli[..., 0, :], moduli[..., -1, ::-1]
    parts = [lost] * bool(places[0] < 0) + [stored] * bool(places[-1] > 0)
    return np.concatenate(parts, axis=-1)
