"""Tests of the residuals of a frequency sweep: both moduli, and inertia."""

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


def about_moduli(
    residuals: Residuals, residual: Array, basis: Array, growth: Array
) -> Iterator[str]:
    """Yield a sentence for each test that residuals, (n_samples,), fail.

    The tests are for a part of the storage modulus that goes with the frequency squared, as of
    inertia; for moduli that differ if each is fitted by itself; and for one that scatters more, by
    an F test. Residuals are over the growth of the noise, with what the fit absorbs, see
    `biogrip.judging.whiteness`.
    """
    places, free = residuals.trace.time_s, len(residual) - len(basis)
    storage = is_storage(places)
    squared = residuals.trace.condensed.cleared(np.where(storage, places**2, 0.0)) / growth
    shape, total = without(basis, squared), float(residual @ residual)
    size = float(shape @ residual) / float(shape @ shape)
    explained = size**2 * float(shape @ shape)
    chance = float(fdtrc(1, free - 1, explained * (free - 1) / (total - explained)))
    if chance < FALSE_ALARM:
        part = abs(size) * float(np.max(places)) ** 2 / float(residuals.trace.readings[-1])
        yield (
            f"The storage modulus has a part that goes with the frequency squared, "
            f"{plain(100 * part, 2)} % at the highest, as by chance only {one_in(chance)} sweeps "
            "have: inertia of the instrument or the sample. Correct for it, or leave the highest "
            "frequencies out (--until)."
        )
    elif (chance := compare_halves(residual, basis, int(np.sum(~storage)))) < FALSE_ALARM:
        yield (
            "The storage and the loss modulus, each fitted by itself, differ as those with white "
            f"noise do only {one_in(chance)} sweeps: the values may be far off."
        )
    # What the fit leaves each column, of all that it absorbs.
    freedoms = [float(np.sum(of) - np.sum(basis[:, of] ** 2)) for of in (storage, ~storage)]
    means = [
        float(np.sum(residual[of] ** 2)) / own
        for of, own in zip((storage, ~storage), freedoms, strict=True)
    ]
    larger = int(means[1] > means[0])
    ratio = means[larger] / means[1 - larger]
    chance = 2 * float(fdtrc(freedoms[larger], freedoms[1 - larger], ratio))
    if chance < FALSE_ALARM:
        name = ("storage", "loss")[larger]
        yield (
            f"The {name} modulus scatters {plain(np.sqrt(ratio), 2)} times as much as the other, "
            "for the weights that they have: give standard deviations of both, by --sd and --sd "
            "loss=COLUMN."
        )
