"""What a good experiment is: one number of the covariances of plausible samples' log-parameters.

With M the Fisher information of the log-parameters and C the part of its inverse that belongs to
the parameters asked for, criteria are of C: D its determinant, A its mean diagonal, E its largest
eigenvalue, or its largest diagonal, the largest relative bound. All but D are the largest of
tr(Z C) over some matrices Z of trace one, which is what makes a bound for the optimum out of a
gradient, see `biogrip.design.sampling`.

References
----------
.. [1] F. Pukelsheim, Optimal Design of Experiments, SIAM, 2006.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array

CRITERIA = ("D", "A", "E", "largest")
OVER = ("worst", "mean")

# Of the information that a parameter has by itself, what is rounding.
_ROUNDING = 1e-13


@dataclass(frozen=True)
class Criterion:
    """A criterion over plausible samples.

    Parameters
    ----------
    name
        One of `CRITERIA`.
    over
        Whether the worst of the samples counts, or their mean.
    asked : (n_asked,)
        Indices of the parameters that are asked for.
    """

    name: str
    over: str
    asked: tuple[int, ...]

    def values(self, covariances: Array) -> Array:
        """Criterion of every sample, (n,), from covariances of shape (n, n_asked, n_asked)."""
        if self.name == "D":
            value: Array = np.linalg.slogdet(covariances)[1]
            return value
        diagonals = np.diagonal(covariances, axis1=1, axis2=2)
        if self.name == "A":
            mean: Array = diagonals.mean(axis=1)
            return mean
        if self.name == "largest":
            largest: Array = diagonals.max(axis=1)
            return largest
        return _eigenvalues(covariances)[:, -1]

    def smooth(self, covariances: Array, sharpness: float) -> float:
        """Criterion in logarithms, with power means for largest values: `weights` go with it."""
        if self.name in ("D", "A"):
            values = self.values(covariances)
            logs = values / len(self.asked) if self.name == "D" else np.log(values)
        elif self.name == "largest":
            logs = _power_mean(np.diagonal(covariances, axis1=1, axis2=2), sharpness)
        else:
            logs = _power_mean(_eigenvalues(covariances), sharpness)
        if self.over == "mean":
            return self._mean_log(logs)
        return float(_power_mean(np.exp(logs)[None], sharpness)[0])

    def typical_bound(self, covariances: Array) -> float:
        """Criterion as a relative standard deviation, by which designs are compared."""
        values = self.values(covariances)
        count = len(self.asked) if self.name == "D" else 1
        logs = values / count if self.name == "D" else np.log(values)
        log = logs.max() if self.over == "worst" else self._mean_log(logs)
        return float(np.exp(0.5 * log))

    def _mean_log(self, logs: Array) -> float:
        return float(logs.mean() if self.name == "D" else np.log(np.exp(logs).mean()))

    def weights(self, covariances: Array, sharpness: float) -> tuple[Array, Array]:
        """Weigh samples, and what is in their covariances, as the criterion does there.

        Parameters
        ----------
        covariances : (n, n_asked, n_asked)
        sharpness
            How sharply a largest value is singled out. What that leaves of the optimum is the
            logarithm of their number over it.

        Returns
        -------
        of_samples : (n,)
            Their sum is one.
        of_covariances : (n, n_asked, n_asked)
            Z: the derivative of the criterion, D, or of what it is the largest of.
        """
        if self.name == "D":
            z = np.linalg.inv(covariances).astype(float)
        elif self.name == "A":
            z = np.broadcast_to(np.eye(len(self.asked)) / len(self.asked), covariances.shape)
        elif self.name == "largest":
            shares = _singled_out(np.diagonal(covariances, axis1=1, axis2=2), sharpness)
            z = shares[:, :, None] * np.eye(len(self.asked))
        else:
            vectors = np.linalg.eigh(covariances)[1]
            shares = _singled_out(_eigenvalues(covariances), sharpness)
            z = (vectors * shares[:, None]) @ vectors.swapaxes(1, 2)
        values = self.values(covariances)
        if self.over == "mean":
            return np.full(len(values), 1 / len(values)), z
        # Logarithms of determinants are compared as they are.
        scale = values if self.name != "D" else np.exp(values / len(self.asked))
        return _singled_out(scale[None], sharpness)[0], z


def _eigenvalues(covariances: Array) -> Array:
    return np.linalg.eigvalsh(covariances).astype(float)


def _power_mean(values: Array, power: float) -> Array:
    """Logarithm of what the power mean of positive values is, along the last axis."""
    largest = values.max(axis=-1)
    sums = np.sum((values / largest[..., None]) ** power, axis=-1)
    logs: Array = np.log(largest) + np.log(sums) / power
    return logs


def _singled_out(values: Array, sharpness: float) -> Array:
    """Shares of the largest of positive values, along the last axis; of others nearly none.

    The gradient of the power mean of that power.
    """
    shares: Array = (values / values.max(axis=-1, keepdims=True)) ** sharpness
    return shares / shares.sum(axis=-1, keepdims=True)


def inverted(information: Array) -> Array:
    """Invert information matrices, (n, n_parameters, n_parameters), of log-parameters.

    What rounding leaves of a singular one has an inverse, too, as large as rounding allows.
    """
    correlations, length = _correlations(information)
    size = length[:, :, None] * length[:, None, :]
    return np.linalg.inv(correlations + _ROUNDING * np.eye(information.shape[1])) / size


def whitened(information: Array, told: Array) -> Array:
    """Return sensitivities in units in which the information is one in all directions.

    In directions of which only rounding has information, they are next to nothing.

    Parameters
    ----------
    information : (n, n_parameters, n_parameters)
    told : (n, n_parameters, n_cells)

    Returns
    -------
    (n, n_parameters, n_cells)
    """
    correlations, length = _correlations(information)
    singular = np.linalg.eigvalsh(correlations)[:, 0] < _ROUNDING
    lifted = np.where(singular, _ROUNDING, 0.0)[:, None, None] * np.eye(information.shape[1])
    root = np.linalg.cholesky(correlations + lifted)
    white: Array = np.linalg.solve(root, told / length[:, :, None])
    return white


def _correlations(information: Array) -> tuple[Array, Array]:
    """Information with a unit diagonal, and the roots of its own, (n, n_parameters)."""
    length = np.sqrt(np.diagonal(information, axis1=1, axis2=2))
    length = np.where(length > 0, length, 1.0)
    return information / (length[:, :, None] * length[:, None, :]), length
