"""Model selection by AIC and BIC, counted over seeds."""

from pathlib import Path

import pandas as pd

from biogrip.fit.model_choice import aic_and_bic
from biogrip.records.model_fits import MODEL_FITS
from biogrip.study.study import Study
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
