"""Comparison of identification methods on the same traces."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.experiment.sample import Parameter
from biogrip.experiment.truth import Truth
from biogrip.fit.success import chi_square_increase, near_noise, near_noise_words
from biogrip.records.identifications import read_identifications
from biogrip.study.study import Study
from biogrip.tables.errors_of_case import error_percent
from biogrip.tables.layout import Cell, Column, Table

_LEADING = (
    Column("case", "Case"),
    Column("method", "Method"),
    Column("seeds", "Seeds"),
    Column("optimum_share", "Share at global optimum", 3),
    Column("near_noise_share", "Share {near_noise}", 2),
    Column("median_rise", "Median Δχ²", 2),
    Column("median_evaluations", "Median responses", 3),
)


def methods(study: Study, identifications: list[Path]) -> Table:
    """Compare success rate, errors and cost of each method."""
    labels = dict.fromkeys(
        _label(quantity)
        for case in study.cases.values()
        for quantity in case.truth.model.quantities
    )
    rows: list[tuple[Cell, ...]] = []
    for (name, case), path in zip(study.cases.items(), identifications, strict=True):
        found = read_identifications(path)
        increase = chi_square_increase(found, case.samples)
        for method in found["method"].unique():
            mine = found["method"] == method
            reached = near_noise(found[mine], study.near_noise_tolerance)
            rows.append(
                (
                    name,
                    study.identifiers[method].title,
                    int(mine.sum()),
                    float(np.mean(increase[mine] <= study.optimum_tolerance)),
                    float(np.mean(reached)),
                    float(np.median(increase[mine])),
                    float(found.loc[mine, "evaluations"].median()),
                    *_errors(found[mine], case.truth, list(labels)),
                )
            )
    words = near_noise_words(study.near_noise_tolerance)
    columns = (
        *(replace(c, heading=c.heading.format(near_noise=words)) for c in _LEADING),
        *(Column(f"error_percent {label}", f"Error {label} %", 2) for label in labels),
    )
    caption = (
        "Methods on the same traces. At the global optimum: chi-squared at most "
        f"{study.optimum_tolerance:g} above the lowest that any method, or the truth, has on "
        f"that trace. A misfit {words} in the trace may be far above that in chi-squared. Errors "
        "are medians of the absolute error."
    )
    return Table(caption, columns, rows)


def _errors(found: pd.DataFrame, truth: Truth, labels: list[str]) -> list[Cell]:
    errors: dict[str, float] = {}
    for quantity in truth.model.quantities:
        target = truth.target(quantity)
        values = found[[p.column for p in quantity]].sum(axis=1).to_numpy(float)
        errors[_label(quantity)] = float(np.median(np.abs(error_percent(target, values))))
    return [errors.get(label) for label in labels]


def _label(quantity: list[Parameter]) -> str:
    return " + ".join(parameter.name for parameter in quantity)
