"""The identification methods on the same traces, and the models that fit them."""

from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.fit.nested_fits import aic_and_bic
from biogrip.records.identifications import (
    ENCODABLE,
    MODEL_FITS,
    chi_square_increase,
    reached_encodable,
    read_identifications,
    share_with_limits,
)
from biogrip.records.rows import seeds_of
from biogrip.study.study import Study
from biogrip.tables.cases import error_percent, target_of
from biogrip.tables.layout import Column, Row, ShownTable

_METHOD_COLUMNS = (
    Column("case", "Case"),
    Column("method", "Method"),
    Column("seeds", "Seeds"),
    Column("reached_share", "Share that reached the best encodable point", 2),
    Column("reached_low", "95 % from", 2),
    Column("reached_high", "95 % to", 2),
    Column("median_rise", "Median Δχ²", 2),
    Column("encodable_rise", "Median Δχ² of that point", 2),
    Column("median_evaluations", "Median responses", 3),
)


def methods(study: Study, identifications: list[Path]) -> ShownTable:
    """Compare success rate, errors and cost of each method."""
    rows = []
    labels = {}
    for (name, case), path in zip(study.cases.items(), identifications, strict=True):
        found = read_identifications(path, case)
        found["increase"] = chi_square_increase(found, len(case.times_s))
        found["least"] = chi_square_increase(found, len(case.times_s), ENCODABLE)
        found["reached"] = reached_encodable(found, len(case.times_s), study.optimum_tolerance)
        for method, mine in found.groupby("method", sort=False):
            share, low, high = share_with_limits(int(mine["reached"].sum()), len(mine))
            row: Row = {
                "case": name,
                "method": study.identifiers[method].title,
                "seeds": len(mine),
                "reached_share": share,
                "reached_low": low,
                "reached_high": high,
                "median_rise": np.median(mine["increase"]),
                "encodable_rise": np.median(mine["least"]),
                "median_evaluations": float(mine["evaluations"].median()),
            }
            for quantity in case.sample.model.quantities:
                label = " + ".join(p.name for p in quantity)
                values = mine[[p.column for p in quantity]].sum(axis=1).to_numpy(float)
                error = np.abs(error_percent(target_of(label, case.parameters), values))
                row[f"error_percent {label}"] = np.median(error)
                labels[f"error_percent {label}"] = f"Error {label} %"
            rows.append(row)
    errors = (Column(name, heading, 2) for name, heading in labels.items())
    caption = (
        "Methods on the same traces. Reached: chi-squared, in mean squares of that point, at most "
        f"{study.optimum_tolerance:g} above that of the best point that the genes can encode of "
        "the trace (95 % interval by Wilson); methods without digits may lie below. That point is "
        "the lowest around the ends of all methods' runs: were there a lower one, a run that is "
        "just within the bound would not count. Δχ² is above the lowest that any method, or the "
        "truth, has on the trace. Errors are medians of the absolute error."
    )
    return ShownTable(caption, (*_METHOD_COLUMNS, *errors), rows)


_MODEL_COLUMNS = (
    Column("case", "Case"),
    Column("model", "Model"),
    Column("parameters", "Parameters"),
    Column("median_delta_aic", "Median ΔAIC", 3),
    Column("median_delta_bic", "Median ΔBIC", 3),
    Column("chosen_by_aic", "Chosen by AIC"),
    Column("chosen_by_bic", "Chosen by BIC"),
    Column("seeds", "Seeds"),
)


def models(study: Study, fits: list[Path]) -> ShownTable:
    """Count over seeds which model has the lowest AIC and BIC, see `aic_and_bic`."""
    found = pd.concat([read_fits(study, path) for path in fits])
    found["aic"], found["bic"] = aic_and_bic(found["misfit"], found["samples"], found["parameters"])
    rows = []
    for case, made in study.cases.items():
        maker = None if made.recorded else made.sample.candidate
        of_case = found[found["case"] == case]
        # In the configured order, since idxmin takes the first of equals.
        tried = list(of_case["model"].unique())
        values = {c: of_case.pivot(index="seed", columns="model", values=c) for c in ("aic", "bic")}
        delta = {c: wide[tried].sub(wide.min(axis=1), axis=0) for c, wide in values.items()}
        for name in tried:
            model = made.models[name].model
            row: Row = {"case": case, "model": model.title + " (made the traces)" * (name == maker)}
            row |= {"parameters": len(model.names), "seeds": len(delta["aic"])}
            for criterion, each in delta.items():
                row[f"median_delta_{criterion}"] = each[name].median()
                row[f"chosen_by_{criterion}"] = (each.idxmin(axis=1) == name).sum()
            rows.append(row)
    caption = (
        "Simplest adequate model: by how much each model's AIC and BIC exceed the lowest, and in "
        "how many seeds it has the lowest."
    )
    return ShownTable(caption, _MODEL_COLUMNS, rows)


def read_fits(study: Study, path: Path) -> pd.DataFrame:
    """Read the fits of every model of a case, in the seeds of a batch."""
    case = study.cases[path.parent.name]
    return MODEL_FITS.read(path, case=[case.name], model=case.models, seed=seeds_of(path.stem))
