"""Changes within a trace, which its fit absorbs: a step at an unknown time, halves that differ.

A fit of p parameters to n readings leaves what is orthogonal to the directions that it absorbs. A
step of all readings from some time on, without what the fit absorbs of it, is one direction more:
its share of the sum of squares is beta-distributed in white noise. `find_step` scans all times, and
`compare_halves` asks whether two parts of the trace, fitted apart, agree (a change of the gain, or
of the sample): Chow's test [1]_, with the fit's slopes.

Of a frequency sweep the parts are its moduli, and inertia is one direction more (`about_moduli`).

The chance that a scan of correlated statistics exceeds a level is that of the first one, and for
each further one that of a random walk's upcrossing, which steps from reading to reading [2]_.

Residuals are (n_samples,), the basis of what the fit absorbs has orthonormal rows, (n_directions,
n_samples), as `biogrip.fit.noise_model_fit.absorbed` returns them.

References
----------
.. [1] G. C. Chow, Tests of equality between sets of coefficients in two linear regressions,
   Econometrica 28 (1960), 591-605.
.. [2] D. Siegmund and B. Yakir, The Statistics of Gene Mapping, Springer, 2007: section 5.2, the
   maximum of a process on a grid.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.digits import p_value, plain
from biogrip.fit.noise_model_fit import absorbed
from biogrip.judging.levels import FALSE_ALARM
from biogrip.physics.protocol import is_storage
from biogrip.physics.residuals import Residuals
from biogrip.physics.whitening import without

# Least share of a step's squares that a fit leaves of one that can be told.
_TOLD = 0.03
# Norm of directions of a part, without what the whole fit absorbs, that are more than rounding.
_MORE = 1e-6
# Most numbers in the steps that are scanned.
_AT_ONCE = 4_000_000


@dataclass(frozen=True)
class Steps:
    """Steps of unit size at all times that can be told."""

    before: IntArray
    """Index of the first reading after each, (n_steps,)."""
    shapes: Array
    """Each without what the fit absorbs, (n_steps, n_samples)."""
    norms: Array
    """Norms of the shapes, (n_steps,)."""
    freedom: int
    """Degrees of freedom of what the fit leaves."""

    def chance(self, share: float) -> float:
        """Return the chance that white noise has such a share of its squares in one of them."""
        from scipy.special import betaincc, ndtr, ndtri

        alone = float(betaincc(0.5, 0.5 * (self.freedom - 1), min(share, 1.0)))
        level, change = -float(ndtri(max(alone, 1e-300) / 2)), self._change
        half = np.maximum(0.5 * level * np.sqrt(2 * change), 1e-9)
        walk = (ndtr(half) - 0.5) / (half * (half * ndtr(half) + _density(half)))
        return min(alone + float(2 * level * _density(level) * np.sum(change * walk)), 1.0)

    @cached_property
    def _change(self) -> Array:
        """One minus the correlation of each with the next, (n_steps - 1,)."""
        products = np.einsum("ij,ij->i", self.shapes[:-1], self.shapes[1:])
        return np.clip(1 - products / (self.norms[:-1] * self.norms[1:]), 0.0, 1.0)

    def critical(self, level: float) -> float:
        """Return the distance in standard deviations at which a scan's chance is a level."""
        from scipy.optimize import brentq
        from scipy.special import betaincinv

        most = float(betaincinv(0.5, 0.5 * (self.freedom - 1), 1 - 1e-12))
        share = brentq(lambda share: self.chance(share) - level, 1e-9, most)
        return float(np.sqrt(share * self.freedom))


def _density(level: Array | float) -> Array:
    """Return the density of the normal distribution."""
    found: Array = np.exp(-0.5 * np.square(level)) / np.sqrt(2 * np.pi)
    return found


@dataclass(frozen=True)
class Step:
    """The step that lowers the sum of squares of residuals the most."""

    before: int
    """Index of the first reading after it."""
    size: float
    """Its size in the unit of the residuals."""
    chance: float
    """Chance of as much in white noise, at any time."""
    left: Array
    """What a fit leaves with it, to first order, (n_samples,)."""
    basis: Array
    """What such a fit absorbs, (n_directions + 1, n_samples)."""


