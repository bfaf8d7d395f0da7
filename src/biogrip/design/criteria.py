"""Optimality criteria: functions of the covariances of plausible samples' log-parameters.

With M the Fisher information of the log-parameters and C the part of its inverse that belongs to
the parameters asked for, the criteria are D, the determinant of C, A, its mean diagonal element,
E, its largest eigenvalue, and its largest diagonal element, which is the largest squared relative
bound. All but D are maxima of tr(Z C) over matrices Z of trace one; so gradients give bounds on
the optimum, see `biogrip.design.sampling`.

References
----------
.. [1] F. Pukelsheim, Optimal Design of Experiments, SIAM, 2006.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array

CRITERIA = ("D", "A", "E", "largest")
OVER = ("worst", "mean")

# Rounding errors of information, relative to that of each parameter by itself.
_ROUNDING = 1e-13


@dataclass(frozen=True)
class Criterion:
    """A criterion over plausible samples."""

    name: str
    """One of `CRITERIA`."""
    over: str
    """``"worst"`` for the maximum over the samples, ``"mean"`` for their mean."""
    targets: tuple[int, ...]
    """Indices of the parameters that are asked for, (n_asked,)."""

    def values(self, covariances: Array) -> Array:
        """Return the criterion of every sample, (n,), from covariances (n, n_asked, n_asked)."""
        if self.name == "D":
            return np.linalg.slogdet(covariances)[1]
        diagonals = _variances(covariances)
        if self.name == "A":
            return diagonals.mean(axis=1)
        if self.name == "largest":
            return diagonals.max(axis=1)
        return _eigenvalues(covariances)[:, -1]

    def smooth(self, covariances: Array, sharpness: float) -> float:
        """Return the log criterion with p-norms in place of maxima, as in `weights`."""
        if self.name in ("D", "A"):
            values = self.values(covariances)
            logs = values / len(self.targets) if self.name == "D" else np.log(values)
        elif self.name == "largest":
            logs = _power_mean(_variances(covariances), sharpness)
        else:
            logs = _power_mean(_eigenvalues(covariances), sharpness)
        if self.over == "mean":
            return self._mean_log(logs)
        return float(_power_mean(np.exp(logs)[None], sharpness)[0])

    def typical_bound(self, covariances: Array) -> float:
        """Return the criterion as a relative standard deviation, for comparison of designs."""
        return float(self.typical_bounds(covariances[None])[0])

    def typical_bounds(self, covariances: Array) -> Array:
        """Return the same of several designs, (n_designs,), whose covariances are stacked."""
        flat = covariances.reshape(-1, *covariances.shape[2:])
        values = self.values(flat).reshape(covariances.shape[:2])
        count = len(self.targets) if self.name == "D" else 1
        logs = values / count if self.name == "D" else np.log(values)
        return np.exp(0.5 * (logs.max(axis=1) if self.over == "worst" else self._mean_logs(logs)))

    def _mean_log(self, logs: Array) -> float:
        return float(self._mean_logs(logs[None])[0])

    def _mean_logs(self, logs: Array) -> Array:
        return logs.mean(axis=1) if self.name == "D" else np.log(np.exp(logs).mean(axis=1))

    def weights(self, covariances: Array, sharpness: float) -> tuple[Array, Array]:
        """Return the derivatives of the criterion by samples and by elements of covariances.

        Parameters
        ----------
        covariances : (n, n_asked, n_asked)
        sharpness
            Power p of the p-norm that replaces a maximum; the error of its logarithm is at
            most the logarithm of the number of values over p.

        Returns
        -------
        of_samples : (n,)
            Weights of the samples, whose sum is one.
        of_covariances : (n, n_asked, n_asked)
            Z: the derivative of a sample's criterion, with p-norms in place of maxima.
        """
        if self.name == "D":
            z = np.linalg.inv(covariances).astype(float)
        elif self.name == "A":
            z = np.broadcast_to(np.eye(len(self.targets)) / len(self.targets), covariances.shape)
        elif self.name == "largest":
            shares = _singled_out(_variances(covariances), sharpness)
            z = shares[:, :, None] * np.eye(len(self.targets))
        else:
            vectors = np.linalg.eigh(covariances)[1]
            shares = _singled_out(_eigenvalues(covariances), sharpness)
            z = (vectors * shares[:, None]) @ vectors.swapaxes(1, 2)
        values = self.values(covariances)
        if self.over == "mean":
            return np.full(len(values), 1 / len(values)), z
        # The values of D are logarithms already.
        scale = values if self.name != "D" else np.exp(values / len(self.targets))
        return _singled_out(scale[None], sharpness)[0], z


def _variances(covariances: Array) -> Array:
    """Return the diagonals; of singular information rounding may have made them negative."""
    return np.abs(np.diagonal(covariances, axis1=1, axis2=2))


def _eigenvalues(covariances: Array) -> Array:
    return np.linalg.eigvalsh(covariances).astype(float)


def _power_mean(values: Array, power: float) -> Array:
    """Return the logarithm of the p-norm of positive values, along the last axis."""
    largest = values.max(axis=-1)
    sums = np.sum((values / largest[..., None]) ** power, axis=-1)
    return np.log(largest) + np.log(sums) / power


def _singled_out(values: Array, sharpness: float) -> Array:
    """Return weights of positive values along the last axis, nearly one for the largest.

    They are normalized powers of the values, as in the gradient of the p-norm.
    """
    shares: Array = (values / values.max(axis=-1, keepdims=True)) ** sharpness
    return shares / shares.sum(axis=-1, keepdims=True)


def inverted(information: Array) -> Array:
    """Invert information matrices, (n, n_parameters, n_parameters), of log-parameters.

    A matrix that is singular up to rounding errors gets an inverse of their reciprocal size.
    """
    correlations, length = _correlations(information)
    size = length[:, :, None] * length[:, None, :]
    identity = np.eye(information.shape[1])
    try:
        inverse = np.linalg.inv(correlations + _ROUNDING * identity)
        diagonal = np.diagonal(inverse, axis1=1, axis2=2)
        if diagonal.min() > 0 and diagonal.max() < 2 / _ROUNDING:
            return inverse / size
    except np.linalg.LinAlgError:
        pass
    # Rounding has made an eigenvalue about as negative as it was lifted, or more.
    lift = _ROUNDING - np.minimum(_least_eigenvalues(correlations), 0)
    return np.linalg.inv(correlations + lift[:, None, None] * identity) / size


def whitened(information: Array, sensitivity: Array) -> Array:
    """Transform sensitivities, (n, n_parameters, n_cells), so that information is the identity.

    In directions whose information is only rounding errors, they become tiny.
    """
    correlations, length = _correlations(information)
    least = _least_eigenvalues(correlations)
    lift = np.where(least < _ROUNDING, _ROUNDING - np.minimum(least, 0), 0)
    identity = np.eye(information.shape[1])
    root = np.linalg.cholesky(correlations + lift[:, None, None] * identity)
    return np.linalg.solve(root, sensitivity / length[:, :, None])


def _least_eigenvalues(correlations: Array) -> Array:
    return _eigenvalues(correlations)[:, 0]


def _correlations(information: Array) -> tuple[Array, Array]:
    """Return information scaled to unit diagonal, and roots of its diagonal, (n, n_parameters)."""
    length = np.sqrt(np.diagonal(information, axis1=1, axis2=2))
    length = np.where(length > 0, length, 1.0)
    return information / (length[:, :, None] * length[:, None, :]), length
