"""Comparison of identification methods on the same traces.

Model selection by AIC and BIC, counted over seeds.

Processor time of the methods on the machine that ran them.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.fit.methods import chi_square_increase, near_noise, near_noise_words
from biogrip.fit.nested_fits import aic_and_bic
from biogrip.physics.models import Truth
from biogrip.physics.sample_model import Parameter
from biogrip.records.identifications import MODEL_FITS, TIMINGS, read_identifications
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


_COLUMNS = (
    Column("case", "Case"),
    Column("model", "Model"),
    Column("parameters", "Parameters"),
    Column("median_delta_aic", "Median ΔAIC", 3),
    Column("median_delta_bic", "Median ΔBIC", 3),
    Column("chosen_by_aic", "Chosen by AIC"),
    Column("chosen_by_bic", "Chosen by BIC"),
    Column("seeds", "Seeds"),
)


def models(study: Study, fits: list[Path]) -> Table:
    """Count over seeds which model has the lowest AIC and BIC, see `aic_and_bic`."""
    found = pd.concat([MODEL_FITS.read(path) for path in fits])
    found["aic"], found["bic"] = aic_and_bic(found["misfit"], found["samples"], found["parameters"])
    rows: list[tuple[Cell, ...]] = []
    for case, made in study.cases.items():
        maker = None if made.recorded else made.sample.candidate
        of_case = found[found["case"] == case]
        delta = {}
        for criterion in ("aic", "bic"):
            wide = of_case.pivot(index="seed", columns="model", values=criterion)
            # In the configured order, since idxmin takes the first of equals.
            wide = wide[list(of_case["model"].unique())]
            delta[criterion] = wide.sub(wide.min(axis=1), axis=0)
        for name in of_case["model"].unique():
            medians = [float(table[name].median()) for table in delta.values()]
            chosen = [int((table.idxmin(axis=1) == name).sum()) for table in delta.values()]
            model = made.models[name].model
            title = model.title + (" (made the traces)" if name == maker else "")
            rows.append((case, title, len(model.names), *medians, *chosen, len(delta["aic"])))
    caption = (
        "Simplest adequate model: by how much each model's AIC and BIC exceed the lowest, and in "
        "how many seeds it has the lowest."
    )
    return Table(caption, _COLUMNS, rows)


_TIMING_COLUMNS = (
    Column("case", "Case"),
    Column("method", "Method"),
    Column("seeds", "Seeds"),
    Column("median_cpu_s", "Median CPU time (s)", 2),
    Column("total_cpu_s", "Total CPU time (s)", 3),
)


def timings(study: Study, times: list[Path]) -> Table:
    """Summarise processor time per identification by case and method, from CSV."""
    spent = pd.concat([TIMINGS.read(path) for path in times])
    rows: list[tuple[Cell, ...]] = [
        (
            case,
            study.identifiers[method].title,
            len(mine),
            float(mine["cpu_s"].median()),
            float(mine["cpu_s"].sum()),
        )
        for (case, method), mine in spent.groupby(["case", "method"], sort=False)
    ]
    return Table("Processor time of the identifications on this machine.", _TIMING_COLUMNS, rows)


# Not in tables/, since times are not reproducible.
