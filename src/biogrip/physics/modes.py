"""Modes and responses of the linear model without inertia, with derivatives by the parameters.

A parameter with a relative imaginary part of 1e-30 carries its derivative through the arithmetic of
the transfer function without changing the real part: the complex step [1]_, [2]_. Rates and weights
of modes, and responses, are differentiated analytically, without cancellation. The result for a
sample does not depend, to the last bit, on the other samples.

After a load's unit step the response is one of modes e^(r t) - 1, with rates r < 0. So a mode that
follows a load T(t), and a branch, spring and damper in series, stretched by x(t), obey

    g' = r g + r T        g' = r g + x'

Both are carried on from phase to phase: a superposition of responses since the start would lose
digits by cancellation, and so would the second as a difference of the first and x, of a fast
branch. Within a phase a load t^n/n! gives, with z = r t,

    g = r t^(n+1) phi_(n+1)(z)        dg/dr = t^(n+1) [phi_n(z) - n phi_(n+1)(z)]

for z phi_n'(z) = phi_(n-1)(z) - n phi_n(z), and a deformation t^n/n! gives g = t^n phi_n(z).

References
----------
.. [1] W. Squire and G. Trapp, SIAM Review 40 (1998), 110-112: derivatives by complex variables.
.. [2] J. R. R. A. Martins et al., ACM Transactions on Mathematical Software 29 (2003), 245-262.
.. [3] J. D. Ferry, Viscoelastic Properties of Polymers, Wiley, 1980, chapter 3.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, IntArray, parts
from biogrip.physics.gripper import Gripper
from biogrip.physics.protocol import Course
from biogrip.physics.response import LEFT, Arms, Impedance, phi_functions
from biogrip.physics.sample_model import Network, SampleModel

_COMPLEX_STEP = 1e-30
# Rate at which a bare damper forgets, in 1/s; its force is c times the rate of the deformation.
_RATE_OF_A_DAMPER = 1e30
# Numbers formed together, which should fit a processor's cache.
_MODE_NUMBERS_AT_ONCE = 400_000
# Phases, and steps of a recursion, that are taken one by one.
_MOST_ONE_BY_ONE = 50


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
) -> Array:
    """Compute what is read in the linear model, corrected eqs. (4)-(6), and d/d log p of it.

    Times, (n_times,), ascend; parameters, (n, n_parameters), are positive. Returns readings and
    their derivatives, (n, 1 + n_parameters, n_times).
    """
    return sum_of_modes(compute_modes(gripper, model, course, parameters), course, time_s)


def sum_of_modes(modes: Modes, course: Course, time_s: Array) -> Array:
    """Return what samples show by all their modes, see `linear_responses`."""
    n, count, m = modes.rate_slopes.shape
    # Sums of responses of modes, w g, and their derivatives, d(w g) = dw g + w dr dg/dr.
    by_response = np.concatenate((modes.weights[:, None], modes.weight_slopes), axis=1)
    by_slope = np.zeros_like(by_response)
    by_slope[:, 1:] = modes.weights[:, None] * modes.rate_slopes
    mixing = np.concatenate((by_response, by_slope), axis=2)
    rows = np.zeros((n, 1 + count, len(time_s)))
    for some in parts(n, max(1, _MODE_NUMBERS_AT_ONCE // (m * len(time_s)))):
        for here, both in responses_in_turn(modes.rates[some], course, time_s):
            # One product per sample: the order of its sums does not depend on their number.
            rows[some, :, here] = mixing[some] @ np.concatenate(both, axis=1)
    return rows


def compute_modes(
    gripper: Gripper,
    model: SampleModel,
    course: Course,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Modes:
    """Compute the modes of samples, all positive, (n, n_parameters), and their derivatives."""
    count = parameters.shape[1] if slopes else 0
    if slopes:
        # After the samples, copies with each of their parameters tilted into the complex plane.
        factors = np.ones((count + 1, 1, count), dtype=np.complex128)
        factors[1:, 0].imag = _COMPLEX_STEP * np.eye(count)
        parameters = (parameters * factors).reshape(-1, count)
    network = model.network(parameters)
    if not course.deforms:
        *of_modes, d_rates, d_weights = _between_arms(gripper, network, count)
        of_slopes = (of.transpose(2, 0, 1) for of in (d_rates, d_weights))
        return Modes(*map(np.ascontiguousarray, (*(of.T for of in of_modes), *of_slopes)))
    both = [of.reshape(count + 1, -1, of.shape[1]) for of in elements_of(network)]
    rates, weights = (np.ascontiguousarray(of[0].real) for of in both)
    return Modes(rates, weights, *((of[1:].imag / _COMPLEX_STEP).swapaxes(0, 1) for of in both))


class _SeenBranch(NamedTuple):
    """A branch of the impedance seen from rates of modes, and derivatives by the log-parameters."""

    weight: Array
    """K_j, (n,)."""
    rate: Array
    """r_j, (n,)."""
    weight_slope: Array
    """(n_parameters, n)."""
    rate_slope: Array
    """(n_parameters, n)."""
    inverse: Array
    """1/(x - r_j), (n_modes, n)."""
    ratio: Array
    """x/(x - r_j), (n_modes, n)."""

    @property
    def moves(self) -> bool:
        """True if its rate depends on the parameters."""
        return bool(self.rate_slope.any())


def _between_arms(
    gripper: Gripper, network: Network, count: int
) -> tuple[Array, Array, Array, Array]:
    """Compute rates and weights of the left arm, (n_modes, n), and derivatives of both.

    These are by the log-parameters, (n_parameters, n_modes, n). The rates x are the zeros of the
    impedance H(x; p). With H(x; p) = 0 at a rate, dx = (sum_j dK_j/(x - r_j) + ...) / (S/x^2); the
    steepness S and the numerators N follow, and the weights, -N/S. The network has n samples, and
    after them the same with each of `count` parameters tilted by the complex step.
    """
    arms = Arms(gripper)
    tilted = arms.with_sample(network)
    every = [
        part.reshape(*part.shape[:-1], count + 1, -1)
        for part in (tilted.weights, tilted.rates, tilted.level)
    ]
    impedance = Impedance(*(part[..., 0, :].real for part in every))
    slopes = [part[..., 1:, :].imag / _COMPLEX_STEP for part in every]
    zeros = impedance.zeros()
    inverses = [1 / zeros.from_pole(rate) for rate in impedance.rates]
    ratios = [zeros.values * inverse for inverse in inverses]
    parts_of_all = impedance.weights, impedance.rates, *slopes[:2], inverses, ratios
    branches = [_SeenBranch(*of_one) for of_one in zip(*parts_of_all, strict=True)]
    steepness = sum(
        (branch.weight * branch.ratio**2 for branch in branches), np.zeros_like(zeros.pole)
    )
    moved = _moved_zeros(zeros.values, steepness, branches if count else [], slopes[2])
    steepening = _steepening(moved, branches if count else [])
    numerators, numerator_slopes = (of_arms[LEFT] for of_arms in arms.rotations(zeros))
    weights = -numerators / steepness
    weight_slopes = -(numerator_slopes * moved + weights * steepening) / steepness
    return -zeros.values, weights, -moved, weight_slopes


def _moved_zeros(
    x: Array, steepness: Array, branches: Sequence[_SeenBranch], level_slope: Array
) -> Array:
    """Return the derivatives of zeros x, (n_parameters, n_modes, n)."""
    moved = np.zeros((len(level_slope), *x.shape)) - level_slope[:, None]
    for branch in branches:
        moved += branch.weight_slope[:, None] * branch.inverse
        if branch.moves:
            pull = (branch.weight * branch.rate_slope)[:, None]
            moved += pull * (branch.inverse * branch.inverse)
    moved *= x * x / steepness
    return moved


def _steepening(moved: Array, branches: Sequence[_SeenBranch]) -> Array:
    """Return the derivatives of the steepness at zeros that move, (n_parameters, n_modes, n)."""
    steepening = np.zeros_like(moved)
    for weight, rate, weight_slope, rate_slope, inverse, ratio in branches:
        away = 2 * weight * rate * ratio * inverse * inverse
        steepening += weight_slope[:, None] * (ratio * ratio) - moved * away
        if rate_slope.any():
            steepening += rate_slope[:, None] * (2 * weight * (ratio * inverse) * ratio)
    return steepening


def elements_of(network: Network) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return rates and stiffnesses of elements side by side, (n, n_modes); of bare ones last."""
    bare = np.stack((network.k_p, _RATE_OF_A_DAMPER * network.c_p), axis=1)
    fixed = np.broadcast_to([0.0, -_RATE_OF_A_DAMPER], bare.shape)
    # A branch so weak that its numbers underflow is none.
    there = network.c.real > 0
    rates = -network.k / np.where(there, network.c, 1.0)
    weights = np.where(there, network.k, 0.0)
    return np.concatenate((rates, fixed), axis=1), np.concatenate((weights, bare), axis=1)


