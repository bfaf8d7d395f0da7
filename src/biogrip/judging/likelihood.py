"""Noise and thresholds of the likelihood of a trace, and its Fisher information.

The increase of chi^2 is that of the sum of squares over its minimum, in units of the noise's
variance. A quantity has a confidence limit where the increase equals a threshold: a quantile of
chi-squared with one degree of freedom if the noise is known, of F if it is estimated [1]_. It has
none unless the increase at the end of the search range reaches the quantile at `CERTAIN`.

Fisher information gives the Cramér-Rao bounds of the parameters of a trace [2]_, [3]_.

References
----------
.. [1] D. M. Bates and D. G. Watts, Nonlinear Regression Analysis, Wiley, 1988: profiles.
.. [2] H. Cramér, Mathematical Methods of Statistics, Princeton University Press, 1946.
.. [3] C. R. Rao, Bulletin of the Calcutta Mathematical Society 37 (1945).
.. [4] H. White, Econometrica 48 (1980), 817-838: noise that changes along the trace.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from statistics import NormalDist

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import TraceProblem
from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.physics.noise import Noise, standard_deviation
from biogrip.physics.response import linear_responses

# Error of sums of squares, as a share of those of the largest reading or response.
_ERROR_OF_SUMS = 1e-12


@dataclass(frozen=True)
class Likelihood:
    """Optimum, noise and thresholds that define the profile likelihoods of one trace."""

    problem: TraceProblem
    """The trace and the model."""
    best: Array
    """Log-parameters of the global optimum, (n_parameters,)."""
    misfit: float
    """Misfit there."""
    noise_sd: float
    """Standard deviation of the noise, known or estimated from the residual."""
    threshold: float
    """Increase of chi^2 at the limits of an interval: a single limit holds with more confidence."""
    certainty: float
    """Increase that a profile must reach at an end of the range to have a limit on that side."""
    freedom: float = inf
    """Degrees of freedom of the noise's estimated variance; infinite if the noise is known."""
    confidence: float = 0.95
    """Of the limits."""
    independent: float = inf
    """How many residuals count as independent, if what the fit leaves is misfit."""

    def as_misfit(self, independent: float, freedom: float) -> "Likelihood":
        """Return the likelihood if what the fit leaves is misfit, not noise.

        All residuals count as so many independent ones, and their variance has this freedom: see
        `biogrip.judging.whiteness.as_correlated`.
        """
        noise_sd = self.misfit * math.sqrt(self.problem.residuals.samples / independent)
        threshold, _ = find_thresholds(self.confidence, freedom)
        # What few degrees of freedom say of one misfit in a thousand is not known.
        known, certain = find_thresholds(self.confidence, inf)
        return replace(
            self,
            noise_sd=noise_sd,
            threshold=threshold,
            certainty=threshold * certain / known,
            freedom=freedom,
            independent=independent,
        )

    def increase(self, misfit: float) -> float:
        """Return the increase of chi^2 over the optimum."""
        excess = misfit**2 - self.misfit**2
        return float(self.problem.residuals.samples * excess / self.noise_sd**2)

    def deviation(self, quantity: Quantity) -> float:
        """Return the first-order standard deviation of a quantity's logarithm.

        Every parameter has a prior of one e-fold, beyond which the linear approximation fails.
        Unlike in a `least_sd`, no parameter is left out for want of information.
        """
        rows = self.problem.residuals.condensed_responses(self.best[None])[0]
        relative = rows[1:] / self.noise_sd
        slope = quantity.gradient(self.best)
        information = relative @ relative.T + np.eye(len(slope))
        try:
            solved = np.linalg.solve(information, slope)
        except np.linalg.LinAlgError:
            # Without noise the trace may outweigh the prior by more than numbers have digits.
            solved = np.linalg.lstsq(information, slope)[0]
        return float(np.sqrt(np.maximum(slope @ solved, 0.0)))


def make_likelihood(
    problem: TraceProblem,
    best: Array,
    misfit: float,
    *,
    confidence: float,
    noise_sd: float | None = None,
) -> Likelihood:
    """Compute noise, by default from the misfit, and thresholds for the profiles of a trace."""
    freedom = inf
    if noise_sd is None:
        left = problem.residuals.free - len(best)
        noise_sd = misfit * float(np.sqrt(problem.residuals.samples / left))
        freedom = float(min(left, problem.residuals.freedom))
    threshold, certainty = find_thresholds(confidence, freedom)
    return Likelihood(problem, best, misfit, noise_sd, threshold, certainty, freedom, confidence)


def check_rows(likelihood: Likelihood) -> None:
    """Raise an `ArithmeticError` if rows, as profiles see them, have not the readings' misfit."""
    residuals, best = likelihood.problem.residuals, likelihood.best
    of_rows = float(residuals.misfit(np.exp(best)[None])[0])
    of_readings = float(np.sqrt(np.mean(residuals.left(best) ** 2)))
    # A spring beside an offset may be as stiff as its range allows.
    both = residuals.trace.readings, residuals.response(best)
    largest = max(float(np.max(np.abs(readings))) for readings in both)
    rounding = _ERROR_OF_SUMS * residuals.samples * (largest / likelihood.noise_sd) ** 2
    apart = likelihood.increase(of_rows) - likelihood.increase(of_readings)
    if abs(apart) > levels.MISSED + rounding:
        text = f"rows with a misfit of {of_rows:.6g} stand for readings with {of_readings:.6g}"
        raise ArithmeticError(text)


