"""Where between its limits a profile rises above the threshold: confidence sets in parts."""

from itertools import pairwise

import numpy as np

from biogrip.arrays import Array

# Fits end where chi^2 is known to a hundredth: what exceeds the threshold by less does not.
_CLEARLY = 1.01


def gaps_of(log_values: Array, rises: Array, threshold: float) -> tuple[tuple[float, float], ...]:
    """Stretches between points within confidence that are not within confidence themselves.

    Parameters
    ----------
    log_values, rises : (n_points,)
        A profile.
    threshold
        Rise at the limits.

    Returns
    -------
    tuple of (float, float)
        Where each begins and ends, between points as the square root of the rise has it.
    """
    inside = np.flatnonzero(rises < threshold).tolist()
    found = []
    for start, end in pairwise(inside):
        if end > start + 1 and rises[start + 1 : end].max() > _CLEARLY * threshold:
            begins = _crossing(log_values, rises, threshold, start, start + 1)
            found.append((begins, _crossing(log_values, rises, threshold, end, end - 1)))
    return tuple(found)


def _crossing(
    log_values: Array, rises: Array, threshold: float, inside: int, outside: int
) -> float:
    ends = np.sqrt(np.maximum(rises[[inside, outside]], 0.0))
    if ends[1] <= ends[0]:
        return float(log_values[outside])
    share = min((np.sqrt(threshold) - ends[0]) / (ends[1] - ends[0]), 1.0)
    return float(log_values[inside] + share * (log_values[outside] - log_values[inside]))
