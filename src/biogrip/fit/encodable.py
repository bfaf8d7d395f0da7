"""The best point of a trace that the digits of the genes can encode (eq. 10)."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.genome import GeneRange
from biogrip.physics.misfit import Misfit

# Least relative decrease of the misfit that counts, so that all processors take the same steps.
_LEAST = 1e-7
# Parameters changed at once: with three a search follows a valley.
_AT_ONCE = 3


def lowest_encodable(misfit: Misfit, ranges: Sequence[GeneRange], starts: Array) -> float:
    """Return the lowest misfit in rad of all encodable points around some starts.

    Around each start's nearest encodable point all neighbours are computed, the last digit or the
    one before it up or down by one in up to three parameters, and then around the best of them,
    until none is better than the point that they surround. A lower point elsewhere is not excluded.
    Starts, (n, n_parameters), are the ends of runs, among which should be the continuous optimum;
    of each parameter a gene range is given.
    """
    values = [genes.values for genes in ranges]
    tens = [genes.most[-1] - genes.least[-1] + 1 for genes in ranges]
    every = product(*((-ten, -1, 0, 1, ten) for ten in tens))
    steps = np.array(sorted(every, key=np.count_nonzero))
    steps = steps[np.count_nonzero(steps, axis=1) <= _AT_ONCE]
    columns = zip(values, starts.T, strict=True)
    places = np.stack([abs(own - start[:, None]).argmin(axis=1) for own, start in columns], axis=1)
    lowest = np.inf
    while len(places):
        around = np.unique(places, axis=0)[:, None] + steps
        np.clip(around, 0, [len(own) - 1 for own in values], out=around)
        columns = zip(values, around.reshape(-1, len(values)).T, strict=True)
        found = misfit(np.stack([own[at] for own, at in columns], axis=1))
        found = found.reshape(around.shape[:2])
        best = np.arange(len(around)), found.argmin(axis=1)
        places = around[best][found[best] < (1 - _LEAST) * found[:, 0]]
        lowest = min(lowest, float(found.min()))
    return lowest
