"""Responses with the arms' inertia: rotations of whole populations, and exact derivatives.

With inertia poles may be complex. Of a conjugate pair one is kept with its weight
doubled, and the real part is taken at the end. At critical damping two poles meet, and
their weights and slopes diverge while the response does not. There the sum of the
residues of close poles is computed by the trapezoidal rule along a circle C around
them,

    sum_j Res_j = (1 / 2 pi i) integral over C of N(s) (e^(s t) - 1) / (s D(s)) ds

which converges geometrically [1]_: its nodes are rates that do not move with the
parameters, and have weights that do.

References
----------
.. [1] L. N. Trefethen and J. A. C. Weideman, The exponentially convergent trapezoidal rule,
   SIAM Review 56 (2014), 385-458.
"""

from collections.abc import Iterator

import numpy as np

from biogrip.arrays import Array, ComplexArray, IntArray, parts
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import evaluate
from biogrip.response.mode_growth import compute_growth
from biogrip.response.modes import (
    Modes,
    Polynomials,
    complex_step_network,
    compute_polynomials,
    modes_at,
)
from biogrip.response.roots import roots

# Weights of poles a relative gap g apart lose eps/g^2, their slopes eps/g^3.
_CLOSE = 0.05
# Number of nodes: the rule's error falls with the ratio of radius and distance to this power.
_NODES = 48
# Radius of a circle relative to its room, if poles leave it so much.
_WIDE = 0.4
# Largest radius relative to the distance of the centre from growing rates.
_DECAYING = 0.7
# A root's imaginary part below this is rounding.
_REAL = 1e-9
# Numbers formed at once, which should fit a processor's cache.
_AT_ONCE = 400_000


