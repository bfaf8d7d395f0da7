"""How well identifications did: against one another, and against the noise."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from biogrip.arrays import Array


def lowest_misfit(found: pd.DataFrame) -> pd.Series:
    """Return the identification of lowest misfit, the first of them if there are several."""
    return found.loc[found["misfit_rad"].idxmin()]


def chi_square_rise(found: pd.DataFrame, samples: int) -> Array:
    """By how much each identification's chi^2 exceeds the lowest known of its trace, (n,).

    The lowest is that of any method, or of the truth where it is known, which
    a fit of a few parameters undercuts.

    Parameters
    ----------
    found
        Identifications of one case by all methods.
    samples
        Samples in a trace.
    """
    misfit = found["misfit_rad"]
    lowest = misfit.groupby(found["seed"]).transform("min")
    lowest = np.fmin(lowest, found["noise_rms_rad"].where(found["noise_rms_rad"] > 0))
    rise: Array = samples * ((misfit / lowest) ** 2 - 1).to_numpy(float)
    return rise


def at_noise_floor(found: pd.DataFrame, tolerance: float) -> NDArray[np.bool_]:
    """Whether each seed's misfit reaches the RMS of the noise in its trace, (n_seeds,).

    A fit of a few parameters to thousands of samples comes out at that RMS or a
    hair below it if, and only if, it is as good as the truth.
    """
    misfit, noise = (
        found["misfit_rad"].to_numpy(float),
        found["noise_rms_rad"].to_numpy(float),
    )
    reached: NDArray[np.bool_] = misfit <= (1 + tolerance) * noise
    return reached
