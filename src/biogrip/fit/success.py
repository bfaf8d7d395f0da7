"""Measures of success: misfits of identifications compared with one another and with noise."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from biogrip.arrays import Array


def typical(found: pd.DataFrame) -> pd.Series:
    """Return the identification with the median ratio of misfit to noise in its trace.

    The lowest misfit of all would be that of the quietest trace. If the noise is unknown
    or absent, the identification of median misfit is returned. Of an even number, it is
    the better of the two in the middle.
    """
    noise = found["noise_rms"].where(found["noise_rms"] > 0).fillna(1.0)
    ranked = (found["misfit"] / noise).sort_values(kind="stable").index
    return found.loc[ranked[(len(ranked) - 1) // 2]]


def chi_square_increase(found: pd.DataFrame, samples: int) -> Array:
    """Return the increase of each identification's chi^2 over the lowest of its trace, (n,).

    The lowest is that of any method, or that of the true parameters where these are
    known; the best fit of a few parameters lies below the latter.

    Parameters
    ----------
    found
        Identifications of one case by all methods.
    samples
        Number of readings in a trace.
    """
    misfit = found["misfit"]
    lowest = misfit.groupby(found["seed"]).transform("min")
    lowest = np.fmin(lowest, found["noise_rms"].where(found["noise_rms"] > 0))
    increase: Array = samples * ((misfit / lowest) ** 2 - 1).to_numpy(float)
    return increase


def near_noise(found: pd.DataFrame, tolerance: float) -> NDArray[np.bool_]:
    """Return True for each seed whose misfit is at most a share above the RMS noise, (n_seeds,).

    Such a fit looks right in a plot. With thousands of readings it need not be an optimum:
    a misfit 2 % above the noise increases chi^2 of 4001 readings by 162; see
    `chi_square_increase`.
    """
    misfit, noise = (found[name].to_numpy(float) for name in ("misfit", "noise_rms"))
    reached: NDArray[np.bool_] = misfit <= (1 + tolerance) * noise
    return reached


def near_noise_words(tolerance: float) -> str:
    """Describe the criterion of `near_noise` in words."""
    return f"within {100 * tolerance:g} % of the noise"
