"""Modes and responses of the linear model without inertia, with derivatives by the parameters.

A parameter with a relative imaginary part of 1e-30 carries its derivative through the arithmetic of
the transfer function without changing the real part: the complex step [1]_, [2]_. Rates and weights
of modes are differentiated analytically, without cancellation for slow or fast modes; so are
responses, sums of modes. The result for a sample does not depend, to the last bit, on the other
samples.

The response of one mode of unit weight to a protocol has a derivative by the mode's rate. After a
load's unit step the response is one of modes e^(r t) - 1, with rates r < 0. So a mode that follows
a load T(t), and a branch, spring and damper in series, stretched by x(t), obey

    g' = r g + r T        g' = r g + x'

Both are carried on from phase to phase: a superposition of responses since the start would lose
digits by cancellation. The second is no difference of the first and x: of a fast branch it would
leave rounding errors only. Within a phase a load t^n/n! gives, with z = r t,

    g = r t^(n+1) phi_(n+1)(z)        dg/dr = t^(n+1) [phi_n(z) - n phi_(n+1)(z)]

for z phi_n'(z) = phi_(n-1)(z) - n phi_n(z), and a deformation t^n/n! gives g = t^n phi_n(z).

References
----------
.. [1] W. Squire and G. Trapp, Using complex variables to estimate derivatives of real
   functions, SIAM Review 40 (1998), 110-112.
.. [2] J. R. R. A. Martins, P. Sturdza and J. J. Alonso, The complex-step derivative
   approximation, ACM Transactions on Mathematical Software 29 (2003), 245-262.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, parts
from biogrip.physics.gripper import Gripper
from biogrip.physics.protocol import Course
from biogrip.physics.response import LEFT, Arms, Impedance, phi_function
from biogrip.physics.sample_model import Network, SampleModel

_COMPLEX_STEP = 1e-30
# Rate at which a bare damper forgets, in 1/s; its force is c times the rate of the deformation.
_RATE_OF_A_DAMPER = 1e30
# Numbers formed together, which should fit a processor's cache, and times: the responses of modes
# at a million would take too much memory.
_NUMBERS_AT_ONCE, _TIMES_AT_ONCE = 400_000, 100_000


class Modes(NamedTuple):
    """Step responses of n samples, and their derivatives by the log-parameters."""

    rates: Array
    """In 1/s, (n, n_modes), negative."""
    weights: Array
    """(n, n_modes): the reading over what is controlled."""
    rate_slopes: Array
    """(n, n_parameters, n_modes)."""
    weight_slopes: Array
    """(n, n_parameters, n_modes)."""


def linear_responses(
    gripper: Gripper,
    model: SampleModel,
    course: Course,
    time_s: Array,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Array:
    """Compute what is read in the linear model, corrected eqs. (4)-(6), and d/d log p of it.

    Parameters
    ----------
    gripper, model, course
        Arms, sample model and protocol of the simulation.
    time_s : (n_times,)
        Ascending.
    parameters : (n, n_parameters)
        All positive.
    slopes
        True to compute derivatives.

    Returns
    -------
    (n, 1 + n_parameters, n_times)
        Readings, and their derivatives; without `slopes`, (n, 1, n_times).
    """
    modes = compute_modes(gripper, model, course, parameters, slopes=slopes)
    rows = np.empty((len(parameters), 1 + modes.rate_slopes.shape[1], len(time_s)))
    for some in parts(len(time_s), _TIMES_AT_ONCE):
        rows[:, :, some] = _superpose(modes, course, time_s[some])
    return rows


def _superpose(modes: Modes, course: Course, time_s: Array) -> Array:
    """Sum responses of modes, w g, and their derivatives, d(w g) = dw g + w dr dg/dr."""
    n, count, m = modes.rate_slopes.shape
    by_response = np.concatenate((modes.weights[:, None], modes.weight_slopes), axis=1)
    by_slope = np.zeros_like(by_response)
    by_slope[:, 1:] = modes.weights[:, None] * modes.rate_slopes
    mixing = np.concatenate((by_response, by_slope), axis=2)
    rows = np.empty((n, 1 + count, len(time_s)))
    for some in parts(n, max(1, _NUMBERS_AT_ONCE // (m * len(time_s)))):
        both = np.concatenate(mode_responses(modes.rates[some], course, time_s), axis=1)
        # One product per sample: the order of its sums does not depend on the number of samples.
        rows[some] = mixing[some] @ both
    return rows


def compute_modes(
    gripper: Gripper,
    model: SampleModel,
    course: Course,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Modes:
    """Compute the modes of samples, (n, n_parameters), without inertia, all of them real.

    All parameters are positive. Without `slopes` there are no derivatives: n_parameters is zero.
    """
    network, count = _complex_step_network(model, parameters, slopes=slopes)
    if course.deforms:
        (rates, rate_slopes), (weights, weight_slopes) = (
            _split_complex_step(of, count) for of in _branches(network)
        )
        return Modes(
            np.ascontiguousarray(rates),
            np.ascontiguousarray(weights),
            rate_slopes.swapaxes(0, 1),
            weight_slopes.swapaxes(0, 1),
        )
    found = _between_arms(gripper, network, count)
    return Modes(*(np.ascontiguousarray(np.moveaxis(part, -1, 0)) for part in found))


def _between_arms(
    gripper: Gripper, network: Network, count: int
) -> tuple[Array, Array, Array, Array]:
    """Compute rates and weights of the left arm, with derivatives by the log-parameters.

    With H(x; p) = 0 at a rate, dx = (sum_j dK_j/(x - r_j) + ...) / (S/x^2); S and N follow. The
    network has n samples, and after them the same with each of `count` parameters tilted into the
    complex plane by the complex step.

    Returns
    -------
    rates : (n_modes, n)
    weights : (n_modes, n)
    rate_slopes : (n_parameters, n_modes, n)
    weight_slopes : (n_parameters, n_modes, n)
    """
    arms = Arms(gripper)
    given = arms.with_sample(network)
    parts = [
        of.reshape(*of.shape[:-1], count + 1, -1)
        for of in (given.weights, given.rates, given.level)
    ]
    impedance = Impedance(*(of[..., 0, :].real for of in parts))
    # (n_parameters, n) of every weight and rate, and of the level.
    d_weights, d_rates, d_level = (of[..., 1:, :].imag / _COMPLEX_STEP for of in parts)
    zeros = impedance.zeros()
    x = zeros.values
    moved = np.zeros((count, *x.shape)) - d_level[:, None]
    steepness = np.zeros_like(x)
    branches = list(zip(impedance.weights, impedance.rates, d_weights, d_rates, strict=True))
    for weight, rate, d_weight, d_rate in branches:
        inverse = 1 / zeros.from_pole(rate)
        steepness += weight * (x * inverse) ** 2
        moved += d_weight[:, None] * inverse
        if np.any(d_rate):
            moved += (weight * d_rate)[:, None] * (inverse * inverse)
    moved *= x * x / steepness
    steepening = np.zeros_like(moved)
    for weight, rate, d_weight, d_rate in branches:
        inverse = 1 / zeros.from_pole(rate)
        ratio = x * inverse
        away = 2 * weight * rate * ratio * inverse * inverse
        steepening += d_weight[:, None] * (ratio * ratio) - moved * away
        if np.any(d_rate):
            steepening += d_rate[:, None] * (2 * weight * (ratio * inverse) * ratio)
    numerators, slopes = (of[LEFT] for of in arms.rotations(zeros))
    weights = -numerators / steepness
    weight_slopes = -(slopes * moved + weights * steepening) / steepness
    return -x, weights, -moved, weight_slopes


def _complex_step_network(
    model: SampleModel, parameters: Array, *, slopes: bool
) -> tuple[Network, int]:
    """Return networks of samples and, for slopes, of copies with complex-step parameters."""
    if not slopes:
        return model.network(parameters), 0
    count = parameters.shape[1]
    factors = np.ones((count + 1, 1, count), dtype=np.complex128)
    factors[1:, 0].imag = _COMPLEX_STEP * np.eye(count)
    return model.network((parameters * factors).reshape(-1, count)), count


def _split_complex_step(values: NDArray[Any], count: int) -> tuple[Array, Array]:
    """Return values, (..., n, terms), and derivatives, (n_parameters, ..., n, terms)."""
    *others, _, terms = values.shape
    of_tilts = values.reshape(*others, count + 1, -1, terms).swapaxes(0, -3)
    return of_tilts[0].real, of_tilts[1:].imag / _COMPLEX_STEP


def relaxation(network: Network, course: Course, time_s: Array) -> Array:
    """Compute the load on samples that a protocol deforms, (n, n_times)."""
    rates, weights = _branches(network)
    decay, _ = mode_responses(rates, course, time_s)
    load: Array = (weights[:, None] @ decay)[:, 0]
    return load


def _branches(network: Network) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return rates and stiffnesses of all elements beside one another, (n, n_modes).

    A branch forgets at the rate -k/c, a bare spring never, and a bare damper at once.
    """
    bare = np.stack((network.k_p, _RATE_OF_A_DAMPER * network.c_p), axis=1)
    fixed = np.broadcast_to([0.0, -_RATE_OF_A_DAMPER], bare.shape)
    # A branch so weak that its numbers underflow is none.
    there = network.c.real > 0
    rates = -network.k / np.where(there, network.c, 1.0)
    weights = np.where(there, network.k, 0.0)
    return np.concatenate((rates, fixed), axis=1), np.concatenate((weights, bare), axis=1)


