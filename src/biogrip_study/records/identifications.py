"""Results of stages: what was identified, a row a seed, and verdicts on a trace, JSON.

Identifications by each method have a row per seed, with histories beside them. Further files of
rows have the fits of every sample model, the intervals of coverage tests, and identifications under
other readings of the paper.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.digits import significant
from biogrip.files import read_object
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import Fit
from biogrip.physics.sample_model import SINGLE_BRANCH, Parameter, SampleModel
from biogrip_study.config.study import Case, Study
from biogrip_study.records.rows import RowFile, read_arrays, seeds_of

if TYPE_CHECKING:
    import pandas as pd

# Few enough that results on different processors agree.
_HISTORY_DIGITS = 8

ENCODABLE = "encodable_misfit"
"""Last column of the identifications of a case: lowest misfit that genes can encode of the
trace, see `lowest_encodable`; empty if it was recorded."""

MODEL_FITS = RowFile(
    "fits of models",
    ("case", "model", "seed", "parameters", "samples", "misfit"),
    words=("case", "model"),
)

INTERVALS = RowFile(
    "intervals",
    (
        *("case", "quantity", "seed", "estimate", "low", "high"),
        *("verdict", "shown_low", "shown_high"),
    ),
    words=("case", "quantity", "verdict"),
)
"""A row per quantity and seed. Quantities that traces should determine have an estimate and its
limits. For some seeds, all quantities have the verdict and limits that users are shown, from whole
profiles."""

LAST_IMPROVEMENT = "last_improvement"
"""Last column of identifications under a reading of the paper, which is their method: the last
generation with a lower misfit."""


def read_readings(path: Path, case: Case) -> "pd.DataFrame":
    """Read what the reading that a file is named like found; parameters stand by name."""
    names = {p.column: p.name for p in SINGLE_BRANCH}
    frame = _read_methods(path, case, [path.stem], range(case.seeds))
    return frame.rename(columns={"method": "reading", **names})


def parameters_in_file(model: SampleModel) -> tuple[Parameter, ...]:
    """Return the parameters that have columns in a file of identifications.

    They are the paper's four, in its units, if these cover the model, with 0 for missing elements,
    so that files can be concatenated. Otherwise they are the model's own.
    """
    covered = {p.column for p in model.parameters} <= {p.column for p in SINGLE_BRANCH}
    return SINGLE_BRANCH if covered else model.parameters


def identification_columns(model: SampleModel) -> tuple[str, ...]:
    """Return the columns of a file of identifications."""
    return (
        *("case", "method", "seed"),
        *(p.column for p in parameters_in_file(model)),
        *("misfit", "noise_rms", "generations", "evaluations", "stop_reason"),
    )


def row_of(experiment: Experiment, answer: Fit, noise_rms: float | None) -> tuple[str | int, ...]:
    """Return what `identification_columns` has of an identification, after case, method and seed.

    Numbers have six significant digits: more than a trace determines, and few enough that
    results on different processors agree. The noise of a recorded trace is None.
    """
    return (
        *(f"{value:.6g}" for value in _by_column(experiment, answer.parameters).values()),
        f"{answer.misfit:.6e}",
        "" if noise_rms is None else f"{noise_rms:.6e}",
        *(answer.generations, answer.evaluations, answer.stop_reason),
    )


def _by_column(of: Experiment, identified: Array) -> dict[str, Any]:
    """Return identified values, (n_searched, ...), fixed ones, and 0 for missing elements."""
    values = {**of.fixed, **dict(zip(of.searched.names, identified, strict=True))}
    return {p.column: values.get(p.name, 0.0) for p in parameters_in_file(of.model)}


def history_of(method: str, seed: int, experiment: Experiment, answer: Fit) -> dict[str, Array]:
    """Return columns of a row per generation, with eight significant digits."""
    history = answer.history
    generations = len(history.best_misfit)
    columns_by_name = {
        "best_misfit": history.best_misfit,
        "median_misfit": history.median_misfit,
        **_by_column(experiment, history.best_parameters.T),
    }
    return {
        "method": np.full(generations, method),
        "seed": np.full(generations, seed),
        "generation": np.arange(generations),
        "evaluations": np.asarray(history.evaluations),
        **{
            name: significant(np.broadcast_to(values, generations), _HISTORY_DIGITS)
            for name, values in columns_by_name.items()
        },
    }


def read_identifications(path: Path, case: Case, method: str | None = None) -> "pd.DataFrame":
    """Read identifications of a case by all methods of the study, or by one, in all seeds."""
    frame = _read_methods(path, case, case.study.config.methods, range(case.seeds))
    return frame if method is None else frame[frame["method"] == method].reset_index(drop=True)


def read_batch(path: Path, case: Case) -> "pd.DataFrame":
    """Read identifications by the method and in the seeds that the path of a batch names."""
    return _read_methods(path, case, [path.parent.name], seeds_of(path.stem))


def _read_methods(path: Path, case: Case, methods: Sequence[str], seeds: range) -> "pd.DataFrame":
    file = RowFile(
        "identifications",
        identification_columns(case.sample.model),
        ("case", "method", "stop_reason"),
    )
    return file.read(path, case=[case.name], method=methods, seed=seeds)


def read_histories(path: Path, method: str, values: Sequence[str]) -> "pd.DataFrame":
    """Read columns of one method's histories."""
    import pandas as pd

    frame = pd.DataFrame(read_arrays(path))
    kept = frame["method"] == method
    return frame.loc[kept, ["seed", "generation", *values]].reset_index(drop=True)


