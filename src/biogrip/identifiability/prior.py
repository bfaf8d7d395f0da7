"""Prior of a sample's log-parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.sample import SampleModel
from biogrip.identifiability.posterior_settings import LogNormal


@dataclass(frozen=True)
class Prior:
    """Normal priors of the log-parameters, truncated at the ends of the search range.

    A prior of zero precision is uniform. Branches are in the order of their relaxation
    times, the fastest first, and springpots in that of their exponents: exchanging them does not
    change a response.
    """

    model: SampleModel
    """Sample model."""
    low: Array
    """Lower ends of the search range, (n_parameters,)."""
    high: Array
    """Upper ends."""
    centre: Array
    """Logarithms of the medians before truncation, (n_parameters,)."""
    precision: Array
    """Reciprocal standard deviations, (n_parameters,)."""

    def log_density(self, log_parameters: Array) -> Array:
        """Return the logarithm of the density of the log-parameters, which integrates to one.

        Parameters
        ----------
        log_parameters : (n, n_parameters)

        Returns
        -------
        (n,)
            Minus infinity outside the range, and where branches are out of order.
        """
        away = (log_parameters - self.centre) * self.precision
        density = self._largest - 0.5 * np.sum(away**2, axis=1)
        allowed = np.all((log_parameters >= self.low) & (log_parameters <= self.high), axis=1)
        branches = self.model.free_branches
        if len(branches) > 1:
            springs, dampers = np.array(branches).T
            springs_log = self.model.branch_power * log_parameters[:, springs]
            times = log_parameters[:, dampers] - springs_log
            allowed &= np.all(np.diff(times, axis=1) >= 0, axis=1)
        return np.where(allowed, density, -np.inf)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Draw log-parameters from the prior, (count, n_parameters)."""
        from scipy.special import ndtri

        share = rng.random((count, len(self.low)))
        below, above = self._within
        drawn = self.low + share * (self.high - self.low)
        informed = self.precision > 0
        z = ndtri(below + share * (above - below))[:, informed]
        drawn[:, informed] = self.centre[informed] + z / self.precision[informed]
        drawn = np.clip(drawn, self.low, self.high)
        return np.take_along_axis(drawn, self.model.in_order(np.exp(drawn)), axis=1)

    @property
    def _within(self) -> tuple[Array, Array]:
        """Shares of the normal distributions below both ends of the range."""
        from scipy.special import ndtr

        ends = (self.low, self.high)
        below, above = (ndtr((end - self.centre) * self.precision) for end in ends)
        return below, above

    @cached_property
    def _largest(self) -> float:
        """Logarithm of the prior density at its centre."""
        below, above = self._within
        informed = self.precision > 0
        of_normal = np.log(
            self.precision[informed] / np.sqrt(2 * np.pi) / (above - below)[informed]
        )
        of_uniform = -np.log((self.high - self.low)[~informed])
        orders = factorial(max(len(self.model.free_branches), 1))
        return float(np.sum(of_normal) + np.sum(of_uniform) + np.log(orders))


def make_prior(
    model: SampleModel, low: Array, high: Array, informed: Mapping[str, LogNormal]
) -> Prior:
    """Return the prior of a model's parameters.

    Parameters
    ----------
    model
        Sample model.
    low, high : (n_parameters,)
        Logarithms of the ends of the search range.
    informed
        Log-normal priors by parameter name; the others are log-uniform.
    """
    centre, precision = 0.5 * (low + high), np.zeros(len(low))
    for index, name in enumerate(model.names):
        if name in informed:
            centre[index] = np.log(informed[name].median)
            precision[index] = 1 / informed[name].spread
    return Prior(model, low, high, centre, precision)
