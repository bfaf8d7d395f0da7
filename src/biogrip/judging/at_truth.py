"""Cramer-Rao bounds of a simulated case, computed at its true parameters."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.noise import Noise, standard_deviation
from biogrip.fit.case_problem import CaseProblem
from biogrip.judging.fisher import bound
from biogrip.judging.quantities import Quantity, parameters_and_sum
from biogrip.response.sensitivity import rotation_and_sensitivity

DETERMINED_PERCENT = 100.0
"""Bound in percent from which on a quantity does not count as determined."""


def bounds_percent(
    problem: CaseProblem, noise: Noise, parameters: Mapping[str, float], time_s: Array
) -> list[tuple[Quantity, float]]:
    """Compute the Cramer-Rao bounds of all identified quantities of a case with its noise.

    Parameters
    ----------
    problem
        Assumptions of the identification.
    noise
        Noise that is added to the rotation.
    parameters
        Parameters at which the bounds are computed, SI units. A parameter of zero comes
        out as undetermined, for its logarithm has no effect on the trace.
    time_s : (n_samples,)
        Sampling times.

    Returns
    -------
    list of (Quantity, float)
        Every parameter, and the sum of the exchangeable ones, each with 100
        times the standard deviation of its logarithm; see
        `biogrip.judging.fisher`. Without noise there are none: NaN.
    """
    model = problem.searched
    quantities = parameters_and_sum(model)
    if noise.absent:
        return [(q, math.nan) for q in quantities]
    values = np.array([parameters[name] for name in model.names])
    rotation, sensitivity = rotation_and_sensitivity(
        problem.gripper, model, problem.torque, time_s, values, nonlinear=problem.nonlinear
    )
    sigma = standard_deviation(rotation, noise)
    with np.errstate(divide="ignore"):
        logarithms = np.log(values)
    return [(q, 100 * bound(sensitivity, sigma, logarithms, q)) for q in quantities]


def headlines(bounds: Sequence[tuple[str, float]]) -> list[str]:
    """Return the best and the worst determined quantity of several points.

    Quantities count if their bound is below `DETERMINED_PERCENT` at half of the points or more.
    Parts of a sum do not count beside it: a first-order bound does not show that they trade
    against each other far from their values.

    Parameters
    ----------
    bounds
        Labels of quantities, and their bounds in percent at the points; NaN, without
        noise, does not count.
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