def read_verdicts(path: Path) -> dict[str, Any]:
    """Read a file of verdicts."""
    return read_object(path, "verdicts")


def values_by_quantity(runs: "pd.DataFrame", model: SampleModel) -> "dict[str, pd.Series[float]]":
    """Return what runs found of every parameter and of the sum of the exchangeable ones, by name.

    Parameters
    ----------
    runs
        Identifications, a row a run.
    model
        Sample model, whose parameters have columns.

    Returns
    -------
    dict
        Values in SI units, (n_runs,) each, by the labels of `parameters_and_sum`.
    """
    return {
        " + ".join(p.name for p in group): runs[[p.column for p in group]].sum(axis=1)
        for group in model.quantities
    }


ALL = "all"
"""Name of the basin of all runs."""
_LEAST_SHARE_OF_BASIN = 0.1
"""Least share of runs that makes a basin."""


def basins(identified: "pd.DataFrame", study: Study) -> "dict[str, pd.DataFrame]":
    """Divide the runs of a method on a case into those that end `near_noise` and those above it.

    These are two basins, by their names, if a tenth of the runs or more end in each. Else there is
    one, `ALL`, as where the noise is unknown.
    """
    near = near_noise(identified, study)
    if not _LEAST_SHARE_OF_BASIN <= near.mean() <= 1 - _LEAST_SHARE_OF_BASIN:
        return {ALL: identified}
    return {"near the noise": identified[near], "above the noise": identified[~near]}


def chi_square_increase(identified: "pd.DataFrame", case: Case, of: str = "misfit") -> Array:
    """Return the increase of each identification's chi^2 over the lowest of its trace.

    The lowest is that of any method, or that of the true parameters where these are known; the best
    fit of a few parameters lies below the latter.

    Parameters
    ----------
    identified
        Identifications by all methods, a row each.
    case
        Whose readings are counted.
    of
        Column of misfits.

    Returns
    -------
    Array
        (n,)
    """
    misfit = identified["misfit"]
    lowest = misfit.groupby(identified["seed"]).transform("min")
    lowest = np.fmin(lowest, identified["noise_rms"].where(identified["noise_rms"] > 0))
    return len(case.times_s) * ((identified[of] / lowest) ** 2 - 1).to_numpy(float)


def reached_encodable(identified: "pd.DataFrame", case: Case) -> BoolArray:
    """Return True for each run with chi^2 at most a tolerance above the best encodable point, (n,).

    Every method can reach this point or lie below it, with digits or without.
    """
    misfit, encodable = (
        identified[name].to_numpy(float) for name in ("misfit", "encodable_misfit")
    )
    above = len(case.times_s) * (misfit**2 - encodable**2)
    return above <= case.study.optimum_tolerance * encodable**2


def share_with_limits(count: int, runs: int) -> tuple[float, float, float]:
    """Return the share of runs that do something, and its 95 % interval by Wilson.

    As `scipy.stats.binomtest` has it, whose import takes longer than a table.
    """
    z, share = NormalDist().inv_cdf(0.975), count / runs
    middle = (share + z * z / (2 * runs)) / (1 + z * z / runs)
    half = z * math.sqrt((share * (1 - share) + z * z / (4 * runs)) / runs) / (1 + z * z / runs)
    # Of none and of all, an end is exact but for rounding.
    return share, middle - half if count else 0.0, middle + half if count < runs else 1.0


def share_in_words(count: int, runs: int) -> str:
    """Return a share of runs in percent with its 95 % interval: ``18 % (10–31)``."""
    share, low, high = (100 * limit for limit in share_with_limits(count, runs))
    return f"{share:.0f} % ({low:.0f}–{high:.0f})"


def near_noise(identified: "pd.DataFrame", study: Study) -> BoolArray:
    """Return True for each seed whose misfit is within the study's tolerance of the noise, (n,).

    Such a fit looks right in a plot. With thousands of readings it need not be an optimum:
    a misfit 2 % above the noise increases chi^2 of 4001 readings by 162; see
    `chi_square_increase`.
    """
    misfit, noise = (identified[name].to_numpy(float) for name in ("misfit", "noise_rms"))
    return misfit <= (1 + study.near_noise_tolerance) * noise


def near_noise_words(study: Study) -> str:
    """Describe the criterion of `near_noise` in words."""
    return f"within {100 * study.near_noise_tolerance:g} % of the noise"
