"""How close seeds come to the truth, beside the paper, in all parameters of a table at once."""

import numpy as np
import pandas as pd

from biogrip.arrays import Array, BoolArray
from biogrip.experiment.sample import SINGLE_BRANCH
from biogrip.experiment.truth import Truth

COMPARED = ("k", "k_p", "c")
"""Parameters compared with the paper's at once; of c_p it says only that it errs by over 100 %."""
ROUNDING = 0.005
"""Relative error by which the paper's values may be rounded."""
_HALF_A_DECADE = 10**0.5
_RESOLVED = 0.01
"""What two digits resolve at best; smaller errors are of this order."""


def compared_parameters(truth: Truth) -> list[str]:
    """Return the parameters that are compared, of those that the paper identifies."""
    published = truth.published.identified
    return [name for name in COMPARED if name in published and truth.parameters.get(name)]


def relative_errors(truth: Truth, found: pd.DataFrame) -> Array:
    """Return absolute relative errors of every seed, shape (n_parameters, n_seeds)."""
    columns = {p.name: p.column for p in SINGLE_BRANCH}
    names = compared_parameters(truth)
    return np.abs(
        [found[columns[name]].to_numpy(float) / truth.parameters[name] - 1 for name in names]
    )


def as_small(truth: Truth, found: pd.DataFrame) -> BoolArray:
    """Return True for each seed whose errors are all as small as the paper's."""
    allowed = _printed_errors(truth) + ROUNDING
    return np.all(relative_errors(truth, found) <= allowed[:, None], axis=0)


def of_same_order(truth: Truth, found: pd.DataFrame) -> BoolArray:
    """Return True for each seed with all errors at most half a decade above the paper's."""
    allowed = _HALF_A_DECADE * np.maximum(_printed_errors(truth), _RESOLVED)
    return np.all(relative_errors(truth, found) <= allowed[:, None], axis=0)


def _printed_errors(truth: Truth) -> Array:
    published = truth.published.identified
    return np.array(
        [abs(published[name] / truth.parameters[name] - 1) for name in compared_parameters(truth)]
    )
