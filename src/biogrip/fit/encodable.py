"""The best point of a trace that the digits of the genes can encode (eq. 10)."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from biogrip.arrays import Array, IntArray
from biogrip.fit.genome import GeneRange
from biogrip.physics.misfit import Misfit, combine_misfits

# Least relative decrease of the misfit that counts, so that all processors take the same steps.
_LEAST = 1e-7
# Steps by encodable numbers: of the last digit, and of the one before if there are two. With the
# steps of three parameters at once a search follows a valley.
_STEPS, _AT_ONCE = (-10, -1, 0, 1, 10), 3


def lowest_encodable(
    misfits: Sequence[Misfit], ranges: Sequence[GeneRange], starts: Array, traces: IntArray
) -> Array:
    """Return the lowest misfit in rad of all encodable points around some starts, (n_traces,).

    Around each start's nearest encodable point all neighbours are computed, one or ten numbers up
    or down in up to three parameters, and then around the best of them, until none is better than
    the point that they surround.

    Parameters
    ----------
    misfits
        Misfit of each trace.
    ranges
        Gene range of each parameter.
    starts : (n_starts, n_parameters)
        Parameters, such as the continuous optimum and the ends of runs.
    traces : (n_starts,)
        Index of the trace of each start.
    """
    misfits_of = combine_misfits(misfits)
    values = [genes.values for genes in ranges]
    steps = np.array(sorted(product(_STEPS, repeat=len(values)), key=np.count_nonzero))
    steps = steps[np.count_nonzero(steps, axis=1) <= _AT_ONCE]
    columns = zip(values, starts.T, strict=True)
    nearest = [np.abs(own - column[:, None]).argmin(axis=1) for own, column in columns]
    places = np.unique(np.column_stack([traces, *nearest]), axis=0)
    lowest = np.full(len(misfits), np.inf)
    while len(places):
        of, center = places[:, 0], places[:, 1:]
        around = center[:, None] + steps
        np.clip(around, 0, [len(own) - 1 for own in values], out=around)
        columns = zip(values, np.moveaxis(around, 2, 0), strict=True)
        found = misfits_of(np.stack([own[at] for own, at in columns], axis=2), of)
        best = found.argmin(axis=1)[:, None]
        least = np.take_along_axis(found, best, axis=1)[:, 0]
        np.minimum.at(lowest, of, least)
        moving = least < (1 - _LEAST) * found[:, 0]
        best = np.take_along_axis(around, best[:, :, None], axis=1)[:, 0]
        places = np.unique(np.column_stack([of, best])[moving], axis=0)
    return lowest
