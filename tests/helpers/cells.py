"""Cells whose likelihoods are normal, as of values with errors."""

import numpy as np

from biogrip.arrays import Array
from biogrip.groups.cell_likelihood import CellLikelihood, make_cell_likelihood
from biogrip.groups.population import Estimates, Population, estimate_population


def normal_cell(y: float, s: float) -> CellLikelihood:
    """Return the likelihood of a cell that is known to be y with the error s."""
    z = np.linspace(-8.0, 8.0, 33)
    return make_cell_likelihood(y + s * z, z * z)


def normal_population(y: Array, s: Array, confidence: float) -> Population:
    """Return the population of cells with these values and errors."""
    estimates = Estimates(tuple(f"cell {number}" for number in range(len(y))), y, s)
    cells = [normal_cell(*own) for own in zip(y.tolist(), s.tolist(), strict=True)]
    return estimate_population(estimates, cells, confidence, freedom=len(y) - 1)
