"""Which sample model is the simplest that a trace asks for."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from biogrip.errors import BiogripError
from biogrip.sample import MODELS
from biogrip.tables.layout import Cell, Column, Table

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


def models(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Count over seeds which model has the lowest AIC and BIC.

    With Gaussian noise of unknown level AIC = n ln(misfit^2) + 2 (p + 1) and
    BIC = n ln(misfit^2) + (p + 1) ln n, the noise being one parameter more.

    Parameters
    ----------
    settings
        ``cases``: the sample models that made the traces, by case; None of a recorded one.
    inputs
        Fits of all models, CSV.
    """
    fits = pd.concat([_read(path) for path in inputs])
    square = fits["samples"] * 2 * np.log(fits["misfit_rad"])
    fits["aic"] = square + 2 * (fits["parameters"] + 1)
    fits["bic"] = square + (fits["parameters"] + 1) * np.log(fits["samples"])
    rows: list[tuple[Cell, ...]] = []
    for case, made_by in settings["cases"].items():
        of_case = fits[fits["case"] == case]
        delta = {}
        for criterion in ("aic", "bic"):
            wide = of_case.pivot(index="seed", columns="model", values=criterion)
            # In the order that the models were asked for: the first of equals is chosen.
            wide = wide[list(of_case["model"].unique())]
            delta[criterion] = wide.sub(wide.min(axis=1), axis=0)
        for name in of_case["model"].unique():
            medians = [float(table[name].median()) for table in delta.values()]
            chosen = [int((table.idxmin(axis=1) == name).sum()) for table in delta.values()]
            title = MODELS[name].title + (" (made the traces)" if name == made_by else "")
            rows.append(
                (case, title, len(MODELS[name].names), *medians, *chosen, len(delta["aic"]))
            )
    caption = (
        "Simplest adequate model: by how much each model's AIC and BIC exceed the lowest, and in "
        "how many seeds it has the lowest."
    )
    return Table(caption, _COLUMNS, rows)


def _read(path: Path) -> pd.DataFrame:
    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as fits of models: {error}.") from error
