"""Model selection by AIC and BIC, counted over seeds."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from biogrip.experiment.sample import CANDIDATES, Sample
from biogrip.identify.model_choice import aic_and_bic
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


@dataclass(frozen=True)
class Settings:
    """Sample models that are compared.

    Parameters
    ----------
    made_by
        Those that made the traces, by case; None of a recorded one.
    tried
        All that traces were fitted with, by name.
    """

    made_by: Mapping[str, str | None]
    tried: Mapping[str, Sample]


def settings(study: Study) -> Settings:
    """Choose which sample models are compared."""
    cases = study.cases
    made_by = {
        name: None if case.recorded else case.sample.candidate for name, case in cases.items()
    }
    tried = {name: CANDIDATES[name] for case in cases.values() for name in study.models_of(case)}
    return Settings(made_by, tried)


def models(settings: Settings, fits: list[Path]) -> Table:
    """Count over seeds which model has the lowest AIC and BIC, see `aic_and_bic`.

    Parameters
    ----------
    settings
        Which.
    fits
        Fits of all models, CSV.
    """
    found = pd.concat([MODEL_FITS.read(path) for path in fits])
    found["aic"], found["bic"] = aic_and_bic(
        found["misfit_rad"], found["samples"], found["parameters"]
    )
    rows: list[tuple[Cell, ...]] = []
    for case, maker in settings.made_by.items():
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
            model = settings.tried[name].model
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
    caption="Number of seeds in which each sample model has the lowest AIC and BIC.",
    rule="tables",
    settings=settings,
    reads={"fits": of_cases(MODEL_FITS.path, lambda study: study.cases)},
    when=lambda study: study.selects_models,
)
