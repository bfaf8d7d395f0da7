"""Fisher information and Cramér-Rao bounds of the parameters of a trace [1]_, [2]_.

References
----------
.. [1] H. Cramér, Mathematical Methods of Statistics, Princeton University Press, 1946.
.. [2] C. R. Rao, Information and the accuracy attainable in the estimation of statistical
   parameters, Bulletin of the Calcutta Mathematical Society 37 (1945).
.. [3] H. White, A heteroskedasticity-consistent covariance matrix estimator and a direct test
   for heteroskedasticity, Econometrica 48 (1980), 817-838: noise that changes along the trace.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.case_problem import CaseProblem
from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.physics.modes import linear_responses
from biogrip.physics.noise import Noise, standard_deviation

# Members with a smaller share in a sum are neglected, whatever their uncertainty.
_NEGLIGIBLE = 1e-2


def covariance(sensitivity: Array, noise_rad: float | Array) -> Array:
    """Compute the first-order covariance of log-parameters estimated by least squares.

    With the same Gaussian noise everywhere, it is the inverse of the Fisher
    information J J^T / sigma^2: the Cramér-Rao bound, which no unbiased
    estimator undercuts. With noise that changes along the trace, it is the
    covariance of unweighted least squares [3]_, A J diag(sigma^2) J^T A with
    A = (J J^T)^-1, and no longer a bound.

    A parameter whose standard deviation exceeds one e-fold even with all others known
    carries no information. It is fixed for the others' covariance: near zero on a
    logarithmic scale, the linear approximation of its effect fails.

    Parameters
    ----------
    sensitivity : (n_parameters, n_samples)
        J, d rotation / d log parameter in rad.
    noise_rad : float or (n_samples,)
        Standard deviation of the noise.

    Returns
    -------
    (n_parameters, n_parameters)
        Infinite on the diagonal for parameters without information; zeros without noise.
    """
    sigma = np.broadcast_to(noise_rad, sensitivity.shape[1])
    scale = float(np.sqrt(np.mean(sigma**2)))
    if not scale:
        return np.zeros((len(sensitivity), len(sensitivity)))
    relative = sensitivity / scale
    informed = np.flatnonzero(np.sum(relative**2, axis=1) > 1)
    found = np.diag(np.full(len(sensitivity), np.inf))
    if len(informed) == 0:
        return found
    j = relative[informed]
    # Rows of length one, for parameters may differ by decades in their information.
    length = np.sqrt(np.sum(j**2, axis=1))
    j = j / length[:, None]
    inverse = np.linalg.pinv(j @ j.T, hermitian=True, rcond=1e-12)
    scattered = j * (sigma / scale)
    within = inverse @ (scattered @ scattered.T) @ inverse / np.outer(length, length)
    found[np.ix_(informed, informed)] = within
    return found


def bound(
    sensitivity: Array, noise_rad: float | Array, log_parameters: Array, q: Quantity
) -> float:
    """Return the first-order standard deviation of a quantity's logarithm, by `covariance`."""
    slope = q.gradient(log_parameters)
    members = np.abs(slope) > _NEGLIGIBLE
    if not np.any(members):
        return float("inf")
    found = covariance(sensitivity, noise_rad)[np.ix_(members, members)]
    if np.any(np.isinf(found)):
        return float("inf")
    return float(np.sqrt(slope[members] @ found @ slope[members]))


DETERMINED_PERCENT = 100.0
"""Bound in percent from which on a quantity does not count as determined."""


def bounds_percent(
    problem: CaseProblem, noise: Noise, parameters: Mapping[str, float], time_s: Array
) -> list[tuple[Quantity, float]]:
    """Compute the Cramér-Rao bounds of all identified quantities of a case with its noise.

    Parameters
    ----------
    problem, noise
        Assumptions of the identification, and noise that is added to the rotation.
    parameters
        Parameters at which the bounds are computed, SI units. A parameter of zero comes
        out as undetermined, for its logarithm has no effect on the trace.
    time_s : (n_samples,)
        Sampling times.

    Returns
    -------
    list of (Quantity, float)
        Each with 100 times the standard deviation of its logarithm; NaN without noise.
    """
    model = problem.searched
    quantities = parameters_and_sum(model)
    if noise.absent:
        return [(q, math.nan) for q in quantities]
    values = np.array([parameters[name] for name in model.names])
    rotation, *sensitivity = linear_responses(
        problem.gripper, model, problem.torque, time_s, values[None]
    )[0]
    sigma = standard_deviation(rotation, noise)
    with np.errstate(divide="ignore"):
        logarithms = np.log(values)
    return [(q, 100 * bound(np.array(sensitivity), sigma, logarithms, q)) for q in quantities]


def headlines(bounds: Sequence[tuple[str, float]]) -> list[str]:
    """Return the best and the worst determined quantity of several points, by label.

    Quantities count if their bound in percent, not NaN, is below `DETERMINED_PERCENT` at half of
    the points or more. Parts of a sum do not count beside it: a first-order bound does not show
    that they trade against each other far from their values.
    """
    percents: dict[str, list[float]] = {}
    for label, percent in bounds:
        if not math.isnan(percent):
            percents.setdefault(label, []).append(percent)
    medians = sorted((float(np.median(found)), label) for label, found in percents.items())
    parts = {part for label in percents if " + " in label for part in label.split(" + ")}
    determined = [
        label for percent, label in medians if percent < DETERMINED_PERCENT and label not in parts
    ]
    return determined[:1] + determined[1:][-1:]