def lag_course(course: Course, shares: Sequence[float], time_s: Array) -> Array:
    """Return loads that lag behind, (n_lags, n_times), at ascending times.

    Of a deformation, they are the forces of springs that forget it with these relaxation times,
    given as shares of the protocol's duration.
    """
    rates, sign = -1 / (course.end_s * np.array(shares)), 1.0 if course.deforms else -1.0
    return sign * mode_responses(rates[None], course, time_s)[0]


def mode_responses(rates: Array, course: Course, time_s: Array) -> Array:
    """Compute responses of modes of unit weight, or of branches of unit stiffness.

    Rates in 1/s, (n, n_modes), are real, negative or zero. Times, (n_times,), ascend; at the very
    instant of a step is what precedes it, and before the protocol nothing responds. Responses are
    (n, n_modes, n_times), in units of what is controlled.
    """
    responses = np.zeros((*rates.shape, len(time_s)))
    for here, (at_times,) in responses_in_turn(rates, course, time_s, slopes=False):
        responses[..., here] = at_times
    return responses


def responses_in_turn(
    rates: Array, course: Course, time_s: Array, *, slopes: bool = True
) -> Iterator[tuple[slice, Array]]:
    """Yield parts of the times after the start, and responses there stacked on dg/dr.

    Responses are those of `mode_responses`; without `slopes` there are no derivatives.
    """
    if course.sweeps:
        yield slice(None), moduli_of_modes(rates, time_s)[: 1 + slopes]
        return
    at_once = max(1, _MODE_NUMBERS_AT_ONCE // max(rates.size, 1))
    lengths = np.diff(course.time_s, append=course.end_s)
    # What precedes a step is read at its instant.
    firsts = np.append(time_s.searchsorted(course.time_s, side="right"), len(time_s))
    # The step of a deformation is the start of a phase.
    steps = np.append(course.changes[:, 0] * course.deforms, 0.0)
    state = np.zeros((1 + slopes, *rates.shape))
    state[0] += steps[0]
    for phases in parts(len(lengths), at_once):
        powers, lasts = course.within_phases[phases], lengths[phases]
        go_on = _Motion(rates[:, :, None], powers, deforms=course.deforms, slopes=slopes)
        after = steps[phases.start + 1 :][: len(lasts)]
        states = go_on.carried(state, lasts, after)
        state = states[..., -1]
        first, counts = firsts[phases.start], np.diff(firsts[phases.start :])[: len(lasts)]
        phase = np.repeat(np.arange(len(lasts)), counts)
        for some in parts(len(phase), at_once):
            here, in_phase = (
                slice(first + some.start, first + min(some.stop, len(phase))),
                phase[some],
            )
            elapsed = time_s[here] - course.time_s[phases][in_phase]
            if np.array_equal(elapsed, lasts[in_phase]):
                # Rows of a record are read at the ends of its phases.
                at_ends = states[..., in_phase + 1]
                at_ends[0] -= after[in_phase]
                yield here, at_ends
            else:
                yield here, go_on.after(states, in_phase, elapsed)


def moduli_of_modes(rates: Array, places: Array) -> Array:
    """Compute moduli of branches of unit stiffness, and dg/dr, (2, n, n_modes, n_places) [3]_.

    A branch that forgets at the rate -r has the complex modulus i w / (i w + r). Its storage part,
    w^2 / (w^2 + r^2), stands at the place w, in rad/s, its loss part, w r / (w^2 + r^2), at -w.
    """
    omega, stores, forgets = np.abs(places), places > 0, -rates[..., None]
    size = omega**2 + forgets**2
    moduli = np.where(stores, omega**2, omega * forgets) / size
    of_loss = omega * (forgets**2 - omega**2)
    return np.stack((moduli, np.where(stores, 2 * forgets * omega**2, of_loss) / size**2))


class _Motion:
    """How modes, (n, n_modes, 1), go on in phases whose orders are (n_phases, n_orders)."""

    def __init__(self, rates: Array, powers: Array, *, deforms: bool, slopes: bool) -> None:
        self._rates, self._powers = rates, powers
        self._deforms, self._slopes = deforms, slopes

    def carried(self, state: Array, lengths_s: Array, steps: Array) -> Array:
        """Return modes at the starts of phases, stretched by steps after each, and at their end."""
        remains, gained = self._terms(np.arange(len(lengths_s)), lengths_s)
        reached = _recursion(state[0], remains, gained[0] + steps)
        if not self._slopes:
            return reached[None]
        moved = reached[..., :-1] * lengths_s * remains + gained[1]
        return np.stack((reached, _recursion(state[1], remains, moved)))

    def after(self, states: Array, phase: IntArray, elapsed_s: Array) -> Array:
        """Return modes at times since the starts of phases, (..., n_times)."""
        remains, moved = self._terms(phase, elapsed_s)
        reached = states[..., phase]
        moved[0] += reached[0] * remains
        if self._slopes:
            moved[1] += (reached[1] + reached[0] * elapsed_s) * remains
        return moved

    def _terms(self, phase: IntArray, elapsed_s: Array) -> tuple[Array, Array]:
        """Return what remains of modes after times in phases, and what they gain in these."""
        at: Array = elapsed_s
        same: IntArray | slice = slice(None)
        if len(self._powers) > _MOST_ONE_BY_ONE:
            # Rows at equal intervals are few different times apart.
            at, same = np.unique(elapsed_s, return_inverse=True)
        orders = np.flatnonzero(np.any(self._powers, axis=0))
        orders = orders[orders >= self._deforms].tolist()
        terms = respond(orders, self._rates, at, deforms=self._deforms, slopes=self._slopes)
        remains = np.exp(self._rates * at)[..., same]
        gained = np.zeros((1 + self._slopes, *remains.shape))
        for order, term in zip(orders, terms, strict=True):
            gained += self._powers[phase, order] * term[..., same]
        return remains, gained


def _recursion(first: Array, factors: Array, terms: Array) -> Array:
    """Return x_0 ... x_n, x_(k+1) = factors_k x_k + terms_k; many steps are taken in blocks."""
    count = terms.shape[-1]
    block = int(np.sqrt(count)) if count > _MOST_ONE_BY_ONE else 1
    blocks = -(-count // block)
    padding = [(0, 0)] * (terms.ndim - 1) + [(0, blocks * block - count)]
    scale, within = (
        np.moveaxis(np.pad(of, padding).reshape(*of.shape[:-1], blocks, block), (-1, -2), (0, 1))
        for of in (factors, terms)
    )
    scale, within = np.ascontiguousarray(scale), np.ascontiguousarray(within)
    for k in range(1, block):
        within[k] += scale[k] * within[k - 1]
        scale[k] *= scale[k - 1]
    starts = np.empty((blocks + 1, *first.shape))
    starts[0] = first
    for k in range(blocks):
        starts[k + 1] = scale[-1, k] * starts[k] + within[-1, k]
    within += scale * starts[:-1]
    reached = np.moveaxis(within, (0, 1), (-1, -2)).reshape(*first.shape, blocks * block)
    return np.concatenate((first[..., None], reached[..., :count]), axis=-1)


def respond(
    orders: Sequence[int], rate: Array, elapsed_s: Array, *, deforms: bool, slopes: bool = False
) -> list[Array]:
    """Return responses of modes to t^n/n! after times, and derivatives by the rate, for each n.

    A load is controlled or, if that `deforms`, a deformation. Rates and times are broadcast; the
    derivatives are stacked below, if there are `slopes`.
    """
    z, most = rate * elapsed_s, max(orders, default=0)
    phis = phi_functions(most + 1, z) if most else []
    responses = []
    for order in orders:
        power = elapsed_s**order
        if order == 0:
            decay = np.exp(z) if deforms else np.expm1(z)
            both = decay, elapsed_s * (decay if deforms else decay + 1)
        elif deforms:
            both = power * phis[order], power * elapsed_s * (phis[order] - order * phis[order + 1])
        else:
            power = power * elapsed_s
            slope = power * (phis[order] - order * phis[order + 1])
            both = rate * power * phis[order + 1], slope
        responses.append(np.stack(both[: 1 + slopes]))
    return responses
