"""The identifiers compared on the same traces."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from biogrip.identify.identifications import (
    at_noise_floor,
    chi_square_rise,
    read_identifications,
)
from biogrip.identify.methods import METHODS
from biogrip.study import build
from biogrip.tables.errors import error_percent
from biogrip.tables.layout import Cell, Column, Table

_LEADING = (
    Column("case", "Case"),
    Column("method", "Method"),
    Column("seeds", "Seeds"),
    Column("optimum_share", "Share at global optimum", 3),
    Column("noise_floor_share", "Share at noise floor", 2),
    Column("median_rise", "Median Δχ²", 2),
    Column("median_evaluations", "Median responses", 3),
)


def methods(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Compare how often each method reaches the global optimum, how exactly, and at what cost.

    Parameters
    ----------
    settings
        ``cases``: settings of each case (``model``, ``branches``, ``parameters``,
        ``samples``); ``optimum_tolerance``; ``noise_floor_tolerance``.
    inputs
        Identifications of the cases, CSV, in the order of the cases.
    """
    labels = dict.fromkeys(
        _label(quantity)
        for case in settings["cases"].values()
        for quantity in build.sample_model(case).quantities
    )
    rows: list[tuple[Cell, ...]] = []
    for (name, case), path in zip(settings["cases"].items(), inputs, strict=True):
        found = read_identifications(path)
        rise = chi_square_rise(found, case["samples"])
        for method in found["method"].unique():
            mine = found["method"] == method
            reached = at_noise_floor(found[mine], settings["noise_floor_tolerance"])
            rows.append(
                (
                    name,
                    METHODS[method].title,
                    int(mine.sum()),
                    float(np.mean(rise[mine] <= settings["optimum_tolerance"])),
                    float(np.mean(reached)),
                    float(np.median(rise[mine])),
                    float(found.loc[mine, "evaluations"].median()),
                    *_errors(found[mine], case, list(labels)),
                )
            )
    columns = (
        *_LEADING,
        *(Column(f"error_percent {label}", f"Error {label} %", 2) for label in labels),
    )
    caption = (
        "Methods on the same traces. At the global optimum: chi-squared at most "
        f"{settings['optimum_tolerance']:g} above the lowest that any method, or the truth, has on "
        "that trace. Errors are medians of the absolute error."
    )
    return Table(caption, columns, rows)


def _errors(found: pd.DataFrame, case: dict[str, Any], labels: list[str]) -> list[Cell]:
    errors: dict[str, float] = {}
    for quantity in build.sample_model(case).quantities:
        target = sum(case["parameters"][p.name] for p in quantity)
        values = found[[p.column for p in quantity]].sum(axis=1).to_numpy(float)
        errors[_label(quantity)] = float(np.median(np.abs(error_percent(target, values))))
    return [errors.get(label) for label in labels]


def _label(quantity: list[Any]) -> str:
    return " + ".join(parameter.name for parameter in quantity)