def steps_of(basis: Array, cleared: Callable[[Array], Array]) -> Steps:
    """Return the steps that can be told beside a fit.

    `cleared` turns functions of time, (n, n_samples), into residuals. Of very many readings not
    every one is the first of a step.
    """
    samples = basis.shape[1]
    count = min(samples - 1, max(_AT_ONCE // samples, 1))
    before = np.unique(np.linspace(1, samples - 1, count).astype(np.int64))
    whole = cleared((np.arange(samples) >= before[:, None]).astype(float))
    shapes = without(basis, whole)
    square, of_whole = (np.einsum("ij,ij->i", rows, rows) for rows in (shapes, whole))
    # The step back is the same step if a constant is absorbed.
    back = np.einsum("ij,ij->i", *[cleared(np.ones((1, samples))) - whole] * 2)
    told = square > _TOLD * np.minimum(of_whole, back)
    return Steps(before[told], shapes[told], np.sqrt(square[told]), samples - len(basis))


def find_step(residual: Array, basis: Array, cleared: Callable[[Array], Array]) -> Step | None:
    """Scan residuals for a step; None where none can be told."""
    steps = steps_of(basis, cleared)
    if not len(steps.before) or steps.freedom < 2:
        return None
    along = steps.shapes @ residual / steps.norms
    found = int(np.argmax(np.abs(along)))
    size, direction = float(along[found]), steps.shapes[found] / steps.norms[found]
    return Step(
        int(steps.before[found]),
        size / float(steps.norms[found]),
        steps.chance(size**2 / float(residual @ residual)),
        residual - size * direction,
        np.vstack((basis, direction)),
    )


def parts_apart(basis: Array, split: int) -> Array:
    """Return what fits to the parts before and after a reading absorb beside one to both."""
    apart = without(basis, np.where(np.arange(basis.shape[1]) < split, basis, 0.0))
    apart = apart[np.linalg.norm(apart, axis=1) > _MORE]
    return absorbed(apart) if len(apart) else apart


def compare_halves(residual: Array, basis: Array, split: int) -> float:
    """Return the chance that parts of white noise before and after a reading differ as much."""
    from scipy.special import fdtrc

    more = parts_apart(basis, split)
    left = len(residual) - len(basis) - len(more)
    if not len(more) or left < 1:
        return 1.0
    gained = float(np.sum((more @ residual) ** 2))
    rest = max(float(residual @ residual) - gained, 1e-300)
    return float(fdtrc(len(more), left, gained / len(more) * left / rest))


def find_inertia(
    residuals: Residuals, residual: Array, basis: Array, growth: Array | float = 1.0
) -> str:
    """Return in words what may make moduli wrong: inertia, if an F test tells it, or what else.

    Inertia adds a part to the storage modulus that goes with the frequency squared.
    """
    from scipy.special import fdtrc

    places, free = residuals.trace.time_s, len(residual) - len(basis)
    squared = np.where(is_storage(places), places**2, 0.0)
    shape = without(basis, residuals.trace.condensed.cleared(squared) / growth)
    total, square = float(residual @ residual), float(shape @ shape)
    size = float(shape @ residual) / square
    explained = size**2 * square
    if fdtrc(1, free - 1, explained * (free - 1) / (total - explained)) >= FALSE_ALARM:
        return "a column of something else, slip, too large a strain, or a sample that changed"
    part = plain(100 * abs(size) * float(places[-1]) ** 2 / float(residuals.trace.readings[-1]), 2)
    return (
        "inertia of the instrument or the sample, as the storage modulus has a part that goes with "
        f"the frequency squared, {part} % at the highest: correct for it, or leave the highest "
        "frequencies out (--until)"
    )


def about_moduli(
    residuals: Residuals, residual: Array, basis: Array, growth: Array
) -> Iterator[str]:
    """Yield a sentence for each test that residuals over the growth of the noise fail.

    The tests are for inertia; for moduli that differ, if each is fitted by itself; and for one that
    scatters more than the other for its weights, by an F test.
    """
    from scipy.special import fdtrc

    storage = is_storage(residuals.trace.time_s)
    cause = find_inertia(residuals, residual, basis, growth)
    if cause.startswith("inertia"):
        yield f"The fit leaves what is of {cause}."
    elif (chance := compare_halves(residual, basis, int(np.sum(~storage)))) < FALSE_ALARM:
        yield (
            "The storage and the loss modulus, each fitted by itself, differ by more than white "
            f"noise ({p_value(chance)}): {cause}."
        )
    if residuals.freedom < np.inf:
        # Their weights are how they scatter.
        return
    columns = storage, ~storage
    free = [float(np.sum(of) - np.sum(basis[:, of] ** 2)) for of in columns]
    means = [float(np.sum(residual[of] ** 2)) / n for of, n in zip(columns, free, strict=True)]
    larger = int(means[1] > means[0])
    ratio = means[larger] / means[1 - larger]
    if 2 * fdtrc(free[larger], free[1 - larger], ratio) < FALSE_ALARM:
        yield (
            f"For its weights the {('storage', 'loss')[larger]} modulus scatters "
            f"{plain(np.sqrt(ratio), 2)} times as much as the other: give standard deviations of "
            "both (--sd, --set measurement.loss_sd=COLUMN)."
        )
