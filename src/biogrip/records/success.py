"""How well identifications succeeded: near the noise, in which basin, in what share of runs."""

import numpy as np
import pandas as pd
from scipy.stats import binom, binomtest

from biogrip.arrays import Array, BoolArray

ALL = "all"
"""Name of the basin of all runs."""
_FEWEST = 0.1
"""Least share of runs that makes a basin."""


def basins(found: pd.DataFrame, tolerance: float) -> dict[str, pd.DataFrame]:
    """Divide the runs of a method on a case into those that end `near_noise` and those above it.

    These are two basins, by their names, if a tenth of the runs or more end in each. Else there is
    one, `ALL`, as where the noise is unknown.
    """
    near = near_noise(found, tolerance)
    if not _FEWEST <= near.mean() <= 1 - _FEWEST:
        return {ALL: found}
    return {"near the noise": found[near], "above the noise": found[~near]}


def chi_square_increase(found: pd.DataFrame, samples: int, of: str = "misfit") -> Array:
    """Return the increase of each identification's chi^2 over the lowest of its trace, (n,).

    Identifications of one case by all methods are given, the number of readings in a trace, and the
    column of misfits. The lowest is that of any method, or that of the true parameters where these
    are known; the best fit of a few parameters lies below the latter.
    """
    misfit = found["misfit"]
    lowest = misfit.groupby(found["seed"]).transform("min")
    lowest = np.fmin(lowest, found["noise_rms"].where(found["noise_rms"] > 0))
    increase: Array = samples * ((found[of] / lowest) ** 2 - 1).to_numpy(float)
    return increase


def reached_encodable(found: pd.DataFrame, samples: int, tolerance: float) -> BoolArray:
    """Return True for each run with chi^2 at most `tolerance` above the best encodable point, (n,).

    Every method can reach this point or lie below it, with digits or without.
    """
    misfit, encodable = (found[name].to_numpy(float) for name in ("misfit", "encodable_misfit"))
    reached: BoolArray = samples * (misfit**2 - encodable**2) <= tolerance * encodable**2
    return reached


def share_with_limits(count: int, runs: int) -> tuple[float, float, float]:
    """Return the share of runs that do something, and its 95 % interval by Wilson."""
    low, high = binomtest(count, runs).proportion_ci(0.95, method="wilson")
    return count / runs, float(low), float(high)


def median_with_limits(values: Array) -> tuple[float, float, float]:
    """Return the median of values, (n,), and its 95 % interval from their order."""
    ordered, count = np.sort(values), len(values)
    first = max(int(binom.ppf(0.025, count, 0.5)) - 1, 0)
    return float(np.median(values)), float(ordered[first]), float(ordered[count - 1 - first])


def share_in_words(count: int, runs: int) -> str:
    """Return a share of runs in percent with its 95 % interval: ``18 % (10–31)``."""
    share, low, high = (100 * each for each in share_with_limits(count, runs))
    return f"{share:.0f} % ({low:.0f}–{high:.0f})"


def near_noise(found: pd.DataFrame, tolerance: float) -> BoolArray:
    """Return True for each seed whose misfit is at most a share above the RMS noise, (n_seeds,).

    Such a fit looks right in a plot. With thousands of readings it need not be an optimum:
    a misfit 2 % above the noise increases chi^2 of 4001 readings by 162; see
    `chi_square_increase`.
    """
    misfit, noise = (found[name].to_numpy(float) for name in ("misfit", "noise_rms"))
    reached: BoolArray = misfit <= (1 + tolerance) * noise
    return reached


def near_noise_words(tolerance: float) -> str:
    """Describe the criterion of `near_noise` in words."""
    return f"within {100 * tolerance:g} % of the noise"
