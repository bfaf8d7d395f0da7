"""How well identifications did: against one another, and against the noise."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from biogrip.arrays import Array


def typical(found: pd.DataFrame) -> pd.Series:
    """Return the identification of median excess of the misfit over the noise in its trace.

    The lowest misfit of all would be that of the quietest trace. Where nobody knows the
    noise, or there is none, it is the identification of median misfit; of an even number
    the better one of the two in the middle.
    """
    noise = found["noise_rms_rad"].where(found["noise_rms_rad"] > 0).fillna(1.0)
    ranked = (found["misfit_rad"] / noise).sort_values(kind="stable").index
    return found.loc[ranked[(len(ranked) - 1) // 2]]


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


def near_noise(found: pd.DataFrame, tolerance: float) -> NDArray[np.bool_]:
    """Whether each seed's misfit is within a share of the noise in its trace (RMS), (n_seeds,).

    That is how far a plot of the fit looks right. With thousands of samples it is no
    optimum: 2 % more misfit than noise is a chi^2 of 162 in 4001 of them; see
    `chi_square_rise`.
    """
    misfit, noise = (found[name].to_numpy(float) for name in ("misfit_rad", "noise_rms_rad"))
    reached: NDArray[np.bool_] = misfit <= (1 + tolerance) * noise
    return reached


def near_noise_words(tolerance: float) -> str:
    """Say what `near_noise` asks for."""
    return f"within {100 * tolerance:g} % of the noise"
