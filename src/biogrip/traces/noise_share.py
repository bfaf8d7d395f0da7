"""Standard deviations of readings whose noise is a share of the rotation.

Weights that followed each reading's own noise would favour readings that are too low by chance.
So the share is one of the smooth rotation: the best non-negative sum of what springs and dampers
of any retardation time let the arm do, which needs no sample model.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.modes import lagged_torques
from biogrip.physics.protocol import TorqueHistory
from biogrip.traces.any_response import extreme_responses

# Retardation times a decade; shortest over the sampling interval, longest over the protocol.
_A_DECADE, _SHORTEST, _LONGEST = 4, 0.01, 10.0
# The smooth rotation and the weights are found in turn.
_ROUNDS = 4
# Share of the readings whose scatter bounds the noise from below, and fewest of them.
_SMALL, _FEWEST = 0.1, 5
# Their scatter over that of the share, beyond which there is other noise: chi-squared with five
# degrees of freedom exceeds it once in a thousand times.
_EXCESS = 2.03
# Least noise over the largest rotation: rounding errors of single precision.
_ROUNDING = 1e-7


def proportional_deviations(
    time_s: Array,
    rotation_rad: Array,
    gripper: Gripper,
    torque: TorqueHistory,
    nuisance: Array,
    share: float,
    noise_rad: float | None = None,
) -> Array:
    """Compute standard deviations in proportion to the smooth rotation.

    Parameters
    ----------
    time_s, rotation_rad : (n_samples,)
        A recorded trace, times ascending.
    gripper, torque
        Gripper and protocol it was recorded with.
    nuisance : (n_functions, n_samples)
        Nuisance functions of the instrument, see `nuisance_basis`.
    share
        Standard deviation over the rotation.
    noise_rad
        Standard deviation of further noise, the same everywhere. By default no deviation is less
        than that of the median of the smallest rotations, nor than they scatter: of a rotation
        of zero, no instrument is certain.

    Returns
    -------
    (n_samples,)
        In rad.
    """
    family = _family(time_s, gripper, torque)
    deviations = np.full(len(time_s), share * np.max(np.abs(rotation_rad)))
    for _ in range(_ROUNDS):
        smooth, rest = _smooth(family, nuisance, rotation_rad, deviations)
        deviations = share * np.abs(smooth)
        if noise_rad is not None:
            deviations = np.hypot(deviations, noise_rad)
        else:
            deviations = np.maximum(deviations, _least(np.abs(smooth), rest, share))
    return np.maximum(deviations, _ROUNDING * float(np.max(np.abs(rotation_rad))))


def _family(time_s: Array, gripper: Gripper, torque: TorqueHistory) -> Array:
    """Return responses of the arm whose non-negative sums are all responses, (n, n_samples)."""
    shortest = _SHORTEST * float(np.diff(time_s).min()) / torque.end_s
    decades = np.log10(_LONGEST / shortest)
    shares = np.geomspace(shortest, _LONGEST, 2 + int(_A_DECADE * decades))
    responses = extreme_responses(
        lagged_torques(torque, shares.tolist())(time_s), gripper, len(shares)
    )
    sizes = np.linalg.norm(responses, axis=1)
    family: Array = responses[sizes > 0] / sizes[sizes > 0, None]
    return family


def _smooth(
    family: Array, nuisance: Array, rotation_rad: Array, deviations: Array
) -> tuple[Array, Array]:
    """Return the smooth rotation and what it and the nuisance leave, (n_samples,) each."""
    from scipy.optimize import nnls

    functions = np.vstack((family, nuisance, -nuisance))
    rows = np.vstack((functions, rotation_rad)) / deviations
    triangle = np.asarray(np.linalg.qr(rows.T, mode="r"))
    amplitudes = nnls(triangle[:, :-1], triangle[:, -1])[0]
    smooth: Array = amplitudes[: len(family)] @ family
    return smooth, rotation_rad - amplitudes @ functions


def _least(sizes: Array, rest: Array, share: float) -> float:
    """Return the least standard deviation, from the readings with the smallest rotations."""
    few = max(_FEWEST, int(_SMALL * len(sizes)))
    smallest = np.argsort(sizes, kind="stable")[:few]
    scatter, size = (np.sqrt(np.mean(own[smallest] ** 2)) for own in (rest, sizes))
    if scatter <= _EXCESS * share * size:
        return share * float(np.median(sizes[smallest]))
    return float(scatter)
