"""A recorded load or deformation as a protocol: few ramps that follow it within its noise.

A step that was recorded is a ramp between two readings: nothing tells when between them it was.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.whitening import estimate_noise

# Largest deviation from a line between two readings over their noise, and least over the largest
# load, for recordings without noise.
_NOISE, _LEAST = 5.0, 1e-4
# Most ramps: each costs time in every fit.
_MOST = 200


def ramps(time_s: Array, load: Array) -> tuple[Array, float]:
    """Return the ends of ramps that follow a load, and how far the farthest reading is off.

    The reading that is farthest off a line between two others ends a ramp [1]_, until none is
    farther than five standard deviations of the noise, or than twice that and so on, where there
    were more than 200 ramps. The loads there follow by least squares. A load that begins within
    that from 0 begins with 0.

    Parameters
    ----------
    time_s : (n,)
        Times, ascending, at least two.
    load : (n,)
        Load or deformation in any unit.

    Returns
    -------
    ends : (n_ramps + 1, 2)
        Times, and loads, which are linear between them.
    farthest
        In the unit of the load.

    References
    ----------
    .. [1] D. H. Douglas and T. K. Peucker, Cartographica 10 (1973), 112-122.
    """
    from scipy.interpolate import make_lsq_spline

    # Rounding is not asked for: of two loads in turn, it is as much as their difference.
    within = max(_NOISE * estimate_noise(load, 0.0), _LEAST * float(np.max(np.abs(load))))
    while len(ends := _ends(time_s, load, within)) > _MOST + 1:
        within *= 2
    # For clocks that count from long ago.
    clock = time_s - time_s[0]
    corners = clock[ends]
    values = make_lsq_spline(clock, load, clock[[0, *ends, -1]], k=1).c
    values[0] = 0.0 if abs(values[0]) <= within else values[0]
    off = float(np.max(np.abs(np.interp(clock, corners, values) - load)))
    return np.column_stack((time_s[ends], values)), off


def _ends(time_s: Array, load: Array, within: float) -> list[int]:
    """Return the indices of readings that end ramps, ascending; some of them if too many do."""
    ends, parts = {0, len(load) - 1}, [(0, len(load) - 1)]
    while parts and len(ends) <= _MOST + 1:
        first, last = parts.pop()
        own = slice(first, last + 1)
        off = np.abs(load[own] - np.interp(time_s[own], time_s[[first, last]], load[[first, last]]))
        if off[farthest := int(np.argmax(off))] > within:
            ends.add(first + farthest)
            parts += [(first, first + farthest), (first + farthest, last)]
    return sorted(ends)
