"""Files of a posterior: summary as JSON, samples as Parquet."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import rounded
from biogrip.experiment.sample import SampleModel
from biogrip.products.files.json_object import read_object
from biogrip.products.files.parquet import read_columns, table_of, write_tables

if TYPE_CHECKING:
    from biogrip.identifiability.marginals import Marginal
    from biogrip.identifiability.posterior_settings import PosteriorSettings
    from biogrip.identifiability.prior_sensitivity import Sensitivity
    from biogrip.identifiability.sampling import Samples

POSTERIOR = "results/posterior/{case}.json"
SAMPLES = "results/posterior/{case}.parquet"

_MOST_ROWS = 10_000
_EXACT_ONSET = (
    "The posterior takes the fitted onset as exact, so its intervals are too narrow; the limits of "
    "the profiles are not."
)

Limits = Mapping[str, tuple[float | None, float | None]]
"""Confidence limits from profile likelihoods by quantity; None at an open end."""


def posterior_data(
    samples: "Samples",
    settings: "PosteriorSettings",
    marginals: Sequence["Marginal"],
    sensitivities: Sequence["Sensitivity"],
    found: Limits,
    *,
    exact_onset: bool,
) -> dict[str, Any]:
    """Return the summary of a posterior as plain data in SI units.

    With an exact onset, the samples are of one that was fitted, and the limits allow for its
    uncertainty.
    """
    from biogrip.identifiability.prior_sensitivity import in_words

    steps, walkers, _ = samples.log_parameters.shape
    convergence = samples.convergence
    return {
        "prior": {name: dict(vars(own)) for name, own in settings.prior.items()},
        "walkers": walkers,
        "steps": steps,
        "accepted": rounded(samples.accepted),
        "r_hat": rounded(convergence.r_hat),
        "bulk": rounded(convergence.bulk),
        "tail": rounded(convergence.tail),
        "converged": convergence.reached,
        "in_words": f"{convergence.words()} {_EXACT_ONSET if exact_onset else ''}".rstrip(),
        "prior_in_words": in_words(sensitivities),
        "quantities": [
            {
                **_quantity(own, *found[own.quantity.label], exact_onset=exact_onset),
                "prior_sensitivity": rounded(each.prior),
                "likelihood_sensitivity": rounded(each.likelihood),
            }
            for own, each in zip(marginals, sensitivities, strict=True)
        ],
    }


def _quantity(
    own: "Marginal", low: float | None, high: float | None, *, exact_onset: bool
) -> dict[str, Any]:
    return {
        "quantity": own.quantity.label,
        "symbol": own.quantity.symbol,
        "unit": own.quantity.unit,
        "median": rounded(own.median),
        "low": rounded(own.outer[0]),
        "high": rounded(own.outer[1]),
        "half_low": rounded(own.inner[0]),
        "half_high": rounded(own.inner[1]),
        "share": rounded(own.share),
        "profile_low": rounded(low),
        "profile_high": rounded(high),
        "against_profile": own.against(low, high),
        "in_words": own.words(),
        "why": own.why(low, high, exact_onset=exact_onset),
    }


def limits_in(verdicts: Mapping[str, Any]) -> Limits:
    """Return the limits of profile likelihoods from verdicts."""
    return {item["quantity"]: (item["low"], item["high"]) for item in verdicts["quantities"]}


def read_posterior(path: Path) -> dict[str, Any]:
    """Read the summary of a posterior."""
    keys = {"quantities", "converged", "in_words"}
    return read_object(path, "a posterior", keys, "says nothing of a posterior")


def thinned(log_parameters: Array) -> Array:
    """Return some thousand samples, (n, n_parameters), evenly spaced over all walkers' steps."""
    steps, walkers, size = log_parameters.shape
    every = -(-steps * walkers // _MOST_ROWS)
    return log_parameters[::every].reshape(-1, size)


def write_samples(
    path: Path, model: SampleModel, log_parameters: Array, words: Mapping[str, str] | None = None
) -> None:
    """Write samples (n, n_parameters) as Parquet, a column per parameter in SI units, and text."""
    values = np.exp(log_parameters)
    columns: dict[str, Array | str] = {
        p.column: values[:, index] for index, p in enumerate(model.parameters)
    }
    columns |= words or {}
    write_tables(path, [table_of(columns, len(values))], dictionary=False)


def read_samples(path: Path, model: SampleModel) -> Array:
    """Read samples written by `write_samples`, (n, n_parameters) in SI units."""
    columns = read_columns(path, [p.column for p in model.parameters])
    return np.stack(list(columns.values()), axis=1)
