"""How precisely a trace can determine parameters: Fisher information and Cramer-Rao bounds."""

import numpy as np

from biogrip.arrays import Array
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.local_fit import PRIOR_WIDTH


def covariance(sensitivity: Array, noise_rad: float | Array) -> Array:
    """Covariance of the log-parameters that least squares finds, to first order.

    With the same Gaussian noise everywhere, it is the inverse of the Fisher
    information J J^T / sigma^2: the Cramer-Rao bound, which no unbiased
    estimator undercuts. With noise that changes along the trace it is what
    unweighted least squares comes to, A J diag(sigma^2) J^T A with
    A = (J J^T)^-1, and no longer a bound. The information of the prior that all
    local fits have is added; where a parameter has no other, it shows as a
    standard deviation of that many e-folds.

    Parameters
    ----------
    sensitivity : (n_parameters, n_samples)
        J, d rotation / d log parameter in rad.
    noise_rad : float or (n_samples,)
        Standard deviation of the noise.

    Returns
    -------
    (n_parameters, n_parameters)
    """
    sigma = np.broadcast_to(noise_rad, sensitivity.shape[1])
    scale = float(np.sqrt(np.mean(sigma**2)))
    prior = np.eye(len(sensitivity)) / PRIOR_WIDTH**2
    relative = sensitivity / scale
    inverse = np.linalg.inv(relative @ relative.T + prior)
    scattered = relative * (sigma / scale)
    return inverse @ (scattered @ scattered.T + prior) @ inverse


def bound(
    sensitivity: Array, noise_rad: float | Array, log_parameters: Array, q: Quantity
) -> float:
    """Standard deviation of the logarithm of a quantity, to first order; see `covariance`."""
    slope = q.gradient(log_parameters)
    return float(np.sqrt(slope @ covariance(sensitivity, noise_rad) @ slope))