def lag_course(course: Course, shares: Sequence[float]) -> Callable[[Array], Array]:
    """Return a function of ascending times for loads that lag behind, (n_lags, n_times).

    Of a deformation, they are the forces of springs that forget it with these relaxation times.

    Parameters
    ----------
    course
        The protocol.
    shares
        Relaxation times of the lags over the protocol's duration.
    """
    rates, sign = -1 / (course.end_s * np.array(shares)), 1.0 if course.deforms else -1.0

    def lagged(time_s: Array) -> Array:
        lags: Array = sign * mode_responses(rates[None], course, time_s)[0][0]
        return lags

    return lagged


def mode_responses(rates: Array, course: Course, time_s: Array) -> tuple[Array, Array]:
    """Compute responses of modes of unit weight, or of branches of unit stiffness, and dg/dr.

    Parameters
    ----------
    rates : (n, n_modes)
        In 1/s, real, negative or zero.
    course
        The protocol, of a load or a deformation.
    time_s : (n_times,)
        Ascending; at the very instant of a step, what precedes it. Before the protocol nothing
        responds.

    Returns
    -------
    responses, slopes : (n, n_modes, n_times)
        In units of what is controlled, and those times s.
    """
    rate = rates[:, :, None]
    responses, slopes = np.zeros((2, *rates.shape, len(time_s)))
    reached, its_slope = np.zeros((2, *rates.shape, 1))
    ends = np.append(course.time_s[1:], course.end_s)
    firsts = np.append(time_s.searchsorted(course.time_s, side="right"), len(time_s))
    level = 0.0
    # The step of a deformation is the start of a phase.
    orders = (1, 2) if course.deforms else (0, 1, 2)
    respond = _stretched if course.deforms else _loaded
    for k, (start, powers) in enumerate(zip(course.time_s, course.within_phases, strict=True)):
        here = slice(firsts[k], firsts[k + 1])
        # The end of a phase is the initial state of the next.
        elapsed = np.append(time_s[here], ends[k]) - start
        if course.deforms:
            value, slope, curvature = powers
            reached = reached + (value - level)
            level = value + slope * elapsed[-1] + curvature * elapsed[-1] ** 2 / 2
        remains = np.exp(rate * elapsed)
        response, slope = reached * remains, (its_slope + reached * elapsed) * remains
        for order in orders:
            if powers[order]:
                one, one_slope = respond(order, rate, elapsed)
                response, slope = response + powers[order] * one, slope + powers[order] * one_slope
        responses[..., here], slopes[..., here] = response[..., :-1], slope[..., :-1]
        reached, its_slope = response[..., -1:], slope[..., -1:]
    return responses, slopes


def _loaded(order: int, rate: Array, elapsed: Array) -> tuple[Array, Array]:
    """Return the response to a load t^n/n!, and its derivative."""
    z = rate * elapsed
    if order == 0:
        growth = np.expm1(z)
        return growth, elapsed * (growth + 1)
    power = elapsed ** (order + 1)
    this, before = phi_function(order + 1, z), phi_function(order, z)
    return rate * power * this, power * (before - order * this)


def _stretched(order: int, rate: Array, elapsed: Array) -> tuple[Array, Array]:
    """Return the response to a deformation t^n/n!, n above 0, and its derivative."""
    z, power = rate * elapsed, elapsed**order
    this, after = phi_function(order, z), phi_function(order + 1, z)
    return power * this, power * elapsed * (this - order * after)
