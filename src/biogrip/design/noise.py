"""Noise of an experiment that is designed: parts with memory, and what is fitted along.

Readings closer than the memory of the noise tell less than independent ones of what changes slowly,
and more of what changes fast. The Fisher information is that of generalised least squares,
S^T Sigma^-1 S, and with offset and drift unknown its Schur complement; both come from sensitivities
that are whitened and rid of offset and drift, in linear time (`biogrip.response.whitening`).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.arrays import Array
from biogrip.experiment.noise_parts import AR1, Flicker, flicker_rates
from biogrip.keys import Block, Problem
from biogrip.response.nuisance import nuisance_basis, without
from biogrip.response.whitening import NoiseModel, Whitening


@dataclass(frozen=True, kw_only=True)
class DesignNoise(Block):
    """Parts of the noise beside white noise, and what is fitted along. By default neither."""

    ar1: AR1 | None = None
    """Autocorrelated component, AR(1). By default none."""
    flicker: Flicker | None = None
    """Component of spectrum 1/f. By default none."""
    offset: bool | None = None
    """If true, a constant offset is fitted along. By default only with ar1 or flicker."""
    drift: bool | None = None
    """If true, a linear drift is fitted along. By default only with ar1 or flicker."""
    exposure_s: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    """Time over which each reading is averaged, up to its instant, as the exposure of a camera's
    frame. By default 0: readings are of instants."""

    def problems(self) -> Iterator[Problem]:
        """Find components whose shares exceed one together."""
        if self.white_share < 0:
            text = (
                f"found {1 - self.white_share:g} with that of ar1, allowed is at most 1 together."
            )
            yield ("flicker", "share"), text

    @property
    def has_memory(self) -> bool:
        """True if successive readings are correlated."""
        return self.ar1 is not None or self.flicker is not None

    @property
    def fits_offset(self) -> bool:
        """True if a constant offset is fitted along."""
        return self.has_memory if self.offset is None else self.offset

    @property
    def fits_drift(self) -> bool:
        """True if a linear drift is fitted along."""
        return self.has_memory if self.drift is None else self.drift

    @property
    def white_share(self) -> float:
        """Share of white noise in the variance."""
        return 1 - sum(part.share for part in (self.ar1, self.flicker) if part is not None)

    @property
    def model(self) -> NoiseModel:
        """Shares of its parts."""
        return NoiseModel(
            self.ar1.share if self.ar1 else 0.0,
            self.ar1.time_s if self.ar1 else 1.0,
            self.flicker.share if self.flicker else 0.0,
        )

    def processes(self, shortest_s: float, longest_s: float) -> tuple[Array, Array]:
        """Return shares in the variance and rates in 1/s of its parts with memory, (n_parts,).

        Those of 1/f noise cover the times between two limits.
        """
        shares, rates = [np.zeros(0)], [np.zeros(0)]
        if self.ar1:
            shares.append(np.array([self.ar1.share]))
            rates.append(np.array([1 / self.ar1.time_s]))
        if self.flicker:
            rates.append(flicker_rates(np.array([0.0, shortest_s, longest_s])))
            shares.append(np.full(len(rates[-1]), self.flicker.share / len(rates[-1])))
        return np.concatenate(shares), np.concatenate(rates)

    def along(self, time_s: Array, longest_s: float) -> Array:
        """Return what is fitted along at some times, (n_functions, n_times)."""
        functions = [np.ones_like(time_s)] * self.fits_offset
        functions += [time_s / longest_s] * self.fits_drift
        return np.array(functions).reshape(-1, len(time_s))

    def whiten(self, time_s: Array, sensitivity: Array) -> Array:
        """Whiten sensitivities, (..., n_times), and rid them of offset and drift.

        They are in units of the noise, at ascending times. The products of what is returned are the
        Fisher information.
        """
        nuisance = nuisance_basis(time_s, offset=self.fits_offset, drift=self.fits_drift)
        if self.has_memory:
            return Whitening(time_s, self.model, nuisance)(sensitivity)
        return without(nuisance, sensitivity)


WHITE = DesignNoise()
"""Independent readings, and nothing fitted along."""
