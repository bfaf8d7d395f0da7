"""Which sample model is the simplest that a trace asks for.

References
----------
.. [1] H. Akaike, A new look at the statistical model identification, IEEE Transactions on
   Automatic Control 19 (1974), 716-723.
.. [2] G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978), 461-464.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.experiment.sample import CANDIDATES
from biogrip.products.files.model_fits import MODEL_FITS
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.study.study import Study

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


def settings(study: Study) -> dict[str, str | None]:
    """Name the sample models that made the traces, by case; None of a recorded one."""
    return {
        name: None if case.recorded else case.sample.candidate for name, case in study.cases.items()
    }


def models(made_by: Mapping[str, str | None], fits: list[Path]) -> Table:
    """Count over seeds which model has the lowest AIC and BIC.

    With Gaussian noise of unknown level AIC = n ln(misfit^2) + 2 (p + 1) and
    BIC = n ln(misfit^2) + (p + 1) ln n, the noise being one parameter more.

    Parameters
    ----------
    made_by
        The sample models that made the traces, by case; None of a recorded one.
    fits
        Fits of all models, CSV.
    """
    found = pd.concat([MODEL_FITS.read(path) for path in fits])
    square = found["samples"] * 2 * np.log(found["misfit_rad"])
    found["aic"] = square + 2 * (found["parameters"] + 1)
    found["bic"] = square + (found["parameters"] + 1) * np.log(found["samples"])
    rows: list[tuple[Cell, ...]] = []
    for case, maker in made_by.items():
        of_case = found[found["case"] == case]
        delta = {}
        for criterion in ("aic", "bic"):
            wide = of_case.pivot(index="seed", columns="model", values=criterion)
            # In the order that the models were asked for: the first of equals is chosen.
            wide = wide[list(of_case["model"].unique())]
            delta[criterion] = wide.sub(wide.min(axis=1), axis=0)
        for name in of_case["model"].unique():
            medians = [float(table[name].median()) for table in delta.values()]
            chosen = [int((table.idxmin(axis=1) == name).sum()) for table in delta.values()]
            model = CANDIDATES[name].model
            title = model.title + (" (made the traces)" if name == maker else "")
            rows.append((case, title, len(model.names), *medians, *chosen, len(delta["aic"])))
    caption = (
        "Simplest adequate model: by how much each model's AIC and BIC exceed the lowest, and in "
        "how many seeds it has the lowest."
    )
    return Table(caption, _COLUMNS, rows)


MODELS_COMPARED = table(
    models,
    name="models",
    item="sample models",
    caption="Which sample model is the simplest that the traces ask for, by AIC and BIC, counted "
    "over seeds.",
    sheet="tables",
    settings=settings,
    reads={"fits": of_cases(MODEL_FITS.path, lambda study: study.cases)},
    when=lambda study: study.selects_models,
)
