"""Rows that are the samples themselves, where too few modes are known to stand for all of them.

With inertia arms ring at any rate and frequency: no small space holds what they do.
"""

from dataclasses import dataclass

from biogrip.arrays import Array
from biogrip.response.nuisance import without
from biogrip.response.whitening import Whitening


@dataclass(frozen=True, eq=False)
class EverySample:
    """What `biogrip.response.condensed.Condensed` is without inertia.

    Parameters
    ----------
    time_s : (n_samples,)
        Ascending sampling times.
    nuisance : (n_functions, n_samples)
        What is taken out of trace and responses, see `nuisance_basis` and `with_uncertain`.
    whitening
        What makes the noise white, and takes the nuisance out, if noise is not white as it is.
    """

    time_s: Array
    nuisance: Array
    whitening: Whitening | None = None

    @property
    def coloured(self) -> bool:
        """Whether noise is not white as it is."""
        return self.whitening is not None

    def cleared(self, rows: Array) -> Array:
        """Take the nuisance out of functions of time, (..., n_samples), and make noise white."""
        if self.whitening is not None:
            return self.whitening(rows)
        return without(self.nuisance, rows)

    def of_trace(self, rotation_rad: Array) -> Array:
        """Rows of a trace less nuisance: the same, (n_samples,)."""
        return rotation_rad
