"""Modes of a sample under what the protocol holds: a torque, a load, or a deformation."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, parts
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import Network, SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.mode_decay import compute_decay
from biogrip.response.mode_growth import compute_growth
from biogrip.response.modes import COMPLEX_STEP, Modes, complex_step_network, compute_modes

# Rate at which a bare damper forgets, in 1/s; its force is c times the rate of the deformation.
_AT_ONCE = 1e30
# Numbers formed together, which should fit a processor's cache.
_TOGETHER = 400_000


def compute_protocol_modes(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Modes:
    """Compute the modes of samples, (n, n_parameters), without inertia, all of them real.

    Arguments are those of `compute_modes`, with the protocol. Of a protocol that deforms, weights
    are forces over deformations.
    """
    if torque.deforms:
        return _relaxation_modes(model, parameters, slopes=slopes)
    return compute_modes(gripper, model, parameters, symmetric=torque.symmetric, slopes=slopes)


def compute_responses(modes: Modes, torque: TorqueHistory, time_s: Array) -> Array:
    """Compute responses of modes to a protocol, and their derivatives by the log-parameters.

    (n, 1 + n_parameters, n_times): d(w g) = dw g + w dr dg/dr.
    """
    n, count, m = modes.rate_slopes.shape
    drives = modes.weights.shape[1]
    by_growth = np.concatenate((modes.weights[:, None], modes.weight_slopes), axis=1)
    by_slope = np.zeros_like(by_growth)
    by_slope[:, 1:] = modes.weights[:, None] * modes.rate_slopes[:, :, None]
    mixing = np.concatenate((by_growth, by_slope), axis=2).reshape(n, 1 + count, -1)
    rows = np.empty((n, 1 + count, len(time_s)))
    at_once = max(1, _TOGETHER // (m * len(time_s)))
    for some in parts(n, at_once):
        both = np.concatenate(compute_growth(modes.rates[some], torque, time_s), axis=1)
        both = both.reshape(-1, 2 * drives * m, len(time_s))
        # One product per sample: the order of its sums does not depend on the number of samples.
        rows[some] = mixing[some] @ both
    return rows


def relaxation(network: Network, history: TorqueHistory, time_s: Array) -> Array:
    """Compute the load on samples that a protocol deforms, (n, n_times)."""
    rates, weights = _branches(network)
    decay, _ = compute_decay(rates, history, time_s)
    load: Array = (weights[:, None] @ decay[:, 0])[:, 0]
    return load


def _relaxation_modes(model: SampleModel, parameters: Array, *, slopes: bool) -> Modes:
    network, count = complex_step_network(model, parameters, slopes=slopes)
    rates, weights = _branches(network)
    weights, weight_slopes = _split(weights, count)
    rates, rate_slopes = _split(rates, count)
    return Modes(rates, weights[:, None], rate_slopes, weight_slopes[:, :, None])


def _branches(network: Network) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return rates and stiffnesses of all elements beside one another, (n, n_modes).

    A branch forgets at the rate -k/c, a bare spring never, and a bare damper at once.
    """
    bare = np.stack((network.k_p, _AT_ONCE * network.c_p), axis=1)
    fixed = np.broadcast_to([0.0, -_AT_ONCE], bare.shape)
    # A branch so weak that its numbers underflow is none.
    there = network.c.real > 0
    rates = -network.k / np.where(there, network.c, 1.0)
    weights = np.where(there, network.k, 0.0)
    return np.concatenate((rates, fixed), axis=1), np.concatenate((weights, bare), axis=1)


def _split(values: NDArray[Any], count: int) -> tuple[Array, Array]:
    """Return values, (n, n_modes), and derivatives, (n, n_parameters, n_modes)."""
    steps = values.reshape(count + 1, -1, values.shape[1])
    return np.ascontiguousarray(steps[0].real), steps[1:].imag.swapaxes(0, 1) / COMPLEX_STEP
