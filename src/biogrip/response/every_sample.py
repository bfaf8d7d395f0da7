"""Rows that are the samples themselves, where too few modes are known to stand for all of them.

With inertia arms ring at any rate and frequency: no small space holds what they do.
"""

from dataclasses import dataclass

from biogrip.arrays import Array


@dataclass(frozen=True, eq=False)
class EverySample:
    """What `biogrip.response.condensed.Condensed` is without inertia.

    Parameters
    ----------
    time_s : (n_samples,)
        Ascending sampling times.
    nuisance : (n_functions, n_samples)
        What is taken out of trace and responses, see `nuisance_basis`.
    """

    time_s: Array
    nuisance: Array

    def of_trace(self, rotation_rad: Array) -> Array:
        """Rows of a trace less nuisance: the same, (n_samples,)."""
        return rotation_rad
