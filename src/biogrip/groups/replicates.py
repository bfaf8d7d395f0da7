"""Replicates: several traces of one cell, posed as one problem with shared parameters.

Each trace has its own noise sigma_i, so what is summed is chi^2: every trace's residuals count in
units of its own noise. The rows of all traces stand below one another, each trace's multiplied by
sigma/sigma_i, where sigma is the noise of the whole; so all that fits, profiles and judges one
trace does it with several, and a trace alone is as it was.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from math import fsum, sqrt

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.sample import SampleModel
from biogrip.identify.problem import Problem
from biogrip.response.grip import Grip
from biogrip.response.residuals import Residuals


class JointResiduals(Residuals):
    """Residuals of several traces of one sample, each in units of its own noise.

    Times of sampling, and what the instrument may have added, are each trace's own.

    Parameters
    ----------
    parts
        Residuals of each trace, for the same model.
    noise_rad
        Standard deviation of the noise of each.
    """

    def __init__(self, parts: Sequence[Residuals], noise_rad: Sequence[float]) -> None:
        self._parts = tuple(parts)
        self.samples = sum(part.samples for part in parts)
        self.duration_s = max(part.duration_s for part in parts)
        self.model, self.nonlinear = parts[0].model, parts[0].nonlinear
        counted = zip(parts, noise_rad, strict=True)
        whole = sqrt(self.samples / fsum(part.samples / own**2 for part, own in counted))
        self.weights = np.array([whole / own for own in noise_rad])
        peaks = (w * part.peak_rad for w, part in zip(self.weights, parts, strict=True))
        self.peak_rad = float(max(peaks))
        scales = (w * part.noise_scale_rad for w, part in zip(self.weights, parts, strict=True))
        squares = (part.samples * s**2 for part, s in zip(parts, scales, strict=True))
        self.noise_scale_rad = sqrt(fsum(squares) / self.samples)

    @property
    def free(self) -> int:
        """Degrees of freedom that samples and nuisance leave to parameters and noise."""
        return sum(part.free for part in self._parts)

    def grip(self, log_parameters: Array) -> Grip:
        """Force of the jaws on the sample; the protocol is the same for all traces."""
        return self._parts[0].grip(log_parameters)

    def of_model(self, model: SampleModel) -> "JointResiduals":
        """Return the same traces for another model."""
        parts = [part.of_model(model) for part in self._parts]
        return JointResiduals(parts, (1 / self.weights).tolist())

    def __call__(self, log_parameters: Array) -> tuple[Array, Array]:
        """Residuals (n_samples,) and derivatives (n_parameters, n_samples), trace after trace."""
        return self._stacked([part(log_parameters) for part in self._parts])

    def gradient(self, log_parameters: Array) -> tuple[Array, float]:
        """Of half the sum of squares, (n_parameters,) in rad^2, and the RMS misfit in rad."""
        found = [part.gradient(log_parameters) for part in self._parts]
        counted = zip(self.weights, self._parts, found, strict=True)
        squares = (w**2 * part.samples * rms**2 for w, part, (_, rms) in counted)
        gradients = [w**2 * own for w, (own, _) in zip(self.weights, found, strict=True)]
        return np.sum(gradients, axis=0), sqrt(fsum(squares) / self.samples)

    def left(self, log_parameters: Array) -> Array:
        """Residuals alone, trace after trace, (n_samples,) in rad."""
        return self._side_by_side([part.left(log_parameters) for part in self._parts])

    @property
    def freedom(self) -> float:
        """Degrees of freedom with which the colour of the noise of the least known is known."""
        return min(part.freedom for part in self._parts)

    @property
    def coloured(self) -> bool:
        """Whether noise was not white, and has been made so."""
        return all(part.coloured for part in self._parts)

    @property
    def inertia(self) -> bool:
        """Whether the arms ring in any of the traces."""
        return any(part.inertia for part in self._parts)

    @cached_property
    def condensed_trace(self) -> Array:
        """Rows of the traces, (n_rows,) in rad."""
        return self._side_by_side([part.condensed_trace for part in self._parts])

    def condensed_linear(self, log_parameters: Array, *, slopes: bool = True) -> Array:
        """Of `condensed_responses`, what the linear model gives."""
        return self._side_by_side(
            [part.condensed_linear(log_parameters, slopes=slopes) for part in self._parts]
        )

    def condensed_corrections(self, log_parameters: Array, *, slopes: bool = True) -> Array:
        """Of `condensed_responses`, what the nonlinear model has over the linear one."""
        return self._side_by_side(
            [part.condensed_corrections(log_parameters, slopes=slopes) for part in self._parts]
        )

    def without_inertia(self) -> "JointResiduals":
        """Return the same traces for arms that do not ring."""
        parts = [part.without_inertia() for part in self._parts]
        return JointResiduals(parts, (1 / self.weights).tolist())

    def shares_responses(self, other: Residuals) -> bool:
        """Whether only the traces tell this from others; weights are in the responses."""
        return self is other

    def _stacked(self, found: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
        rows, slopes = zip(*found, strict=True)
        return self._side_by_side(rows), self._side_by_side(slopes)

    def _side_by_side(self, rows: Sequence[Array]) -> Array:
        """Rows of all traces along the last axis, each trace's in units of its noise."""
        weighted = (weight * own for weight, own in zip(self.weights, rows, strict=True))
        return np.concatenate(list(weighted), axis=-1)


def joint_problem(problems: Sequence[Problem], noise_rad: Sequence[float]) -> Problem:
    """Pose the identification of one cell from several traces.

    Parameters
    ----------
    problems
        Of each trace, for the same model and range.
    noise_rad
        Standard deviation of the noise of each.
    """
    residuals = JointResiduals([problem.residuals for problem in problems], noise_rad)
    return replace(problems[0], misfit=residuals.condensed_misfit, residuals=residuals)
