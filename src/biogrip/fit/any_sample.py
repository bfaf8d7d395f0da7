"""What a gripper's arm may do with any sample, by which a trace is judged without a model of it.

A linear viscoelastic sample relaxes by a sum of non-negative exponentials, so a response is a
non-negative combination of the `extreme_responses`, fitted by non-negative least squares [1]_.
`proportional_deviations` smooths a trace so: weights that followed each reading's own noise would
favour readings that are too low by chance.

References
----------
.. [1] C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, Prentice-Hall, 1974,
   chapter 23.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import nnls

from biogrip.arrays import Array
from biogrip.fit.experiment import Experiment
from biogrip.physics.modes import lag_course

# Retardation times a decade; shortest over the sampling interval, longest over the protocol, and
# that of what does not relax.
_A_DECADE, _SHORTEST, _LONGEST, _LASTING = 4, 0.01, 10.0, 1e6
# The smooth rotation and the weights are found in turn.
_ROUNDS = 4
# Share of the readings whose scatter bounds the noise from below, and fewest of them.
_SMALL, _FEWEST = 0.1, 5
# Their scatter over that of the share, beyond which there is other noise: chi-squared with five
# degrees of freedom exceeds it once in a thousand times.
_EXCESS = 2.03
# Least noise over the largest rotation: rounding errors of single precision.
_ROUNDING = 1e-7


def extreme_responses(problem: Experiment, lags: Sequence[float]) -> Callable[[Array], Array]:
    """Return a function of times, (n_rows,), that computes extreme responses, (n, n_rows).

    All samples' are non-negative combinations of them. A sample turns the left arm by
    (1 - x) tau/k_2, where x is the sample's rigidity and decreases, as it relaxes, from at most 1
    to at least 0. The extremes are: no sample, and rigid ones that relax with one of the lags. Lags
    are shares of the protocol; the shortest is negligible.
    """
    lagged, stiffness = lag_course(problem.torque, lags), problem.gripper.left
    return lambda time_s: lagged(time_s) / stiffness.stiffness_Nm_per_rad


def fit_responses(trace: Array, responses: Array) -> tuple[Array, float]:
    """Fit non-negative amplitudes of responses, (n, n_rows), to a trace, (n_rows,).

    Returns the amplitudes, (n,), and the residual sum of squares.
    """
    # As many rows as functions have the same inner products.
    rows = np.asarray(np.linalg.qr(np.vstack((responses, trace)).T, mode="r"))
    sizes = np.linalg.norm(responses, axis=1)
    sizes[sizes == 0] = 1.0
    amplitudes, norm = nnls(rows[:, :-1] / sizes, rows[:, -1])
    return amplitudes / sizes, float(norm**2)


def proportional_deviations(problem: Experiment, time_s: Array, readings: Array) -> Array:
    """Compute standard deviations of readings in proportion to the smooth rotation, (n_samples,).

    The problem has that share, and the standard deviation of further noise. If it is not known, no
    deviation is less than that of the median of the smallest readings, nor than they scatter: of
    a rotation of zero, no instrument is certain.

    Parameters
    ----------
    problem
        What the trace was recorded with, and what is known of its noise.
    time_s, readings : (n_samples,)
        A recorded trace, times ascending.
    """
    share, noise_sd = problem.noise_share or 0.0, problem.noise_sd
    nuisance = problem.nuisance(time_s)
    shortest = _SHORTEST * float(np.diff(time_s).min()) / problem.torque.end_s
    count = 2 + int(_A_DECADE * np.log10(_LONGEST / shortest))
    lags = np.append(np.geomspace(shortest, _LONGEST, count), _LASTING)
    family = extreme_responses(problem, lags.tolist())(time_s)
    functions = np.vstack((family, nuisance, -nuisance))
    deviations = np.full(len(time_s), share * np.max(np.abs(readings)))
    for _ in range(_ROUNDS):
        amplitudes, _ = fit_responses(readings / deviations, functions / deviations)
        smooth, rest = amplitudes[: len(family)] @ family, readings - amplitudes @ functions
        deviations = share * np.abs(smooth)
        if noise_sd is not None:
            deviations = np.hypot(deviations, noise_sd)
        else:
            deviations = np.maximum(deviations, _least(np.abs(smooth), rest, share))
    return np.maximum(deviations, _ROUNDING * float(np.max(np.abs(readings))))


def _least(sizes: Array, rest: Array, share: float) -> float:
    """Return the least standard deviation, from the smallest readings."""
    few = max(_FEWEST, int(_SMALL * len(sizes)))
    smallest = np.argsort(sizes, kind="stable")[:few]
    scatter, size = (np.sqrt(np.mean(own[smallest] ** 2)) for own in (rest, sizes))
    if scatter <= _EXCESS * share * size:
        return share * float(np.median(sizes[smallest]))
    return float(scatter)
