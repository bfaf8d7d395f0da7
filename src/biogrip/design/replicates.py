"""Replicates: several traces of one cell as one fit problem with shared parameters.

Each trace has its own noise sigma_i, and chi^2 is summed over residuals in units of that noise.
Rows of all traces are concatenated, each trace's multiplied by sigma/sigma_i with the joint noise
sigma. So all code for fits, profiles and verdicts of one trace works for several, and for a
single trace nothing changes.
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

    Sampling times and nuisance terms of the instrument are separate for each trace.

    Parameters
    ----------
    parts
        Residuals of each trace, for the same sample model.
    noise_rad
        Standard deviation of each trace's noise.
    """

    def __init__(self, parts: Sequence[Residuals], noise_rad: Sequence[float]) -> None:
        self._parts = tuple(parts)
        self.samples = sum(part.samples for part in parts)
        self.duration_s = max(part.duration_s for part in parts)
        self.model, self.nonlinear = parts[0].model, parts[0].nonlinear
        self.instrument = parts[0].instrument
        whole = compute_common_noise([part.samples for part in parts], noise_rad)
        self.weights = np.array([whole / own for own in noise_rad])
        peaks = (w * part.peak_rad for w, part in zip(self.weights, parts, strict=True))
        self.peak_rad = float(max(peaks))
        self.rounding_rad = max(
            float(w * part.rounding_rad) for w, part in zip(self.weights, parts, strict=True)
        )
        scales = (w * part.noise_scale_rad for w, part in zip(self.weights, parts, strict=True))
        squares = (part.samples * s**2 for part, s in zip(parts, scales, strict=True))
        self.noise_scale_rad = sqrt(fsum(squares) / self.samples)

    @property
    def free(self) -> int:
        """Degrees of freedom after the nuisance terms are fitted."""
        return sum(part.free for part in self._parts)

    @property
    def sampling_s(self) -> None:
        """None, for each trace has its own times."""
        return None

    def grip(self, log_parameters: Array) -> Grip | None:
        """Force of the jaws on the sample; the protocol is the same for all traces."""
        return self._parts[0].grip(log_parameters)

    def of_model(self, model: SampleModel) -> "JointResiduals":
        """Return the same traces for another model."""
        parts = [part.of_model(model) for part in self._parts]
        return JointResiduals(parts, (1 / self.weights).tolist())

    def __call__(self, log_parameters: Array) -> tuple[Array, Array]:
        """Return residuals (n_samples,) and derivatives (n_parameters, n_samples) of all traces."""
        return self._stacked([part(log_parameters) for part in self._parts])

    def gradients(self, log_parameters: Array, others: Sequence[Residuals]) -> tuple[Array, Array]:
        """Return gradients of half the sums of squares, (n, n_parameters), and RMS in rad."""
        count = len(others)
        found = [part.gradients(log_parameters, [part] * count) for part in self._parts]
        counted = zip(self.weights, self._parts, found, strict=True)
        squares = [w**2 * part.samples * rms**2 for w, part, (_, rms) in counted]
        gradients = [w**2 * own for w, (own, _) in zip(self.weights, found, strict=True)]
        return np.sum(gradients, axis=0), np.sqrt(np.sum(squares, axis=0) / self.samples)

    def left(self, log_parameters: Array) -> Array:
        """Return residuals only, trace after trace, (n_samples,) in rad."""
        return self._side_by_side([part.left(log_parameters) for part in self._parts])

    def rotation(self, log_parameters: Array) -> Array:
        """Return the simulated rotation, trace after trace, (n_samples,) in rad."""
        return self._side_by_side([part.rotation(log_parameters) for part in self._parts])

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the noise's correlation, of the trace that has least."""
        return min(part.freedom for part in self._parts)

    @property
    def coloured(self) -> bool:
        """True if the noise of all traces is coloured, and was whitened."""
        return all(part.coloured for part in self._parts)

    @property
    def inertia(self) -> bool:
        """True if the arms ring in any of the traces."""
        return any(part.inertia for part in self._parts)

    @cached_property
    def condensed_trace(self) -> Array:
        """Condensed rows of all traces, (n_rows,) in rad."""
        return self._side_by_side([part.condensed_trace for part in self._parts])

    def condensed_linear(self, log_parameters: Array, *, slopes: bool = True) -> Array:
        """Return the linear model's part of `condensed_responses`."""
        return self._side_by_side(
            [part.condensed_linear(log_parameters, slopes=slopes) for part in self._parts]
        )

    def condensed_corrections(self, log_parameters: Array, *, slopes: bool = True) -> Array:
        """Return the nonlinear correction in `condensed_responses`."""
        return self._side_by_side(
            [part.condensed_corrections(log_parameters, slopes=slopes) for part in self._parts]
        )

    def without_inertia(self) -> "JointResiduals":
        """Return the same traces for arms without inertia."""
        parts = [part.without_inertia() for part in self._parts]
        return JointResiduals(parts, (1 / self.weights).tolist())

    def shares_responses(self, other: Residuals) -> bool:
        """Return True if problems differ only in traces; weights are part of the responses."""
        return self is other

    def _stacked(self, found: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
        rows, slopes = zip(*found, strict=True)
        return self._side_by_side(rows), self._side_by_side(slopes)

    def _side_by_side(self, rows: Sequence[Array]) -> Array:
        """Concatenate rows of all traces along the last axis, in units of each trace's noise."""
        weighted = (weight * own for weight, own in zip(self.weights, rows, strict=True))
        return np.concatenate(list(weighted), axis=-1)


def compute_common_noise(samples: Sequence[int], noise_rad: Sequence[float]) -> float:
    """Compute the standard deviation in rad that the weighted residuals of all traces share.

    `samples` has the number of readings of each trace, and `noise_rad` its noise.
    """
    counted = zip(samples, noise_rad, strict=True)
    return sqrt(sum(samples) / fsum(count / own**2 for count, own in counted))


def joint_problem(problems: Sequence[Problem], noise_rad: Sequence[float]) -> Problem:
    """Return the fit problem of one cell with several traces.

    Parameters
    ----------
    problems
        Problems of each trace, with the same model and search range.
    noise_rad
        Standard deviation of each trace's noise.
    """
    residuals = JointResiduals([problem.residuals for problem in problems], noise_rad)
    return replace(problems[0], misfit=residuals.condensed_misfit, residuals=residuals)
