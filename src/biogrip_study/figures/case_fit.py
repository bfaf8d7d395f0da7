"""Figures 9, 11 and 12: target, noisy trace, fits, and the residuals; and profiles."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from biogrip.figures.fit import FittedTrace, draw_fit, fit_of
from biogrip.figures.likelihood import draw_profiles_of
from biogrip_study.config.study import Case
from biogrip_study.records.identifications import ALL, basins, read_identifications, read_verdicts
from biogrip_study.records.rows import seeds_of
from biogrip_study.records.traces import read_measurements
from biogrip_study.stages.identification import experiment_for
from biogrip_study.stages.judgement import JUDGED_SEED

SHOWN_SEEDS = 100
"""Most seeds drawn individually; figures show the first ones."""


def first_of_basins(identified: pd.DataFrame, case: Case) -> dict[str, pd.Series]:
    """Return the first run of each of the `basins`, by what it is called in a legend."""
    if len(identified) == 1:
        return {"the only trace": identified.iloc[0]}
    return {
        f"seed {runs['seed'].iloc[0]}" + f", {name}" * (name != ALL): runs.iloc[0]
        for name, runs in basins(identified, case.study).items()
    }


def fits_of_basins(
    case: Case, identifications: Path, measurements: list[Path]
) -> dict[str, FittedTrace]:
    """Return the fit of the first run of each basin, by label, from files of a case."""
    identified = read_identifications(identifications, case, case.study.shown_method.name)
    fits = {}
    for words, run in first_of_basins(identified, case).items():
        seed = int(run["seed"])
        values = {p.name: float(run[p.column]) for p in case.sample.model.parameters}
        holding = next(path for path in measurements if seed in seeds_of(path.stem))
        fits[f"fit ({words})"] = _fit_of_seed(case, seed, values, holding)
    return fits


def _fit_of_seed(
    case: Case, seed: int, values: Mapping[str, float], measurements: Path
) -> FittedTrace:
    made = read_measurements(measurements, [seed])
    experiment = experiment_for(case.experiment, made)
    return fit_of(
        experiment, values, made.time_s, made.readings[seed], made.known.get("sd"), made.target
    )


def seeds_in_words(count: int) -> str:
    """Return in words how many seeds are drawn individually."""
    if count == 1:
        return "the only trace"
    return f"all {count} seeds" if count <= SHOWN_SEEDS else f"first {SHOWN_SEEDS} of {count} seeds"


def draw_fits(case: Case, identifications: Path, measurements: list[Path]) -> Figure:
    """Draw the fit of the first run in each basin, beside the trace of the first of these."""
    fits = fits_of_basins(case, identifications, measurements)
    return draw_fit(fits, case.title, case.published.axis_rad)


def draw_judged_fit(case: Case, verdicts: Path, measurements: list[Path]) -> Figure:
    """Draw the judged trace of a case and its best fit."""
    fit = judged_fit(case, read_verdicts(verdicts), measurements[0])
    trace = "recorded trace" if case.recorded else f"seed {JUDGED_SEED}"
    return draw_fit({f"best fit ({trace})": fit}, case.title, case.published.axis_rad)


def draw_profiles(case: Case, verdicts: Path, expected: list[Path]) -> Figure:
    """Draw the profile of every quantity of a case, with confidence limits."""
    others = [read_verdicts(path) for path in expected]
    return draw_profiles_of(read_verdicts(verdicts), others, case.title, case.parameters)


def judged_fit(case: Case, verdicts: Mapping[str, Any], measurements: Path) -> FittedTrace:
    """Return the judged trace of a case and its best fit."""
    values = {item["quantity"]: item["value"] for item in verdicts["quantities"]}
    return _fit_of_seed(case, JUDGED_SEED, values, measurements)
