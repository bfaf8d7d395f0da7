"""The evidence of sample models for one trace of each case, beside AIC and BIC."""

from pathlib import Path

from biogrip.products.files.posterior import POSTERIOR, read_posterior
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.products.uses import each, from_study
from biogrip.study.study import Study

_COLUMNS = (
    Column("case", "Case"),
    Column("model", "Model"),
    Column("parameters", "Parameters"),
    Column("delta_aic", "ΔAIC", 3),
    Column("delta_bic", "ΔBIC", 3),
    Column("half_delta_bic", "½ ΔBIC", 3),
    Column("delta_log_evidence", "Δ log evidence", 3),
    Column("error", "Error", 2),
    Column("reliable", "To be relied on"),
)


def _compared(study: Study) -> list[str]:
    """Return the cases whose models are compared by evidence."""
    return [name for name in study.sampled if study.case(name).compared_models]


def posterior_models(study: Study, files: list[Path]) -> Table:
    """List models and their evidence from the posterior summary of each case, JSON."""
    rows: list[tuple[Cell, ...]] = [
        (
            case,
            row["title"],
            row["parameters"],
            row["delta_aic"],
            row["delta_bic"],
            0.5 * row["delta_bic"],
            float(f"{row['delta_log_evidence']:.3g}"),
            float(f"{row['error']:.1g}"),
            "yes" if row["reliable"] else "no",
        )
        for case, path in zip(study.cases, files, strict=True)
        for row in read_posterior(path)["evidence"]
    ]
    caption = (
        "Evidence of sample models for the trace of one seed: by how much its natural logarithm is "
        "below the highest, and its standard deviation, beside by how much AIC and BIC exceed the "
        "lowest. Half a difference of BIC stands for one of the logarithm of the evidence."
    )
    return Table(caption, _COLUMNS, rows)


POSTERIOR_MODELS = table(
    posterior_models,
    item="evidence of models",
    caption="Evidence of sample models for one trace of each case, beside AIC and BIC.",
    uses=from_study(cases=each(_compared)),
    reads={"files": of_cases(POSTERIOR, _compared)},
    when=_compared,
)
