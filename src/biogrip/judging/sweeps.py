"""Tests of the residuals of a frequency sweep: inertia, and both moduli apart.

Residuals, (n_samples,), are over the growth of the noise, with a basis of what a fit absorbs, see
`biogrip.judging.whiteness`.
"""

from collections.abc import Iterator

import numpy as np
from scipy.special import fdtrc

from biogrip.arrays import Array
from biogrip.digits import one_in, plain
from biogrip.judging.changes import compare_halves
from biogrip.judging.levels import FALSE_ALARM
from biogrip.physics.residuals import Residuals
from biogrip.physics.sweep import is_storage
from biogrip.physics.whitening import without


def find_inertia(
    residuals: Residuals, residual: Array, basis: Array, growth: Array | float = 1.0
) -> str:
    """Return in words what may make moduli wrong: inertia, if an F test tells it, or what else.

    Inertia adds a part to the storage modulus that goes with the frequency squared.
    """
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
    """Yield a sentence for each test that residuals fail.

    The tests are for inertia; for moduli that differ, if each is fitted by itself; and for one that
    scatters more than the other for its weights, by an F test.
    """
    storage = is_storage(residuals.trace.time_s)
    cause = find_inertia(residuals, residual, basis, growth)
    if cause.startswith("inertia"):
        yield f"The fit leaves what is of {cause}."
    elif (chance := compare_halves(residual, basis, int(np.sum(~storage)))) < FALSE_ALARM:
        yield (
            "The storage and the loss modulus, each fitted by itself, differ as those with white "
            f"noise do only {one_in(chance)} sweeps: {cause}."
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
