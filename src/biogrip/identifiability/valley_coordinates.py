"""Coordinates in which the valley of exchangeable dampers is straight.

Where c and c_p trade against each other and only their sum is determined, log-parameters
of samples lie along a narrow bend, which no straight step can follow. The logarithms of
the sum and of ratios lie along a straight line.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.sample import SampleModel


@dataclass(frozen=True)
class ValleyCoordinates:
    """A change of coordinates whose Jacobian determinant is one."""

    members: tuple[int, ...]
    """Indices of the exchangeable parameters; fewer than two change nothing."""

    def of(self, log_parameters: Array) -> Array:
        """Replace the last member's logarithm by the sum's, the others' by log-ratios to the last.

        Both arrays have shape (n, n_parameters).
        """
        found = log_parameters.copy()
        if len(self.members) > 1:
            *others, last = self.members
            own = log_parameters[:, list(self.members)]
            found[:, last] = np.logaddexp.reduce(own, axis=1)
            found[:, others] = own[:, :-1] - own[:, -1:]
        return found

    def range(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return bounds of the coordinates from bounds of log-parameters, (n_parameters,) each."""
        ends = low.copy(), high.copy()
        if len(self.members) > 1:
            *others, last = self.members
            for own, these, those in zip(ends, (low, high), (high, low), strict=True):
                own[others] = these[others] - those[last]
                own[last] = np.logaddexp.reduce(these[list(self.members)])
        return ends

    def back(self, coordinates: Array) -> Array:
        """Transform coordinates back to log-parameters, both of shape (n, n_parameters)."""
        found = coordinates.copy()
        if len(self.members) > 1:
            *others, last = self.members
            ratios = coordinates[:, others]
            of_last = np.zeros((len(ratios), 1))
            found[:, last] -= np.logaddexp.reduce(np.concatenate((ratios, of_last), axis=1), axis=1)
            found[:, others] = ratios + found[:, last, None]
        return found


def valley_coordinates(model: SampleModel) -> ValleyCoordinates:
    """Return the coordinates in which a model's exchangeable parameters have a straight valley."""
    named = enumerate(model.names)
    return ValleyCoordinates(tuple(index for index, name in named if name in model.exchangeable))
