"""Posterior intervals of all quantities beside profile likelihoods, and evidence of models."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from biogrip.identifiability.marginals import AGREES, DIFFERS, PRIOR
from biogrip.products.files.posterior import POSTERIOR, read_posterior
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.products.tables.verdicts import target_of
from biogrip.products.uses import each, from_study, sampled
from biogrip.study.study import Study

_IN_WORDS = {AGREES: "the same", DIFFERS: "another interval", PRIOR: "an end is the prior's"}

_COLUMNS = (
    Column("case", "Case"),
    Column("quantity", "Quantity"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("median", "Median", 3),
    Column("low", "From", 3),
    Column("high", "To", 3),
    Column("half_low", "Half from", 3),
    Column("half_high", "Half to", 3),
    Column("profile_low", "Profile from", 3),
    Column("profile_high", "Profile to", 3),
    Column("against_profile", "Against the profile"),
    Column("r_hat", "R-hat", 4),
    Column("bulk", "Effective samples", 2),
    Column("tail", "In the tails", 2),
    Column("steps", "Steps", 5),
)


def posteriors(study: Study, files: list[Path]) -> Table:
    """List posteriors from the summary of each case, JSON."""
    found = [read_posterior(path) for path in files]
    rows = [
        row
        for each, (name, case) in zip(found, study.cases.items(), strict=True)
        for row in _rows(name, case.parameters, each)
    ]
    confidences = {f"{100 * each['confidence']:g}" for each in found}
    percent = " or ".join(sorted(confidences))
    caption = (
        f"Posteriors of the trace of one seed: median, interval of {percent} % and of half of the "
        "samples, beside the limits of profile likelihoods. Sums count where the branch relaxes "
        "within the experiment."
    )
    return Table(caption, _COLUMNS, rows)


def _rows(
    case: str, parameters: Mapping[str, float], found: Mapping[str, Any]
) -> Iterator[tuple[Cell, ...]]:
    for item in found["quantities"]:
        ends = ("low", "high", "half_low", "half_high", "profile_low", "profile_high")
        yield (
            case,
            item["quantity"],
            item["unit"],
            target_of(item["quantity"], parameters),
            _rounded(item["median"]),
            *(_rounded(item[key]) for key in ends),
            _IN_WORDS[item["against_profile"]],
            found["r_hat"],
            _rounded(found["bulk"]),
            _rounded(found["tail"]),
            found["steps"],
        )


def _rounded(value: float | None) -> float | None:
    # Some thousand samples give about three digits.
    return None if value is None else float(f"{value:.3g}")


POSTERIOR_TABLE = table(
    posteriors,
    caption="Posteriors of one trace of each case, beside its profile likelihoods, and how far "
    "the samples have converged.",
    uses=from_study(cases=each(sampled, "parameters")),
    reads={"files": of_cases(POSTERIOR, sampled)},
    when=sampled,
)

_OF_MODELS = (
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
    return Table(caption, _OF_MODELS, rows)


POSTERIOR_MODELS = table(
    posterior_models,
    name="posterior_models",
    item="evidence of models",
    caption="Evidence of sample models for one trace of each case, beside AIC and BIC.",
    uses=from_study(cases=each(_compared)),
    reads={"files": of_cases(POSTERIOR, _compared)},
    when=_compared,
)