def ringing_responses(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Array:
    """Compute the rotation of the left arm with inertia, and its derivatives d phi / d log p.

    Parameters
    ----------
    gripper, model, torque
        Arms, sample model and protocol of the simulation; the linear model (corrected eqs. 4-6).
    time_s : (n_times,)
        Ascending, from 0.
    parameters : (n, n_parameters)
        All positive.
    slopes
        True to compute derivatives.

    Returns
    -------
    (n, 1 + n_parameters, n_times)
        In rad; without `slopes`, (n, 1, n_times).
    """
    count = parameters.shape[1] if slopes else 0
    rows = np.empty((len(parameters), 1 + count, len(time_s)))
    for where, modes in ringing_modes(
        gripper, model, parameters, symmetric=torque.symmetric, slopes=slopes
    ):
        rows[where] = sum(
            compute_responses(part, torque, time_s) for part in modes if part.rates.shape[1]
        )
    return rows


def compute_responses(modes: Modes, torque: TorqueHistory, time_s: Array) -> Array:
    """Compute responses of modes to a protocol, and their derivatives by the log-parameters.

    Real parts, (n, 1 + n_parameters, n_times): d(w g) = dw g + w dr dg/dr.
    """
    n, count, m = modes.rate_slopes.shape
    drives = modes.weights.shape[1]
    by_growth = np.concatenate((modes.weights[:, None], modes.weight_slopes), axis=1)
    by_slope = np.zeros_like(by_growth)
    by_slope[:, 1:] = modes.weights[:, None] * modes.rate_slopes[:, :, None]
    mixing = np.concatenate((by_growth, by_slope), axis=2).reshape(n, 1 + count, -1)
    if np.iscomplexobj(mixing):
        mixing = np.concatenate((mixing.real, -mixing.imag), axis=2)
    rows = np.empty((n, 1 + count, len(time_s)))
    at_once = max(1, _AT_ONCE // (m * len(time_s)))
    for some in parts(n, at_once):
        both = np.concatenate(compute_growth(modes.rates[some], torque, time_s), axis=1)
        both = both.reshape(-1, 2 * drives * m, len(time_s))
        if np.iscomplexobj(both):
            both = np.concatenate((both.real, both.imag), axis=1)
        # One product per sample: the order of its sums does not depend on the number of samples.
        rows[some] = mixing[some] @ both
    return rows


def ringing_modes(
    gripper: Gripper,
    model: SampleModel,
    parameters: Array,
    *,
    symmetric: bool,
    slopes: bool = True,
) -> Iterator[tuple[IntArray, tuple[Modes, ...]]]:
    """Yield modes with inertia, grouping samples with equal numbers of complex modes.

    Arguments are those of `compute_modes`. With the indices of samples, (n_rows,), come their real
    modes, and complex modes of whose responses the real part is meant.
    """
    network, count = complex_step_network(model, parameters, slopes=slopes)
    polynomials = compute_polynomials(gripper, network, count, symmetric=symmetric, inertia=True)
    rates = roots(polynomials.denominator)
    size = np.abs(rates)
    close = _closest(rates, size) < _CLOSE
    for row in np.flatnonzero(close):
        yield np.array([row]), (_circled(polynomials.of(np.array([row])), rates[row]),)
    # Real ones first, then those above the real axis, then below.
    side = np.where(np.abs(rates.imag) < _REAL * size, 0, np.where(rates.imag > 0, 1, 2))
    rates = np.take_along_axis(rates, np.argsort(side, axis=1, kind="stable"), axis=1)
    pairs = np.where(close, -1, np.sum(side == 1, axis=1))
    for count in sorted({*pairs.tolist()} - {-1}):
        rows = np.flatnonzero(pairs == count)
        # For a single row, numpy's complex product uses other instructions, with other last bits.
        some = rows if len(rows) > 1 else rows.repeat(2)
        reals = rates.shape[1] - 2 * count
        rates[rows, :reals] = rates[rows, :reals].real
        if count == 0:
            modes = modes_at(polynomials.of(some), rates[some].real)
            yield rows, (_part(modes, len(rows), slice(None)),)
            continue
        modes = modes_at(polynomials.of(some), rates[some])
        above = _part(modes, len(rows), slice(reals, reals + count))
        above = above._replace(weights=2.0 * above.weights, weight_slopes=2.0 * above.weight_slopes)
        yield rows, (Modes(*(of.real for of in _part(modes, len(rows), slice(reals)))), above)


def _part(modes: Modes, rows: int, which: slice) -> Modes:
    """Return some of the modes of the first samples."""
    return Modes(*(of[:rows, ..., which] for of in modes))


def _closest(rates: ComplexArray, size: Array) -> Array:
    """Return the smallest relative distance between two poles of each sample, (n,)."""
    distance = np.abs(rates[:, :, None] - rates[:, None, :]) / size[:, None, :]
    distance[:, range(rates.shape[1]), range(rates.shape[1])] = np.inf
    return distance.min(axis=(1, 2))


def _circled(polynomials: Polynomials, rates: ComplexArray) -> Modes:
    """Compute the modes of one sample, with nodes of a circle in place of close modes."""
    plain = modes_at(polynomials, rates[None])
    left, parts = list(range(len(rates))), []
    while left:
        first = min(left, key=lambda j: _next(rates, j))
        inside, centre, radius = _circle(rates, first)
        # A larger circle may contain poles that a smaller one has replaced: none counts twice.
        if inside and set(inside) <= set(left):
            parts.append(_nodes(polynomials, centre, radius))
        else:
            inside = [first]
            parts.append(_part(plain, 1, slice(first, first + 1)))
        left = [j for j in left if j not in inside]
    return Modes(*(np.concatenate(of, axis=-1) for of in zip(*parts, strict=True)))


def _next(rates: ComplexArray, j: int) -> float:
    """Return the relative distance of a pole to its nearest neighbour."""
    return float(np.min(np.abs(np.delete(rates, j) - rates[j]), initial=np.inf) / abs(rates[j]))


def _circle(rates: ComplexArray, j: int) -> tuple[list[int], complex, float]:
    """Find the poles close to one, and centre and radius of a circle with no others near it.

    There are none if no circle has twice the radius of theirs and half the distance of all others.
    """
    near = np.argsort(np.abs(rates - rates[j]), kind="stable")
    best: tuple[float, list[int], complex, float] = (4.0, [], 0j, 0.0)
    for count in range(2, len(rates) + 1):
        inside = near[:count]
        centre = complex(np.mean(rates[inside]))
        if abs(centre.imag) < _CLOSE * abs(centre.real):
            centre = complex(centre.real, 0.0)
        extent = float(np.max(np.abs(rates[inside] - centre)))
        others = np.abs(np.delete(rates, inside) - centre)
        room = min(float(np.min(others, initial=np.inf)), abs(centre), -centre.real * _DECAYING)
        # On a small circle the denominator suffers from cancellation.
        extent = max(extent, _WIDE**2 * room)
        if room / extent > best[0]:
            best = room / extent, inside.tolist(), centre, float(np.sqrt(room * extent))
    return best[1:]


def _nodes(polynomials: Polynomials, centre: complex, radius: float) -> Modes:
    """Return nodes of a circle as modes of fixed rates, weights N(s) (s - centre) / (n s D(s))."""
    turn = radius * np.exp(2j * np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    s = (centre + turn)[None]
    denominator = evaluate(polynomials.denominator, s)
    steepening = evaluate(polynomials.denominator_slopes, s) / denominator
    share = turn / (_NODES * s * denominator)
    weights = share * evaluate(polynomials.numerators, s)
    slopes = share * evaluate(polynomials.numerator_slopes, s) - weights * steepening[:, None]
    rate_slopes = np.zeros((1, len(slopes), _NODES), dtype=complex)
    return Modes(s, weights.swapaxes(0, 1), rate_slopes, slopes.transpose(2, 0, 1, 3))