def find_thresholds(confidence: float, freedom: float) -> tuple[float, float]:
    """Return increases of chi^2 at limits and at `CERTAIN`: chi-squared(1), or F(1, freedom)."""
    from scipy.special import fdtri

    both = confidence, levels.CERTAIN
    if freedom == inf:
        at_limits, certain = (NormalDist().inv_cdf((1 + level) / 2) ** 2 for level in both)
    else:
        at_limits, certain = (float(fdtri(1, freedom, level)) for level in both)
    return at_limits, certain


def compute_fall(samples: int, before: float, after: float, noise_sd: float | None = None) -> float:
    """Compute the decrease of chi^2, twice the increase of log-likelihood, between RMS residuals.

    If the standard deviation of the noise is not known, each fit's misfit estimates it; no noise is
    less than what the better fit leaves.
    """
    if noise_sd is not None:
        return samples * (before**2 - after**2) / max(noise_sd, after) ** 2
    return 2 * samples * float(np.log(before / after))


# Members with a smaller share in a sum are neglected, whatever their uncertainty; so is a smaller
# part of a gradient, scaled by information, along what the response does not show.
_NEGLIGIBLE = 1e-2
# Share of the largest information that is rounding.
_NO_INFORMATION = 1e-12


def covariance(
    sensitivity: Array, noise_sd: float | Array, gradients: Array | None = None
) -> Array:
    """Compute the first-order covariance of quantities estimated by least squares.

    With the same Gaussian noise everywhere, it is the inverse of the Fisher information J J^T /
    sigma^2: the Cramér-Rao bound, which no unbiased estimator undercuts. With noise that changes
    along the trace, it is that of unweighted least squares [4]_, A J diag(sigma^2) J^T A with A =
    (J J^T)^-1, and no longer a bound. A parameter whose standard deviation exceeds one e-fold even
    with all others known carries no information, and is fixed for the others' covariance: near zero
    on a logarithmic scale, the linear approximation fails.

    J is d response / d log parameter, (n_parameters, n_samples), sigma a number or (n_samples,).
    Gradients are d quantity / d log parameter, (n_quantities, n_parameters), by default of the
    log-parameters. The covariance, (n_quantities, n_quantities), is infinite on the diagonal for
    what the response does not show, and zero without noise.
    """
    slopes = np.eye(len(sensitivity)) if gradients is None else gradients
    sigma = np.broadcast_to(noise_sd, sensitivity.shape[1])
    scale = float(np.sqrt(np.mean(sigma**2)))
    if not scale:
        return np.zeros((len(slopes), len(slopes)))
    relative = sensitivity / scale
    informed = np.sum(relative**2, axis=1) > 1
    unknown = np.any(np.abs(slopes[:, ~informed]) > _NEGLIGIBLE, axis=1)
    unknown |= ~np.any(np.abs(slopes) > _NEGLIGIBLE, axis=1)
    j = relative[informed]
    # Rows of length one, for parameters may differ by decades in their information.
    length = np.sqrt(np.sum(j**2, axis=1))
    j = j / length[:, None]
    within = slopes[:, informed] / length
    sizes, directions = np.linalg.eigh(j @ j.T)
    none = sizes <= _NO_INFORMATION * sizes.max(initial=0.0)
    parts = within @ directions
    longest = np.sqrt(np.sum(parts**2, axis=1, keepdims=True))
    unknown |= np.any(np.abs(parts[:, none]) > _NEGLIGIBLE * longest, axis=1)
    inverse = parts[:, ~none] / sizes[~none] @ directions[:, ~none].T
    scattered = inverse @ (j * (sigma / scale))
    matrix: Array = scattered @ scattered.T
    matrix[unknown] = matrix[:, unknown] = 0.0
    matrix[unknown, unknown] = inf
    return matrix


def least_sd(
    sensitivity: Array, noise_sd: float | Array, log_parameters: Array, q: Quantity
) -> float:
    """Return the first-order standard deviation of a quantity's logarithm, by `covariance`."""
    gradient = q.gradient(log_parameters)
    return float(np.sqrt(covariance(sensitivity, noise_sd, gradient[None])[0, 0]))


def bounds_percent(
    problem: Experiment, noise: Noise, parameters: Mapping[str, float], time_s: Array
) -> list[tuple[Quantity, float]]:
    """Compute the Cramér-Rao bounds of all identified quantities of a case with its noise.

    They are 100 times the standard deviation of a quantity's logarithm, NaN without noise, at
    parameters in SI units and sampling times, (n_samples,); a parameter of zero is undetermined.
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
    return [(q, 100 * least_sd(np.array(sensitivity), sigma, logarithms, q)) for q in quantities]


def headlines(bounds: Sequence[tuple[str, float]]) -> list[str]:
    """Return the best and the worst determined quantity of several points, by label.

    Quantities count if their bound in percent, not NaN, is below `DETERMINED_PERCENT` at half of
    the points or more. Parts of a sum, which may trade against each other, do not count beside it.
    """
    percents: dict[str, list[float]] = {}
    for label, percent in bounds:
        if not math.isnan(percent):
            percents.setdefault(label, []).append(percent)
    medians = sorted(
        (float(np.median(bounds_of_one)), label) for label, bounds_of_one in percents.items()
    )
    parts = {part for label in percents if " + " in label for part in label.split(" + ")}
    determined = [
        label
        for percent, label in medians
        if percent < levels.DETERMINED_PERCENT and label not in parts
    ]
    return determined[:1] + determined[1:][-1:]
